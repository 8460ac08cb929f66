//! The cutting itself: a bounded buffer, and one decision at a time about what stands at its front.

use core::marker::PhantomData;

use super::{Counts, Framing, Item, Measure, SkipReason};

/// Cuts the stream of one line into frames with a buffer of `N` bytes, `N >= F::MAX_FRAME`.
#[derive(Clone, Debug)]
pub struct Deframer<F, const N: usize> {
    buffer: [u8; N],
    start: usize,
    end: usize,
    /// Stream index of `buffer[start]`.
    offset: u64,
    /// With fewer buffered bytes than this, nothing new can be said.
    wanted: usize,
    /// Stream index of a gap on the line: no frame goes across it.
    gap_at: Option<u64>,
    /// Whether a telegram could start here, so that a control byte is one.
    in_sync: bool,
    /// Why bytes that are skipped now are skipped.
    reason: SkipReason,
    /// Stream index of the end of the frame that failed last: false starts before it are part of that
    /// failure.
    failed_until: u64,
    /// Skipped bytes directly before `offset`, not handed out yet.
    pending: usize,
    pending_reason: SkipReason,
    /// Bytes of the frame that was handed out last, 0 for another piece.
    handed_out: usize,
    counts: Counts,
    framing: PhantomData<F>,
}

/// What stands at the front of the buffer.
enum Verdict {
    Wait(usize),
    Frame(usize),
    Control,
    Noise(usize),
    Failed { reason: SkipReason, extent: usize },
}

/// An [`Item`] without its bytes.
enum Found {
    Frame(usize),
    Control(u8),
    Skipped { count: usize, reason: SkipReason },
}

impl<F: Framing, const N: usize> Default for Deframer<F, N> {
    fn default() -> Self {
        Self::new()
    }
}

impl<F: Framing, const N: usize> Deframer<F, N> {
    /// An empty deframer at stream index 0.
    pub fn new() -> Self {
        const { assert!(N >= F::MAX_FRAME, "the buffer must hold the longest frame") };
        Self {
            buffer: [0; N],
            start: 0,
            end: 0,
            offset: 0,
            wanted: 0,
            gap_at: None,
            in_sync: true,
            reason: SkipReason::Noise,
            failed_until: 0,
            pending: 0,
            pending_reason: SkipReason::Noise,
            handed_out: 0,
            counts: Counts::default(),
            framing: PhantomData,
        }
    }

    /// Takes bytes into the buffer and says how many. Drain with [`Deframer::next`] and push the rest; after
    /// a complete drain at least one byte is always taken.
    pub fn push(&mut self, bytes: &[u8]) -> usize {
        self.handed_out = 0;
        if N - self.end < bytes.len() && self.start > 0 {
            self.buffer.copy_within(self.start..self.end, 0);
            self.end -= self.start;
            self.start = 0;
        }
        let count = bytes.len().min(N - self.end);
        self.buffer[self.end..self.end + count].copy_from_slice(&bytes[..count]);
        self.end += count;
        count
    }

