//! A host that is not always there: the process suspended, a core stolen, pages faulted in late, a disk that
//! takes nothing. No scan that a read returned is lost, stamps stay those of the mirror, nothing is
//! allocated, and a line that only waited to be read is not called silent.
//!
//! Truth: when the simulated mirror stood at the first beam; and the telegrams cut out of what the reads
//! returned.

use std::ops::RangeInclusive;

use biplane_mock::faults::Faults;
use biplane_mock::rng::Rng;
use biplane_onboard::{Event, Sink};
use biplane_recording::{Port, Rig};

use crate::rig::devices::{
    self, idle_laser, remembered_laser, rflex_base, rig_at, roboclaw_base, with_inertial_unit,
};
use crate::rig::disk::SlowDisk;
use crate::rig::host::{Host, Stalls, THREADS};
use crate::rig::line::SimLine;
use crate::rig::plan::Plan;
use crate::rig::verdict::digest::digest;
use crate::rig::verdict::inertial::{inertial_account, sent_samples, stamp_errors_ms};
use crate::rig::verdict::truth::{
    Account, LONGEST_PARTIAL_FRAME_NS, laser_account, pioneer_account, sent_scans,
};
use crate::rig::verdict::witness::Witness;
use crate::rig::world::Taken;
use crate::rig::{Lines, MS, PORTS, S, SimRig, fault_seeds as seeds, place};

/// Everything streams by then.
const UP_NS: i64 = 3 * S;
/// How long is looked on behind the fault.
const AFTER_NS: i64 = 10 * S;
/// A stamp may be off by this much, root mean square of a run, and at most, milliseconds.
const STAMPS_MS: [f64; 2] = [1.0, 15.0];

/// The same where the kernel had no room for bytes: how many are missing, nobody knows until a telegram comes
/// at the line's pace.
const STAMPS_BEHIND_HOLES_MS: [f64; 2] = [20.0, 400.0];

/// An inertial unit sends 1.5 ms after the end of a sample, and is reckoned with 1 ms, milliseconds.
const UNIT_LATENCY_ERROR_MS: f64 = 0.5;
/// Its stamps may be off by so much beyond that, at most, milliseconds.
const UNIT_STAMPS_MS: f64 = 1.0;
/// The same behind a hole of up to a minute where the kernel had no room: until then the rate of its clock is
/// known from three seconds only.
const UNIT_STAMPS_BEHIND_HOLES_MS: f64 = 10.0;

/// What is wrong with the host.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Fault {
    /// Nothing.
    None,
    /// The process is stopped for 0.1 to 60 s, and goes on, each thread in its own time.
    Suspended,
    /// For eight seconds every thread is held up for 10 to 200 ms again and again.
    CoreStolen,
    /// For eight seconds memory is short: every thread waits for pages, up to 30 ms a time.
    PageFaults,
}

impl Fault {
    fn name(self) -> &'static str {
        match self {
            Self::None => "nothing",
            Self::Suspended => "process suspended for 0.1 to 60 s",
            Self::CoreStolen => "a core stolen: threads late by 10 to 200 ms",
            Self::PageFaults => "memory pressure: threads late by up to 30 ms",
        }
    }

    /// When each thread stands still, and the end of it.
    fn stalls(self, rng: &mut Rng) -> ([Stalls; THREADS], i64) {
        let from_ns = UP_NS + (rng.unit() * 1e9) as i64;
        let spell = (from_ns, from_ns + 8 * S);
        match self {
            Self::None => (Default::default(), spell.1),
            Self::Suspended => {
                // As many of a second as of a minute.
                let to_ns = from_ns + (0.1 * 600_f64.powf(rng.unit()) * 1e9) as i64;
                let stalls = std::array::from_fn(|_| {
                    Stalls::one(from_ns, to_ns + (rng.between(0.0, 5.0) * MS as f64) as i64)
                });
                (stalls, to_ns)
            }
            Self::CoreStolen => {
                (std::array::from_fn(|_| Stalls::by_chance(spell, [10.0, 200.0, 100.0], rng)), spell.1)
            }
            Self::PageFaults => {
                (std::array::from_fn(|_| Stalls::by_chance(spell, [0.1, 30.0, 20.0], rng)), spell.1)
            }
        }
    }
}

