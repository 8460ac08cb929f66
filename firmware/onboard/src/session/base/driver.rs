//! What every kind of base can do beyond a session.

use crate::session::base::reading::BaseInfo;
use crate::session::device_session::Session;

/// What a driver is made for.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
pub(crate) enum Purpose {
    /// Open the base and keep it reporting.
    Stream,
    /// Ask the base who it is, and be done.
    Probe,
    /// Only listen to what once came from a base.
    Listen,
}

/// The session of one kind of base.
pub(crate) trait BaseDriver: Session {
    /// What is known of the base.
    fn info(&self) -> &BaseInfo;

    /// What a unit of its position was last taken as, meters; `None` where it counts otherwise, or before the
    /// first report.
    fn metres_per_tick(&self) -> Option<f64> {
        None
    }

    /// Intact packets that could not be read.
    fn not_kept(&self) -> u64;

    /// Whether odometry flows.
    fn is_streaming(&self) -> bool;

    /// A recording's next write to the base, at its time: for answers that only mean something with their
    /// question. The bytes that a base sends by itself need none.
    fn host_sent(&mut self, _now_ns: i64, _bytes: &[u8]) {}

    /// What is due now is so late that the base's watchdog may have run out: nobody called while this process
    /// stood still.
    fn watchdog_missed(&mut self) {}

    /// The input ends: what is held of an unfinished packet is let go.
    fn finish(&mut self);
}
