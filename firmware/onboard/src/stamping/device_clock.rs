//! The clock of a device that states its own time in every telegram: microseconds since power-on, 32 bits.
//!
//! A telegram states when it was sent. It arrives later by what the network and this computer add, never
//! earlier: the offset between both clocks is the lower envelope of arrival minus sending, and every moment
//! that the device states follows from it. The device's time wraps after 71.6 minutes, and begins anew when
//! the device is switched on; which of both happened shows in its count of telegrams and in the host's time.
//! Times are nanoseconds of the host, microseconds of the device.

use crate::stamping::envelope::{Envelope, EnvelopeParams};

/// Nanoseconds of an event of the envelope: a microsecond of the device.
const EVENT_NS: i64 = 1000;
/// Microseconds until the device's time comes round.
const ROUND_US: i64 = 1 << 32;
/// Telegrams may be held back by so much, microseconds: a pause of the network, a host that stood still.
const HELD_BACK_US: i64 = 2_000_000;
/// A telegram that is later than the clock says by more was held back, and says nothing of the clock,
/// nanoseconds. Larger: a pause of the network pulls the stamps behind it along.
const LATE_NS: i64 = 100_000_000;
/// When all are late for so long of the device's time, microseconds, the clock was wrong.
const ALL_LATE_US: i64 = 60_000_000;
/// Telegrams that were counted on by at most this many follow one another.
const FOLLOWING: u16 = 3000;
/// The intervals of telegrams that follow one another differ by no more than this part.
const SAME_INTERVAL: f64 = 0.1;

/// A telegram's own times.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
pub(crate) struct Stated {
    /// When it was sent, microseconds of the device.
    pub sent_us: u32,
    /// Its number.
    pub counter: u16,
    /// From a telegram to the next, microseconds.
    pub interval_us: i64,
}

/// The clock.
#[derive(Clone, Debug, Default)]
pub(crate) struct DeviceClock {
    envelope: Option<Envelope>,
    last: Option<(Stated, i64)>,
    /// The last telegram's time since the envelope's origin, microseconds.
    at_us: i64,
    /// That of the last telegram that was not held back.
    prompt_us: i64,
    /// Times that the device's time began anew, and how many of them were told.
    restarts: u64,
    reported: u64,
}

impl DeviceClock {
    /// A telegram arrived. The host's time of a moment that lies `before_us` before it was sent, nanoseconds.
    pub(crate) fn stamp_ns(&mut self, stated: Stated, arrived_ns: i64, before_us: i64) -> i64 {
        let passed_us = self.last.map(|(last, last_ns)| passed_us(last, last_ns, stated, arrived_ns));
        // One that follows the last at once waited where that one did.
        let since_last_ns = self.last.map_or(i64::MAX, |(_, last_ns)| arrived_ns.saturating_sub(last_ns));
        let is_burst = since_last_ns < stated.interval_us.saturating_mul(500);
        self.last = Some((stated, arrived_ns));
        match (passed_us, &mut self.envelope) {
            (Some(Some(passed_us)), Some(envelope)) => {
                self.at_us += passed_us;
                if !is_burst && arrived_ns.saturating_sub(envelope.at_ns(self.at_us)) <= LATE_NS {
                    envelope.add(self.at_us, arrived_ns);
                    self.prompt_us = self.at_us;
                } else if self.at_us - self.prompt_us > ALL_LATE_US {
                    self.begin(arrived_ns);
                }
            }
            _ => {
                self.restarts += u64::from(self.envelope.is_some());
                self.begin(arrived_ns);
            }
        }
        let at_us = self.at_us.saturating_sub(before_us);
        self.envelope.as_ref().map_or(arrived_ns, |envelope| envelope.at_ns(at_us))
    }

    fn begin(&mut self, arrived_ns: i64) {
        (self.at_us, self.prompt_us) = (0, 0);
        self.envelope = Some(Envelope::new(EnvelopeParams::default(), EVENT_NS, arrived_ns));
    }

    /// Whether the device's time began anew since this was asked last.
    pub(crate) fn take_restart(&mut self) -> bool {
        std::mem::replace(&mut self.reported, self.restarts) != self.restarts
    }

    /// Times that the device's time began anew.
    #[cfg(test)]
    pub(crate) fn restarts(&self) -> u64 {
        self.restarts
    }
}

