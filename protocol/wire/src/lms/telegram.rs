//! A whole telegram as a view: any code, known or not.

use super::frame::FRAME_OVERHEAD;
use super::{REPLY_BIT, Reply, Request, STX, Status, checksum, frame};
use crate::WireError;
use crate::cursor::Reader;

/// One telegram, its frame checked: start byte, length and checksum are good. `Copy`, borrows the bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Telegram<'a> {
    address: u8,
    code: u8,
    data: &'a [u8],
    status: Option<Status>,
}

impl<'a> Telegram<'a> {
    /// Checks the frame of exactly one telegram.
    ///
    /// # Errors
    /// The start byte, the length or the checksum is wrong, or there are too few or too many bytes.
    pub fn parse(bytes: &'a [u8]) -> Result<Self, WireError> {
        let mut reader = Reader::new(bytes, 0);
        let start = reader.u8()?;
        if start != STX {
            return Err(WireError::Byte { expected: STX, found: start, offset: 0 });
        }
        let address = reader.u8()?;
        let is_reply = address & REPLY_BIT != 0;
        let length = usize::from(reader.u16()?);
        let shortest = if is_reply { 2 } else { 1 };
        if length < shortest {
            return Err(WireError::LengthField { expected: shortest, found: length, offset: 2 });
        }
        if bytes.len() < length + FRAME_OVERHEAD {
            return Err(WireError::TooShort { needed: length + FRAME_OVERHEAD, found: bytes.len() });
        }
        let code = reader.u8()?;
        let data = reader.take(length - shortest)?;
        let status = if is_reply { Some(Status(reader.u8()?)) } else { None };
        let offset = reader.offset();
        let found = reader.u16()?;
        reader.end_with(())?;
        let expected = checksum(bytes.get(..offset).unwrap_or(bytes));
        if found != expected {
            return Err(WireError::Checksum { expected, found, offset });
        }
        Ok(Self { address, code, data, status })
    }

    /// Address byte; bit 7 is set in replies.
    pub fn address(&self) -> u8 {
        self.address
    }

    /// Command of a request, or command + 80h of a reply.
    pub fn code(&self) -> u8 {
        self.code
    }

    /// Everything between the code and the status (or checksum).
    pub fn data(&self) -> &'a [u8] {
        self.data
    }

    /// Status byte; requests have none.
    pub fn status(&self) -> Option<Status> {
        self.status
    }

    /// What the host asks.
    ///
    /// # Errors
    /// The telegram is a reply, or a known command has fields of a wrong shape.
    pub fn request(&self) -> Result<Request, WireError> {
        match self.status {
            None => Request::parse(self.code, self.data),
            Some(_) => Err(WireError::Direction { expect_reply: false, found: self.address }),
        }
    }

    /// What the device says.
    ///
    /// # Errors
    /// The telegram is a request, or a known reply has fields of a wrong shape.
    pub fn reply(&self) -> Result<Reply<'a>, WireError> {
        match self.status {
            Some(_) => Reply::parse(self.code, self.data),
            None => Err(WireError::Direction { expect_reply: true, found: self.address }),
        }
    }

    /// Bytes of the whole telegram.
    pub fn encoded_len(&self) -> usize {
        FRAME_OVERHEAD + 1 + self.data.len() + usize::from(self.status.is_some())
    }

    /// Writes the telegram and returns its length.
    ///
    /// # Errors
    /// `out` is too small.
    pub fn emit(&self, out: &mut [u8]) -> Result<usize, WireError> {
        frame::emit(out, self.address, self.status, |writer| {
            writer.u8(self.code);
            writer.bytes(self.data);
        })
    }
}
