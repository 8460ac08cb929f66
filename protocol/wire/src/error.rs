//! What can be wrong with the bytes of a telegram. Every error says what was expected, what was found, and
//! where: offsets count bytes from the first byte of the telegram.

use thiserror::Error;

/// A telegram that cannot be read or written. Small, `Copy`, and without a heap, so that it can be kept in a
/// log.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum WireError {
    /// The bytes end before the telegram does.
    #[error("telegram is cut: {needed} bytes needed, {found} found")]
    TooShort {
        /// Bytes that the telegram or the field needs, from the telegram's first byte.
        needed: usize,
        /// Bytes that were there.
        found: usize,
    },
    /// There are bytes behind the end of the telegram or of its last field.
    #[error("{found} bytes where the telegram has {expected}")]
    TooLong {
        /// Bytes from the telegram's first byte to its end.
        expected: usize,
        /// Bytes that were there.
        found: usize,
    },
    /// A byte that is the same in every telegram is another one here.
    #[error("byte {offset} is {found:02X}h, expected {expected:02X}h")]
    Byte {
        /// The value that every telegram has.
        expected: u8,
        /// The value found.
        found: u8,
        /// Where it stands.
        offset: usize,
    },
    /// The telegram's own length field cannot be true.
    #[error("length field at byte {offset} is {found}, expected at least {expected}")]
    LengthField {
        /// Smallest possible value.
        expected: usize,
        /// The value found.
        found: usize,
        /// Where the field stands.
        offset: usize,
    },
    /// The checksum does not fit the bytes.
    #[error("checksum at byte {offset} is {found:04X}h, the bytes give {expected:04X}h")]
    Checksum {
        /// Computed from the bytes.
        expected: u16,
        /// Read from the telegram.
        found: u16,
        /// Where it stands.
        offset: usize,
    },
    /// A field holds a value that has no meaning, or that cannot be sent.
    #[error("{field} is {found} (byte {offset})")]
    Value {
        /// The field's name.
        field: &'static str,
        /// The value found.
        found: u32,
        /// Where it stands in the telegram.
        offset: usize,
    },
    /// More elements than the telegram can hold.
    #[error("{field}: {found} where at most {limit} fit (byte {offset})")]
    Capacity {
        /// The field's name.
        field: &'static str,
        /// Elements that fit.
        limit: usize,
        /// Elements asked for.
        found: usize,
        /// Where the elements start.
        offset: usize,
    },
    /// The telegram goes the other way: a request where a reply was expected, or the reverse.
    #[error("address {found:02X}h is that of a {}, expected a {}", direction(!.expect_reply), direction(*.expect_reply))]
    Direction {
        /// Whether a reply was expected.
        expect_reply: bool,
        /// The address byte found (bit 7 set = reply).
        found: u8,
    },
    /// The buffer to write into is too small; nothing useful was written.
    #[error("{needed} bytes to write, but the buffer has {found}")]
    BufferTooSmall {
        /// Bytes of the telegram.
        needed: usize,
        /// Bytes of the buffer.
        found: usize,
    },
}

fn direction(is_reply: bool) -> &'static str {
    if is_reply { "reply" } else { "request" }
}
