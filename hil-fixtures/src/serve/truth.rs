//! The truth behind a served world: its surfaces, where the robot was, and where it was at each scan that was
//! sent.
//!
//! Frame `map`: `base_link` at the start of the drive. Stamps are UTC seconds as a host without any delay
//! would give them; the same files as `simulate` writes: `surfaces.ply`, `trajectory.tum` (dense),
//! `poses.tum` and `scans_horizontal.txt` (at each scan's t0), and the vertical laser's.

use super::clock::VirtualClock;
use crate::devices::lms::scans::feed::{Answer, Ask, ScanFeed};
use crate::devices::lms::settings::Variant;
use crate::devices::run::Begun;
use crate::rig::simulated::SimulatedRig;
use crate::simulate::truth::seconds;
use crate::simulate::truth_folder::{TruthError, write_file};
use crate::world::files::ply::write_ply;
use std::io::{self, Write};
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};

/// Distance of dense poses.
const STEP_NS: i64 = 10_000_000;

/// Poses are written from this long before the drive's start to this long after its end.
const MARGIN_NS: i64 = 2_000_000_000;

/// When the scans of one laser began, on the virtual clock.
#[derive(Clone, Debug, Default)]
pub(super) struct SentScans(Arc<Mutex<Vec<i64>>>);

impl SentScans {
    /// A scan that is sent began at this time.
    pub(super) fn note(&self, t0_ns: i64) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).push(t0_ns);
    }

    fn times_ns(&self) -> Vec<i64> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

/// A feed that notes which scans it gave.
pub(super) struct NotingFeed<F> {
    /// The feed.
    pub feed: F,
    /// Where to.
    pub sent: SentScans,
}

impl<F: ScanFeed> ScanFeed for NotingFeed<F> {
    fn holds(&self, variant: Variant) -> bool {
        self.feed.holds(variant)
    }

    fn next(&mut self, ask: &Ask) -> Answer {
        let answer = self.feed.next(ask);
        if let Answer::Scan(offer) = &answer {
            self.sent.note(ask.t0_ns(offer.start_ns));
        }
        answer
    }

    fn status(&mut self, now_ns: i64) -> u8 {
        self.feed.status(now_ns)
    }
}

/// A run through the world, of one client after the other.
#[derive(Clone, Copy, Debug)]
pub(super) struct TruthRun {
    /// Its start.
    pub begun: Begun,
    /// When its last device had stopped, on the virtual clock; `None` while it goes on.
    pub ended_ns: Option<i64>,
}

/// The run that a time belongs to: what devices send before a run begins is seen from where it will begin.
fn run_at(runs: &[TruthRun], virtual_ns: i64) -> Option<&TruthRun> {
    runs.iter().find(|run| run.ended_ns.is_none_or(|ended_ns| virtual_ns < ended_ns)).or(runs.last())
}

/// The times of dense poses, in order: each run's drive and a margin around it, as far as it is its own.
fn dense_ns(runs: &[TruthRun], drive_ns: i64) -> Vec<i64> {
    let mut free_ns = i64::MIN;
    let mut times = Vec::new();
    for TruthRun { begun, ended_ns } in runs {
        let all = (-MARGIN_NS..=drive_ns + MARGIN_NS).step_by(STEP_NS as usize);
        let own = free_ns..ended_ns.unwrap_or(i64::MAX);
        times.extend(all.map(|t_ns| begun.start_ns + t_ns).filter(|t_ns| own.contains(t_ns)));
        free_ns = own.end;
    }
    times
}

/// Writes the truth of all runs so far.
pub(super) struct TruthWriter<'a> {
    /// Folder that is there.
    pub folder: &'a Path,
    /// The world and the drive through it.
    pub rig: &'a SimulatedRig,
    /// The mock's clock.
    pub clock: VirtualClock,
    /// The runs, in the order in which they began.
    pub runs: &'a [TruthRun],
}

