//! A run may be stopped at any moment: in the middle of a start-up, of a scan, of an outage. It ends soon,
//! and leaves the devices idle.

use biplane_mock::faults::{Faults, Preset};
use biplane_mock::rng::Rng;

use crate::rig::devices::{idle_lines, rig_at, with_inertial_unit};
use crate::rig::plan::{Happening, Plan};
use crate::rig::verdict::witness::Witness;
use crate::rig::{MS, PORTS, S, SimRig, seeds};

/// `record` waits so long for its devices.
const STOPPED_NS: i64 = 3 * S;

/// Stops after `at_ns`; returns how long that took, if it ended in time, and which devices stream
/// nevertheless.
fn stop_after(at_ns: i64, baud: u32, seed: u64, faults: &Faults, plan: Plan) -> (Option<i64>, Vec<usize>) {
    let rig = with_inertial_unit(rig_at(baud), 115_200, 100);
    let lines = idle_lines(&rig, seed, faults, &[0, 1, 2, 3]);
    let mut sim = SimRig::new(&rig, lines, plan, Witness::default());
    sim.run(at_ns, |_| false);
    sim.stop();
    let stopped = sim.run(at_ns + STOPPED_NS, |sim| sim.engine.is_stopped());
    let took_ns = stopped.then(|| sim.now_ns() - at_ns);
    // What has been sent last is still on its way to the device.
    sim.run(sim.now_ns() + S / 2, |_| false);
    let streams = |place: &usize| sim.lines[*place].as_ref().is_some_and(|line| line.device_streams());
    (took_ns, (0..PORTS.len()).filter(streams).collect())
}

#[test]
fn stopped_while_everything_streams_all_devices_are_idle_within_a_second() {
    for seed in seeds(4, 1) {
        let at_ns = 2 * S + (Rng::new(seed, 0x5709, 0).unit() * 1e9) as i64;
        for baud in [38_400, 500_000] {
            let (took_ns, streaming) = stop_after(at_ns, baud, seed, &Faults::default(), Plan::default());
            assert!(took_ns.is_some_and(|took_ns| took_ns <= S), "seed {seed}: {took_ns:?}");
            assert!(streaming.is_empty(), "seed {seed}: {streaming:?}");
        }
    }
}

#[test]
fn stopped_in_the_middle_of_a_start_up_the_devices_that_others_left_streaming_are_idle_too() {
    for seed in seeds(20, 1) {
        let at_ns = (Rng::new(seed, 0x570A, 0).unit() * 1e9) as i64;
        let faults = Faults::new(&[Preset::LeftStreaming], seed);
        let (took_ns, streaming) = stop_after(at_ns, 38_400, seed, &faults, Plan::default());
        assert!(took_ns.is_some_and(|took_ns| took_ns <= S), "seed {seed}, {} ms: {took_ns:?}", at_ns / MS);
        assert!(streaming.is_empty(), "seed {seed}, {} ms: {streaming:?}", at_ns / MS);
    }
}

#[test]
fn stopped_while_a_cable_is_pulled_or_a_device_dark_the_run_ends_all_the_same() {
    for seed in seeds(4, 1) {
        for happening in [Happening::Part, Happening::PowerOff, Happening::Mute, Happening::Babble] {
            let at_ns = 3 * S + (Rng::new(seed, 0x570B, 0).unit() * 3e9) as i64;
            let plan = Plan::new(PORTS.iter().map(|port| (2 * S, *port, happening.clone())).collect());
            let (took_ns, _) = stop_after(at_ns, 38_400, seed, &Faults::default(), plan);
            assert!(took_ns.is_some(), "seed {seed}, {happening:?}, {} ms", at_ns / MS);
        }
    }
}
