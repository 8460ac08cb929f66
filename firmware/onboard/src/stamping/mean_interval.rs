//! The mean distance of the telegrams of a device, where it sends them at even distances.
//!
//! Only telegrams that came at the line's pace are looked at; those between them are counted. A distance that
//! differs from the mean begins a new run: telegrams were left out, or the device does not keep its time.
//! Nanoseconds.

use crate::stamping::arrivals::Pace;
use crate::stamping::departure::{Departure, HostState};

/// A departure at the line's pace may be off its even distance by this much, nanoseconds: what its reads
/// leave open.
const EVEN_NS: i64 = 1_000_000;
/// A mean is taken over so many telegrams ...
const MIN_TELEGRAMS: i64 = 8;
/// ... and so long a time, nanoseconds: twice [`EVEN_NS`] is then less than an envelope follows.
const MIN_SPAN_NS: i64 = 5_000_000_000;

/// A run of telegrams at even distances.
#[derive(Copy, Clone, Debug, Default)]
pub(crate) struct MeanInterval {
    run: Option<Run>,
}

#[derive(Copy, Clone, Debug)]
struct Run {
    first_ns: i64,
    min_cycles: i64,
    /// Telegrams since the first one.
    telegrams: i64,
    /// The last one at the line's pace: its number and its time.
    last: (i64, i64),
}

impl MeanInterval {
    /// A telegram has come.
    pub(crate) fn note(&mut self, departure: &Departure) {
        let is_next = departure.is_next && departure.host != HostState::Resumed;
        let run = self.run.filter(|run| is_next && run.min_cycles == departure.min_cycles);
        let run = run.map(|run| Run { telegrams: run.telegrams + 1, ..run });
        if departure.pace != Pace::Line || departure.host != HostState::Listening {
            self.run = run;
            return;
        }
        let time_ns = departure.time_ns;
        let fitting = run.filter(|run| run.is_even(time_ns));
        self.run = Some(match fitting {
            Some(run) => Run { last: (run.telegrams, time_ns), ..run },
            None => {
                let min_cycles = departure.min_cycles;
                Run { first_ns: time_ns, min_cycles, telegrams: 0, last: (0, time_ns) }
            }
        });
    }

    /// The mean distance; `None` before enough telegrams have come at even ones.
    pub(crate) fn mean_ns(&self) -> Option<f64> {
        let run = self.run?;
        let (telegrams, last_ns) = run.last;
        let span_ns = last_ns.saturating_sub(run.first_ns);
        (telegrams >= MIN_TELEGRAMS && span_ns >= MIN_SPAN_NS).then(|| span_ns as f64 / telegrams as f64)
    }
}

impl Run {
    /// Whether a telegram at this time is as far from the last one as those before were apart.
    fn is_even(&self, time_ns: i64) -> bool {
        let (number, last_ns) = self.last;
        if number == 0 {
            // Only of neighbors is it known that there is one distance between them.
            return self.telegrams == 1;
        }
        let mean_ns = last_ns.saturating_sub(self.first_ns) as f64 / number as f64;
        let expected_ns = mean_ns * (self.telegrams - number) as f64;
        (time_ns.saturating_sub(last_ns) as f64 - expected_ns).abs() <= EVEN_NS as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn departure(time_ns: i64, pace: Pace) -> Departure {
        let host = HostState::Listening;
        Departure { time_ns, pace, unit: 1, min_cycles: 8, is_next: true, index: None, host }
    }

    #[test]
    fn a_mean_comes_after_five_even_seconds_also_with_telegrams_that_were_held_back() {
        let mut interval = MeanInterval::default();
        for scan in 0..70 {
            let held_ns = if scan % 5 == 3 { 90_000_000 } else { 0 };
            let pace = if held_ns > 0 { Pace::AtOnce } else { Pace::Line };
            interval.note(&departure(scan * 108_000_000 + held_ns, pace));
            assert_eq!(interval.mean_ns(), (scan >= 47).then_some(108_000_000.0), "{scan}");
        }
    }

    #[test]
    fn uneven_telegrams_have_no_mean() {
        let mut interval = MeanInterval::default();
        for scan in 0..400_i64 {
            let uneven_ns = (scan * 7_919 % 13) * 1_000_000;
            interval.note(&departure(scan * 108_000_000 + uneven_ns, Pace::Line));
            assert_eq!(interval.mean_ns(), None);
        }
    }
}
