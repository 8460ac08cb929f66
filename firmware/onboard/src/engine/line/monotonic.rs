//! One line of time for a run, whatever the clock did that once wrote its input.
//!
//! A live run's time never steps. A capture's does when somebody set the computer's clock while it was made:
//! then `log_time` jumps. Back it cannot have gone, so from there on time goes on where it was, and the rest
//! of the capture is later than its `log_time` by as much. Ahead it may have gone, when nothing came for so
//! long: a jump ahead is believed. Nanoseconds.

use biplane_recording::{Direction, Port};

use crate::engine::options::Feed;

/// Reads of one line are in order; a line whose time goes back by more than this has a clock that was set,
/// nanoseconds.
const DISORDER_NS: i64 = 500_000_000;
/// Behind the reads of other lines one may be by this: its thread was held up between reading and handing
/// over, nanoseconds.
const OVERTAKING_NS: i64 = 10_000_000_000;

/// Both directions of each line.
const STREAMS: usize = Direction::ALL.len() * Port::ALL.len();

/// One direction of a line.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
pub(crate) struct Stream {
    pub(crate) port: Port,
    pub(crate) direction: Direction,
}

/// From the times of an input to those of the run.
#[derive(Copy, Clone, Debug)]
pub(crate) struct TimeLine {
    feed: Feed,
    shift_ns: i64,
    latest_ns: i64,
    latest_of_ns: [i64; STREAMS],
    steps: u64,
}

impl TimeLine {
    /// A line that begins at this time.
    #[must_use]
    pub(crate) fn new(feed: Feed, start_ns: i64) -> Self {
        Self { feed, shift_ns: 0, latest_ns: start_ns, latest_of_ns: [i64::MIN; STREAMS], steps: 0 }
    }

    /// The run's time of what a line brought, or was sent, at `log_ns`.
    pub(crate) fn run_ns(&mut self, stream: Stream, log_ns: i64) -> i64 {
        if self.feed == Feed::Live {
            return log_ns;
        }
        let latest_of_ns = &mut self.latest_of_ns[place(stream)];
        let mut time_ns = log_ns.saturating_add(self.shift_ns);
        let is_step = time_ns < latest_of_ns.saturating_sub(DISORDER_NS)
            || time_ns < self.latest_ns.saturating_sub(OVERTAKING_NS);
        if is_step {
            self.steps += 1;
            self.shift_ns = self.latest_ns.saturating_sub(log_ns);
            time_ns = self.latest_ns;
        }
        *latest_of_ns = time_ns.max(*latest_of_ns);
        self.latest_ns = self.latest_ns.max(time_ns);
        time_ns
    }

    /// Times that the input's clock went back.
    #[must_use]
    pub(crate) fn steps(&self) -> u64 {
        self.steps
    }
}

fn place(Stream { port, direction }: Stream) -> usize {
    Direction::ALL.len() * port.index() + direction.index()
}

#[cfg(test)]
mod tests {
    use super::*;

    const S: i64 = 1_000_000_000;
    const LASER: Stream = Stream { port: Port::Horizontal, direction: Direction::Rx };
    const BASE: Stream = Stream { port: Port::Base, direction: Direction::Rx };

    #[test]
    fn a_clock_that_is_set_back_leaves_the_line_where_it_was() {
        let mut line = TimeLine::new(Feed::Recorded, 100 * S);
        let mut run_ns = |log_ns| line.run_ns(LASER, log_ns);
        assert_eq!([run_ns(101 * S), run_ns(101 * S - 3_000_000)], [101 * S, 101 * S - 3_000_000]);
        // An hour back, then on; then ahead again by an hour, as silence would look.
        assert_eq!([run_ns(101 * S - 3600 * S), run_ns(102 * S - 3600 * S)], [101 * S, 102 * S]);
        assert_eq!(run_ns(103 * S), 103 * S + 3600 * S);
        assert!(run_ns(i64::MIN) >= 103 * S && run_ns(i64::MAX) == i64::MAX);
        assert_eq!(line.steps(), 2);
    }

    #[test]
    fn a_line_that_comes_late_behind_the_others_is_no_clock_that_was_set() {
        let mut line = TimeLine::new(Feed::Recorded, 100 * S);
        assert_eq!([line.run_ns(LASER, 101 * S), line.run_ns(BASE, 101 * S)], [101 * S, 101 * S]);
        assert_eq!([line.run_ns(LASER, 104 * S), line.run_ns(BASE, 102 * S)], [104 * S, 102 * S]);
        assert_eq!(line.steps(), 0);
        // A line that was not heard for long tells a step back by the others.
        assert_eq!(line.run_ns(Stream { port: Port::Vertical, direction: Direction::Rx }, 50 * S), 104 * S);
        assert_eq!([line.run_ns(BASE, 51 * S), line.run_ns(LASER, 51 * S)], [105 * S, 105 * S]);
        assert_eq!(line.steps(), 1);
    }

    #[test]
    fn live_times_are_what_they_are() {
        let mut line = TimeLine::new(Feed::Live, 100 * S);
        assert_eq!([110 * S, 50 * S, 111 * S].map(|ns| line.run_ns(LASER, ns)), [110 * S, 50 * S, 111 * S]);
        assert_eq!(line.steps(), 0);
    }
}
