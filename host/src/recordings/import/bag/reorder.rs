//! Messages in the order of their stamps: a recorder writes them as they come, and some come late.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// A message waits so long, by receipt, for earlier ones, ns.
const WINDOW_NS: i64 = 1_000_000_000;
/// Bytes that may wait; beyond, the earliest goes on.
const MAX_BYTES: usize = 64 << 20;

/// Waiting messages.
#[derive(Debug)]
pub(crate) struct Reorder<T> {
    waiting: BinaryHeap<Reverse<Waiting<T>>>,
    bytes: usize,
    count: u64,
    newest_ns: i64,
}

#[derive(Debug)]
struct Waiting<T> {
    stamp_ns: i64,
    /// Its place in the bag, which decides among equal stamps.
    place: u64,
    received_ns: i64,
    bytes: usize,
    message: T,
}

impl<T> PartialEq for Waiting<T> {
    fn eq(&self, other: &Self) -> bool {
        self.place == other.place
    }
}
impl<T> Eq for Waiting<T> {}
impl<T> PartialOrd for Waiting<T> {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}
impl<T> Ord for Waiting<T> {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        (self.stamp_ns, self.place).cmp(&(other.stamp_ns, other.place))
    }
}

impl<T> Default for Reorder<T> {
    fn default() -> Self {
        Self { waiting: BinaryHeap::new(), bytes: 0, count: 0, newest_ns: i64::MIN }
    }
}

impl<T> Reorder<T> {
    /// Takes a message of so many bytes.
    pub(crate) fn push(&mut self, stamp_ns: i64, received_ns: i64, bytes: usize, message: T) {
        self.newest_ns = self.newest_ns.max(received_ns);
        self.bytes += bytes;
        let place = self.count;
        self.count += 1;
        self.waiting.push(Reverse(Waiting { stamp_ns, place, received_ns, bytes, message }));
    }

    /// The next message that has waited long enough.
    pub(crate) fn pop(&mut self) -> Option<(i64, T)> {
        let Reverse(first) = self.waiting.peek()?;
        let is_due = self.newest_ns.saturating_sub(first.received_ns) >= WINDOW_NS;
        if is_due || self.bytes > MAX_BYTES { self.pop_any() } else { None }
    }

    /// The next message, however long it has waited.
    pub(crate) fn pop_any(&mut self) -> Option<(i64, T)> {
        let Reverse(first) = self.waiting.pop()?;
        self.bytes -= first.bytes;
        Some((first.stamp_ns, first.message))
    }
}

#[cfg(test)]
mod tests {
    use super::{MAX_BYTES, Reorder};

    #[test]
    fn what_comes_late_goes_to_its_place_and_equal_stamps_stay_in_order() {
        let mut reorder = Reorder::default();
        let mut out = Vec::new();
        for (stamp_ns, received_ms, name) in
            [(10, 0, 'a'), (30, 100, 'c'), (20, 200, 'b'), (30, 300, 'd'), (90, 1_100, 'f'), (80, 1_150, 'e')]
        {
            reorder.push(stamp_ns, received_ms * 1_000_000, 1, name);
            out.extend(std::iter::from_fn(|| reorder.pop()));
        }
        // The first has waited a second; the third keeps waiting, and so does all behind it.
        assert_eq!(out, [(10, 'a')]);
        out.extend(std::iter::from_fn(|| reorder.pop_any()));
        let names: String = out.iter().map(|(_, name)| *name).collect();
        assert_eq!(names, "abcdef");
    }

    #[test]
    fn memory_is_bounded_whatever_the_receipt_says() {
        let mut reorder = Reorder::default();
        let mut max_waiting = 0;
        for stamp in 0..100 {
            reorder.push(stamp, 0, MAX_BYTES / 10, stamp);
            while reorder.pop().is_some() {}
            max_waiting = max_waiting.max(reorder.waiting.len());
        }
        assert_eq!(max_waiting, 10);
    }
}