/// How much of the device's time has passed since the last telegram; `None` when it began anew.
fn passed_us(last: Stated, last_ns: i64, now: Stated, now_ns: i64) -> Option<i64> {
    let passed_us = i64::from(now.sent_us.wrapping_sub(last.sent_us));
    let counted = now.counter.wrapping_sub(last.counter);
    let expected_us = i64::from(counted).saturating_mul(now.interval_us);
    let allowed_us = now.interval_us / 2 + (SAME_INTERVAL * expected_us as f64) as i64;
    if (1..=FOLLOWING).contains(&counted) && (passed_us - expected_us).abs() <= allowed_us {
        return Some(passed_us);
    }
    // Nothing came for a while, so that it may have come round.
    let elapsed_us = now_ns.saturating_sub(last_ns) / 1000;
    let rounds = (elapsed_us.saturating_sub(passed_us).saturating_add(ROUND_US / 2)).div_euclid(ROUND_US);
    let passed_us = passed_us + rounds.max(0) * ROUND_US;
    (passed_us.saturating_sub(elapsed_us).abs() <= HELD_BACK_US).then_some(passed_us)
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: i64 = 1_000_000;

    /// The worst error of the stamps of a device that sends each 20 ms, by its own time at the first telegram
    /// and what happens to each: time lost by the device's clock, delay; the first second left out.
    fn worst_ns(first_us: u32, of: impl Fn(i64) -> (u32, u16, i64)) -> (i64, u64) {
        let mut clock = DeviceClock::default();
        let mut worst_ns = 0;
        for number in 0..2000_i64 {
            let (back_us, back, late_ns) = of(number);
            let sent_us = first_us.wrapping_add((20_002 * number) as u32).wrapping_sub(back_us);
            let counter = (number as u16).wrapping_add(65_000).wrapping_sub(back);
            let stated = Stated { sent_us, counter, interval_us: 20_000 };
            let true_ns = number * 20_000_000;
            let stamp_ns = clock.stamp_ns(stated, true_ns + late_ns, 3_000);
            if number > 50 {
                worst_ns = worst_ns.max((stamp_ns - (true_ns - 3 * MS)).abs());
            }
        }
        (worst_ns, clock.restarts())
    }

    fn late_ns(number: i64) -> i64 {
        (number * 7919 % 13) * 30_000 + if number % 97 == 5 { 8 * MS } else { 0 }
    }

    #[test]
    fn stamps_follow_the_devices_clock_and_not_the_delays() {
        // 100 millionths fast, delays up to 8 ms: no stamp errs by more than 0.1 ms.
        let (worst, restarts) = worst_ns(5, |number| (0, 0, late_ns(number)));
        assert!(worst < 100_000 && restarts == 0, "{worst} ns");
    }

    #[test]
    fn a_clock_that_comes_round_changes_nothing() {
        let plain = worst_ns(5, |number| (0, 0, late_ns(number)));
        assert_eq!(worst_ns(u32::MAX - 12_345_678, |number| (0, 0, late_ns(number))), plain);
    }

    #[test]
    fn a_device_that_is_switched_on_begins_anew_and_a_host_that_stood_still_does_not() {
        let restarted = |number: i64| {
            let is_new = number >= 700;
            (if is_new { 700 * 20_002 } else { 0 }, if is_new { 464 } else { 0 }, 0)
        };
        let (worst, restarts) = worst_ns(90_000_000, |number| {
            let (back_us, back, late) = restarted(number);
            (if back_us > 0 { back_us + 80_000_000 } else { 0 }, back, late)
        });
        assert!(worst < 100_000 && restarts == 1, "{worst} ns, {restarts}");
        // Thirty seconds of telegrams arrive at once.
        let held = |number: i64| if (300..1500).contains(&number) { (1500 - number) * 20 * MS } else { 0 };
        let (worst, restarts) = worst_ns(5, |number| (0, 0, held(number)));
        assert!(worst < 4 * MS && restarts == 0, "{worst} ns, {restarts}");
    }

    #[test]
    fn what_comes_round_while_nobody_listens_is_counted_by_the_hosts_time() {
        let first = Stated { sent_us: 1_000, counter: 3, interval_us: 20_000 };
        let later_us = 2 * ROUND_US + 5_000_000;
        let later = Stated { sent_us: (1_000 + later_us) as u32, counter: 7, interval_us: 20_000 };
        assert_eq!(passed_us(first, 0, later, later_us * 1000 + 40 * MS), Some(later_us));
        assert_eq!(passed_us(first, 0, later, later_us * 1000 + 4_000 * MS), None);
    }
}
