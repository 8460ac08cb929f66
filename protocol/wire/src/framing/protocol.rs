//! What a deframer has to know of one protocol.

/// How one protocol's frames are recognized.
pub trait Framing {
    /// First byte of every frame, or of one of those that there are most of.
    const START: u8;
    /// Longest possible frame in bytes, the bound for how long a false start can hold up the stream.
    const MAX_FRAME: usize;

    /// Whether a frame can begin with `byte`; most protocols know one such byte.
    fn is_start(byte: u8) -> bool {
        byte == Self::START
    }

    /// Whether `byte` alone, between frames, is a message of its own; most protocols have none.
    fn is_control(_byte: u8) -> bool {
        false
    }

    /// Judges the head of a frame. `head` starts with a byte that [`Framing::is_start`] takes, and may
    /// be short or longer than the frame.
    fn measure(head: &[u8]) -> Measure;

    /// Whether the checksum of a whole frame fits.
    fn is_intact(frame: &[u8]) -> bool;
}

/// What the head of a possible frame says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Measure {
    /// More bytes are needed to say.
    Unknown,
    /// A frame of this many bytes in all, checksum included.
    Frame(usize),
    /// No frame starts here: the start byte is chance.
    Noise,
    /// The length or the kind announced cannot be true.
    BadLength,
}
