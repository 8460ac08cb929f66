//! When the bytes of a capture left their device.
//!
//! A capture has the times at which reads returned, and a read returns once its last byte has come.
//! Nanoseconds on the capture's clock.

use crate::line::transfer_ns;
use std::collections::VecDeque;

/// Reads of one line, to tell when a byte left.
pub struct ByteTimes {
    baud: u32,
    /// Bytes read so far.
    pub position: u64,
    /// First byte's position, number of bytes, time of the read.
    reads: VecDeque<(u64, usize, i64)>,
}

/// No telegram spans more reads than this, unless they are of one byte each.
const READS_KEPT: usize = 1024;

impl ByteTimes {
    /// Nothing read yet, on a line of this rate.
    #[must_use]
    pub fn new(baud: u32) -> Self {
        Self { baud, position: 0, reads: VecDeque::new() }
    }

    /// A read of `count` bytes returned.
    pub fn read(&mut self, time_ns: i64, count: usize) {
        if self.reads.len() == READS_KEPT {
            self.reads.pop_front();
        }
        self.reads.push_back((self.position, count, time_ns));
        self.position += count as u64;
    }

    /// When the byte at `offset` left: its read returned once the bytes behind it had come, too; but never
    /// before the read before.
    #[must_use]
    pub fn left_ns(&self, offset: u64) -> i64 {
        let next = self.reads.partition_point(|read| read.0 <= offset);
        let Some(&(start, count, time_ns)) = self.reads.get(next.saturating_sub(1)) else { return 0 };
        let behind = count - usize::try_from(offset - start.min(offset)).unwrap_or(0).min(count);
        let left_ns = time_ns - transfer_ns(behind, self.baud);
        let before = next.checked_sub(2).and_then(|index| self.reads.get(index));
        before.map_or(left_ns, |before| left_ns.max(before.2 - transfer_ns(1, self.baud)))
    }
}

#[cfg(test)]
mod tests {
    use super::ByteTimes;

    #[test]
    fn a_byte_left_as_long_before_the_read_as_the_bytes_behind_it_took() {
        let mut times = ByteTimes::new(10_000);
        times.read(100_000_000, 4);
        times.read(120_000_000, 10);
        assert_eq!(times.left_ns(0), 96_000_000);
        assert_eq!(times.left_ns(3), 99_000_000);
        assert_eq!(times.left_ns(4), 110_000_000);
        assert_eq!(times.left_ns(13), 119_000_000);
    }

    #[test]
    fn a_byte_did_not_leave_before_the_read_before_returned() {
        let mut times = ByteTimes::new(10_000);
        times.read(100_000_000, 4);
        times.read(103_000_000, 10);
        assert_eq!(times.left_ns(4), 99_000_000);
    }
}