impl TruthWriter<'_> {
    /// Surfaces and the whole drive of each run, known as soon as it begins.
    pub(super) fn write_drive(&self) -> Result<(), TruthError> {
        self.file("surfaces.ply", |out| write_ply(out, self.rig.scene().mesh()))?;
        let drive_ns = (self.rig.drive_duration_s() * 1e9) as i64;
        self.poses("trajectory.tum", dense_ns(self.runs, drive_ns).into_iter())
    }

    /// The poses at the scans of one laser.
    pub(super) fn write_scans(&self, name: &str, poses: &str, sent: &SentScans) -> Result<(), TruthError> {
        let times_ns = sent.times_ns();
        self.file(name, |out| {
            times_ns.iter().try_for_each(|t_ns| writeln!(out, "{}", seconds(self.clock.utc_ns(*t_ns))))
        })?;
        self.poses(poses, times_ns.into_iter())
    }

    fn poses(&self, name: &str, mut virtual_ns: impl Iterator<Item = i64>) -> Result<(), TruthError> {
        self.file(name, |out| virtual_ns.try_for_each(|t_ns| self.pose_line(out, t_ns)))
    }

    fn pose_line(&self, out: &mut dyn Write, virtual_ns: i64) -> io::Result<()> {
        let start_ns = run_at(self.runs, virtual_ns).map_or(0, |run| run.begun.start_ns);
        let pose = self.rig.map_from_base(virtual_ns - start_ns);
        let ([x, y, z], [qx, qy, qz, qw]) = (pose.translation_m, pose.quaternion_xyzw());
        let time = seconds(self.clock.utc_ns(virtual_ns));
        writeln!(out, "{time} {x:.6} {y:.6} {z:.6} {qx:.9} {qy:.9} {qz:.9} {qw:.9}")
    }

    fn file(
        &self,
        name: &str,
        write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
    ) -> Result<(), TruthError> {
        write_file(self.folder, name, write)
    }
}

#[cfg(test)]
mod tests {
    use super::{MARGIN_NS, STEP_NS, TruthRun, dense_ns, run_at};
    use crate::devices::run::Begun;

    const NS_PER_S: i64 = 1_000_000_000;

    fn run(number: u64, start_s: i64, ended_s: Option<i64>) -> TruthRun {
        let begun = Begun { start_ns: start_s * NS_PER_S, number };
        TruthRun { begun, ended_ns: ended_s.map(|s| s * NS_PER_S) }
    }

    #[test]
    fn scans_of_two_clients_belong_to_the_drive_of_each() {
        let runs = [run(1, 10, Some(30)), run(2, 45, None)];
        let number_at = |t_s: i64| run_at(&runs, t_s * NS_PER_S).map(|run| run.begun.number);
        // A laser streams some seconds before all do, and then the drive begins.
        assert_eq!([5, 10, 29].map(number_at), [Some(1); 3]);
        assert_eq!([31, 44, 45, 500].map(number_at), [Some(2); 4]);
        // The last one is over, too.
        assert_eq!(run_at(&[run(1, 10, Some(30))], 31 * NS_PER_S).map(|run| run.begun.number), Some(1));
        assert!(run_at(&[], 0).is_none());
    }

    #[test]
    fn dense_poses_are_those_of_all_drives_and_their_stamps_rise() {
        let runs = [run(1, 10, Some(30)), run(2, 31, None)];
        let times = dense_ns(&runs, 40 * NS_PER_S);
        assert!(times.is_sorted_by(|a, b| a < b));
        assert_eq!(times.first().copied(), Some(10 * NS_PER_S - MARGIN_NS));
        assert_eq!(times.last().copied(), Some(71 * NS_PER_S + MARGIN_NS));
        // The first drive as far as it went, the second from the first's end on.
        assert!(times.contains(&(30 * NS_PER_S - STEP_NS)) && times.contains(&(30 * NS_PER_S)));
        assert_eq!(dense_ns(&runs[..1], 40 * NS_PER_S).last().copied(), Some(30 * NS_PER_S - STEP_NS));
    }
}
