//! The times that a laser with a clock states of a scan.

use crate::session::cola::scan::ColaScan;
use crate::session::scip::scan::ScipScan;
use crate::stamping::device_clock::Stated;

/// What a telegram states, and how long before it was sent its first beam was taken, microseconds.
pub(super) fn of_sick(scan: &ColaScan) -> (Stated, i64) {
    let since_scan_us = i64::from(scan.sent_us.wrapping_sub(scan.scan_us));
    let before_us = since_scan_us - (scan.first_beam_s * 1e6).round() as i64;
    let interval_us = (1e6 / scan.rate_hz).round() as i64;
    (Stated { sent_us: scan.sent_us, counter: scan.telegram_counter, interval_us }, before_us)
}

/// The same of a Hokuyo laser. It states no time of sending: a scan is taken as sent when its last step was
/// measured, which is the soonest.
pub(super) fn of_hokuyo(scan: &ScipScan) -> (Stated, i64) {
    let sent_us = scan.time.step_0_us + (scan.last_step_s * 1e6).round() as u64;
    let before_us = ((scan.last_step_s - scan.first_beam_s) * 1e6).round() as i64;
    let interval_us = scan.time.interval_us.round() as i64;
    (Stated { sent_us: sent_us as u32, counter: scan.counter, interval_us }, before_us)
}
