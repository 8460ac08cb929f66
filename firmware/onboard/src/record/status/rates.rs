//! Rates for people: over some seconds, so that a line of the slowest laser does not flicker between two
//! numbers.

use crate::engine::out::health::Health;
use crate::engine::out::health::LineHealth;

/// States that a rate is taken over, one a second.
const SPAN: usize = 5;

/// What the lines had brought in the last seconds.
#[derive(Clone, Debug, Default)]
pub(crate) struct Rates {
    /// Time in nanoseconds, and measurements of the horizontal laser, the vertical one, the base and
    /// the inertial unit.
    reported: heapless::Deque<(i64, [u64; 4]), SPAN>,
    streaming: [bool; 4],
}

impl Rates {
    /// The state at a time, with rates since up to five states before; a line that has just begun has its
    /// own.
    pub(crate) fn smooth(&mut self, now_ns: i64, health: &Health) -> Health {
        let mut smooth = *health;
        let mut lines = [&mut smooth.horizontal, &mut smooth.vertical, &mut smooth.base, &mut smooth.imu];
        let streaming = lines.each_ref().map(|line| line.streaming);
        if streaming != self.streaming {
            // A pause, or its end, is seen at once.
            self.reported.clear();
            self.streaming = streaming;
        }
        let measurements = lines.each_ref().map(|line| line.measurements);
        if let Some(&(before_ns, before)) = self.reported.front() {
            for (line, before) in lines.iter_mut().zip(before) {
                since(line, now_ns.saturating_sub(before_ns), before);
            }
        }
        if self.reported.is_full() {
            self.reported.pop_front();
        }
        let _ = self.reported.push_back((now_ns, measurements));
        smooth
    }
}

fn since(line: &mut LineHealth, span_ns: i64, before: u64) {
    if span_ns > 0 {
        line.rate_hz = line.measurements.saturating_sub(before) as f64 / (span_ns as f64 * 1e-9);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rate_is_that_of_five_seconds_and_a_line_that_begins_has_its_own() {
        const S: i64 = 1_000_000_000;
        let mut rates = Rates::default();
        let mut health = Health::default();
        let mut shown = Vec::new();
        // 9.4 Hz brings 9 or 10 a second.
        for (at_s, measurements) in [9, 19, 28, 38, 47, 56, 66].into_iter().enumerate() {
            health.horizontal =
                LineHealth { streaming: true, measurements, rate_hz: 9.0, ..health.horizontal };
            shown.push(rates.smooth(at_s as i64 * S, &health).horizontal.rate_hz);
        }
        assert_eq!(shown, [9.0, 10.0, 9.5, 29.0 / 3.0, 9.5, 9.4, 9.4]);
    }
}
