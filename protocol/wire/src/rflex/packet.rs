//! A whole packet as a view.

use super::emit::emit;
use super::framing::OVERHEAD;
use super::{Command, HEADER, Report, TRAILER, checksum};
use crate::WireError;
use crate::cursor::Reader;

/// One packet, its frame checked: header, length, checksum and trailer are good.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Packet<'a> {
    /// Which part of the base: 1 system, 2 motion, 3 joystick, 4 sonar, 5 digital inputs, 6 infrared.
    pub port: u8,
    /// 0 or 4 from the host; counts up from the base.
    pub id: u8,
    /// What the port is told or tells.
    pub opcode: u8,
    /// The data.
    pub data: &'a [u8],
}

impl<'a> Packet<'a> {
    /// Checks the frame of exactly one packet.
    ///
    /// # Errors
    /// Header, checksum or trailer are wrong, or there are too few or too many bytes.
    pub fn parse(bytes: &'a [u8]) -> Result<Self, WireError> {
        let mut reader = Reader::new(bytes, 0);
        for (offset, expected) in HEADER.into_iter().enumerate() {
            fixed(&mut reader, offset, expected)?;
        }
        let [port, id, opcode, length] = reader.array()?;
        let data = reader.take(usize::from(length))?;
        let offset = reader.offset();
        let found = u16::from(reader.u8()?);
        for (index, expected) in TRAILER.into_iter().enumerate() {
            fixed(&mut reader, offset + 1 + index, expected)?;
        }
        reader.end_with(())?;
        let expected = u16::from(checksum(&[port, id, opcode, length]) ^ checksum(data));
        if found != expected {
            return Err(WireError::Checksum { expected, found, offset });
        }
        Ok(Self { port, id, opcode, data })
    }

    /// What a host commands. Every packet is a command, if only [`Command::Raw`].
    pub fn command(&self) -> Command {
        Command::parse(self.port, self.opcode, self.data)
    }

    /// What a base reports.
    ///
    /// # Errors
    /// A known report has fields of a wrong shape.
    pub fn report(&self) -> Result<Report<'a>, WireError> {
        Report::parse(self.port, self.opcode, self.data)
    }

    /// Bytes of the whole packet.
    pub fn encoded_len(&self) -> usize {
        OVERHEAD + self.data.len()
    }

    /// Writes the whole packet and returns its length.
    ///
    /// # Errors
    /// `out` is too small, or the data is longer than a packet can hold.
    pub fn emit(&self, out: &mut [u8]) -> Result<usize, WireError> {
        emit(self.port, self.id, self.opcode, out, |writer| writer.bytes(self.data))
    }
}

fn fixed(reader: &mut Reader<'_>, offset: usize, expected: u8) -> Result<(), WireError> {
    match reader.u8()? {
        found if found == expected => Ok(()),
        found => Err(WireError::Byte { expected, found, offset }),
    }
}
