//! `std_msgs/msg/UInt8MultiArray`: bytes as they came from a serial line, one message a read.

use super::Message;
use crate::messages::cdr::{CdrError, Decoder, Encoder};

/// Bytes. The ROS type's layout is empty in what we write and passed over in what we read.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct ByteArray {
    /// The bytes.
    pub data: Vec<u8>,
}

/// The least bytes a dimension of the layout takes: an empty string and two numbers.
const DIMENSION_MIN_SIZE: usize = 4 + 8;

impl ByteArray {
    /// Encodes bytes as such a message without owning them; replaces what is in `out` and keeps its memory.
    pub fn encode_slice(data: &[u8], out: &mut Vec<u8>) {
        write_slice(data, &mut Encoder::new(out));
    }
}

fn write_slice(data: &[u8], encoder: &mut Encoder) {
    encoder.count(0);
    encoder.u32(0);
    encoder.byte_sequence(data);
}

impl Message for ByteArray {
    const TYPE: &'static str = "std_msgs/msg/UInt8MultiArray";

    fn write(&self, encoder: &mut Encoder) {
        write_slice(&self.data, encoder);
    }

    fn read(decoder: &mut Decoder) -> Result<Self, CdrError> {
        for _ in 0..decoder.count(DIMENSION_MIN_SIZE)? {
            decoder.string()?;
            decoder.u32()?;
            decoder.u32()?;
        }
        decoder.u32()?;
        Ok(Self { data: decoder.byte_sequence()?.to_vec() })
    }
}
