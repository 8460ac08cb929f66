//! A scan: the clock at step 0 of its turn, and a value a step.

use super::block::{Block, Body};
use super::command::{Command, ScanRequest};
use super::lines::{CLOCK_CHARACTERS, Characters, NumberLines, write_clock};
use super::numbers::{decode, encode, six_bits};
use crate::WireError;
use crate::cursor::Writer;

/// Characters of a range and of an intensity.
const VALUE_CHARACTERS: usize = 3;
/// Stands before a further echo of the same step.
const FURTHER: u8 = b'&';

/// A value of a scan.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct Reading {
    /// Whether it is a further echo of the step before; echoes come from the nearest on.
    pub is_further: bool,
    /// Range in mm; below the device's shortest range it is a code. 18 bits.
    pub range_mm: u32,
    /// Intensity in the device's units, where it is sent. 18 bits.
    pub intensity: Option<u32>,
}

/// Values of a scan, as they came or to be sent.
#[derive(Clone, Copy, Debug)]
pub enum Values<'a> {
    /// Of a reply: its lines, checked.
    Received {
        /// Lines with their sums and line feeds.
        lines: &'a [u8],
        /// Whether each range comes with its intensity.
        with_intensity: bool,
    },
    /// To be sent.
    Numbers(&'a [Reading]),
}

impl<'a> Values<'a> {
    /// One by one.
    #[must_use]
    pub fn iter(&self) -> Readings<'a> {
        match *self {
            Self::Received { lines, with_intensity } => {
                Readings { characters: Characters::of(lines), with_intensity, numbers: &[] }
            }
            Self::Numbers(numbers) => {
                Readings { characters: Characters::of(&[]), with_intensity: false, numbers }
            }
        }
    }
}

impl<'a> IntoIterator for &Values<'a> {
    type Item = Reading;
    type IntoIter = Readings<'a>;

    fn into_iter(self) -> Readings<'a> {
        self.iter()
    }
}

/// Walks through values.
#[derive(Clone, Copy, Debug)]
pub struct Readings<'a> {
    characters: Characters<'a>,
    with_intensity: bool,
    numbers: &'a [Reading],
}

impl Readings<'_> {
    /// Three characters as a number, of which the first is known.
    fn number(&mut self, first: u8) -> Option<u32> {
        let rest = [first, self.characters.next()?, self.characters.next()?];
        decode(&rest)
    }
}

impl Iterator for Readings<'_> {
    type Item = Reading;

    fn next(&mut self) -> Option<Reading> {
        if let Some((first, rest)) = self.numbers.split_first() {
            self.numbers = rest;
            return Some(*first);
        }
        let mut character = self.characters.next()?;
        let is_further = character == FURTHER;
        if is_further {
            character = self.characters.next()?;
        }
        let range_mm = self.number(character)?;
        let intensity = match self.with_intensity {
            true => {
                let first = self.characters.next()?;
                Some(self.number(first)?)
            }
            false => None,
        };
        Some(Reading { is_further, range_mm, intensity })
    }
}

/// One scan.
#[derive(Clone, Copy, Debug)]
pub struct Scan<'a> {
    /// What was asked; of a stream with the number of scans that are still to come.
    pub request: ScanRequest,
    /// The device's clock when the mirror passed step 0, in ms; comes round at
    /// [`CLOCK_ROUND_MS`](super::CLOCK_ROUND_MS).
    pub clock_ms: u32,
    /// A value a step or cluster, and further echoes.
    pub values: Values<'a>,
}

impl<'a> Scan<'a> {
    /// The scan of a reply; `None` when the reply has none.
    ///
    /// # Errors
    /// A character is no number, or there are other values than were asked for.
    pub fn parse(block: &Block<'a>) -> Option<Result<Self, WireError>> {
        match (block.request.command, Body::of(block.request.command, block.status)) {
            (Command::Scans(request), Body::Scan) => Some(Self::of_lines(request, block)),
            _ => None,
        }
    }

    fn of_lines(request: ScanRequest, block: &Block<'a>) -> Result<Self, WireError> {
        let offset = block.encoded_len() - block.lines.len();
        let no_clock = WireError::Value { field: "clock", found: 0, offset };
        let clock_ms = block.clock_ms().ok_or(no_clock)?;
        let lines = block.lines.get(CLOCK_CHARACTERS + 2..).unwrap_or_default();
        let values = Values::Received { lines, with_intensity: request.with_intensity };
        let width = VALUE_CHARACTERS * (1 + usize::from(request.with_intensity));
        let (mut steps, mut in_value, mut is_further) = (0, 0, false);
        for character in Characters::of(lines) {
            match character {
                FURTHER if in_value == 0 && steps > 0 && !is_further && request.all_echoes => {
                    is_further = true;
                }
                _ if six_bits(character).is_none() => {
                    let found = u32::from(character);
                    return Err(WireError::Value { field: "character", found, offset });
                }
                _ => {
                    steps += usize::from(in_value == 0 && !is_further);
                    in_value = (in_value + 1) % width;
                    is_further = false;
                }
            }
        }
        let needed = request.values();
        if in_value != 0 || is_further || steps != needed {
            return Err(WireError::Capacity { field: "values", limit: needed, found: steps, offset });
        }
        Ok(Self { request, clock_ms, values })
    }

    /// Writes the lines of a reply, and returns their length.
    ///
    /// # Errors
    /// `out` is too small.
    pub fn emit_lines(&self, out: &mut [u8]) -> Result<usize, WireError> {
        let mut writer = Writer::new(out);
        write_clock(&mut writer, self.clock_ms);
        let mut lines = NumberLines::new(&mut writer);
        for reading in &self.values {
            if reading.is_further {
                lines.push(&[FURTHER]);
            }
            lines.push(&encode::<VALUE_CHARACTERS>(reading.range_mm));
            if let Some(intensity) = reading.intensity {
                lines.push(&encode::<VALUE_CHARACTERS>(intensity));
            }
        }
        lines.finish();
        writer.finish().map(|written| written.len())
    }
}
