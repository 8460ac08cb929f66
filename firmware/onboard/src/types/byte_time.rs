//! How long bytes are on a serial line.

/// Bits that a byte takes on the line: start, eight data, stop.
const LINE_BITS_PER_BYTE: i64 = 10;

/// How long one byte takes on the line, nanoseconds, at a rate in bits per second.
#[must_use]
pub(crate) fn byte_time_ns(baud: u32) -> i64 {
    LINE_BITS_PER_BYTE * 1_000_000_000 / i64::from(baud.max(1))
}
