//! One line of time for a run, whatever the clock did that once wrote its input.
//!
//! A live run's time never steps. A capture's does when somebody set the computer's clock while it was made: then `log_time` jumps. Back
//! it cannot have gone, so from there on time goes on where it was, and the rest of the capture is later than its `log_time` by as
//! much. Ahead it may have gone, when nothing came for so long: a jump ahead is believed. Nanoseconds.

/// Reads of different lines overtake each other by no more than this, nanoseconds.
const OVERTAKING_NS: i64 = 500_000_000;

/// From the times of an input to those of the run.
#[derive(Copy, Clone, Debug)]
pub struct TimeLine {
    shift_ns: i64,
    latest_ns: i64,
    steps: u64,
}

impl TimeLine {
    /// A line that begins at this time.
    #[must_use]
    pub fn new(start_ns: i64) -> Self {
        Self { shift_ns: 0, latest_ns: start_ns, steps: 0 }
    }

    /// The run's time of an input at `log_ns`. A little before the input that was latest it may be, not more.
    pub fn run_ns(&mut self, log_ns: i64) -> i64 {
        let mut time_ns = log_ns.saturating_add(self.shift_ns);
        if time_ns < self.latest_ns.saturating_sub(OVERTAKING_NS) {
            self.steps += 1;
            self.shift_ns = self.latest_ns.saturating_sub(log_ns);
            time_ns = self.latest_ns;
        }
        self.latest_ns = self.latest_ns.max(time_ns);
        time_ns
    }

    /// Times that the input's clock went back.
    #[must_use]
    pub fn steps(&self) -> u64 {
        self.steps
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_clock_that_is_set_back_leaves_the_line_where_it_was() {
        let s = 1_000_000_000;
        let mut line = TimeLine::new(100 * s);
        assert_eq!([line.run_ns(101 * s), line.run_ns(101 * s - 3_000_000)], [101 * s, 101 * s - 3_000_000]);
        // An hour back, then on; then ahead again by an hour, as silence would look.
        assert_eq!([line.run_ns(101 * s - 3600 * s), line.run_ns(102 * s - 3600 * s)], [101 * s, 102 * s]);
        assert_eq!(line.run_ns(103 * s), 103 * s + 3600 * s);
        assert_eq!(line.steps(), 1);
        assert!(line.run_ns(i64::MIN) >= 103 * s && line.run_ns(i64::MAX) == i64::MAX);
    }
}
