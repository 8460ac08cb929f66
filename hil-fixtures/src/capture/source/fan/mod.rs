//! What a capture holds of lasers of today (SICK on a network, Hokuyo), and how it is played.

pub mod cola;
mod playback;
pub mod scip;

/// Bytes of a network come as fast as they leave, Bd.
const NETWORK_BAUD: u32 = 1_000_000_000;

/// One telegram of a capture, as it was sent.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RecordedTelegram {
    /// When its first byte left the laser.
    pub time_ns: i64,
    /// All of it.
    pub bytes: Vec<u8>,
}

/// When they were sent, since a capture's start.
fn times_ns(telegrams: &[RecordedTelegram], origin_ns: i64) -> Vec<i64> {
    telegrams.iter().map(|telegram| telegram.time_ns - origin_ns).collect()
}
