//! A disk that now and then takes nothing, behind the queue of a live run: what does not fit is dropped
//! whole, and counted.

use biplane_onboard::test_support::{Head, MessagesIn, MessagesOut, message_ring};
use biplane_onboard::{Health, Sink};
use biplane_recording::Topic;

use super::host::Stalls;

/// A sink on such a disk.
pub(crate) struct SlowDisk<K> {
    /// What was written.
    pub written: K,
    /// Messages that were handed to the queue.
    pub handed: u64,
    /// Messages that came out of it.
    pub taken: u64,
    dropped: u64,
    messages_in: MessagesIn,
    messages_out: MessagesOut,
    stalls: Stalls,
    cdr: Vec<u8>,
    healths: Vec<(i64, Health)>,
    waiting_bytes: usize,
    max_waiting_bytes: usize,
    /// Whether it writes by itself; otherwise when it is told to, as a thread of its own does.
    pub writes_at_once: bool,
}

/// States that may wait.
const QUEUE_HEALTHS: usize = 256;

impl<K: Sink> SlowDisk<K> {
    /// A disk that takes nothing in these stretches, behind a queue of so many bytes.
    #[must_use]
    pub(crate) fn new(written: K, queue_bytes: usize, stalls: Stalls) -> Self {
        let (messages_in, messages_out) = message_ring(queue_bytes);
        Self {
            written,
            handed: 0,
            taken: 0,
            dropped: 0,
            messages_in,
            messages_out,
            stalls,
            cdr: Vec::new(),
            healths: Vec::with_capacity(QUEUE_HEALTHS),
            waiting_bytes: 0,
            max_waiting_bytes: 0,
            writes_at_once: true,
        }
    }

    /// Every page of the queue is used once, as after hours: until its ring has been round, memory in use
    /// grows by what goes through it.
    pub(crate) fn touch(&mut self, queue_bytes: usize) {
        const PIECE: [u8; 4096] = [0; 4096];
        let head = Head { topic: Topic::Diagnostics, log_time_ns: 0, publish_time_ns: 0 };
        for _ in 0..queue_bytes / PIECE.len() + 1 {
            assert!(self.messages_in.push(head, &PIECE));
            self.messages_out.pop(&mut self.cdr).unwrap();
        }
    }

    /// Takes nothing in these stretches either, which come later.
    pub(crate) fn stall(&mut self, later: Stalls) {
        self.stalls.extend(later);
    }

    /// Most bytes that have waited.
    #[must_use]
    pub(crate) fn max_waiting_bytes(&self) -> usize {
        self.max_waiting_bytes
    }

    /// What waits is written, if the disk takes something.
    pub(crate) fn write(&mut self, now_ns: i64) {
        self.stalls.forget(now_ns);
        if self.stalls.is_free(now_ns) {
            self.flush();
        }
    }

    /// Everything that waits is written.
    pub(crate) fn flush(&mut self) {
        while let Some(head) = self.messages_out.pop(&mut self.cdr) {
            self.taken += 1;
            self.written.message(head.topic, head.log_time_ns, head.publish_time_ns, &self.cdr);
        }
        self.waiting_bytes = 0;
        for (now_ns, health) in self.healths.drain(..) {
            self.written.health(now_ns, &health);
        }
    }
}

impl<K: Sink> Sink for SlowDisk<K> {
    fn message(&mut self, topic: Topic, log_time_ns: i64, publish_time_ns: i64, cdr: &[u8]) {
        if self.writes_at_once && self.stalls.is_free(log_time_ns) {
            self.flush();
        }
        self.handed += 1;
        let is_in = self.messages_in.push(Head { topic, log_time_ns, publish_time_ns }, cdr);
        self.dropped += u64::from(!is_in);
        self.waiting_bytes += cdr.len();
        self.max_waiting_bytes = self.max_waiting_bytes.max(self.waiting_bytes);
    }

    fn health(&mut self, now_ns: i64, health: &Health) {
        if self.healths.len() < QUEUE_HEALTHS {
            self.healths.push((now_ns, *health));
        } else {
            self.dropped += 1;
        }
    }

    fn dropped(&self) -> u64 {
        self.dropped
    }
}
