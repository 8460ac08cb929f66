//! Collecting the bytes of one answer. Never more than the open question has, never across questions: what
//! comes unasked, too late or behind an answer is dropped and counted.

use heapless::Vec;

use super::{Answer, MAX_ANSWER_BYTES, Request};
use crate::{Counts, WireError};

/// An answer and where it stood in the stream.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Collected<'a> {
    /// Index of its first byte since [`Collector::new`].
    pub offset: u64,
    /// Its bytes.
    pub length: usize,
    /// Bytes that came with it behind its end: more than was asked for, so that it may be the answer to an
    /// earlier question.
    pub surplus: usize,
    /// What it says.
    pub answer: Answer<'a>,
}

/// Takes in what a controller sends. Without an open question it takes nothing.
#[derive(Clone, Debug, Default)]
pub struct Collector {
    open: Option<Request>,
    bytes: Vec<u8, MAX_ANSWER_BYTES>,
    /// Stream index of the next byte.
    position: u64,
    counts: Counts,
}

impl Collector {
    /// Nothing asked, stream index 0.
    pub fn new() -> Self {
        Self::default()
    }

    /// The request has been sent: the next bytes answer it. An answer that was awaited before is given up.
    pub fn ask(&mut self, request: Request) {
        self.abandon();
        self.open = Some(request);
    }

    /// The answer did not come in time: what came of it is dropped, and so is what comes before the next
    /// question.
    pub fn abandon(&mut self) {
        if self.open.take().is_some() {
            self.counts.abandoned += u64::from(!self.bytes.is_empty());
            self.counts.skipped_bytes += self.bytes.len() as u64;
        }
        self.bytes.clear();
    }

    /// Takes all of `bytes`; `Some` when the open question's answer ended in them. It is closed then,
    /// answered or not.
    pub fn take(&mut self, bytes: &[u8]) -> Option<Result<Collected<'_>, WireError>> {
        let offset = self.position - self.buffered() as u64;
        self.position += bytes.len() as u64;
        let Some(request) = self.open else {
            self.counts.skipped_bytes += bytes.len() as u64;
            return None;
        };
        let mut rest = bytes;
        loop {
            let missing = request.question.answer_len(&self.bytes).saturating_sub(self.bytes.len());
            if missing == 0 {
                break;
            }
            let (head, behind) = rest.split_at(missing.min(rest.len()));
            if head.is_empty() || self.bytes.extend_from_slice(head).is_err() {
                return None;
            }
            rest = behind;
        }
        self.open = None;
        self.counts.skipped_bytes += rest.len() as u64;
        let length = self.bytes.len();
        let answer = Answer::accept(request, &self.bytes);
        if answer.is_ok() {
            self.counts.frames += 1;
            self.counts.frame_bytes += length as u64;
        } else {
            self.counts.bad_checksums += 1;
            self.counts.skipped_bytes += length as u64;
        }
        Some(answer.map(|answer| Collected { offset, length, surplus: rest.len(), answer }))
    }

    /// Bytes kept of an answer that is not complete.
    pub fn buffered(&self) -> usize {
        if self.open.is_some() { self.bytes.len() } else { 0 }
    }

    /// Stream index of the next byte: the number of bytes taken so far.
    pub fn position(&self) -> u64 {
        self.position
    }

    /// The account so far; bytes of an incomplete answer are not in it yet.
    pub fn counts(&self) -> Counts {
        self.counts
    }
}
