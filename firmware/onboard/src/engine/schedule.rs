//! The engine's own time, and when it tells its state. Nanoseconds.

use crate::engine::line::monotonic::TimeLine;
use crate::engine::options::Feed;

/// Diagnostics interval, nanoseconds.
const HEALTH_NS: i64 = 1_000_000_000;
/// A hole in time longer than this is not lived through step by step: what was due in it happens at its end.
pub(crate) const HOLE_NS: i64 = 10_000_000_000;
/// Times beyond are taken as this one: sums and differences of two stay in range (nanoseconds, year 2116).
const LATEST_NS: i64 = i64::MAX / 2;

/// Where the engine is in time.
#[derive(Debug)]
pub(crate) struct Schedule {
    pub(crate) time_line: TimeLine,
    pub(crate) now_ns: i64,
    first_ns: i64,
    health_ns: i64,
    last_health_ns: i64,
}

impl Schedule {
    /// Begins at this time.
    pub(crate) fn new(feed: Feed, now_ns: i64) -> Self {
        Self {
            time_line: TimeLine::new(feed, now_ns),
            now_ns,
            first_ns: now_ns,
            health_ns: now_ns.saturating_add(HEALTH_NS),
            last_health_ns: now_ns,
        }
    }

    /// When the state is due; `i64::MAX` once the run is told to stop.
    pub(crate) fn health_ns(&self) -> i64 {
        self.health_ns
    }

    /// The state is told now. From the last one to this one, seconds; the next is due an interval later.
    pub(crate) fn health_reported(&mut self, now_ns: i64) -> f64 {
        let interval_s = now_ns.saturating_sub(self.last_health_ns) as f64 * 1e-9;
        self.last_health_ns = now_ns;
        self.health_ns = now_ns.saturating_add(HEALTH_NS);
        interval_s
    }

    /// Whether a last state says something: rates of a short interval do not, unless no state was told
    /// before.
    pub(crate) fn wants_last_health(&self, now_ns: i64) -> bool {
        now_ns.saturating_sub(self.last_health_ns) >= HEALTH_NS / 2 || self.last_health_ns == self.first_ns
    }

    /// No state is told any more.
    pub(crate) fn end_health(&mut self) {
        self.health_ns = i64::MAX;
    }

    /// From the first input to the last, seconds.
    pub(crate) fn duration_s(&self) -> f64 {
        (self.now_ns - self.first_ns) as f64 * 1e-9
    }
}

/// A time with which sums stay in range.
pub(crate) fn bounded(time_ns: i64) -> i64 {
    time_ns.clamp(-LATEST_NS, LATEST_NS)
}
