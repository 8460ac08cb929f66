//! Power cuts, kills and disks that refuse, at any moment of a recording in parts: what was recorded until a
//! second before is there.
//!
//! The writer writes to a simulated disk (`disk.rs`) at the times of a simulated ride (`ride.rs`); then the
//! states that a cut at any moment may leave are made, salvaged as the service does it, and compared with all
//! that was sent.

mod disk;
mod ride;

use std::collections::BTreeSet;
use std::io::ErrorKind;
use std::path::Path;

use biplane_mock::rng::Rng;
use biplane_onboard::test_support::{Leftover, Salvaged, salvage_on};
use biplane_recording::{Entry, Reader, Rotation, Topic, WriteError, recover};

use crate::rig::{MS, S, seeds};
use disk::{Files, Folder, Refusal, SimDisk, below, read_folder};
use ride::{Plan, START_NS, Sent, messages, ride};

/// What a cut may cost.
const PROMISED_NS: i64 = S;
/// Moments of each ride at which the power is cut, and the process killed.
const CUTS: usize = 50;

/// A ride on a disk whose syncs take so long, its disk and all that was sent.
struct Ride {
    disk: SimDisk,
    sent: Vec<Sent>,
    sent_set: BTreeSet<Sent>,
    name: String,
}

impl Ride {
    fn new(seed: u64, plan: &Plan, sync_ns: (i64, i64), refusal: Option<Refusal>) -> (Self, ride::Ridden) {
        let thread = std::thread::current();
        let test = thread.name().unwrap_or_default().replace("::", "-");
        let name = format!("{test}-{seed}");
        let folder = Folder::new(&name);
        let disk = SimDisk::over(&folder.0, START_NS, sync_ns, seed);
        if let Some(refusal) = refusal {
            disk.refuse(refusal);
        }
        let sent = messages(plan, seed);
        let ridden = ride(&disk, &folder.0, plan, &sent);
        let sent_set = sent.iter().cloned().collect();
        (Self { disk, sent, sent_set, name }, ridden)
    }

    /// Salvages what a cut left, and compares. Gives how many messages, of those that came before the cut,
    /// are lost; all are younger than `window_ns`.
    fn judge(&self, left: &Files, cut_ns: i64, window_ns: i64, rng: &mut Rng) -> usize {
        let folder = Folder::new(&format!("{}-left", self.name));
        folder.fill(left);
        let context = format!("{}, cut after {:.4} s", self.name, (cut_ns - START_NS) as f64 / 1e9);
        self.recover_alone(&folder, left);
        let disk = SimDisk::over(&folder.0, 0, (MS, 0), rng.bits());
        let mut leftovers = salvage_on(&disk.disk(), &folder.0).unwrap();
        if rng.bits().is_multiple_of(3) {
            // The power goes once more, while the service salvages.
            let at_ns = (rng.unit() * disk.now_ns() as f64) as i64;
            folder.fill(&disk.cut(at_ns, rng));
            leftovers = salvage_on(&SimDisk::over(&folder.0, 0, (MS, 0), 1).disk(), &folder.0).unwrap();
        }
        assert_ended(&leftovers, &folder, &context);
        let kept = self.kept(&folder.0, &context);
        let due = self.sent.iter().filter(|sent| sent.log_ns <= cut_ns);
        let lost: Vec<_> = due.filter(|sent| !kept.contains(sent)).collect();
        let oldest = lost.iter().map(|sent| cut_ns - sent.log_ns).max().unwrap_or(0);
        assert!(
            oldest < window_ns,
            "{context}: a message {:.3} s old is lost, {leftovers:?}",
            oldest as f64 / 1e9
        );
        lost.len()
    }

