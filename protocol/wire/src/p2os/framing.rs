//! How packets are found in a stream.

use super::checksum;
use crate::framing;
use crate::framing::{Framing, Measure};

/// First two bytes of every packet.
pub const HEADER: [u8; 2] = [0xFA, 0xFB];
/// Longest packet that the length byte allows.
pub const MAX_PACKET_BYTES: usize = 3 + 255;
/// Shortest value of the length byte: one byte of body.
pub(crate) const MIN_LENGTH: u8 = 3;

/// Packets of a base, in either direction.
#[derive(Clone, Copy, Debug)]
pub enum P2osFraming {}

/// Deframer for either end of a base's line.
pub type Deframer = framing::Deframer<P2osFraming, 1024>;

impl Framing for P2osFraming {
    const START: u8 = HEADER[0];
    const MAX_FRAME: usize = MAX_PACKET_BYTES;

    fn measure(head: &[u8]) -> Measure {
        match *head {
            [_, second, ..] if second != HEADER[1] => Measure::Noise,
            [_, _, length, ..] if length < MIN_LENGTH => Measure::BadLength,
            [_, _, length, ..] => Measure::Frame(3 + usize::from(length)),
            _ => Measure::Unknown,
        }
    }

    fn is_intact(frame: &[u8]) -> bool {
        frame
            .get(3..)
            .and_then(|rest| rest.split_last_chunk::<2>())
            .is_some_and(|(body, &sent)| checksum(body) == u16::from_be_bytes(sent))
    }
}
