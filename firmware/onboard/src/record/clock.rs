//! The time of a live run: UTC at its start, and monotonic since, so that a system clock that is set meanwhile does no harm.

/// Nanoseconds UTC that never step.
#[derive(Copy, Clone, Debug)]
pub struct RunClock {
    utc_minus_monotonic_ns: i64,
}

impl RunClock {
    /// A clock that starts now.
    #[must_use]
    pub fn start() -> Self {
        Self { utc_minus_monotonic_ns: biplane_clock::utc_ns() - biplane_clock::monotonic_ns() }
    }

    /// The time now.
    #[must_use]
    pub fn now_ns(&self) -> i64 {
        biplane_clock::monotonic_ns() + self.utc_minus_monotonic_ns
    }
}