    /// `recover` does not touch an unfinished file; and only of one that has all that the finished one had it
    /// says that nothing is lost.
    fn recover_alone(&self, folder: &Folder, left: &Files) {
        for (name, bytes) in left.iter().filter(|(name, _)| name.ends_with(".active")) {
            let (input, output) = (folder.0.join(name), folder.0.join("alone"));
            if let Ok(report) = recover(&input, &output) {
                let whole = self.disk.killed(i64::MAX).remove(name.trim_end_matches(".active"));
                let count = Reader::open(&output).unwrap().messages().count();
                let has_all = whole.is_none_or(|whole| count == count_in(folder, &whole));
                assert!(report.lost() || has_all, "{name}: {report}");
                std::fs::remove_file(output).unwrap();
            }
            assert!(std::fs::read(&input).unwrap() == *bytes, "{name} was touched");
        }
    }

    fn kept_after(&self, left: &Files) -> BTreeSet<Sent> {
        let folder = Folder::new(&format!("{}-left", self.name));
        folder.fill(left);
        self.kept(&folder.0, &self.name)
    }

    /// All messages in the recordings of a folder; each was sent, no part has one twice, and all stand in
    /// order.
    fn kept(&self, folder: &Path, context: &str) -> BTreeSet<Sent> {
        let mut kept = BTreeSet::new();
        for name in read_folder(folder).keys().filter(|name| name.ends_with(".mcap")) {
            let reader = Reader::open(&folder.join(name)).unwrap();
            let mut last_ns = 0;
            for entry in reader.messages() {
                let entry = entry.unwrap_or_else(|error| panic!("{context}: {error}"));
                assert!(entry.log_time_ns >= last_ns, "{context}: {name} is out of order");
                last_ns = entry.log_time_ns;
                let sent = sent_as(entry);
                if sent.topic == Topic::TfStatic {
                    // Each part repeats it.
                    kept.extend(self.sent.iter().find(|one| one.cdr == sent.cdr).cloned());
                    continue;
                }
                assert!(self.sent_set.contains(&sent), "{context}: {name} has what was never sent: {sent:?}");
                assert!(kept.insert(sent), "{context}: {name} has a message twice");
            }
            if last_ns > 0 {
                assert!(reader.rig().unwrap().is_some(), "{context}: {name} has lost its rig");
            }
        }
        kept
    }
}

/// How many messages are in a whole file of these bytes.
fn count_in(folder: &Folder, whole: &[u8]) -> usize {
    let path = folder.0.join("finished");
    std::fs::write(&path, whole).unwrap();
    let count = Reader::open(&path).unwrap().messages().count();
    std::fs::remove_file(path).unwrap();
    count
}

fn sent_as(entry: Entry) -> Sent {
    let topic = entry.topic.unwrap();
    Sent { log_ns: entry.log_time_ns, topic, number: entry.sequence, cdr: entry.bytes }
}

/// Nothing is left to salvage, and nothing half made.
fn assert_ended(leftovers: &[Leftover], folder: &Folder, context: &str) {
    for leftover in leftovers {
        assert!(
            matches!(
                leftover.outcome,
                Salvaged::Whole
                    | Salvaged::Cut { .. }
                    | Salvaged::Damaged(_)
                    | Salvaged::Empty
                    | Salvaged::NotOurs(_)
            ),
            "{context}: {leftover:?}"
        );
    }
    for name in read_folder(&folder.0).keys() {
        assert!(name.ends_with(".mcap") || name.ends_with(".damaged"), "{context}: {name} is left");
    }
}

#[test]
fn a_power_cut_or_a_kill_at_any_moment_costs_less_than_a_second() {
    let (mut states, mut lost, mut largest) = (0, 0, 0);
    for seed in seeds(3, 1) {
        let mut rng = Rng::new(seed, 0xC24F, 0);
        // From a solid-state disk to a slow memory card.
        let sync_ns = [(2 * MS, 8 * MS), (20 * MS, 60 * MS), (100 * MS, 90 * MS)][below(&mut rng, 3)];
        let plan = Plan::of(seed);
        let (ride, ridden) = Ride::new(seed, &plan, sync_ns, None);
        assert!(ridden.error.is_none(), "{:?}", ridden.error);
        assert!(ridden.reported_ns < PROMISED_NS, "seed {seed}: {}", ridden.reported_ns);
        let end_ns = ride.disk.now_ns();
        for _ in 0..CUTS {
            let at_ns = START_NS + (rng.unit() * (end_ns - START_NS) as f64) as i64;
            for left in [ride.disk.cut(at_ns, &mut rng), ride.disk.killed(at_ns)] {
                let count = ride.judge(&left, at_ns, PROMISED_NS, &mut rng);
                states += 1;
                lost += count;
                largest = largest.max(count);
            }
        }
    }
    println!("| power cut, kill | {states} | {lost} messages, at most {largest} of a cut |");
}

