//! Fields of a telegram's data one after the other, the same for both dialects.

use super::telegram::Dialect;
use crate::WireError;
use crate::cursor::{Reader, Writer};

/// Takes fields from data.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Fields<'a> {
    dialect: Dialect,
    reader: Reader<'a>,
    /// The blank in front of the next token was already taken: that behind the name.
    is_first: bool,
}

impl<'a> Fields<'a> {
    /// Of data whose first byte is byte `offset` of the telegram.
    pub(crate) fn new(dialect: Dialect, data: &'a [u8], offset: usize) -> Self {
        Self { dialect, reader: Reader::new(data, offset), is_first: true }
    }

    pub(crate) fn dialect(&self) -> Dialect {
        self.dialect
    }

    pub(crate) fn offset(&self) -> usize {
        self.reader.offset()
    }

    /// Whether nothing is left.
    pub(crate) fn is_over(&self) -> bool {
        self.reader.remaining() == 0
    }

    pub(crate) fn end_with<T>(&self, value: T) -> Result<T, WireError> {
        self.reader.end_with(value)
    }

    fn blank(&mut self) -> Result<(), WireError> {
        if core::mem::take(&mut self.is_first) {
            return Ok(());
        }
        let offset = self.reader.offset();
        match self.reader.u8()? {
            b' ' => Ok(()),
            found => Err(WireError::Byte { expected: b' ', found, offset }),
        }
    }

    /// The next token of CoLa A.
    fn token(&mut self) -> Result<(&'a [u8], usize), WireError> {
        self.blank()?;
        let offset = self.reader.offset();
        let mut ahead = self.reader;
        let rest = ahead.rest();
        let length = rest.iter().position(|&byte| byte == b' ').unwrap_or(rest.len());
        match length {
            0 => Err(WireError::TooShort { needed: offset + 1, found: offset }),
            _ => Ok((self.reader.take(length)?, offset)),
        }
    }

    /// A number of CoLa A as the bits of 32, and whether it came with a sign.
    fn number(&mut self, field: &'static str) -> Result<(i64, usize), WireError> {
        let (token, offset) = self.token()?;
        let (digits, radix, sign) = match token {
            [b'+', digits @ ..] => (digits, 10, 1),
            [b'-', digits @ ..] => (digits, 10, -1),
            digits => (digits, 16, 1),
        };
        let refuse = |found| WireError::Value { field, found, offset };
        if digits.is_empty() || digits.len() > 10 {
            return Err(refuse(u32::try_from(token.len()).unwrap_or(u32::MAX)));
        }
        let mut value = 0_i64;
        for &digit in digits {
            let found = char::from(digit).to_digit(radix).ok_or_else(|| refuse(u32::from(digit)))?;
            value = value * i64::from(radix) + i64::from(found);
        }
        Ok((value * sign, offset))
    }

    fn ranged(&mut self, field: &'static str, max: u32) -> Result<u32, WireError> {
        let (value, offset) = self.number(field)?;
        let found = value.clamp(0, i64::from(u32::MAX)) as u32;
        if value < 0 || value > i64::from(max) {
            return Err(WireError::Value { field, found, offset });
        }
        Ok(found)
    }

    pub(crate) fn u8(&mut self, field: &'static str) -> Result<u8, WireError> {
        match self.dialect {
            Dialect::A => self.ranged(field, u32::from(u8::MAX)).map(|value| value as u8),
            Dialect::B => self.reader.u8(),
        }
    }

    pub(crate) fn u16(&mut self, field: &'static str) -> Result<u16, WireError> {
        match self.dialect {
            Dialect::A => self.ranged(field, u32::from(u16::MAX)).map(|value| value as u16),
            Dialect::B => self.reader.be_u16(),
        }
    }

    pub(crate) fn u32(&mut self, field: &'static str) -> Result<u32, WireError> {
        match self.dialect {
            Dialect::A => self.ranged(field, u32::MAX),
            Dialect::B => self.reader.be_u32(),
        }
    }

