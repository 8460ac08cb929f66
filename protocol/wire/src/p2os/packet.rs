//! A whole packet as a view.

use super::emit::{BODY_OFFSET, emit, framed_len};
use super::framing::MIN_LENGTH;
use super::{Command, HEADER, Report, checksum};
use crate::WireError;
use crate::cursor::{Reader, Writer};

/// One packet, its frame checked: header, length and checksum are good.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Packet<'a> {
    kind: u8,
    data: &'a [u8],
}

impl<'a> Packet<'a> {
    /// Checks the frame of exactly one packet.
    ///
    /// # Errors
    /// Header, length or checksum are wrong, or there are too few or too many bytes.
    pub fn parse(bytes: &'a [u8]) -> Result<Self, WireError> {
        let mut reader = Reader::new(bytes, 0);
        for (offset, expected) in HEADER.into_iter().enumerate() {
            let found = reader.u8()?;
            if found != expected {
                return Err(WireError::Byte { expected, found, offset });
            }
        }
        let length = reader.u8()?;
        if length < MIN_LENGTH {
            let (expected, found) = (usize::from(MIN_LENGTH), usize::from(length));
            return Err(WireError::LengthField { expected, found, offset: 2 });
        }
        let body = reader.take(usize::from(length) - 2)?;
        let offset = reader.offset();
        let sent: [u8; 2] = reader.array()?;
        reader.end_with(())?;
        let (found, expected) = (u16::from_be_bytes(sent), checksum(body));
        if found != expected {
            return Err(WireError::Checksum { expected, found, offset });
        }
        let mut reader = Reader::new(body, BODY_OFFSET);
        Ok(Self { kind: reader.u8()?, data: reader.rest() })
    }

    /// First byte of the body: the command's number, or the report's type.
    pub fn kind(&self) -> u8 {
        self.kind
    }

    /// The body behind its first byte.
    pub fn data(&self) -> &'a [u8] {
        self.data
    }

    /// What a host commands. Every packet is a command, if only [`Command::Raw`].
    pub fn command(&self) -> Command {
        Command::parse(self.kind, self.data)
    }

    /// What a base reports.
    ///
    /// # Errors
    /// A known report has fields of a wrong shape.
    pub fn report(&self) -> Result<Report<'a>, WireError> {
        Report::parse(self.kind, self.data)
    }

    /// Bytes of the whole packet.
    pub fn encoded_len(&self) -> usize {
        framed_len(|writer| self.write(writer))
    }

    /// Writes the packet and returns its length.
    ///
    /// # Errors
    /// `out` is too small.
    pub fn emit(&self, out: &mut [u8]) -> Result<usize, WireError> {
        emit(out, |writer| self.write(writer))
    }

    fn write(&self, writer: &mut Writer<'_>) {
        writer.u8(self.kind);
        writer.bytes(self.data);
    }
}
