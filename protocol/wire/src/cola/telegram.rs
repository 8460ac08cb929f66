//! A whole telegram as a view: kind, name, and what follows.

use super::framing::{BODY_OFFSET, END, OVERHEAD, START, checksum};
use super::kind::{KIND_BYTES, Kind};
use crate::WireError;
use crate::cursor::{Reader, Writer};

/// How a telegram is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Dialect {
    /// CoLa A: text.
    A,
    /// CoLa B: binary.
    B,
}

/// One telegram, its frame checked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Telegram<'a> {
    /// How it is written.
    pub dialect: Dialect,
    /// What it asks or answers.
    pub kind: Kind,
    /// The variable, method or event; empty in a refusal.
    pub name: &'a [u8],
    /// What follows the name: bytes in CoLa B, text in CoLa A. `None` where not even a blank does; devices
    /// answer with the blank, clients ask without.
    pub data: Option<&'a [u8]>,
}

impl<'a> Telegram<'a> {
    /// Checks the frame of exactly one telegram.
    ///
    /// # Errors
    /// Start, length, checksum, end or kind are wrong, or there are too few or too many bytes.
    pub fn parse(bytes: &'a [u8]) -> Result<Self, WireError> {
        if bytes.get(1) == Some(&START) { Self::parse_binary(bytes) } else { Self::parse_text(bytes) }
    }

    fn parse_binary(bytes: &'a [u8]) -> Result<Self, WireError> {
        let mut reader = Reader::new(bytes, 0);
        for offset in 0..4 {
            fixed(reader.u8()?, START, offset)?;
        }
        let length = reader.be_u32()? as usize;
        if length < KIND_BYTES {
            return Err(WireError::LengthField { expected: KIND_BYTES, found: length, offset: 4 });
        }
        if length > bytes.len() {
            return Err(WireError::TooShort { needed: length.saturating_add(OVERHEAD), found: bytes.len() });
        }
        let body = reader.take(length)?;
        let offset = reader.offset();
        let found = u16::from(reader.u8()?);
        reader.end_with(())?;
        let expected = u16::from(checksum(body));
        if found != expected {
            return Err(WireError::Checksum { expected, found, offset });
        }
        Self::of_body(Dialect::B, body, BODY_OFFSET)
    }

    fn parse_text(bytes: &'a [u8]) -> Result<Self, WireError> {
        let mut reader = Reader::new(bytes, 0);
        fixed(reader.u8()?, START, 0)?;
        let body = reader.rest();
        let needed = bytes.len() + 1;
        let Some(end) = body.iter().position(|&byte| byte < b' ') else {
            return Err(WireError::TooShort { needed, found: bytes.len() });
        };
        fixed(body[end], END, end + 1)?;
        if end + 1 < body.len() {
            return Err(WireError::TooLong { expected: end + 2, found: bytes.len() });
        }
        Self::of_body(Dialect::A, &body[..end], 1)
    }

    fn of_body(dialect: Dialect, body: &'a [u8], offset: usize) -> Result<Self, WireError> {
        let Some((start, rest)) = body.split_first_chunk::<KIND_BYTES>() else {
            return Err(WireError::TooShort { needed: offset + KIND_BYTES, found: offset + body.len() });
        };
        let [a, b, c] = start.map(u32::from);
        let unknown = WireError::Value { field: "kind", found: a << 16 | b << 8 | c, offset };
        let kind = *Kind::ALL.iter().find(|kind| kind.bytes() == start).ok_or(unknown)?;
        if kind == Kind::Error && dialect == Dialect::B {
            return Ok(Self { dialect, kind, name: &[], data: Some(rest) });
        }
        let Some((&b' ', rest)) = rest.split_first() else {
            let found = rest.first().copied().map_or(0, u32::from);
            return Err(WireError::Value {
                field: "byte behind the kind",
                found,
                offset: offset + KIND_BYTES,
            });
        };
        if kind == Kind::Error {
            return Ok(Self { dialect, kind, name: &[], data: Some(rest) });
        }
        let name = rest.split(|&byte| byte == b' ').next().unwrap_or_default();
        let data = rest.get(name.len() + 1..);
        Ok(Self { dialect, kind, name, data })
    }

    /// The first byte of the data, counted from the telegram's.
    pub(crate) fn data_offset(&self) -> usize {
        let start = match self.dialect {
            Dialect::A => 1,
            Dialect::B => BODY_OFFSET,
        };
        start + self.head_bytes() + usize::from(self.kind != Kind::Error && self.data.is_some())
    }

    /// Kind and name with the blank between them, where there is one.
    fn head_bytes(&self) -> usize {
        match (self.kind, self.dialect) {
            (Kind::Error, Dialect::B) => KIND_BYTES,
            _ => KIND_BYTES + 1 + self.name.len(),
        }
    }

    fn body_bytes(&self) -> usize {
        let blank = usize::from(self.kind != Kind::Error);
        self.head_bytes() + self.data.map_or(0, |data| blank + data.len())
    }

    /// The code of a refusal.
    #[must_use]
    pub fn error_code(&self) -> Option<u16> {
        let data = self.data.filter(|_| self.kind == Kind::Error)?;
        match self.dialect {
            Dialect::B => data.try_into().ok().map(u16::from_be_bytes),
            Dialect::A => u16::from_str_radix(core::str::from_utf8(data).ok()?, 16).ok(),
        }
    }

    /// Bytes of the whole telegram.
    #[must_use]
    pub fn encoded_len(&self) -> usize {
        match self.dialect {
            Dialect::A => self.body_bytes() + 2,
            Dialect::B => self.body_bytes() + OVERHEAD,
        }
    }

    /// Writes the whole telegram and returns its length.
    ///
    /// # Errors
    /// `out` is too small.
    pub fn emit(&self, out: &mut [u8]) -> Result<usize, WireError> {
        let mut writer = Writer::new(out);
        writer.u8(START);
        if self.dialect == Dialect::B {
            writer.bytes(&[START; 3]);
            writer.bytes(&(self.body_bytes() as u32).to_be_bytes());
        }
        writer.bytes(self.kind.bytes());
        if self.kind != Kind::Error || self.dialect == Dialect::A {
            writer.u8(b' ');
        }
        writer.bytes(self.name);
        if let Some(data) = self.data {
            if self.kind != Kind::Error {
                writer.u8(b' ');
            }
            writer.bytes(data);
        }
        // The place of checksum or end.
        writer.u8(END);
        let written = writer.finish()?;
        if self.dialect == Dialect::B
            && let Some((sum, rest)) = written.split_last_mut()
        {
            *sum = checksum(rest.get(BODY_OFFSET..).unwrap_or_default());
        }
        Ok(written.len())
    }
}

fn fixed(found: u8, expected: u8, offset: usize) -> Result<(), WireError> {
    if found == expected { Ok(()) } else { Err(WireError::Byte { expected, found, offset }) }
}
