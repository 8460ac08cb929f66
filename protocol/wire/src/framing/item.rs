//! The pieces that a stream is cut into, and their account. Offsets count bytes from the start of the stream.

/// Why bytes belong to no frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum SkipReason {
    /// No frame started here.
    Noise,
    /// A whole frame whose checksum does not fit.
    BadChecksum,
    /// A start of a frame whose length or kind cannot be true.
    BadLength,
    /// A frame that was not finished: a gap on the line, or the end of the input.
    Abandoned,
    /// A frame that was taken back: see [`super::Deframer::reject`].
    Rejected,
}

/// A piece of the stream. `offset` is the index of its first byte since [`super::Deframer::new`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Item<'a> {
    /// A whole telegram, checksum included and good.
    Frame {
        /// Index of the first byte.
        offset: u64,
        /// All bytes of the telegram.
        bytes: &'a [u8],
    },
    /// A control byte where a telegram could have started: LMS acknowledge `06` or refusal `15`.
    Control {
        /// Index of the byte.
        offset: u64,
        /// The byte.
        byte: u8,
    },
    /// Bytes that belong to no telegram. A long run may come in several pieces.
    Skipped {
        /// Index of the first byte.
        offset: u64,
        /// Number of bytes.
        count: usize,
        /// Why.
        reason: SkipReason,
    },
}

/// The account of all bytes taken out of a [`super::Deframer`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Whole telegrams.
    pub frames: u64,
    /// Their bytes.
    pub frame_bytes: u64,
    /// Control bytes between telegrams.
    pub control_bytes: u64,
    /// Bytes in no telegram, whatever the reason.
    pub skipped_bytes: u64,
    /// Telegrams lost to a checksum. A false start inside a failed telegram counts only with that telegram.
    pub bad_checksums: u64,
    /// Starts of telegrams whose length cannot be true.
    pub bad_lengths: u64,
    /// Telegrams that were not finished.
    pub abandoned: u64,
}

impl Counts {
    /// All bytes accounted for.
    pub fn bytes(&self) -> u64 {
        self.frame_bytes + self.control_bytes + self.skipped_bytes
    }
}
