//! When a laser's scans and beams were taken: what the bag tells, what is given, what has to be guessed.

use super::LaserPlan;
use super::placed::Placed;
use crate::recordings::import::bag::frames::bare;
use crate::recordings::import::bag::messages::scans::{BeamTimes, stated_scan_time_s, times_of_one_turn};
use crate::recordings::import::bag::options::{LaserOptions, Stamps};
use crate::recordings::import::bag::survey::LaserSeen;

/// Scans come to a recorder so long after their stamps, as a rule, in ms: at 38400 Bd a scan of an LMS 2xx is
/// on the line for 0.1 s.
const USUAL_LAG_MS: (f64, f64) = (5.0, 130.0);
/// Stamps so far from their receipt were made by another clock, in ms.
const OTHER_CLOCK_MS: f64 = 86_400_000.0;
/// The direction that a scan ends in is off by so many increments when something is wrong with it.
const END_STEPS: f64 = 0.5;

/// A laser as it is taken; what is odd about its times and directions is noted. `delay_flag` moves its
/// stamps; without one nothing is said of them.
pub(crate) fn laser_plan(
    laser: &Placed<'_>,
    given: &LaserOptions,
    stamps: Stamps,
    delay_flag: Option<&str>,
    notes: &mut Vec<String>,
) -> LaserPlan {
    let seen = laser.seen;
    let unstamped = seen.is_unstamped();
    let by_receipt = stamps == Stamps::Receipt || unstamped;
    if unstamped && stamps == Stamps::Header {
        notes.push(format!("{}: no stamps; the time of receipt is taken", seen.topic));
    }
    if let Some(delay_flag) = delay_flag.filter(|_| !by_receipt) {
        note_lag(seen, delay_flag, notes);
    }
    note_ends(seen, notes);
    if let Some((period_ns, gaps, longest_ns)) = seen.periods(by_receipt).filter(|(_, gaps, _)| *gaps > 0) {
        let [period_ms, longest_s] = [period_ns as f64 / 1e6, longest_ns as f64 / 1e9];
        let topic = &seen.topic;
        notes.push(format!(
            "{topic}: {gaps} {}, the longest of {longest_s:.2} s (a scan comes every {period_ms:.1} ms)",
            if gaps == 1 { "gap" } else { "gaps" }
        ));
    }
    let mount = given.mount.or(laser.mount).unwrap_or_else(|| {
        notes.push(format!("where {} sits is not known: it is taken to be at the base's origin", seen.topic));
        Default::default()
    });
    LaserPlan {
        topic: bare(&seen.topic).to_owned(),
        frame: seen.frame.clone(),
        mount,
        times: beam_times(seen, given, by_receipt, notes),
        is_override: given.time_increment_s.is_some(),
        delay_ns: (given.delay_ms * 1e6).round() as i64,
        by_receipt,
        beams: seen.usual_beams(),
    }
}

/// What stands in for beam times that the bag does not tell.
fn beam_times(
    seen: &LaserSeen,
    given: &LaserOptions,
    by_receipt: bool,
    notes: &mut Vec<String>,
) -> Option<BeamTimes> {
    let first = seen.first.as_ref()?;
    let period_s = seen.periods(by_receipt).map(|(period_ns, ..)| period_ns as f64 * 1e-9);
    let scan_time_s = stated_scan_time_s(first).map(f64::from).or(period_s).unwrap_or_default();
    if let Some(time_s) = given.time_increment_s {
        let (time_increment_s, scan_time_s) = (time_s as f32, scan_time_s as f32);
        return Some(BeamTimes { time_increment_s, scan_time_s });
    }
    if seen.untimed == 0 {
        return None;
    }
    let times = times_of_one_turn(first, scan_time_s);
    notes.push(format!(
        "{}: {} of {} scans tell no time from beam to beam; {:.2} us are taken, as of a mirror that turns once in {:.1} ms \
         (--time-increment-us says another; 0 for all beams at once)",
        seen.topic, seen.untimed, seen.scans, f64::from(times.time_increment_s) * 1e6, scan_time_s * 1e3
    ));
    Some(times)
}

fn note_lag(seen: &LaserSeen, delay_flag: &str, notes: &mut Vec<String>) {
    let lag_ms = seen.lag_ns() as f64 / 1e6;
    if (USUAL_LAG_MS.0..=USUAL_LAG_MS.1).contains(&lag_ms) {
        return;
    }
    if lag_ms.abs() > OTHER_CLOCK_MS {
        notes.push(format!(
            "{}: stamps run on another clock than the recorder's, {:.1} s apart (a simulation's?); they are taken as they are",
            seen.topic,
            lag_ms / 1e3
        ));
        return;
    }
    notes.push(format!(
        "{}: scans came {lag_ms:.1} ms after their stamps ({} to {} ms is usual, more on a line of 19200 Bd and less); \
         where a stamp is not that of the first beam, {delay_flag} moves it",
        seen.topic, USUAL_LAG_MS.0, USUAL_LAG_MS.1
    ));
}

/// The increment counts; a last direction that does not fit is given.
fn note_ends(seen: &LaserSeen, notes: &mut Vec<String>) {
    let Some(first) = &seen.first else { return };
    let steps = seen.usual_beams().saturating_sub(1) as f64;
    let increment = f64::from(first.angle_increment_rad);
    let [min, max] = [first.angle_min_rad, first.angle_max_rad].map(f64::from);
    let off_steps = (max - min - steps * increment) / increment;
    if off_steps.abs() > END_STEPS || off_steps.is_nan() {
        notes.push(format!(
            "{}: angle_max {:.3} deg does not fit {} beams from {:.3} deg in steps of {:.4} deg; the steps are taken",
            seen.topic,
            max.to_degrees(),
            steps + 1.0,
            min.to_degrees(),
            increment.to_degrees()
        ));
    }
}
