//! How packets are found in a stream: by start, length, checksum and trailer together.

use super::checksum;
use crate::framing;
use crate::framing::{Framing, Measure};

/// First two bytes of every packet.
pub const HEADER: [u8; 2] = [0x1B, 0x02];
/// Last two bytes of every packet.
pub const TRAILER: [u8; 2] = [0x1B, 0x03];
/// Most data bytes of a packet.
pub const MAX_DATA_BYTES: usize = 255;
/// Header, port, id, opcode and length in front of the data.
pub(crate) const DATA_OFFSET: usize = 6;
/// Everything but the data.
pub(crate) const OVERHEAD: usize = DATA_OFFSET + 3;
/// Longest packet that the length byte allows.
pub const MAX_PACKET_BYTES: usize = OVERHEAD + MAX_DATA_BYTES;

/// Packets of a base, in either direction.
#[derive(Clone, Copy, Debug)]
pub enum RflexFraming {}

/// Deframer for either end of a base's line.
pub type Deframer = framing::Deframer<RflexFraming, 1024>;

impl Framing for RflexFraming {
    const START: u8 = HEADER[0];
    const MAX_FRAME: usize = MAX_PACKET_BYTES;

    fn measure(head: &[u8]) -> Measure {
        match *head {
            [_, second, ..] if second != HEADER[1] => Measure::Noise,
            [_, _, _, _, _, length, ..] => Measure::Frame(OVERHEAD + usize::from(length)),
            _ => Measure::Unknown,
        }
    }

    fn is_intact(frame: &[u8]) -> bool {
        frame
            .get(HEADER.len()..)
            .and_then(|rest| rest.strip_suffix(&TRAILER))
            .and_then(|rest| rest.split_last())
            .is_some_and(|(sum, body)| checksum(body) == *sum)
    }
}
