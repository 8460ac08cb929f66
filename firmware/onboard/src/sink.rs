//! Where messages go: straight into a file (replay), or over a queue to the thread that writes one (record).

use biplane_matcher::Iteration;
use biplane_recording::msg::Message;
use biplane_recording::{PartsWriter, Topic, WriteError};

use crate::health::Health;
use crate::journal::JournalFile;
use crate::live::Tap;

/// Takes what the engine makes, in its order.
pub trait Sink {
    /// A message, CDR with its header. Times in nanoseconds: when it was made or received, and its own stamp.
    fn message(&mut self, topic: Topic, log_time_ns: i64, publish_time_ns: i64, cdr: &[u8]);

    /// The state of everything, once a second.
    fn health(&mut self, now_ns: i64, health: &Health);

    /// The iterations of the match of the scan with this stamp, nanoseconds; only while the engine keeps a journal.
    fn iterations(&mut self, _stamp_ns: i64, _iterations: &[Iteration]) {}

    /// Messages that could not be taken so far.
    fn dropped(&self) -> u64;

    /// What could be recorded, and not be told, so far.
    fn untold(&self) -> u64 {
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

/// Writes each message at once. The first error is kept; nothing is written after it.
#[derive(Debug)]
pub struct DirectSink {
    writer: PartsWriter,
    failed: Option<WriteError>,
    journal: Option<JournalFile>,
    tap: Option<Tap>,
    cdr: Vec<u8>,
}

impl DirectSink {
    /// A sink that writes to this file, and the iterations of matches to that one; what is in the file goes to the tap of a live
    /// view as well.
    #[must_use]
    pub fn new(writer: PartsWriter, journal: Option<JournalFile>, tap: Option<Tap>) -> Self {
        Self { writer, failed: None, journal, tap, cdr: Vec::new() }
    }

    /// What it wrote to, to be finished.
    #[must_use]
    pub fn into_files(self) -> (PartsWriter, Option<JournalFile>) {
        (self.writer, self.journal)
    }
}

impl Sink for DirectSink {
    fn message(&mut self, topic: Topic, log_time_ns: i64, publish_time_ns: i64, cdr: &[u8]) {
        if self.failed.is_none() {
            self.failed = self.writer.write_encoded(topic, log_time_ns, publish_time_ns, cdr).err();
            if let Some(tap) = &mut self.tap {
                tap.message(topic, log_time_ns, publish_time_ns, cdr);
            }
        }
    }

    fn health(&mut self, now_ns: i64, health: &Health) {
        let mut cdr = std::mem::take(&mut self.cdr);
        crate::diagnostics::message(now_ns, health).encode(&mut cdr);
        self.message(Topic::Diagnostics, now_ns, now_ns, &cdr);
        self.cdr = cdr;
    }

    fn iterations(&mut self, stamp_ns: i64, iterations: &[Iteration]) {
        if let Some(journal) = &mut self.journal {
            journal.write(stamp_ns, iterations);
        }
    }

    fn dropped(&self) -> u64 {
        0
    }

    fn check(&mut self) -> Result<(), WriteError> {
        self.failed.take().map_or(Ok(()), Err)
    }
}

/// Keeps nothing: for whoever wants the engine's work and not its messages.
#[derive(Copy, Clone, Debug, Default)]
pub struct NoSink;

impl Sink for NoSink {
    fn message(&mut self, _topic: Topic, _log_time_ns: i64, _publish_time_ns: i64, _cdr: &[u8]) {}

    fn health(&mut self, _now_ns: i64, _health: &Health) {}

    fn dropped(&self) -> u64 {
        0
    }
}
