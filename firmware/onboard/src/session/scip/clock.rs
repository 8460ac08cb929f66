//! The clock of a Hokuyo laser: milliseconds of 24 bits, at which its mirror passed step 0. It comes round
//! after 4 h 40 min, and begins anew when the device is switched on or reset.
//!
//! A millisecond is coarse: a wall 10 m away moves by 17 mm in it when the robot turns at 1.7 rad/s. The
//! mirror turns evenly, so that the times of step 0 follow from many scans, and each of them must lie in its
//! millisecond. Times are nanoseconds of the host, microseconds of the device.

use biplane_wire::scip::CLOCK_ROUND_MS;

/// A clock that differs from the host's by more since the last scan has begun anew, milliseconds. Larger: a
/// host that stood still, or a network that paused, is no reset.
const HELD_BACK_MS: i64 = 2_000;
/// Behind a clock that began anew, so much time seems to have passed that nobody takes it for one that goes
/// on, microseconds.
const ANEW_US: u64 = 1 << 31;
/// Scans that may be missing between two that are counted on.
const MAX_MISSING: f64 = 40.0;
/// A scan that is farther from where it should be begins a new count, microseconds.
const OUTLIER_US: f64 = 1_500.0;
/// Share of a scan's error that corrects the time, once many were seen; a time that leaves its millisecond is
/// corrected wholly. Of 0.02, 0.01 and 0.005 this is the best for turns of 25.013, 24.991 and 25.003 ms (RMS
/// 82 to 229, 63 to 150, 79 to 111 us). Larger: follows a mirror that wavers sooner, with more noise.
const GAIN: f64 = 0.01;
/// The same for the interval, which then is damped.
const INTERVAL_GAIN: f64 = GAIN * GAIN / (2.0 - GAIN);
/// Half of the clock's step, microseconds.
const HALF_US: f64 = 500.0;

/// A scan's times.
#[derive(Copy, Clone, PartialEq, Debug, Default)]
pub(crate) struct ScanTime {
    /// When the mirror passed step 0, microseconds since the first scan and without end.
    pub step_0_us: u64,
    /// From a scan to the next, microseconds.
    pub interval_us: f64,
    /// Scans between the last one and this that did not come.
    pub missing: u32,
}

/// The clock.
#[derive(Clone, Debug, Default)]
pub(crate) struct ScanClock {
    last: Option<Last>,
}

#[derive(Copy, Clone, Debug)]
struct Last {
    clock_ms: u32,
    now_ns: i64,
    /// The clock without end, microseconds.
    begun_us: u64,
    /// Behind it, when step 0 was passed, microseconds.
    rest_us: f64,
    interval_us: f64,
    /// Scans in a row.
    count: u32,
}

impl ScanClock {
    /// A scan has come with this time; its interval as far as the device has told.
    pub(crate) fn take(&mut self, clock_ms: u32, now_ns: i64, nominal_us: f64) -> ScanTime {
        let first =
            || Last { clock_ms, now_ns, begun_us: 0, rest_us: HALF_US, interval_us: nominal_us, count: 1 };
        let (last, missing) = match self.last {
            None => (first(), 0),
            Some(last) => {
                let passed_ms = clock_ms.wrapping_sub(last.clock_ms) % CLOCK_ROUND_MS;
                match passed_us(passed_ms, now_ns.saturating_sub(last.now_ns)) {
                    None => (Last { begun_us: last.begun_us + ANEW_US, ..first() }, 0),
                    Some(passed_us) => last.next(clock_ms, now_ns, passed_us, nominal_us),
                }
            }
        };
        self.last = Some(last);
        let step_0_us = last.begun_us + last.rest_us.round() as u64;
        ScanTime { step_0_us, interval_us: last.interval_us, missing }
    }
}

/// How much of the device's time has passed, microseconds; `None` when its clock has begun anew.
fn passed_us(passed_ms: u32, elapsed_ns: i64) -> Option<u64> {
    let (passed_ms, elapsed_ms) = (i64::from(passed_ms), elapsed_ns / 1_000_000);
    let round_ms = i64::from(CLOCK_ROUND_MS);
    let rounds = (elapsed_ms - passed_ms + round_ms / 2).div_euclid(round_ms).max(0);
    let passed_ms = passed_ms + rounds * round_ms;
    ((passed_ms - elapsed_ms).abs() <= HELD_BACK_MS).then_some(passed_ms.unsigned_abs() * 1000)
}

