//! From read times to the time at which a telegram's first byte left its device.
//!
//! A read returns some time after its last byte was on the line: late by what the adapter adds (about 0.3 ms, now and
//! then 8 ms), never early. Two lower envelopes remove most of that. [`Arrivals`] takes, over all reads that a telegram
//! came in, the earliest departure of its first byte that fits the line's rate. [`TurnClock`] then follows the departures of
//! a laser's scans, which lie whole mirror turns apart. All is causal: a stamp uses what has arrived, nothing later.
//! Units: nanoseconds of the host's time; byte offsets since the port was opened. Model: `interfaces.md` section 2.

mod turn_clock;

pub use turn_clock::{Departure, TurnClock, TurnClockParams};

/// Bits that a byte takes on the line: start, eight data, stop.
const LINE_BITS_PER_BYTE: i64 = 10;
/// Reads that are remembered; a telegram that came in more reads is stamped from its last ones.
const REMEMBERED_READS: usize = 256;

/// How long one byte takes on the line, nanoseconds, at a rate in bits per second.
#[must_use]
pub fn byte_time_ns(baud: u32) -> i64 {
    LINE_BITS_PER_BYTE * 1_000_000_000 / i64::from(baud.max(1))
}

#[derive(Copy, Clone, Debug, Default)]
struct Read {
    end_offset: u64,
    time_ns: i64,
}

/// The latest reads of one port: up to which byte, and when.
#[derive(Clone, Debug)]
pub struct Arrivals {
    reads: Box<[Read; REMEMBERED_READS]>,
    pushed: usize,
}

impl Default for Arrivals {
    fn default() -> Self {
        Self { reads: Box::new([Read::default(); REMEMBERED_READS]), pushed: 0 }
    }
}

impl Arrivals {
    /// A read that returned at `time_ns` and brought the stream to `end_offset` bytes.
    pub fn push(&mut self, end_offset: u64, time_ns: i64) {
        if let Some(read) = self.reads.get_mut(self.pushed % REMEMBERED_READS) {
            *read = Read { end_offset, time_ns };
            self.pushed += 1;
        }
    }

    /// The earliest time at which the first byte of a telegram may have left the device: the smallest estimate over all
    /// reads that brought bytes of it. `None` when no such read is remembered.
    #[must_use]
    pub fn departure_ns(&self, offset: u64, length: usize, byte_ns: i64) -> Option<i64> {
        let end = offset.saturating_add(length as u64);
        let mut earliest = None;
        for back in 1..=self.pushed.min(REMEMBERED_READS) {
            let read = self.reads[(self.pushed - back) % REMEMBERED_READS];
            if read.end_offset <= offset {
                break;
            }
            let bytes = read.end_offset.min(end) - offset;
            let on_the_line_ns = byte_ns.saturating_mul(i64::try_from(bytes).unwrap_or(i64::MAX));
            let departure_ns = read.time_ns.saturating_sub(on_the_line_ns);
            earliest = Some(earliest.map_or(departure_ns, |other: i64| other.min(departure_ns)));
        }
        earliest
    }
}

#[cfg(test)]
mod tests;