    /// Signed; in hex the two's complement of 32 bits.
    pub(crate) fn i32(&mut self, field: &'static str) -> Result<i32, WireError> {
        if self.dialect == Dialect::B {
            return self.reader.be_i32();
        }
        let (value, offset) = self.number(field)?;
        if value < i64::from(i32::MIN) || value > i64::from(u32::MAX) {
            return Err(WireError::Value { field, found: u32::MAX, offset });
        }
        Ok(value as u32 as i32)
    }

    pub(crate) fn f32(&mut self, field: &'static str) -> Result<f32, WireError> {
        self.u32(field).map(f32::from_bits)
    }

    /// Two bytes that belong together, the low one first; two tokens.
    pub(crate) fn pair(&mut self, field: &'static str) -> Result<[u8; 2], WireError> {
        Ok([self.u8(field)?, self.u8(field)?])
    }

    /// So many bytes of text, whatever is in them.
    pub(crate) fn text(&mut self, count: usize) -> Result<&'a [u8], WireError> {
        if self.dialect == Dialect::A {
            self.blank()?;
        }
        self.reader.take(count)
    }

    /// A text of known length.
    pub(crate) fn letters<const N: usize>(&mut self) -> Result<[u8; N], WireError> {
        let mut letters = [0; N];
        letters.copy_from_slice(self.text(N)?);
        Ok(letters)
    }

    /// The bytes or the text of so many numbers of `width` bytes each, every one of them checked.
    pub(crate) fn numbers(&mut self, count: usize, width: usize) -> Result<&'a [u8], WireError> {
        if self.dialect == Dialect::B {
            return self.reader.take(count * width);
        }
        let (mut all, start) = (self.reader, self.reader.offset());
        for _ in 0..count {
            match width {
                1 => self.u8("value").map(drop)?,
                _ => self.u16("value").map(drop)?,
            }
        }
        all.take(self.reader.offset() - start)
    }
}

/// Appends fields to data.
#[derive(Debug)]
pub(crate) struct FieldWriter<'a> {
    dialect: Dialect,
    writer: Writer<'a>,
    is_first: bool,
}

impl<'a> FieldWriter<'a> {
    pub(crate) fn new(dialect: Dialect, out: &'a mut [u8]) -> Self {
        Self { dialect, writer: Writer::new(out), is_first: true }
    }

    pub(crate) fn finish(self) -> Result<usize, WireError> {
        self.writer.finish().map(|written| written.len())
    }

    fn blank(&mut self) {
        if !core::mem::take(&mut self.is_first) {
            self.writer.u8(b' ');
        }
    }

    /// Hex without leading zeros.
    fn hex(&mut self, value: u32) {
        self.blank();
        let digits = (8 - value.leading_zeros() / 4).max(1);
        for place in (0..digits).rev() {
            let digit = char::from_digit(value >> (4 * place) & 0xF, 16).unwrap_or('0');
            self.writer.u8(digit.to_ascii_uppercase() as u8);
        }
    }

    pub(crate) fn u8(&mut self, value: u8) {
        match self.dialect {
            Dialect::A => self.hex(u32::from(value)),
            Dialect::B => self.writer.u8(value),
        }
    }

    pub(crate) fn u16(&mut self, value: u16) {
        match self.dialect {
            Dialect::A => self.hex(u32::from(value)),
            Dialect::B => self.writer.bytes(&value.to_be_bytes()),
        }
    }

    pub(crate) fn u32(&mut self, value: u32) {
        match self.dialect {
            Dialect::A => self.hex(value),
            Dialect::B => self.writer.bytes(&value.to_be_bytes()),
        }
    }

    /// A float has all its eight digits.
    pub(crate) fn f32(&mut self, value: f32) {
        let bits = value.to_bits();
        if self.dialect == Dialect::B {
            return self.u32(bits);
        }
        self.blank();
        for place in (0..8).rev() {
            let digit = char::from_digit(bits >> (4 * place) & 0xF, 16).unwrap_or('0');
            self.writer.u8(digit.to_ascii_uppercase() as u8);
        }
    }

    pub(crate) fn pair(&mut self, [low, high]: [u8; 2]) {
        self.u8(low);
        self.u8(high);
    }

    pub(crate) fn text(&mut self, text: &[u8]) {
        if self.dialect == Dialect::A {
            self.blank();
        }
        self.writer.bytes(text);
    }
}
