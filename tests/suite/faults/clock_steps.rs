//! The host's clock steps by seconds to hours: a live run's time does not follow, and a capture stamped by
//! that clock loses nothing.

use std::cell::{Cell, RefCell};
use std::rc::Rc;

use biplane_matcher::TrackerParams;
use biplane_mock::faults::clock_step::HostClock;
use biplane_mock::faults::{Faults, Preset};
use biplane_onboard::test_support::{Clocks, RunClock};
use biplane_onboard::{Engine, EngineOptions, Feed, RunReport};
use biplane_recording::{Port, Rig};

use crate::rig::devices::{idle_lines, rig_at};
use crate::rig::plan::Plan;
use crate::rig::verdict::witness::Witness;
use crate::rig::{S, SimRig, seeds};

const ZERO_UTC_NS: i64 = 1_700_000_000 * S;
/// Long enough for two or three steps away and back.
const LENGTH_NS: i64 = 20 * S;

/// The two clocks of a computer in simulated time.
#[derive(Clone)]
struct Computer {
    now_ns: Rc<Cell<i64>>,
    host: Rc<RefCell<HostClock>>,
}

impl Clocks for Computer {
    fn monotonic_ns(&self) -> i64 {
        self.now_ns.get()
    }

    fn utc_ns(&self) -> i64 {
        self.host.borrow_mut().utc_ns(self.now_ns.get())
    }
}

/// A read: of which line, what the system's clock showed, the bytes.
type Read = (Port, i64, Vec<u8>);

/// A live run; returns what was recorded, and a capture of it stamped by the system's clock.
fn live(rig: &Rig, seed: u64) -> (Witness, Vec<Read>) {
    let host = Faults::new(&[Preset::ClockStep], seed).host_clock(ZERO_UTC_NS);
    let computer = Computer { now_ns: Rc::default(), host: Rc::new(RefCell::new(host)) };
    let clock = RunClock::start_on(computer.clone());
    let lines = idle_lines(rig, seed, &Faults::default(), &[]);
    let mut sim = SimRig::new(rig, lines, Plan::default(), Witness::default());
    let reads = Rc::new(RefCell::new(Vec::new()));
    let shared = Rc::clone(&reads);
    sim.tap = Some(Box::new(move |port, at_ns, bytes| {
        computer.now_ns.set(at_ns);
        assert_eq!(clock.now_ns(), ZERO_UTC_NS + at_ns, "a live run's time follows the system's clock");
        shared.borrow_mut().push((port, computer.utc_ns(), bytes.to_vec()));
    }));
    sim.run(LENGTH_NS, |_| false);
    let recorded = std::mem::take(sim.engine.sink());
    (recorded, reads.take())
}

/// The capture replayed, in the order in which it was written.
fn replayed(rig: &Rig, reads: &[Read]) -> (RunReport, Witness) {
    let options = EngineOptions {
        rig: rig.clone(),
        matcher: TrackerParams::default(),
        feed: Feed::Recorded,
        raw: false,
    };
    let mut engine = Engine::new(&options, Witness::default(), reads[0].1);
    for (port, shown_ns, bytes) in reads {
        engine.bytes(*shown_ns, *port, bytes);
        while engine.next_event().is_some() || engine.next_command().is_some() {}
    }
    let end_ns = reads.iter().map(|read| read.1).max().unwrap_or(0);
    engine.finish(end_ns)
}

#[test]
fn a_system_clock_that_steps_moves_no_live_time_and_its_capture_loses_nothing() {
    let rig = rig_at(38_400);
    let (mut steps, mut ahead, mut scans, mut lost) = (0, 0, 0, 0);
    let seeds = seeds(3, 1);
    for seed in seeds.clone() {
        let (live, reads) = live(&rig, seed);
        let (report, again) = replayed(&rig, &reads);
        let jumps = |is_one: fn(i64) -> bool| {
            reads.windows(2).filter(|pair| is_one(pair[1].1 - pair[0].1)).count() as u64
        };
        let back = jumps(|by_ns| by_ns < -S / 2);
        (steps, ahead) = (steps + back, ahead + jumps(|by_ns| by_ns > S / 2));
        assert_eq!(report.arrival.clock_steps, back, "seed {seed}");
        for (live, again) in live.scans.iter().zip(&again.scans) {
            scans += live.len();
            let is_kept = |ranges_mm: &Vec<u32>| again.iter().any(|scan| scan.ranges_mm == *ranges_mm);
            lost += live.iter().filter(|scan| !is_kept(&scan.ranges_mm)).count();
            let is_ordered = again.windows(2).all(|pair| pair[0].stamp_ns < pair[1].stamp_ns);
            assert!(is_ordered, "seed {seed}: stamps step back");
        }
        lost += live.odometry_ns.len().saturating_sub(again.odometry_ns.len());
        assert_eq!(
            (report.losses.lost, report.arrival.backward_stamps, report.recorded.unmatched),
            (0, 0, 0),
            "seed {seed}: {report:?}"
        );
        assert!(
            report.arrival.damaged <= 3,
            "seed {seed}: the end may cut a telegram a line: {}",
            report.arrival.damaged
        );
    }
    println!(
        "| clock-step | runs {} | steps back {steps}, ahead {ahead} | scans {scans}, not kept {lost} |",
        seeds.count()
    );
    assert!(steps > 0 && ahead > 0 && lost == 0, "{steps} {ahead} {lost}");
}
