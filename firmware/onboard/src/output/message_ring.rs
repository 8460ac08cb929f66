//! A ring of whole messages as bytes between two threads: memory is what the messages need, nothing is
//! allocated on the way in, and nobody waits. A message goes in whole, or not at all.

use biplane_recording::Topic;
use rtrb::{Consumer, Producer, RingBuffer};

/// Before each message: topic, two times, length.
const HEAD_BYTES: usize = 1 + 8 + 8 + 4;

/// What a message is, beside its bytes.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub struct Head {
    /// Its topic.
    pub topic: Topic,
    /// When it was made or received, nanoseconds.
    pub log_time_ns: i64,
    /// Its own stamp, nanoseconds.
    pub publish_time_ns: i64,
}

/// Where messages go in.
#[derive(Debug)]
pub struct MessagesIn(Producer<u8>);

/// Where they come out, in their order.
#[derive(Debug)]
pub struct MessagesOut(Consumer<u8>);

/// A ring that holds so many bytes.
#[must_use]
pub fn message_ring(bytes: usize) -> (MessagesIn, MessagesOut) {
    let (messages_in, messages_out) = RingBuffer::new(bytes);
    (MessagesIn(messages_in), MessagesOut(messages_out))
}

impl MessagesIn {
    /// Adds a message; whether there was room for it.
    #[must_use]
    pub fn push(&mut self, head: Head, cdr: &[u8]) -> bool {
        let length = u32::try_from(cdr.len()).unwrap_or(u32::MAX);
        let mut bytes = [0; HEAD_BYTES];
        bytes[0] = head.topic.index() as u8;
        bytes[1..9].copy_from_slice(&head.log_time_ns.to_le_bytes());
        bytes[9..17].copy_from_slice(&head.publish_time_ns.to_le_bytes());
        bytes[17..].copy_from_slice(&length.to_le_bytes());
        let Ok(mut chunk) = self.0.write_chunk(HEAD_BYTES + cdr.len()) else { return false };
        let (first, second) = chunk.as_mut_slices();
        let slots = first.iter_mut().chain(second);
        for (slot, byte) in slots.zip(bytes.iter().chain(cdr)) {
            *slot = *byte;
        }
        chunk.commit_all();
        true
    }
}

impl MessagesOut {
    /// The next message, its bytes in `cdr`.
    pub fn pop(&mut self, cdr: &mut Vec<u8>) -> Option<Head> {
        let mut head = [0; HEAD_BYTES];
        self.0.pop_entire_slice(&mut head).ok()?;
        let word =
            |at: usize| head.get(at..).and_then(|rest| rest.first_chunk()).copied().unwrap_or_default();
        let topic = Topic::ALL.get(usize::from(head[0])).copied()?;
        let length = u32::from_le_bytes(head.last_chunk().copied().unwrap_or_default());
        cdr.clear();
        cdr.resize(length as usize, 0);
        // A message goes in whole, so it is there when its head is.
        self.0.pop_entire_slice(cdr).ok()?;
        let (log_time_ns, publish_time_ns) = (i64::from_le_bytes(word(1)), i64::from_le_bytes(word(9)));
        Some(Head { topic, log_time_ns, publish_time_ns })
    }

    /// Whether whoever fills it has gone and nothing is left.
    #[must_use]
    pub fn is_over(&self) -> bool {
        self.0.is_abandoned() && self.0.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_come_out_as_they_went_in_also_over_the_end_of_the_ring() {
        let (mut messages_in, mut messages_out) = message_ring(1 << 20);
        let mut cdr = Vec::new();
        // 400 messages of 200 kB go many times round the ring.
        for round in 0..400_i64 {
            let bytes = vec![round as u8; 200_000 + round as usize];
            let head = Head { topic: Topic::Pose, log_time_ns: round, publish_time_ns: -round };
            assert!(messages_in.push(head, &bytes));
            assert_eq!(messages_out.pop(&mut cdr), Some(head));
            assert_eq!(cdr, bytes);
        }
        assert_eq!(messages_out.pop(&mut cdr), None);
        assert!(!messages_out.is_over());
        drop(messages_in);
        assert!(messages_out.is_over());
    }

    #[test]
    fn what_does_not_fit_stays_out_whole() {
        let (mut messages_in, mut messages_out) = message_ring(100);
        let head = |log_time_ns| Head { topic: Topic::Odom, log_time_ns, publish_time_ns: 0 };
        let taken: Vec<bool> = [(1, 40), (2, 40), (3, 10)]
            .map(|(time, length)| messages_in.push(head(time), &vec![7; length]))
            .to_vec();
        assert_eq!(taken, [true, false, true]);
        let mut cdr = Vec::new();
        let times: Vec<_> =
            std::iter::from_fn(|| messages_out.pop(&mut cdr)).map(|head| head.log_time_ns).collect();
        assert_eq!(times, [1, 3]);
    }
}
