//! All bytes that passed a place, with their times.

use std::ops::Range;

/// Bytes and when they passed.
#[derive(Clone, Debug, Default)]
pub(crate) struct Tape {
    /// The bytes.
    pub bytes: Vec<u8>,
    /// End of a piece (index of the byte behind it), and its time, nanoseconds.
    marks: Vec<(usize, i64)>,
    /// Indices of bytes that came from a port that had been gone: whoever listens starts anew with them.
    breaks: Vec<usize>,
    /// Beyond the usual, bytes may have been held back so long before they came here, nanoseconds.
    pub held_ns: i64,
}

impl Tape {
    /// Bytes pass at `now_ns`; times do not step back.
    pub(crate) fn push(&mut self, now_ns: i64, bytes: &[u8]) {
        if !bytes.is_empty() {
            self.bytes.extend_from_slice(bytes);
            self.marks.push((self.bytes.len(), now_ns));
        }
    }

    /// What passes from now on does not belong to what has passed.
    pub(crate) fn interrupt(&mut self) {
        self.breaks.push(self.bytes.len());
    }

    /// Whether the bytes of these indices belong together.
    #[must_use]
    pub(crate) fn is_in_one(&self, bytes: &Range<usize>) -> bool {
        self.breaks.iter().all(|index| *index <= bytes.start || bytes.end <= *index)
    }

    /// Forgets what passed before.
    pub(crate) fn forget_before(&mut self, at_ns: i64) {
        let gone = self.marks.partition_point(|(_, passed_ns)| *passed_ns < at_ns);
        let Some(&(end, _)) = gone.checked_sub(1).and_then(|last| self.marks.get(last)) else { return };
        self.bytes.drain(..end);
        self.marks.drain(..gone);
        self.marks.iter_mut().for_each(|(index, _)| *index -= end);
        self.breaks.retain(|index| *index > end);
        self.breaks.iter_mut().for_each(|index| *index -= end);
    }

    /// Pieces that passed at one time each.
    pub(crate) fn pieces(&self) -> impl Iterator<Item = (i64, &[u8])> {
        let starts = [0].into_iter().chain(self.marks.iter().map(|(end, _)| *end));
        self.marks.iter().zip(starts).map(|((end, at_ns), start)| (*at_ns, &self.bytes[start..*end]))
    }

    /// Whether a piece ends before the byte of this index.
    #[must_use]
    pub(crate) fn is_end(&self, index: usize) -> bool {
        self.marks.binary_search_by_key(&index, |(end, _)| *end).is_ok()
    }

    /// When the byte of this index passed.
    #[must_use]
    pub(crate) fn time_ns(&self, index: usize) -> i64 {
        let mark = self.marks.partition_point(|(end, _)| *end <= index);
        self.marks.get(mark).map_or(i64::MAX, |(_, at_ns)| *at_ns)
    }

    /// Index of the first byte that passed after `at_ns`.
    #[must_use]
    pub(crate) fn index_after(&self, at_ns: i64) -> usize {
        let mark = self.marks.partition_point(|(_, passed_ns)| *passed_ns <= at_ns);
        mark.checked_sub(1).map_or(0, |last| self.marks[last].0)
    }
}
