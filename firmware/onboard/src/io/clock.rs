//! The time of a live run: UTC at its start, and monotonic since, so that a system clock that is set
//! meanwhile does no harm.
//!
//! Everything inside a run (reads, stamps, `log_time`) lies on this one line. The system's clock is read
//! again only to be compared with it, once a second, for the diagnostics.

use biplane_recording::messages::{DiagnosticStatus, KeyValue};

/// A difference of the system's clock beyond this is told as a warning, nanoseconds.
const NOTIFY_OFFSET_NS: i64 = 100_000_000;

/// The two clocks of the machine. A test puts its own in.
pub trait Clocks {
    /// Nanoseconds that never step.
    fn monotonic_ns(&self) -> i64;
    /// Nanoseconds UTC as the system holds them now; they step when the clock is set.
    fn utc_ns(&self) -> i64;
}

/// The machine's own clocks.
#[derive(Copy, Clone, Debug, Default)]
pub struct SystemClocks;

impl Clocks for SystemClocks {
    fn monotonic_ns(&self) -> i64 {
        biplane_clock::monotonic_ns()
    }

    fn utc_ns(&self) -> i64 {
        biplane_clock::utc_ns()
    }
}

/// Nanoseconds UTC that never step.
#[derive(Copy, Clone, Debug)]
pub struct RunClock<C = SystemClocks> {
    clocks: C,
    utc_minus_monotonic_ns: i64,
}

impl RunClock {
    /// A clock that starts now, at the system's UTC.
    #[must_use]
    pub fn start() -> Self {
        Self::start_on(SystemClocks)
    }
}

impl<C: Clocks> RunClock<C> {
    /// The same on other clocks.
    #[must_use]
    pub fn start_on(clocks: C) -> Self {
        let utc_minus_monotonic_ns = clocks.utc_ns().saturating_sub(clocks.monotonic_ns());
        Self { clocks, utc_minus_monotonic_ns }
    }

    /// The time now.
    #[must_use]
    pub fn now_ns(&self) -> i64 {
        self.clocks.monotonic_ns().saturating_add(self.utc_minus_monotonic_ns)
    }

    /// By how much the system's UTC has moved against this clock since the start, nanoseconds; positive when
    /// the system is ahead.
    #[must_use]
    pub fn utc_offset_ns(&self) -> i64 {
        self.clocks.utc_ns().saturating_sub(self.now_ns())
    }
}

/// The state of the system's clock, for the diagnostics: what times of other programs must be corrected by.
#[must_use]
pub(crate) fn clock_status(utc_offset_ns: i64) -> DiagnosticStatus {
    let is_far = utc_offset_ns.saturating_abs() > NOTIFY_OFFSET_NS;
    let (level, message) = if is_far {
        (
            DiagnosticStatus::WARN,
            "the system's clock was set since the start; the recording keeps to the start's",
        )
    } else {
        (DiagnosticStatus::OK, "the system's clock runs with the recording's")
    };
    let value = format!("{:.3}", utc_offset_ns as f64 * 1e-9);
    DiagnosticStatus {
        level,
        name: "biplane: clock".to_owned(),
        message: message.to_owned(),
        hardware_id: "clock".to_owned(),
        values: vec![KeyValue { key: "utc_offset_s".to_owned(), value }],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::cell::Cell;

    const S: i64 = 1_000_000_000;

    #[derive(Default)]
    struct Hand {
        monotonic_ns: Cell<i64>,
        utc_ns: Cell<i64>,
    }

    impl Hand {
        fn pass(&self, ns: i64, utc_step_ns: i64) {
            self.monotonic_ns.set(self.monotonic_ns.get() + ns);
            self.utc_ns.set(self.utc_ns.get() + ns + utc_step_ns);
        }
    }

    impl Clocks for &Hand {
        fn monotonic_ns(&self) -> i64 {
            self.monotonic_ns.get()
        }

        fn utc_ns(&self) -> i64 {
            self.utc_ns.get()
        }
    }

    #[test]
    fn a_system_clock_that_is_set_moves_no_time_of_the_run_and_is_told() {
        let hand = Hand::default();
        hand.monotonic_ns.set(77 * S);
        hand.utc_ns.set(1_700_000_000 * S);
        let clock = RunClock::start_on(&hand);
        assert_eq!((clock.now_ns(), clock.utc_offset_ns()), (1_700_000_000 * S, 0));
        hand.pass(2 * S, 3600 * S);
        assert_eq!((clock.now_ns(), clock.utc_offset_ns()), (1_700_000_002 * S, 3600 * S));
        hand.pass(S, -7200 * S);
        assert_eq!((clock.now_ns(), clock.utc_offset_ns()), (1_700_000_003 * S, -3600 * S));
        hand.pass(S, 3600 * S);
        assert_eq!((clock.now_ns(), clock.utc_offset_ns()), (1_700_000_004 * S, 0));
    }

    #[test]
    fn a_tenth_of_a_second_between_the_clocks_is_told_as_a_warning() {
        let reported = |utc_offset_ns| {
            let status = clock_status(utc_offset_ns);
            (status.level, status.values[0].value.clone())
        };
        assert_eq!(reported(99_000_000), (DiagnosticStatus::OK, "0.099".to_owned()));
        assert_eq!(reported(101_000_000), (DiagnosticStatus::WARN, "0.101".to_owned()));
        assert_eq!(reported(-7_200_000_000_000), (DiagnosticStatus::WARN, "-7200.000".to_owned()));
    }
}