/// What runs came to.
#[derive(Default)]
struct Outcome {
    runs: u64,
    account: Account,
    kernel_lost_bytes: u64,
    squares: f64,
    stamps: u64,
    largest_ms: f64,
    inertial_ms: f64,
    back_ns: i64,
    queues: [usize; 2],
    reported: u64,
    wrong: Vec<String>,
    digests: Vec<u64>,
}

fn lines(rig: &Rig, seed: u64, taken: &[Taken; 2]) -> Lines {
    let laser = |stream: usize| {
        let device = remembered_laser(idle_laser(rig.horizontal.baud), seed, stream as u64, &taken[stream]);
        Some(SimLine::new(device, seed, stream as u64))
    };
    let base = devices::base(&rig.base, &Faults::default());
    let unit = |unit| SimLine::new(devices::inertial_unit(unit, &Faults::default(), seed), seed, 3);
    [laser(0), laser(1), Some(SimLine::new(base, seed, 2)), rig.imu.as_ref().map(unit)]
}

fn run(fault: Fault, rig: &Rig, seed: u64, outcome: &mut Outcome) {
    let mut rng = Rng::new(seed, 0x4057, fault as i64);
    let (stalls, end_ns) = fault.stalls(&mut rng);
    let taken: [Taken; 2] = Default::default();
    let mut sim = SimRig::new(rig, lines(rig, seed, &taken), Plan::default(), Witness::default());
    sim.host = Some(Host::new(stalls));
    sim.run(end_ns + AFTER_NS, |_| false);
    outcome.runs += 1;
    let mut wrong = Vec::new();
    for port in PORTS {
        judge(&mut sim, rig, port, end_ns, outcome, &mut wrong);
    }
    for (laser, taken) in taken.iter().enumerate() {
        judge_stamps(&mut sim, laser, taken, outcome, &mut wrong);
    }
    judge_inertial_stamps(&mut sim, outcome, &mut wrong);
    let warnings = sim
        .reported
        .iter()
        .filter(|reported| reported.event.is_warning() && reported.event != Event::Untried);
    let warnings = warnings.count() as u64;
    outcome.reported = outcome.reported.max(warnings);
    if let Some(host) = &sim.host {
        outcome.kernel_lost_bytes += host.lost_bytes();
        let queues = host.longest_queues();
        outcome.queues = std::array::from_fn(|queue| outcome.queues[queue].max(queues[queue]));
    }
    outcome.digests.push(digest(&mut sim));
    if !wrong.is_empty() {
        let what = wrong.join("; ");
        let head = format!("seed {seed}, {} Bd, {fault:?} until {} ms", rig.horizontal.baud, end_ns / MS);
        outcome.wrong.push(format!("{head}: {what}\n{}", sim.transcript()));
    }
}

/// What reads returned intact was recorded, and it goes on.
fn judge(
    sim: &mut SimRig<Witness>,
    rig: &Rig,
    port: Port,
    end_ns: i64,
    outcome: &mut Outcome,
    wrong: &mut Vec<String>,
) {
    let (Some(line), Some(host)) = (&sim.lines[place(port)], &sim.host) else { return };
    let delivered = host.delivered(place(port));
    let witness = sim.engine.sink();
    let recorded_ns: Vec<i64> = match port {
        Port::Base => witness.odometry_ns.clone(),
        Port::Imu => witness.samples.iter().map(|sample| sample.log_ns).collect(),
        laser => witness.scans[place(laser)].iter().map(|scan| scan.log_ns).collect(),
    };
    let account = match port {
        Port::Base if rig.base != rig_at(0).base => Account::default(),
        Port::Base => {
            pioneer_account(&line.sent, delivered, 0, &recorded_ns, &sim.reported, LONGEST_PARTIAL_FRAME_NS)
        }
        Port::Imu => inertial_account(&sent_samples(&line.sent, delivered), delivered, &witness.samples),
        laser => {
            let telegrams = sent_scans(&line.sent, delivered);
            laser_account(laser, &telegrams, delivered, &witness.scans[place(laser)], &sim.reported)
        }
    };
    if account.lost() > 0 || account.wrongly_kept > 0 || account.undetected > 0 {
        wrong.push(format!("{port:?}: {account:?}"));
    }
    outcome.account.add(&account);
    match recorded_ns.iter().find(|at_ns| **at_ns > end_ns) {
        Some(at_ns) => outcome.back_ns = outcome.back_ns.max(at_ns - end_ns),
        None => wrong.push(format!("{port:?} not back")),
    }
    if recorded_ns.last().is_none_or(|last_ns| sim.now_ns() - last_ns > S) {
        wrong.push(format!("{port:?} silent at the end"));
    }
}

