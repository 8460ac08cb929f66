//! A replay's sink: straight into a file.

use biplane_matcher::Iteration;
use biplane_recording::messages::Message;
use biplane_recording::{PartsWriter, Topic, WriteError};

use crate::engine::out::health::Health;
use crate::engine::out::sink::Sink;
use crate::output::journal::JournalFile;
use crate::output::tap::Tap;

/// Writes each message at once. The first error is kept; nothing is written after it.
#[derive(Debug)]
pub(crate) struct DirectSink {
    writer: PartsWriter,
    has_failed: bool,
    /// Not taken yet.
    error: Option<WriteError>,
    journal: Option<JournalFile>,
    tap: Option<Tap>,
    cdr: Vec<u8>,
}

impl DirectSink {
    /// A sink that writes to this file, and the iterations of matches to that one; what is in the file goes
    /// to the tap of a live view as well.
    #[must_use]
    pub(crate) fn new(writer: PartsWriter, journal: Option<JournalFile>, tap: Option<Tap>) -> Self {
        Self { writer, has_failed: false, error: None, journal, tap, cdr: Vec::new() }
    }

    /// What it wrote to, to be finished.
    #[must_use]
    pub(crate) fn into_files(self) -> (PartsWriter, Option<JournalFile>) {
        (self.writer, self.journal)
    }
}

impl Sink for DirectSink {
    fn message(&mut self, topic: Topic, log_time_ns: i64, publish_time_ns: i64, cdr: &[u8]) {
        if self.has_failed {
            return;
        }
        if let Err(error) = self.writer.write_encoded(topic, log_time_ns, publish_time_ns, cdr) {
            (self.has_failed, self.error) = (true, Some(error));
            return;
        }
        if let Some(tap) = &mut self.tap {
            tap.message(topic, log_time_ns, publish_time_ns, cdr);
        }
    }

    fn health(&mut self, now_ns: i64, health: &Health) {
        let mut cdr = std::mem::take(&mut self.cdr);
        crate::output::diagnostics::message(now_ns, health).encode(&mut cdr);
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
        self.error.take().map_or(Ok(()), Err)
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use biplane_recording::mcap::write::part_path;
    use biplane_recording::{Rotation, WriterOptions};

    use super::*;
    use crate::output::message_ring::message_ring;

    #[test]
    fn the_first_error_is_told_once_and_nothing_is_written_or_shown_after_it() {
        let folder = std::env::temp_dir().join(format!("biplane-sink-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let path = folder.join("run.mcap");
        // Each message begins a part of its own, and another file is where the second one would be.
        let rotation = Rotation { span_ns: Some(1), bytes: None };
        let writer = PartsWriter::create(&path, &WriterOptions::default(), rotation).unwrap();
        std::fs::write(part_path(&path, 1), "precious").unwrap();
        let (shown_in, mut shown) = message_ring(1 << 10);
        let mut sink = DirectSink::new(writer, None, Some(Tap::new(shown_in, Arc::default())));
        let mut at = |log_time_ns: i64| {
            sink.message(Topic::Odom, log_time_ns, log_time_ns, &[0; 8]);
            sink.check()
        };
        let reported = [1, 2, 3, 4].map(|second| at(second * 1_000_000_000));
        assert!(matches!(reported, [Ok(()), Err(WriteError::Exists { .. }), Ok(()), Ok(())]), "{reported:?}");
        let mut cdr = Vec::new();
        let shown: Vec<_> = std::iter::from_fn(|| shown.pop(&mut cdr)).map(|head| head.log_time_ns).collect();
        assert_eq!(shown, [1_000_000_000]);
        std::fs::remove_dir_all(folder).unwrap();
    }
}
