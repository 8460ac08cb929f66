//! How a stream has behaved of late: the distances it keeps, how often it kept to the cycles, how long it has
//! been late.

use crate::stamping::cycle_params::CycleClockParams;
use crate::stamping::departure::Departure;

/// Judgments that are remembered.
const REMEMBERED: u32 = 16;

/// The distance in time of telegrams that follow each other, in cycles.
#[derive(Copy, Clone, Debug, Default)]
pub(crate) struct ExpectedInterval {
    min_cycles: i64,
    before_ns: i64,
    interval: i64,
    repeats: u32,
    /// What it has come to be; 0 for nothing.
    cycles: i64,
}

/// Which of the latest departures were near their cycles: a bit each.
#[derive(Copy, Clone, Debug, Default)]
pub(crate) struct PhaseConfidence {
    near: u32,
    judged: u32,
}

/// Whether a stream keeps to the cycles.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub(crate) enum Verdict {
    /// Too little has been seen, or now and then.
    Unknown,
    /// It does.
    Kept,
    /// It does not.
    Broken,
}

/// Departures in a row that were late.
#[derive(Copy, Clone, Debug, Default)]
pub(crate) struct LatenessRun {
    scans: u32,
    alike: u32,
    before_ns: i64,
    since_ns: i64,
    min_ns: i64,
}

impl ExpectedInterval {
    /// Cycles to this telegram when it is as it has been; the least that the line allows when there is no
    /// habit.
    pub(crate) fn expected(&self, departure: &Departure) -> i64 {
        let is_known = departure.is_next && self.cycles > 0 && self.min_cycles == departure.min_cycles;
        if is_known { self.cycles } else { departure.min_cycles.max(1) }
    }

    /// A departure has come that nobody listened to, at this time by its cycle: no distance to it is one that
    /// was seen.
    pub(crate) fn miss(&mut self, time_ns: i64) {
        (self.before_ns, self.interval, self.repeats) = (time_ns, 0, 0);
    }

    /// Another departure has come.
    pub(crate) fn note(&mut self, departure: &Departure, cycle_ns: i64, params: &CycleClockParams) {
        let interval_ns = departure.time_ns.saturating_sub(self.before_ns);
        let interval = interval_ns.saturating_add(cycle_ns / 2).div_euclid(cycle_ns);
        let is_whole = (interval_ns - interval * cycle_ns).abs() <= params.near_ns;
        if self.min_cycles != departure.min_cycles {
            *self = Self { min_cycles: departure.min_cycles, ..Self::default() };
        }
        let is_same = departure.is_next && is_whole && interval == self.interval;
        self.repeats = if is_same { self.repeats.saturating_add(1) } else { 1 };
        (self.before_ns, self.interval) = (departure.time_ns, interval);
        if self.repeats >= params.expected_interval && interval > 0 {
            self.cycles = interval;
        }
    }
}

impl PhaseConfidence {
    /// With another judgment.
    #[must_use]
    pub(crate) fn with(self, is_near: bool) -> Self {
        Self {
            near: (self.near << 1 | u32::from(is_near)) & ((1 << REMEMBERED) - 1),
            judged: (self.judged + 1).min(REMEMBERED),
        }
    }

    /// What the judgments come to.
    pub(crate) fn verdict(self, params: &CycleClockParams) -> Verdict {
        let outliers = self.judged - self.near.count_ones().min(self.judged);
        if self.judged < params.confident_after {
            Verdict::Unknown
        } else if outliers <= params.max_outliers {
            Verdict::Kept
        } else if outliers * 2 > self.judged {
            Verdict::Broken
        } else {
            Verdict::Unknown
        }
    }
}

impl LatenessRun {
    /// The least lateness of a run that is long enough, which then begins anew.
    pub(crate) fn note(&mut self, time_ns: i64, late_ns: i64, params: &CycleClockParams) -> Option<i64> {
        if late_ns <= params.lateness.late_ns {
            *self = Self::default();
            return None;
        }
        if self.scans == 0 {
            *self = Self { since_ns: time_ns, min_ns: late_ns, before_ns: late_ns, ..Self::default() };
        }
        self.scans += 1;
        self.min_ns = self.min_ns.min(late_ns);
        let is_alike =
            (late_ns - self.before_ns).abs() <= params.near_ns && late_ns > params.longest_timer_ns / 2;
        self.alike = if is_alike { self.alike + 1 } else { 1 };
        self.before_ns = late_ns;
        let is_long = time_ns.saturating_sub(self.since_ns) >= params.lateness.after_ns;
        let is_over =
            (self.scans >= params.lateness.scans && is_long) || self.alike >= params.lateness.alike_scans;
        is_over.then(|| std::mem::take(self).min_ns)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stamping::arrivals::Pace;
    use crate::stamping::departure::HostState;

    const CYCLE_NS: i64 = 13_000_000;

    fn every_eighth(scan: i64) -> Departure {
        Departure {
            time_ns: scan * 8 * CYCLE_NS,
            pace: Pace::Line,
            unit: 1,
            min_cycles: 8,
            is_next: true,
            index: None,
            host: HostState::Listening,
        }
    }

    #[test]
    fn distances_over_telegrams_that_lay_unread_become_no_habit() {
        let params = CycleClockParams::default();
        let mut expected_interval = ExpectedInterval::default();
        (0..10).for_each(|scan| expected_interval.note(&every_eighth(scan), CYCLE_NS, &params));
        for scan in 10..40 {
            match scan % 2 {
                0 => expected_interval.miss(scan * 8 * CYCLE_NS),
                _ => expected_interval.note(&every_eighth(scan), CYCLE_NS, &params),
            }
        }
        assert_eq!(expected_interval.expected(&every_eighth(40)), 8);
        // Where no telegram was missed they do.
        (40..60).step_by(2).for_each(|scan| expected_interval.note(&every_eighth(scan), CYCLE_NS, &params));
        assert_eq!(expected_interval.expected(&every_eighth(60)), 16);
    }
}