fn judge_stamps(
    sim: &mut SimRig<Witness>,
    laser: usize,
    taken: &Taken,
    outcome: &mut Outcome,
    wrong: &mut Vec<String>,
) {
    let taken = taken.lock().unwrap();
    let scans = &sim.engine.sink().scans[laser];
    let errors_ms: Vec<f64> = scans
        .iter()
        .filter_map(|scan| Some((scan.stamp_ns - taken.get(&scan.ranges_mm)?) as f64 * 1e-6))
        .collect();
    let squares: f64 = errors_ms.iter().map(|error| error * error).sum();
    let rms_ms = (squares / errors_ms.len().max(1) as f64).sqrt();
    let largest_ms = errors_ms.iter().fold(0.0_f64, |maximum, error| maximum.max(error.abs()));
    outcome.squares += squares;
    outcome.stamps += errors_ms.len() as u64;
    outcome.largest_ms = outcome.largest_ms.max(largest_ms);
    let has_lost = sim.host.as_ref().is_some_and(|host| host.lost_bytes() > 0);
    let max_ms = if has_lost { STAMPS_BEHIND_HOLES_MS } else { STAMPS_MS };
    if rms_ms > max_ms[0] || largest_ms > max_ms[1] {
        wrong.push(format!("laser {laser}: stamps off by {rms_ms:.2} ms rms, {largest_ms:.2} ms at most"));
    }
    let scans = &sim.engine.sink().scans[laser];
    if !has_lost && scans.windows(2).any(|pair| pair[0].stamp_ns >= pair[1].stamp_ns) {
        wrong.push(format!("laser {laser}: stamps step back"));
    }
}

/// Those of an inertial unit: it states its time, so that what lay unread is stamped as well as any other.
fn judge_inertial_stamps(sim: &mut SimRig<Witness>, outcome: &mut Outcome, wrong: &mut Vec<String>) {
    let samples = &sim.engine.sink().samples;
    // Before that its clock is not known well.
    let settled = samples.iter().position(|sample| sample.stamp_ns > S).unwrap_or(samples.len());
    let errors_ms = stamp_errors_ms(&samples[settled..]).map(|error_ms| error_ms - UNIT_LATENCY_ERROR_MS);
    let largest_ms = errors_ms.fold(0.0_f64, |largest, error_ms| largest.max(error_ms.abs()));
    outcome.inertial_ms = outcome.inertial_ms.max(largest_ms);
    let has_lost = sim.host.as_ref().is_some_and(|host| host.lost_bytes() > 0);
    if largest_ms > if has_lost { UNIT_STAMPS_BEHIND_HOLES_MS } else { UNIT_STAMPS_MS } {
        wrong.push(format!("inertial unit: stamps off by {largest_ms:.2} ms at most"));
    }
}

fn runs(fault: Fault, rig: &Rig, seeds: RangeInclusive<u64>) -> Outcome {
    let mut outcome = Outcome::default();
    for seed in seeds {
        run(fault, rig, seed, &mut outcome);
    }
    println!(
        "| {} | {} Bd, {}{} | {} | {} / {} | {} | {} | {:.2}, {:.2} | {:.2} | {} | {:?} | {} |",
        fault.name(),
        rig.horizontal.baud,
        rig.base.protocol.name(),
        if rig.imu.is_some() { ", xsens" } else { "" },
        outcome.runs,
        outcome.account.recorded,
        outcome.account.intact,
        outcome.account.damaged,
        outcome.kernel_lost_bytes,
        (outcome.squares / outcome.stamps.max(1) as f64).sqrt(),
        outcome.largest_ms,
        outcome.inertial_ms,
        outcome.back_ns / MS,
        outcome.queues,
        outcome.reported,
    );
    outcome
}

const HEAD: &str = "| fault of the host | rig | runs | recorded / intact | cut by a full buffer | bytes without room | stamps off, ms: rms, most | of a unit, most | back, worst ms | most bytes in the kernel, reads before the loop | said |\n|---|---|---|---|---|---|---|---|---|---|---|";

