//! What a live view has done.

use serde::Serialize;

/// The account of a live view. Nothing in it is a loss of the recording.
#[derive(Copy, Clone, PartialEq, Eq, Debug, Default, Serialize)]
pub struct LiveReport {
    /// Viewers that were let in.
    pub viewers: u64,
    /// Connections that were turned away: too many, no WebSocket, another protocol.
    pub refused: u64,
    /// Messages that went to viewers, all of them together.
    pub sent: u64,
    /// Messages that were left out because a viewer did not take them fast enough, all of them together.
    pub left_out: u64,
    /// Messages that the live thread itself did not get to in time.
    pub missed: u64,
}
