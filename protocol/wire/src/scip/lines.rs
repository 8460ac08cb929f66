//! Lines of a reply: `KEY:value;` with a sum, or up to 64 characters of numbers with a sum.

use super::numbers::{encode, sum};
use crate::WireError;
use crate::cursor::Writer;

/// Characters of a whole line of numbers, without its sum.
pub(crate) const LINE_CHARACTERS: usize = 64;
/// Characters of a clock.
pub(crate) const CLOCK_CHARACTERS: usize = 4;
/// Longest line of a key and its value; the longest known has 70 bytes.
pub(crate) const MAX_KEY_LINE_BYTES: usize = 128;

/// A line of a reply to `VV`, `PP` or `II`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct KeyValue<'a> {
    /// Four letters.
    pub key: &'a [u8],
    /// What the device says.
    pub value: &'a [u8],
}

impl<'a> KeyValue<'a> {
    /// Reads a line without its line feed; `None` when it is none, or its sum is wrong. A value may hold `;`.
    /// Real devices leave the last `;` out of the sum; some are said to count it.
    pub(crate) fn parse(line: &'a [u8]) -> Option<Self> {
        let (&found, rest) = line.split_last()?;
        let text = rest.strip_suffix(b";")?;
        if found != sum(text) && found != sum(rest) {
            return None;
        }
        let colon = text.iter().position(|&byte| byte == b':')?;
        Some(Self { key: &text[..colon], value: &text[colon + 1..] })
    }
}

/// Writes lines of keys with their values, and returns their length.
///
/// # Errors
/// `out` is too small.
pub fn emit_key_values(lines: &[KeyValue<'_>], out: &mut [u8]) -> Result<usize, WireError> {
    let mut writer = Writer::new(out);
    for KeyValue { key, value } in lines {
        let all = [*key, b":", value].into_iter().flatten().fold(0_u8, |all, &byte| all.wrapping_add(byte));
        for part in [key, &b":"[..], value, b";", &[sum(&[all])], b"\n"] {
            writer.bytes(part);
        }
    }
    writer.finish().map(|written| written.len())
}

/// Writes the line of a clock, and returns its length.
///
/// # Errors
/// `out` is too small.
pub fn emit_clock(clock_ms: u32, out: &mut [u8]) -> Result<usize, WireError> {
    let mut writer = Writer::new(out);
    write_clock(&mut writer, clock_ms);
    writer.finish().map(|written| written.len())
}

pub(crate) fn write_clock(writer: &mut Writer<'_>, clock_ms: u32) {
    let characters: [u8; CLOCK_CHARACTERS] = encode(clock_ms);
    writer.bytes(&characters);
    writer.bytes(&[sum(&characters), b'\n']);
}

/// Writes characters as lines of numbers.
#[derive(Debug)]
pub(crate) struct NumberLines<'a, 'b> {
    writer: &'a mut Writer<'b>,
    characters: usize,
    total: u8,
}

impl<'a, 'b> NumberLines<'a, 'b> {
    pub(crate) fn new(writer: &'a mut Writer<'b>) -> Self {
        Self { writer, characters: 0, total: 0 }
    }

    pub(crate) fn push(&mut self, characters: &[u8]) {
        for &character in characters {
            if self.characters == LINE_CHARACTERS {
                self.end_line();
            }
            self.writer.u8(character);
            self.characters += 1;
            self.total = self.total.wrapping_add(character);
        }
    }

    /// Ends the last line.
    pub(crate) fn finish(mut self) {
        if self.characters > 0 {
            self.end_line();
        }
    }

    fn end_line(&mut self) {
        self.writer.bytes(&[sum(&[self.total]), b'\n']);
        (self.characters, self.total) = (0, 0);
    }
}

/// The characters of lines of numbers one after the other, without sums and line feeds.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Characters<'a> {
    lines: &'a [u8],
}

impl<'a> Characters<'a> {
    pub(crate) fn of(lines: &'a [u8]) -> Self {
        Self { lines }
    }
}

impl Iterator for Characters<'_> {
    type Item = u8;

    fn next(&mut self) -> Option<u8> {
        loop {
            match *self.lines {
                [_sum, b'\n', ref rest @ ..] => self.lines = rest,
                [character, ref rest @ ..] => {
                    self.lines = rest;
                    return Some(character);
                }
                [] => return None,
            }
        }
    }
}
