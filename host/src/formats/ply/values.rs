//! The numbers of a PLY body, one after the other.

use super::header::{Element, Format, Scalar};
use crate::formats::ply::error::PlyError;

/// Hands out the body's numbers.
pub(crate) struct Values<'a> {
    format: Format,
    rest: &'a [u8],
}

/// Why there is no next number.
pub(crate) enum Lack {
    /// The file ends.
    End,
    /// A word is no number.
    Word(String),
}

impl Lack {
    /// The error for an element of the file.
    pub(crate) fn at(self, element: &Element, index: usize) -> PlyError {
        match self {
            Self::End => PlyError::Truncated { element: element.name.clone(), index, count: element.count },
            Self::Word(found) => PlyError::NotANumber { element: element.name.clone(), index, found },
        }
    }
}

impl<'a> Values<'a> {
    pub(crate) fn new(format: Format, body: &'a [u8]) -> Self {
        Self { format, rest: body }
    }

    /// Whether numbers have the bits of their type, not digits.
    pub(crate) fn are_binary(&self) -> bool {
        self.format != Format::Ascii
    }

    /// The next number, as the file's type says.
    pub(crate) fn next(&mut self, scalar: Scalar) -> Result<f64, Lack> {
        match self.format {
            Format::Ascii => self.word(),
            Format::LittleEndian | Format::BigEndian => match scalar {
                Scalar::I8 => self.bytes().map(|b| f64::from(i8::from_le_bytes(b))),
                Scalar::U8 => self.bytes().map(|b| f64::from(u8::from_le_bytes(b))),
                Scalar::I16 => self.bytes().map(|b| f64::from(i16::from_le_bytes(b))),
                Scalar::U16 => self.bytes().map(|b| f64::from(u16::from_le_bytes(b))),
                Scalar::I32 => self.bytes().map(|b| f64::from(i32::from_le_bytes(b))),
                Scalar::U32 => self.bytes().map(|b| f64::from(u32::from_le_bytes(b))),
                Scalar::F32 => self.bytes().map(|b| f64::from(f32::from_le_bytes(b))),
                Scalar::F64 => self.bytes().map(f64::from_le_bytes),
            },
        }
    }

    /// The next bytes, least significant first.
    fn bytes<const N: usize>(&mut self) -> Result<[u8; N], Lack> {
        let (first, rest) = self.rest.split_first_chunk::<N>().ok_or(Lack::End)?;
        self.rest = rest;
        let mut bytes = *first;
        if self.format == Format::BigEndian {
            bytes.reverse();
        }
        Ok(bytes)
    }

    fn word(&mut self) -> Result<f64, Lack> {
        let rest = self.rest.trim_ascii_start();
        let end = rest.iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len());
        let (word, after) = rest.split_at(end);
        if word.is_empty() {
            return Err(Lack::End);
        }
        self.rest = after;
        let text = String::from_utf8_lossy(word);
        text.parse().map_err(|_| Lack::Word(text.chars().take(40).collect()))
    }
}