    /// The next piece of the stream; `None` when more bytes are needed.
    #[allow(clippy::should_implement_trait)] // a lending iterator: the item borrows from the deframer
    pub fn next(&mut self) -> Option<Item<'_>> {
        self.handed_out = 0;
        let found = self.advance()?;
        let offset = self.offset;
        Some(match found {
            Found::Frame(count) => Item::Frame {
                offset: offset - count as u64,
                bytes: &self.buffer[self.start - count..self.start],
            },
            Found::Control(byte) => Item::Control { offset: offset - 1, byte },
            Found::Skipped { count, reason } => {
                Item::Skipped { offset: offset - count as u64, count, reason }
            }
        })
    }

    /// Pushes all of `bytes` and hands every piece to `each`.
    pub fn feed(&mut self, mut bytes: &[u8], mut each: impl FnMut(Item<'_>)) {
        loop {
            let taken = self.push(bytes);
            bytes = &bytes[taken..];
            while let Some(item) = self.next() {
                each(item);
            }
            if bytes.is_empty() {
                return;
            }
        }
    }

    /// Tells that the line paused here for longer than a telegram may: an unfinished telegram is given up,
    /// its bytes are searched for others, and the next byte stands where a telegram could start. Drain before
    /// and after.
    pub fn abandon(&mut self) {
        self.gap_at = Some(self.offset + self.buffered() as u64);
        self.wanted = 0;
    }

    /// Takes back the frame that [`Deframer::next`] has just handed out: it cannot be true, for a reason that
    /// no checksum sees. Its bytes are searched for others and handed out again, as those of any frame that
    /// failed: what passed by chance, a byte short, has taken the first byte of the true one behind it.
    /// Whoever rejects counts. Does nothing once bytes were pushed or another piece was taken.
    pub fn reject(&mut self) {
        let count = core::mem::take(&mut self.handed_out);
        if count == 0 {
            return;
        }
        self.counts.frames -= 1;
        self.counts.frame_bytes -= count as u64;
        self.start -= count;
        self.offset -= count as u64;
        self.reason = SkipReason::Rejected;
        self.failed_until = self.offset + count as u64;
        self.skip(1);
    }

    /// Tells that the input ends here: draining then accounts for every byte.
    pub fn finish(&mut self) {
        self.abandon();
    }

    /// The account so far. Buffered bytes of an unfinished telegram are not in it yet.
    pub fn counts(&self) -> Counts {
        self.counts
    }

    /// Bytes held back because they may become a telegram. Not 0 when the line falls silent: see
    /// [`Deframer::abandon`].
    pub fn buffered(&self) -> usize {
        self.end - self.start
    }

    /// Stream index of the next byte to be pushed: the number of bytes pushed so far.
    pub fn position(&self) -> u64 {
        self.offset + self.buffered() as u64
    }

    fn advance(&mut self) -> Option<Found> {
        loop {
            if self.gap_at == Some(self.offset) {
                if self.pending > 0 {
                    return self.flush();
                }
                self.gap_at = None;
                self.synchronized();
            }
            if self.buffered() == 0 || self.buffered() < self.wanted {
                return self.flush();
            }
            match self.judge() {
                Verdict::Wait(wanted) => {
                    self.wanted = wanted;
                    return self.flush();
                }
                Verdict::Noise(count) => self.skip(count),
                Verdict::Failed { .. } if self.offset < self.failed_until => self.skip(1),
                _ if self.pending > 0 => return self.flush(),
                Verdict::Failed { reason, extent } => {
                    self.note_failure(reason, extent);
                    self.skip(1);
                }
                Verdict::Frame(count) => return Some(self.take_frame(count)),
                Verdict::Control => return Some(self.take_control()),
            }
        }
    }

    fn judge(&self) -> Verdict {
        let bytes = &self.buffer[self.start..self.end];
        let to_gap = self.gap_at.map_or(u64::MAX, |gap| gap - self.offset);
        let closed = to_gap <= bytes.len() as u64;
        let head = if closed { &bytes[..to_gap as usize] } else { bytes };
        let Some(&first) = head.first() else {
            return Verdict::Wait(1);
        };
        if !F::is_start(first) {
            if self.in_sync && F::is_control(first) {
                return Verdict::Control;
            }
            let run = head.iter().position(|&byte| F::is_start(byte)).unwrap_or(head.len());
            return Verdict::Noise(run);
        }
        let abandoned = Verdict::Failed { reason: SkipReason::Abandoned, extent: head.len() };
        match F::measure(head) {
            Measure::Noise => Verdict::Noise(1),
            Measure::BadLength => Verdict::Failed { reason: SkipReason::BadLength, extent: 1 },
            Measure::Frame(length) if length > F::MAX_FRAME => {
                Verdict::Failed { reason: SkipReason::BadLength, extent: 1 }
            }
            Measure::Frame(length) => match head.get(..length) {
                Some(frame) if F::is_intact(frame) => Verdict::Frame(length),
                Some(_) => Verdict::Failed { reason: SkipReason::BadChecksum, extent: length },
                None if closed => abandoned,
                None => Verdict::Wait(length),
            },
            Measure::Unknown if closed => abandoned,
            Measure::Unknown => Verdict::Wait(head.len() + 1),
        }
    }

    fn note_failure(&mut self, reason: SkipReason, extent: usize) {
        self.reason = reason;
        self.failed_until = self.offset + extent as u64;
        match reason {
            SkipReason::BadChecksum => self.counts.bad_checksums += 1,
            SkipReason::BadLength => self.counts.bad_lengths += 1,
            SkipReason::Abandoned => self.counts.abandoned += 1,
            SkipReason::Noise | SkipReason::Rejected => {}
        }
    }

    fn consume(&mut self, count: usize) {
        self.start += count;
        self.offset += count as u64;
        self.wanted = 0;
    }

    fn skip(&mut self, count: usize) {
        if self.pending == 0 {
            self.pending_reason = self.reason;
        }
        self.pending += count;
        self.counts.skipped_bytes += count as u64;
        self.in_sync = false;
        self.consume(count);
    }

    fn synchronized(&mut self) {
        self.in_sync = true;
        self.reason = SkipReason::Noise;
        self.failed_until = 0;
    }

    fn take_frame(&mut self, count: usize) -> Found {
        self.counts.frames += 1;
        self.counts.frame_bytes += count as u64;
        self.consume(count);
        self.synchronized();
        self.handed_out = count;
        Found::Frame(count)
    }

    fn take_control(&mut self) -> Found {
        let byte = self.buffer[self.start];
        self.counts.control_bytes += 1;
        self.consume(1);
        self.synchronized();
        Found::Control(byte)
    }

    fn flush(&mut self) -> Option<Found> {
        let count = core::mem::take(&mut self.pending);
        (count > 0).then_some(Found::Skipped { count, reason: self.pending_reason })
    }
}
