//! How LMS telegrams are found in a stream (telegram listing, section 4), once for each direction.

use super::frame::FRAME_OVERHEAD;
use super::{ACK, MAX_PARTS, MAX_VALUES, NAK, REPLY_BIT, STX, checksum};
use crate::framing::{Deframer, Framing, Measure};

/// Longest reply: ranges and remissions (F5h) of 401 values in five parts with index bytes. Half of it is the
/// longest that the listing's tables show.
pub const MAX_REPLY_BYTES: usize = FRAME_OVERHEAD + 1 + 2 + 6 * MAX_PARTS + 4 * MAX_VALUES + 2 + 1;
/// Longest reply of ranges alone: a sub-range of mean values (BFh) of all 401 values with index bytes.
const MAX_SCAN_BYTES: usize = FRAME_OVERHEAD + 1 + 7 + 2 * MAX_VALUES + 2 + 1;
/// Longest reply of an S14: 181 ranges, as many remissions, index bytes; with some reserve.
const MAX_S14_BYTES: usize = 640;
/// Longest request: the second half of a configuration (7Ch, 84 bytes) with some reserve.
pub const MAX_REQUEST_BYTES: usize = FRAME_OVERHEAD + 1 + 95;
/// Longest reply that holds no measured values; the longest known is the status with 160 bytes.
const MAX_SHORT_REPLY_BYTES: usize = 256;

/// Frames that a laser sends: address 80h to FFh.
#[derive(Clone, Copy, Debug)]
pub enum DeviceFraming {}

/// Frames that a host sends to a laser: address 00h to 7Fh.
#[derive(Clone, Copy, Debug)]
pub enum HostFraming {}

/// Deframer for what a laser sends; holds the longest telegram, and two of any other kind.
pub type DeviceDeframer = Deframer<DeviceFraming, 2048>;
/// Deframer for what a host sends to a laser.
pub type HostDeframer = Deframer<HostFraming, 512>;

impl Framing for DeviceFraming {
    const START: u8 = STX;
    const MAX_FRAME: usize = MAX_REPLY_BYTES;

    fn is_control(byte: u8) -> bool {
        byte == ACK || byte == NAK
    }

    fn measure(head: &[u8]) -> Measure {
        measure(head, REPLY_BIT, 2, |code| match code {
            0xB0 | 0xB6 | 0xB7 | 0xBF => MAX_SCAN_BYTES,
            0xBE | 0xF5 | 0xF6 => MAX_REPLY_BYTES,
            0xC4 => MAX_S14_BYTES,
            0x90..=0xFF => MAX_SHORT_REPLY_BYTES,
            _ => 0,
        })
    }

    fn is_intact(frame: &[u8]) -> bool {
        checksum_fits(frame)
    }
}

impl Framing for HostFraming {
    const START: u8 = STX;
    const MAX_FRAME: usize = MAX_REQUEST_BYTES;

    fn measure(head: &[u8]) -> Measure {
        measure(head, 0, 1, |code| match code {
            0x10..=0x7F => MAX_REQUEST_BYTES,
            _ => 0,
        })
    }

    fn is_intact(frame: &[u8]) -> bool {
        checksum_fits(frame)
    }
}

/// `longest` gives the longest whole frame of a code, 0 for a code that does not exist in this direction.
fn measure(head: &[u8], direction: u8, min_length: usize, longest: impl Fn(u8) -> usize) -> Measure {
    if head.get(1).is_some_and(|address| address & REPLY_BIT != direction) {
        return Measure::Noise;
    }
    let &[_, _, low, high, ref body @ ..] = head else {
        return Measure::Unknown;
    };
    let length = usize::from(u16::from_le_bytes([low, high]));
    let total = length + FRAME_OVERHEAD;
    if length < min_length || total > MAX_REPLY_BYTES {
        return Measure::BadLength;
    }
    match body.first() {
        None => Measure::Unknown,
        Some(&code) if total <= longest(code) => Measure::Frame(total),
        Some(_) => Measure::BadLength,
    }
}

fn checksum_fits(frame: &[u8]) -> bool {
    frame.split_last_chunk::<2>().is_some_and(|(bytes, &sent)| checksum(bytes) == u16::from_le_bytes(sent))
}