#[test]
fn a_disk_that_refuses_ends_the_recording_with_one_error_and_keeps_what_it_took() {
    let mut states = 0;
    for seed in seeds(2, 2) {
        let mut rng = Rng::new(seed, 0xE10, 0);
        let plan = Plan { seconds: 4, ..Plan::of(seed) };
        let (whole, _) = Ride::new(seed, &plan, (2 * MS, 8 * MS), None);
        let kinds = [
            ErrorKind::StorageFull,
            ErrorKind::Other,
            ErrorKind::QuotaExceeded,
            ErrorKind::ReadOnlyFilesystem,
        ];
        for _ in 0..20 {
            let number = below(&mut rng, whole.disk.asked());
            let kind = kinds[below(&mut rng, kinds.len())];
            let (ride, ridden) = Ride::new(seed, &plan, (2 * MS, 8 * MS), Some(Refusal::From(number, kind)));
            let error = ridden.error.unwrap();
            let is_full = matches!(kind, ErrorKind::StorageFull | ErrorKind::QuotaExceeded);
            assert_eq!(is_full, matches!(error, WriteError::DiskFull { .. }), "{number}: {error}");
            assert!(!matches!(error, WriteError::Failed { .. }), "the first error is told: {error}");
            let end_ns = ride.disk.now_ns();
            for left in [ride.disk.cut(end_ns, &mut rng), ride.disk.killed(end_ns)] {
                ride.judge(&left, end_ns, PROMISED_NS, &mut rng);
                states += 1;
            }
        }
    }
    println!("| write or sync refused | {states} |");
}

#[test]
fn writes_that_are_interrupted_or_short_change_nothing() {
    for seed in seeds(2, 10) {
        let plan = Plan { seconds: 4, silence_ns: None, ..Plan::of(seed) };
        let files = |refusal| {
            let (ride, ridden) = Ride::new(seed, &plan, (0, 0), refusal);
            assert!(ridden.error.is_none(), "{:?}", ridden.error);
            let end_ns = ride.disk.now_ns();
            ride.kept_after(&ride.disk.killed(end_ns))
        };
        assert!(files(Some(Refusal::Stutter)) == files(None), "seed {seed}");
    }
}

#[test]
fn a_disk_that_takes_seconds_to_sync_falls_no_further_behind_and_the_writer_knows_what_a_cut_costs() {
    for (seed, sync_ns) in [(2, 200 * MS), (5, 400 * MS), (8, S), (11, 3 * S)] {
        let plan = Plan { seconds: 16, rotation: Rotation::default(), silence_ns: None };
        let (ride, ridden) = Ride::new(seed, &plan, (sync_ns, 0), None);
        assert!(ridden.error.is_none());
        // What came while one sync was under way waits for the end of the next.
        let window_ns = PROMISED_NS.max(2 * sync_ns + 300 * MS);
        assert!(ridden.reported_ns < window_ns, "syncs of {sync_ns} ns: {} ns", ridden.reported_ns);
        let mut rng = Rng::new(seed, 0x510E, 0);
        for _ in 0..10 {
            let at_ns = START_NS + (rng.between(0.0, 15.0) * 1e9) as i64;
            ride.judge(&ride.disk.cut(at_ns, &mut rng), at_ns, window_ns, &mut rng);
        }
        println!(
            "| every sync takes {:.1} s | a cut costs {:.2} s at most |",
            s(sync_ns),
            s(ridden.reported_ns)
        );
    }
}

/// Nanoseconds as seconds.
fn s(ns: i64) -> f64 {
    ns as f64 / 1e9
}
