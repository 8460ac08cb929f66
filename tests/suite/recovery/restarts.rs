//! Stamps of a laser that was switched off and on without a word: its message at power-on is not heard, its
//! mirror has another phase, its index counts anew. Truth is when the simulated mirror stood at the first
//! beam.
//!
//! The same reads then go through a replay, which sees nothing but a pause.

use std::sync::{Arc, Mutex};

use biplane_matcher::TrackerParams;
use biplane_mock::devices::lms::LmsParams;
use biplane_mock::devices::lms::settings::Variant;
use biplane_onboard::{Engine, EngineOptions, Feed};
use biplane_recording::rig::Laser;
use biplane_recording::{Port, Rig};

use crate::rig::devices::{idle_laser, remembered_laser, rig_at};
use crate::rig::line::SimLine;
use crate::rig::line::usb::UsbParams;
use crate::rig::plan::{Happening, Plan};
use crate::rig::verdict::witness::{RecordedScan, Witness};
use crate::rig::world::Taken;
use crate::rig::{MS, S, SimRig, seeds};

const BAUD: u32 = 500_000;
/// The outage of a run.
#[derive(Clone, Copy, Debug)]
struct Outage {
    off_ns: i64,
    lasts_ns: i64,
    /// Whether the adapter is out of the computer all the time.
    unplugged: bool,
}

impl Outage {
    fn on_ns(self) -> i64 {
        self.off_ns + self.lasts_ns
    }

    fn plan(self) -> Plan {
        // Nothing is heard of the device until its message at power-on is over.
        let received_ns = self.on_ns() + LmsParams::default().boot_ns + 200 * MS;
        let (deaf, hears) = match self.unplugged {
            true => (Happening::Unplug, Happening::Plug),
            false => (Happening::Mute, Happening::Unmute),
        };
        let happenings = [
            (self.off_ns, deaf),
            (self.off_ns, Happening::PowerOff),
            (self.on_ns(), Happening::PowerOn),
            (received_ns, hears),
        ];
        Plan::new(happenings.map(|(at_ns, happening)| (at_ns, Port::Vertical, happening)).to_vec())
    }
}

fn rig(fov_deg: u16, resolution_deg: f64, index: bool) -> Rig {
    let mut rig = rig_at(BAUD);
    if let Some(laser) = &mut rig.vertical {
        *laser = Laser { fov_deg, resolution_deg, index_bytes: Some(index), ..laser.clone() };
    }
    rig
}

/// Errors of the stamps of all scans that were taken from then on, milliseconds.
fn errors_ms(scans: &[RecordedScan], taken: &Taken, from_ns: i64) -> Vec<f64> {
    let taken = taken.lock().unwrap();
    let truth_ns = scans.iter().map(|scan| (scan.stamp_ns, taken[&scan.ranges_mm]));
    let wanted = truth_ns.filter(|(_, t0_ns)| *t0_ns >= from_ns);
    wanted.map(|(stamp_ns, t0_ns)| (stamp_ns - t0_ns) as f64 * 1e-6).collect()
}

/// A read's time and bytes.
type Read = (i64, Vec<u8>);

/// Errors after the outage: live, and when the same reads are replayed.
fn run(rig: &Rig, outage: Outage, usb: UsbParams, seed: u64) -> [Vec<f64>; 2] {
    let laser = rig.vertical.as_ref().unwrap();
    let variant = Variant::of(laser.fov_deg, (laser.resolution_deg * 100.0).round() as u16);
    let taken = Taken::default();
    let device = remembered_laser(LmsParams { variant, ..idle_laser(BAUD) }, seed, 1, &taken);
    let lines = [None, Some(SimLine::new(device, seed, 1).behind(usb)), None, None];
    let mut sim = SimRig::new(rig, lines, outage.plan(), Witness::default());
    let reads = Arc::new(Mutex::new(Vec::new()));
    let tapped = reads.clone();
    sim.tap =
        Some(Box::new(move |_, at_ns, bytes: &[u8]| tapped.lock().unwrap().push((at_ns, bytes.to_vec()))));
    sim.run(outage.on_ns() + 14 * S, |_| false);
    let live = errors_ms(&sim.engine.sink().scans[1], &taken, outage.on_ns());
    let reads = reads.lock().unwrap();
    let replayed = errors_ms(&replay(rig, &reads), &taken, outage.on_ns());
    [live, replayed]
}

/// The scans of a replay of these reads.
fn replay(rig: &Rig, reads: &[Read]) -> Vec<RecordedScan> {
    let (rig, matcher) = (rig.clone(), TrackerParams::default());
    let options = EngineOptions { rig, matcher, feed: Feed::Recorded, raw: false };
    let mut engine = Engine::new(&options, Witness::default(), 0);
    for (at_ns, bytes) in reads {
        engine.bytes(*at_ns, Port::Vertical, bytes);
        while engine.next_event().is_some() {}
    }
    std::mem::take(&mut engine.sink().scans[1])
}

/// One row of the table: root mean square and largest error, milliseconds.
fn row(rig: &Rig, unplugged: bool, tick_ms: f64, seed: u64, wrong: &mut Vec<String>) {
    let at = seed as i64;
    let outage = Outage { off_ns: 4 * S + at * 7 * MS, lasts_ns: 400 * MS + at * 1103 * MS, unplugged };
    let usb = UsbParams { tick_ms, ..UsbParams::default() };
    for (errors, how) in run(rig, outage, usb, seed).iter().zip(["live", "replayed"]) {
        let rms = (errors.iter().map(|e| e * e).sum::<f64>() / errors.len().max(1) as f64).sqrt();
        let largest = errors.iter().fold(0.0_f64, |maximum, e| maximum.max(e.abs()));
        let Some(Laser { fov_deg, resolution_deg, index_bytes, .. }) = rig.vertical else { return };
        let row = format!(
            "{fov_deg} by {resolution_deg}, index {index_bytes:?}, unplugged {unplugged}, ticks of {tick_ms} ms, seed {seed}, {how}: {} scans, {rms:.3} ms rms, {largest:.2} ms",
            errors.len()
        );
        println!("{row}");
        if errors.len() < 180 || rms >= 1.0 || largest > 15.0 {
            wrong.push(row);
        }
    }
}

#[test]
fn a_laser_that_was_switched_off_and_on_unheard_is_stamped_by_its_new_mirror_phase_and_index() {
    let mut wrong = Vec::new();
    for seed in seeds(2, 4) {
        for (fov_deg, resolution_deg) in [(180, 1.0), (100, 1.0), (100, 0.25)] {
            for index in [false, true] {
                let rig = rig(fov_deg, resolution_deg, index);
                for (unplugged, tick_ms) in [(false, 0.0), (true, 0.0), (false, 16.0), (true, 16.0)] {
                    row(&rig, unplugged, tick_ms, seed, &mut wrong);
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}
