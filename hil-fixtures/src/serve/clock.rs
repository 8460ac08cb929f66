//! The mock's clock: virtual nanoseconds since the start, `speed` times as fast as the wall clock.

use biplane_clock::{monotonic_ns, utc_ns};

/// Virtual time, and what it is on the wall.
#[derive(Clone, Copy, Debug)]
pub(super) struct VirtualClock {
    start_monotonic_ns: i64,
    start_utc_ns: i64,
    speed: f64,
}

impl VirtualClock {
    /// A clock that starts now at zero.
    #[must_use]
    pub(super) fn start(speed: f64) -> Self {
        Self { start_monotonic_ns: monotonic_ns(), start_utc_ns: utc_ns(), speed }
    }

    /// Virtual time now.
    #[must_use]
    pub(super) fn now_ns(&self) -> i64 {
        ((monotonic_ns() - self.start_monotonic_ns) as f64 * self.speed) as i64
    }

    /// Wall time from `now_ns` to `then_ns`, both virtual.
    #[must_use]
    pub(super) fn wall_between_ns(&self, now_ns: i64, then_ns: i64) -> i64 {
        (then_ns.saturating_sub(now_ns) as f64 / self.speed) as i64
    }

    /// UTC at a virtual time, as a host without any delay would stamp it.
    #[must_use]
    pub(super) fn utc_ns(&self, virtual_ns: i64) -> i64 {
        self.start_utc_ns + (virtual_ns as f64 / self.speed) as i64
    }
}
