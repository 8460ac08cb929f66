//! A laser whose mirror does not turn at 75 Hz: that is said once and stands in the diagnostics and in the
//! account, and scans are stamped by the mirror that turns.
//!
//! Truth: when the simulated mirror stood at the first beam. How many turns lie between two telegrams is not
//! known of another mirror, so a stamp may be off by what a scan lasts longer or shorter; that is the same
//! for all scans, and taken out as their median.

use biplane_mock::devices::lms::LmsParams;
use biplane_mock::devices::lms::scans::feed::Mirror;
use biplane_mock::faults::Preset;
use biplane_onboard::Event;
use biplane_recording::Port;

use super::seeds;
use crate::rig::devices::{idle_laser, mirror, remembered_laser_turning, rig_at};
use crate::rig::line::SimLine;
use crate::rig::plan::{Happening, Plan};
use crate::rig::verdict::witness::Witness;
use crate::rig::world::Taken;
use crate::rig::{S, SimRig};

/// A run lasts so long.
const LASTS_NS: i64 = 40 * S;
/// The adapter stalls from then on.
const STALLS_NS: i64 = 12 * S;
/// That the mirror turns otherwise is said by then: streaming, and what a mean takes, twice at most.
const REPORTED_NS: i64 = 11 * S;
/// Stamps are off by no more than this from then on, milliseconds.
const MAX_OFF_MS: f64 = 1.0;
/// And by no more than this, root mean square, milliseconds.
const MAX_RMS_MS: f64 = 0.2;

/// What a run has shown.
struct Shown {
    reported_ns: Option<i64>,
    reports: usize,
    is_in_health: bool,
    is_in_account: bool,
    /// What stamps are off after it was reported, milliseconds, less their median.
    off_ms: Vec<f64>,
    median_ms: f64,
}

fn run(baud: u32, hz: f64, seed: u64) -> Shown {
    let rig = rig_at(baud);
    let taken = Taken::default();
    let of_seed = mirror(seed, 0);
    let turn_ns = if hz == 75.0 { of_seed.turn_ns } else { (1e9 / hz) as i64 };
    let params = LmsParams { mirror: Mirror { turn_ns, ..of_seed }, ..idle_laser(baud) };
    let device = remembered_laser_turning(params, seed, 0, &taken);
    let lines = [Some(SimLine::new(device, seed, 0)), None, None, None];
    let stalls = Happening::Faults(vec![Preset::UsbStall]);
    let plan = Plan::new(vec![(STALLS_NS, Port::Horizontal, stalls)]);
    let mut sim = SimRig::new(&rig, lines, plan, Witness::default());
    sim.run(LASTS_NS, |_| false);
    let of_interval = |event: &Event| matches!(event, Event::OddInterval { .. });
    let odd = sim.reported.iter().filter(|reported| of_interval(&reported.event));
    let reported: Vec<i64> = odd.map(|reported| reported.at_ns).collect();
    let now_ns = sim.now_ns();
    let (report, witness) = sim.engine.finish(now_ns);
    let is_in_account = report.mounting.odd_interval_ms_horizontal.is_some();
    let health = witness.health.last();
    let is_in_health = health.is_some_and(|(_, health)| health.horizontal.odd_interval_ms.is_some());
    let from_ns = reported.first().map_or(REPORTED_NS, |at_ns| at_ns + S);
    let taken = taken.lock().unwrap();
    let late = witness.scans[0].iter().filter(|scan| scan.log_ns >= from_ns);
    let mut off_ms: Vec<f64> =
        late.map(|scan| (scan.stamp_ns - taken[&scan.ranges_mm]) as f64 * 1e-6).collect();
    off_ms.sort_by(f64::total_cmp);
    let median_ms = off_ms.get(off_ms.len() / 2).copied().unwrap_or(f64::NAN);
    off_ms.iter_mut().for_each(|off_ms| *off_ms -= median_ms);
    Shown {
        reported_ns: reported.first().copied(),
        reports: reported.len(),
        is_in_health,
        is_in_account,
        off_ms,
        median_ms,
    }
}

/// A row of the table, and what was wrong.
fn row(baud: u32, hz: f64, wrong: &mut Vec<String>) -> String {
    let (mut runs, mut scans, mut reported_ns, mut rms_ms, mut largest_ms, mut median_ms) =
        (0, 0, 0, 0.0_f64, 0.0_f64, 0.0_f64);
    for seed in seeds(2, 5) {
        let shown = run(baud, hz, seed);
        let squares: f64 = shown.off_ms.iter().map(|off_ms| off_ms * off_ms).sum();
        let rms = (squares / shown.off_ms.len().max(1) as f64).sqrt();
        let largest = shown.off_ms.iter().fold(0.0_f64, |largest, off_ms| largest.max(off_ms.abs()));
        let is_odd = hz != 75.0;
        let is_reported = shown.reports == usize::from(is_odd)
            && shown.reported_ns.is_none_or(|at_ns| at_ns <= REPORTED_NS)
            && shown.is_in_health == is_odd
            && shown.is_in_account == is_odd;
        if !is_reported || rms > MAX_RMS_MS || largest > MAX_OFF_MS || shown.off_ms.len() < 100 {
            wrong.push(format!(
                "{hz} Hz at {baud} Bd, seed {seed}: reported {} times, {:?}, in health {}, account {}, {} scans, {rms:.3} ms rms, {largest:.2} ms",
                shown.reports,
                shown.reported_ns,
                shown.is_in_health,
                shown.is_in_account,
                shown.off_ms.len()
            ));
        }
        (runs, scans) = (runs + 1, scans + shown.off_ms.len());
        reported_ns = reported_ns.max(shown.reported_ns.unwrap_or(0));
        (rms_ms, largest_ms) = (rms_ms.max(rms), largest_ms.max(largest));
        median_ms = median_ms.max(shown.median_ms.abs());
    }
    let reported_s = reported_ns as f64 * 1e-9;
    format!(
        "| {hz} Hz | {baud} | {runs} | {scans} | {reported_s:.1} | {rms_ms:.3} | {largest_ms:.2} | {median_ms:.2} |\n"
    )
}

#[test]
fn a_mirror_that_turns_at_another_rate_is_reported_once_and_followed() {
    let mut wrong = Vec::new();
    let mut rows = String::new();
    for baud in [38_400, 500_000] {
        for hz in [70.0, 72.0, 74.0, 75.0, 76.0, 78.0] {
            rows += &row(baud, hz, &mut wrong);
        }
    }
    println!(
        "| mirror | Bd | runs | scans | said after, s | worst RMS, ms | largest, ms | median, ms |\n{rows}"
    );
    assert!(wrong.is_empty(), "{} runs are wrong:\n{}", wrong.len(), wrong.join("\n"));
}
