//! How messages are found in a stream: by preamble, length and checksum together.

use super::checksum;
use crate::framing;
use crate::framing::{Framing, Measure};

/// First two bytes of every message: preamble and bus address of a unit that is alone on its line.
pub const PREAMBLE: [u8; 2] = [0xFA, 0xFF];
/// Most data bytes of a message.
pub const MAX_DATA_BYTES: usize = 2048;
/// From so many data bytes on, the length is extended.
pub const MIN_EXTENDED_BYTES: usize = 255;
/// This length announces an extended one.
pub(crate) const EXTENDED: u8 = 0xFF;
/// Preamble, address, message identifier and length in front of the data.
pub(crate) const DATA_OFFSET: usize = 4;
/// The same with an extended length.
pub(crate) const EXTENDED_DATA_OFFSET: usize = 6;
/// Longest message.
pub const MAX_MESSAGE_BYTES: usize = EXTENDED_DATA_OFFSET + MAX_DATA_BYTES + 1;

/// Messages of a unit, in either direction.
#[derive(Clone, Copy, Debug)]
pub enum XsensFraming {}

/// Deframer for either end of a unit's line.
pub type Deframer = framing::Deframer<XsensFraming, 4096>;

impl Framing for XsensFraming {
    const START: u8 = PREAMBLE[0];
    const MAX_FRAME: usize = MAX_MESSAGE_BYTES;

    fn measure(head: &[u8]) -> Measure {
        match *head {
            [_, second, ..] if second != PREAMBLE[1] => Measure::Noise,
            [_, _, _, EXTENDED, high, low, ..] => {
                match usize::from(u16::from_be_bytes([high, low])) {
                    // What fits a plain length has one.
                    length if (MIN_EXTENDED_BYTES..=MAX_DATA_BYTES).contains(&length) => {
                        Measure::Frame(EXTENDED_DATA_OFFSET + length + 1)
                    }
                    _ => Measure::BadLength,
                }
            }
            [_, _, _, length, ..] if length != EXTENDED => {
                Measure::Frame(DATA_OFFSET + usize::from(length) + 1)
            }
            _ => Measure::Unknown,
        }
    }

    fn is_intact(frame: &[u8]) -> bool {
        frame.get(1..).is_some_and(|rest| checksum(rest) == 0)
    }
}
