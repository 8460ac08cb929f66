//! Where the live view takes its messages from: behind the file, never in anybody's way.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use biplane_recording::Topic;

use crate::output::message_ring::{Head, MessagesIn};

/// Takes a copy of each message that a live view shows. When there is no room for one it is missed, and
/// counted.
#[derive(Debug)]
pub(crate) struct Tap {
    messages: MessagesIn,
    missed: Arc<AtomicU64>,
}

impl Tap {
    /// A tap into this ring, with its counter of what was missed.
    #[cfg_attr(not(any(feature = "live", test)), expect(dead_code, reason = "only a live view has one"))]
    pub(crate) fn new(messages: MessagesIn, missed: Arc<AtomicU64>) -> Self {
        Self { messages, missed }
    }

    /// A message was recorded. Neither waits nor allocates. Serial bytes are for replays; nobody looks at
    /// them.
    pub(crate) fn message(&mut self, topic: Topic, log_time_ns: i64, publish_time_ns: i64, cdr: &[u8]) {
        if matches!(topic, Topic::Serial(..)) {
            return;
        }
        if !self.messages.push(Head { topic, log_time_ns, publish_time_ns }, cdr) {
            self.missed.fetch_add(1, Ordering::Relaxed);
        }
    }
}
