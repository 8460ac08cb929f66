//! A whole message as a view.

use super::emit::{emit, message_bytes};
use super::framing::{DATA_OFFSET, EXTENDED, MAX_DATA_BYTES, MIN_EXTENDED_BYTES};
use super::{Command, PREAMBLE, Report, checksum};
use crate::WireError;
use crate::cursor::Reader;

/// One message, its frame checked: preamble, length and checksum are good.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Message<'a> {
    /// Message identifier.
    pub mid: u8,
    /// The data.
    pub data: &'a [u8],
}

impl<'a> Message<'a> {
    /// Checks the frame of exactly one message.
    ///
    /// # Errors
    /// Preamble, length or checksum are wrong, or there are too few or too many bytes.
    pub fn parse(bytes: &'a [u8]) -> Result<Self, WireError> {
        let mut reader = Reader::new(bytes, 0);
        for (offset, expected) in PREAMBLE.into_iter().enumerate() {
            let found = reader.u8()?;
            if found != expected {
                return Err(WireError::Byte { expected, found, offset });
            }
        }
        let mid = reader.u8()?;
        let length = length(&mut reader)?;
        let data = reader.take(length)?;
        let offset = reader.offset();
        let found = u16::from(reader.u8()?);
        reader.end_with(())?;
        let expected = u16::from(checksum(bytes.get(1..offset).unwrap_or_default()));
        if found != expected {
            return Err(WireError::Checksum { expected, found, offset });
        }
        Ok(Self { mid, data })
    }

    /// What a host asks. Every message is a command, if only [`Command::Raw`].
    ///
    /// # Errors
    /// A known command has fields of a wrong shape, or too much data to be kept.
    pub fn command(&self) -> Result<Command, WireError> {
        Command::parse(self.mid, self.data)
    }

    /// What a unit says.
    ///
    /// # Errors
    /// A known report has fields of a wrong shape.
    pub fn report(&self) -> Result<Report<'a>, WireError> {
        Report::parse(self.mid, self.data)
    }

    /// Bytes of the whole message.
    pub fn encoded_len(&self) -> usize {
        message_bytes(self.data.len())
    }

    /// Writes the whole message and returns its length.
    ///
    /// # Errors
    /// `out` is too small, or the data is longer than a message can hold.
    pub fn emit(&self, out: &mut [u8]) -> Result<usize, WireError> {
        emit(self.mid, out, |writer| writer.bytes(self.data))
    }
}

fn length(reader: &mut Reader<'_>) -> Result<usize, WireError> {
    match reader.u8()? {
        EXTENDED => {}
        length => return Ok(usize::from(length)),
    }
    let found = usize::from(reader.be_u16()?);
    if found < MIN_EXTENDED_BYTES {
        return Err(WireError::LengthField { expected: MIN_EXTENDED_BYTES, found, offset: DATA_OFFSET });
    }
    if found > MAX_DATA_BYTES {
        let limit = MAX_DATA_BYTES;
        return Err(WireError::Capacity { field: "data", limit, found, offset: DATA_OFFSET });
    }
    Ok(found)
}
