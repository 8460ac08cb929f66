//! The queue between the loop and the thread that writes the file: whole messages as bytes in one ring, so
//! that memory is what the messages need and nothing is allocated. A message that does not fit is dropped and
//! counted; the loop never waits.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use biplane_matcher::Iteration;
use biplane_recording::Topic;
use rtrb::{Consumer, Producer, RingBuffer};

use crate::engine::out::health::Health;
use crate::engine::out::sink::Sink;
use crate::output::journal::JournalQueue;
use crate::output::message_ring::{Head, MessagesIn, MessagesOut, message_ring};
use crate::record::status::notifier::States;

/// Bytes that may wait for the disk: over a minute of both lasers at full rate with raw bytes.
const QUEUE_BYTES: usize = 32 << 20;
/// States that may wait.
const QUEUE_HEALTHS: usize = 64;

/// The loop's end.
#[derive(Debug)]
pub(crate) struct QueueSink {
    messages: MessagesIn,
    healths: Producer<(i64, Health)>,
    reported: States,
    dropped: u64,
    reads_dropped: Arc<AtomicU64>,
    unreported: Arc<AtomicU64>,
    journal: Option<JournalQueue>,
}

/// The writing thread's end.
#[derive(Debug)]
pub(crate) struct QueueSource {
    messages: MessagesOut,
    healths: Consumer<(i64, Health)>,
}

/// Both ends. `reads_dropped` counts reads of the ports that were lost before they came to the loop; they are
/// told with the messages. States go to `told` as well; those that do not fit there are counted with what
/// else was not told.
#[must_use]
pub(crate) fn queue(
    reads_dropped: Arc<AtomicU64>,
    reported: States,
    unreported: Arc<AtomicU64>,
) -> (QueueSink, QueueSource) {
    let (message_in, messages) = message_ring(QUEUE_BYTES);
    let (health_in, healths) = RingBuffer::new(QUEUE_HEALTHS);
    let sink = QueueSink {
        messages: message_in,
        healths: health_in,
        reported,
        dropped: 0,
        reads_dropped,
        unreported,
        journal: None,
    };
    (sink, QueueSource { messages, healths })
}

impl QueueSink {
    /// Hands on the iterations of matches to this queue as well.
    #[must_use]
    pub(crate) fn with_journal(self, journal: Option<JournalQueue>) -> Self {
        Self { journal, ..self }
    }
}

impl Sink for QueueSink {
    fn message(&mut self, topic: Topic, log_time_ns: i64, publish_time_ns: i64, cdr: &[u8]) {
        let head = Head { topic, log_time_ns, publish_time_ns };
        self.dropped += u64::from(!self.messages.push(head, cdr));
    }

    fn health(&mut self, now_ns: i64, health: &Health) {
        self.dropped += u64::from(self.healths.push((now_ns, *health)).is_err());
        if self.reported.push((now_ns, *health)).is_err() {
            self.unreported.fetch_add(1, Ordering::Relaxed);
        }
    }

    fn iterations(&mut self, stamp_ns: i64, iterations: &[Iteration]) {
        if let Some(journal) = &mut self.journal {
            journal.push(stamp_ns, iterations);
        }
    }

    fn dropped(&self) -> u64 {
        self.dropped + self.reads_dropped.load(Ordering::Relaxed)
    }

    fn unreported(&self) -> u64 {
        self.unreported.load(Ordering::Relaxed)
    }
}

impl QueueSource {
    /// The next message, its bytes in `cdr`.
    pub(crate) fn next_message(&mut self, cdr: &mut Vec<u8>) -> Option<Head> {
        self.messages.pop(cdr)
    }

    /// The next state.
    pub(crate) fn next_health(&mut self) -> Option<(i64, Health)> {
        self.healths.pop().ok()
    }

    /// Whether the loop has gone and nothing is left.
    #[must_use]
    pub(crate) fn is_over(&self) -> bool {
        self.messages.is_over() && self.healths.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_does_not_fit_is_dropped_whole_and_counted() {
        let reads_dropped = Arc::new(AtomicU64::new(3));
        let (mut sink, mut source) = queue(reads_dropped, RingBuffer::new(1).0, Arc::default());
        let bytes = vec![7; 20 << 20];
        sink.message(Topic::Odom, 1, 1, &bytes);
        sink.message(Topic::Odom, 2, 2, &bytes);
        sink.message(Topic::Odom, 3, 3, &[1]);
        assert_eq!(sink.dropped(), 1 + 3);
        let mut cdr = Vec::new();
        let times: Vec<_> =
            std::iter::from_fn(|| source.next_message(&mut cdr)).map(|head| head.log_time_ns).collect();
        assert_eq!(times, [1, 3]);
    }

    #[test]
    fn states_that_do_not_fit_are_counted_as_what_they_are() {
        let (mut sink, mut source) = queue(Arc::default(), RingBuffer::new(16).0, Arc::default());
        for second in 0..QUEUE_HEALTHS as i64 + 2 {
            sink.health(second, &Health::default());
        }
        assert_eq!((sink.dropped(), sink.unreported()), (2, QUEUE_HEALTHS as u64 + 2 - 16));
        assert_eq!(std::iter::from_fn(|| source.next_health()).count(), QUEUE_HEALTHS);
    }
}