#[track_caller]
fn check(fault: Fault) {
    println!("{HEAD}");
    let mut wrong = runs(fault, &rig_at(38_400), seeds(2, 1)).wrong;
    wrong.extend(runs(fault, &rig_at(500_000), seeds(1, 4)).wrong);
    for base in [roboclaw_base(), rflex_base()] {
        wrong.extend(runs(fault, &Rig { base, ..rig_at(38_400) }, seeds(1, 4)).wrong);
    }
    let rig = with_inertial_unit(rig_at(38_400), 115_200, 100);
    wrong.extend(runs(fault, &rig, seeds(1, 4)).wrong);
    assert!(wrong.is_empty(), "{} runs are wrong, the first:\n{}", wrong.len(), wrong[0]);
}

#[test]
fn a_host_that_does_all_in_time() {
    check(Fault::None);
}

#[test]
fn a_suspended_process() {
    check(Fault::Suspended);
}

#[test]
fn a_core_stolen() {
    check(Fault::CoreStolen);
}

#[test]
fn memory_pressure() {
    check(Fault::PageFaults);
}

#[test]
fn the_same_seed_gives_the_same_run_to_the_last_byte() {
    let rig = rig_at(38_400);
    for fault in [Fault::Suspended, Fault::CoreStolen] {
        let [once, again] = [(); 2].map(|()| runs(fault, &rig, 1..=2).digests);
        assert_eq!(once, again, "{fault:?}");
        assert_ne!(once[0], once[1], "{fault:?}");
    }
}

/// A run on a disk that takes nothing for a while behind a queue of a quarter of a megabyte, in place of 32.
fn on_slow_disk(seed: u64, stalls: Stalls) -> SimRig<SlowDisk<Witness>> {
    let rig = rig_at(500_000);
    let disk = SlowDisk::new(Witness::default(), 256 << 10, stalls);
    let mut sim = SimRig::new(&rig, lines(&rig, seed, &Default::default()), Plan::default(), disk);
    sim.run(15 * S, |_| false);
    sim
}

/// Runs on such a disk; how many messages were written, and how many dropped.
fn slow_disks(name: &str, stall: impl Fn(&mut Rng) -> Stalls) {
    let (mut runs, mut written, mut dropped) = (0, 0, 0);
    for seed in seeds(1, 1) {
        let mut sim = on_slow_disk(seed, stall(&mut Rng::new(seed, 0xD15C, 0)));
        let mut undisturbed = on_slow_disk(seed, Stalls::default());
        undisturbed.engine.sink().flush();
        let (transcript, reported_undisturbed) = (sim.transcript(), undisturbed.transcript());
        let disk = sim.engine.sink();
        disk.flush();
        let reported_dropped = disk.written.health.last().map_or(0, |(_, health)| health.dropped);
        let dropped_here = disk.dropped();
        let all = &undisturbed.engine.sink().written;
        for (written, all) in disk.written.scans.iter().zip(&all.scans) {
            // What was written is what would have been, in its order, with holes.
            let mut rest = all.iter();
            assert!(written.iter().all(|scan| rest.any(|other| other == scan)), "seed {seed}");
        }
        assert_eq!(disk.handed, disk.taken + dropped_here, "seed {seed}: dropped is what is not written");
        assert_eq!(transcript, reported_undisturbed, "seed {seed}: a disk disturbs no device");
        assert!(
            reported_dropped <= dropped_here && (reported_dropped > 0) == (dropped_here > 0),
            "seed {seed}"
        );
        (runs, written, dropped) = (runs + 1, written + disk.taken, dropped + dropped_here);
    }
    println!("| {name} | 500000 Bd | {runs} | written {written} | dropped and told {dropped} |");
}

#[test]
fn a_slow_disk() {
    slow_disks("slow disk: nothing taken for 0.1 to 10 s", |rng| {
        let from_ns = UP_NS + (rng.unit() * 1e9) as i64;
        Stalls::one(from_ns, from_ns + (0.1 * 100_f64.powf(rng.unit()) * 1e9) as i64)
    });
}

#[test]
fn a_full_disk() {
    slow_disks("full disk: nothing taken any more", |rng| {
        Stalls::one(UP_NS + (rng.unit() * 1e9) as i64, i64::MAX)
    });
}
