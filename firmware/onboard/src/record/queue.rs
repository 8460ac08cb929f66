//! The queue between the loop and the thread that writes the file: whole messages as bytes in one ring, so that memory is what the
//! messages need and nothing is allocated. A message that does not fit is dropped and counted; the loop never waits.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use biplane_matcher::Iteration;
use biplane_recording::Topic;
use rtrb::{Consumer, Producer, RingBuffer};

use super::telling::States;
use crate::health::Health;
use crate::journal::JournalQueue;
use crate::message_ring::{Head, MessagesIn, MessagesOut, message_ring};
use crate::sink::Sink;

/// Bytes that may wait for the disk: over a minute of both lasers at full rate with raw bytes.
const QUEUE_BYTES: usize = 32 << 20;
/// States that may wait.
const QUEUE_HEALTHS: usize = 64;

/// The loop's end.
#[derive(Debug)]
pub struct QueueSink {
    messages: MessagesIn,
    healths: Producer<(i64, Health)>,
    told: States,
    dropped: u64,
    reads_dropped: Arc<AtomicU64>,
    untold: Arc<AtomicU64>,
    journal: Option<JournalQueue>,
}

/// The writing thread's end.
#[derive(Debug)]
pub struct QueueSource {
    messages: MessagesOut,
    healths: Consumer<(i64, Health)>,
}

/// Both ends. `reads_dropped` counts reads of the ports that were lost before they came to the loop; they are told with the messages.
/// States go to `told` as well; those that do not fit there are counted with what else was not told.
#[must_use]
pub fn queue(
    reads_dropped: Arc<AtomicU64>,
    (told, untold): (States, Arc<AtomicU64>),
) -> (QueueSink, QueueSource) {
    let (message_in, messages) = message_ring(QUEUE_BYTES);
    let (health_in, healths) = RingBuffer::new(QUEUE_HEALTHS);
    let sink = QueueSink {
        messages: message_in,
        healths: health_in,
        told,
        dropped: 0,
        reads_dropped,
        untold,
        journal: None,
    };
    (sink, QueueSource { messages, healths })
}

impl QueueSink {
    /// Hands on the iterations of matches to this queue as well.
    #[must_use]
    pub fn with_journal(self, journal: Option<JournalQueue>) -> Self {
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
        if self.told.push((now_ns, *health)).is_err() {
            self.untold.fetch_add(1, Ordering::Relaxed);
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

    fn untold(&self) -> u64 {
        self.untold.load(Ordering::Relaxed)
    }
}

impl QueueSource {
    /// The next message, its bytes in `cdr`.
    pub fn next_message(&mut self, cdr: &mut Vec<u8>) -> Option<Head> {
        self.messages.pop(cdr)
    }

    /// The next state.
    pub fn next_health(&mut self) -> Option<(i64, Health)> {
        self.healths.pop().ok()
    }

    /// Whether the loop has gone and nothing is left.
    #[must_use]
    pub fn is_over(&self) -> bool {
        self.messages.is_over() && self.healths.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_does_not_fit_is_dropped_whole_and_counted() {
        let reads_dropped = Arc::new(AtomicU64::new(3));
        let (mut sink, mut source) = queue(reads_dropped, (RingBuffer::new(1).0, Arc::default()));
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
        let (mut sink, mut source) = queue(Arc::default(), (RingBuffer::new(16).0, Arc::default()));
        for second in 0..QUEUE_HEALTHS as i64 + 2 {
            sink.health(second, &Health::default());
        }
        assert_eq!((sink.dropped(), sink.untold()), (2, QUEUE_HEALTHS as u64 + 2 - 16));
        assert_eq!(std::iter::from_fn(|| source.next_health()).count(), QUEUE_HEALTHS);
    }
}
