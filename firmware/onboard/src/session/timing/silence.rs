//! When a line that brings nothing is silent: later while it is listened to all the time, soon once its port
//! is back.

/// A device that still streams is heard within so long, nanoseconds: bases report ten times a second, a
/// laser's line pauses for two turns of its mirror at most, and an adapter that was just opened takes a
/// moment.
const LISTEN_NS: i64 = 350_000_000;

/// Until when something must come: so long after the last, or, when the port was gone and came back since,
/// after that.
pub(crate) fn deadline_ns(last_ns: i64, silence_ns: i64, port_back_ns: i64) -> i64 {
    if port_back_ns > last_ns {
        port_back_ns.saturating_add(LISTEN_NS)
    } else {
        last_ns.saturating_add(silence_ns)
    }
}