impl Last {
    fn next(self, clock_ms: u32, now_ns: i64, passed_us: u64, nominal_us: f64) -> (Self, u32) {
        let fresh = Self {
            clock_ms,
            now_ns,
            begun_us: self.begun_us + passed_us,
            rest_us: HALF_US,
            interval_us: nominal_us,
            count: 1,
        };
        let passed_us = passed_us as f64;
        let intervals = (passed_us / self.interval_us).round();
        // From the begin of this millisecond.
        let predicted_us = self.rest_us + intervals * self.interval_us - passed_us;
        let error_us = HALF_US - predicted_us;
        if !(1.0..=MAX_MISSING).contains(&intervals) || error_us.abs() > OUTLIER_US {
            return (fresh, 0);
        }
        let count = self.count.saturating_add(1);
        let seen = f64::from(count);
        let gain = (2.0 * (2.0 * seen - 1.0) / (seen * (seen + 1.0))).clamp(GAIN, 1.0);
        let interval_gain = (6.0 / (seen * (seen + 1.0))).clamp(INTERVAL_GAIN, 0.2);
        let rest_us = (predicted_us + gain * error_us).clamp(0.0, 2.0 * HALF_US);
        let interval_us = self.interval_us + interval_gain * error_us / intervals;
        (Self { rest_us, interval_us, count, ..fresh }, intervals as u32 - 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Errors of the times of step 0, RMS and worst, microseconds, of a mirror whose turns take this long.
    fn errors_us(turn_us: f64, first_ms: u32, wavers: bool) -> (f64, f64) {
        let mut clock = ScanClock::default();
        let (mut sum, mut worst, mut count) = (0.0, 0.0_f64, 0.0);
        let mut first_us = 0.0;
        for number in 0..4000_u32 {
            // A mirror that is half a thousandth slow and fast in turn.
            let waver_us = if wavers { 100.0 * (f64::from(number) * 0.02).sin() } else { 0.0 };
            let true_us = 217.0 + f64::from(number) * turn_us + waver_us;
            let clock_ms = (first_ms + (true_us / 1000.0) as u32) % CLOCK_ROUND_MS;
            let time = clock.take(clock_ms, (true_us * 1000.0) as i64 + 20_000_000, 25_000.0);
            first_us = if number == 0 { (true_us / 1000.0).floor() * 1000.0 } else { first_us };
            let error_us = time.step_0_us as f64 - (true_us - first_us);
            if number > 50 {
                (sum, count) = (sum + error_us * error_us, count + 1.0);
                worst = worst.max(error_us.abs());
            }
        }
        ((sum / count).sqrt(), worst)
    }

    #[test]
    fn step_0_is_known_much_better_than_its_millisecond_and_the_clock_comes_round() {
        for (turn_us, first_ms, wavers) in [
            (25_013.0, 5, false),
            (25_013.0, CLOCK_ROUND_MS - 40_000, false),
            (24_990.7, 77, true),
            (25_170.3, 1, true),
        ] {
            let (rms_us, worst_us) = errors_us(turn_us, first_ms, wavers);
            println!("{turn_us} us: RMS {rms_us:.0} us, worst {worst_us:.0} us");
            assert!(rms_us < 150.0 && worst_us < 600.0, "{turn_us}: RMS {rms_us}, worst {worst_us}");
        }
    }

    #[test]
    fn scans_that_are_missing_are_counted_and_a_reset_is_none() {
        let mut clock = ScanClock::default();
        let mut at = |clock_ms: u32, ms: i64| clock.take(clock_ms, ms * 1_000_000, 25_000.0);
        at(1000, 0);
        let before = at(1025, 25);
        let behind = at(1125, 125);
        assert_eq!((before.missing, behind.missing), (0, 3));
        assert!(behind.step_0_us - before.step_0_us < 101_000);
        // Reset, and found again half a second later.
        let anew = at(300, 625);
        assert!(anew.step_0_us - behind.step_0_us >= ANEW_US - 1000 && anew.missing == 0);
        // Twice round while nobody listened.
        let round_ms = i64::from(CLOCK_ROUND_MS);
        let later = at(400, 725 + 2 * round_ms);
        let passed_us = (later.step_0_us - anew.step_0_us) as i64;
        assert!((passed_us - (100 + 2 * round_ms) * 1000).abs() <= 1000, "{passed_us}");
    }
}
