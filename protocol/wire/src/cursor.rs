//! Reading and writing fields one after the other, without a way to panic. Words are little-endian, those
//! named `be_` big-endian.
//!
//! The reader knows where its bytes stand in the telegram, so that its errors say so. The writer counts on
//! past the end of its buffer, so that one function both measures a telegram and emits it.

use crate::WireError;

/// Takes fields from the front of a slice.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Reader<'a> {
    rest: &'a [u8],
    offset: usize,
}

impl<'a> Reader<'a> {
    /// Reads `bytes`, whose first byte is byte `offset` of the telegram.
    pub(crate) fn new(bytes: &'a [u8], offset: usize) -> Self {
        Self { rest: bytes, offset }
    }

    /// Where the next field stands in the telegram.
    pub(crate) fn offset(&self) -> usize {
        self.offset
    }

    /// Bytes left.
    pub(crate) fn remaining(&self) -> usize {
        self.rest.len()
    }

    pub(crate) fn take(&mut self, count: usize) -> Result<&'a [u8], WireError> {
        let Some((field, rest)) = self.rest.split_at_checked(count) else {
            let found = self.offset + self.rest.len();
            return Err(WireError::TooShort { needed: self.offset + count, found });
        };
        self.rest = rest;
        self.offset += count;
        Ok(field)
    }

    pub(crate) fn array<const N: usize>(&mut self) -> Result<[u8; N], WireError> {
        let mut field = [0; N];
        field.copy_from_slice(self.take(N)?);
        Ok(field)
    }

    pub(crate) fn u8(&mut self) -> Result<u8, WireError> {
        self.array::<1>().map(|[byte]| byte)
    }

    pub(crate) fn u16(&mut self) -> Result<u16, WireError> {
        self.array().map(u16::from_le_bytes)
    }

    pub(crate) fn i16(&mut self) -> Result<i16, WireError> {
        self.array().map(i16::from_le_bytes)
    }

    pub(crate) fn i32(&mut self) -> Result<i32, WireError> {
        self.array().map(i32::from_le_bytes)
    }

    pub(crate) fn be_u16(&mut self) -> Result<u16, WireError> {
        self.array().map(u16::from_be_bytes)
    }

    pub(crate) fn be_u32(&mut self) -> Result<u32, WireError> {
        self.array().map(u32::from_be_bytes)
    }

    pub(crate) fn be_i32(&mut self) -> Result<i32, WireError> {
        self.array().map(i32::from_be_bytes)
    }

    /// Everything that is left.
    pub(crate) fn rest(&mut self) -> &'a [u8] {
        let rest = self.rest;
        self.offset += rest.len();
        self.rest = &[];
        rest
    }

    /// Accepts `value` only when nothing is left behind it.
    pub(crate) fn end_with<T>(&self, value: T) -> Result<T, WireError> {
        match self.rest.len() {
            0 => Ok(value),
            more => Err(WireError::TooLong { expected: self.offset, found: self.offset + more }),
        }
    }
}

/// Appends fields to a slice.
#[derive(Debug)]
pub(crate) struct Writer<'a> {
    out: &'a mut [u8],
    written: usize,
}

impl<'a> Writer<'a> {
    pub(crate) fn new(out: &'a mut [u8]) -> Self {
        Self { out, written: 0 }
    }

    /// Counts without writing.
    pub(crate) fn measure(write: impl FnOnce(&mut Writer<'_>)) -> usize {
        let mut writer = Writer::new(&mut []);
        write(&mut writer);
        writer.written
    }

    pub(crate) fn u8(&mut self, byte: u8) {
        self.bytes(&[byte]);
    }

    pub(crate) fn u16(&mut self, word: u16) {
        self.bytes(&word.to_le_bytes());
    }

    pub(crate) fn i16(&mut self, word: i16) {
        self.bytes(&word.to_le_bytes());
    }

    pub(crate) fn bytes(&mut self, bytes: &[u8]) {
        let end = self.written + bytes.len();
        if let Some(slot) = self.out.get_mut(self.written..end) {
            slot.copy_from_slice(bytes);
        }
        self.written = end;
    }

    /// The bytes written so far, or an error when they did not fit.
    pub(crate) fn finish(self) -> Result<&'a mut [u8], WireError> {
        let found = self.out.len();
        self.out.get_mut(..self.written).ok_or(WireError::BufferTooSmall { needed: self.written, found })
    }
}
