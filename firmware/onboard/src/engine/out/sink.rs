//! Who takes what the engine makes. The engine knows no more of files and queues than this.

use biplane_matcher::Iteration;
use biplane_recording::{Topic, WriteError};

use crate::engine::out::health::Health;

/// Iterations of one scan that are kept: more than a match from all its starts takes.
pub(crate) const ITERATIONS_PER_SCAN: usize = 1024;

/// Takes what the engine makes, in its order.
pub trait Sink {
    /// A message, CDR with its header. Times in nanoseconds: when it was made or received, and its own stamp.
    fn message(&mut self, topic: Topic, log_time_ns: i64, publish_time_ns: i64, cdr: &[u8]);

    /// The state of everything, once a second.
    fn health(&mut self, now_ns: i64, health: &Health);

    /// The iterations of the match of the scan with this stamp, nanoseconds; only while the engine keeps a
    /// journal.
    fn iterations(&mut self, _stamp_ns: i64, _iterations: &[Iteration]) {}

    /// Messages that could not be taken so far.
    fn dropped(&self) -> u64;

    /// What could be recorded, and not be told, so far.
    fn unreported(&self) -> u64 {
        0
    }

    /// The first error so far; it can be taken once.
    ///
    /// # Errors
    /// That of the first message that could not be written.
    fn check(&mut self) -> Result<(), WriteError> {
        Ok(())
    }
}

/// Keeps nothing: for whoever wants the engine's work and not its messages.
#[derive(Copy, Clone, Debug, Default)]
pub(crate) struct NoSink;

impl Sink for NoSink {
    fn message(&mut self, _topic: Topic, _log_time_ns: i64, _publish_time_ns: i64, _cdr: &[u8]) {}

    fn health(&mut self, _now_ns: i64, _health: &Health) {}

    fn dropped(&self) -> u64 {
        0
    }
}
