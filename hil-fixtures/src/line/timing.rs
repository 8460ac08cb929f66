//! When bytes are on a serial line, nanoseconds.
//!
//! A byte takes ten bits (8N1). An LMS puts at most 508 bytes of a scan on the line in a mirror turn and
//! leaves out whole scans while its line is busy (SICK telegram listing, figures on data output).

use crate::rig::scanner::TURN_NS;

/// Bytes that an LMS sends in a mirror turn at most.
const BYTES_PER_TURN: usize = 508;

/// Time of `bytes` bytes at `baud` bits a second.
#[must_use]
pub fn transfer_ns(bytes: usize, baud: u32) -> i64 {
    i64::try_from(bytes as u128 * 10_000_000_000 / u128::from(baud.max(1))).unwrap_or(i64::MAX)
}

/// When byte `index` of a laser's telegram has arrived, after the telegram's first bit.
#[must_use]
pub fn laser_byte_ns(index: usize, baud: u32) -> i64 {
    let block_ns = transfer_ns(BYTES_PER_TURN, baud);
    if block_ns < TURN_NS {
        (index / BYTES_PER_TURN) as i64 * TURN_NS + transfer_ns(index % BYTES_PER_TURN + 1, baud)
    } else {
        transfer_ns(index + 1, baud)
    }
}

/// Every how many scans a laser sends one: the transfer time in whole scans, rounded up.
#[must_use]
pub fn scans_per_telegram(telegram_bytes: usize, baud: u32, scan_ns: i64) -> i64 {
    let busy_ns = laser_byte_ns(telegram_bytes.saturating_sub(1), baud);
    ((busy_ns + scan_ns - 1) / scan_ns).max(1)
}
