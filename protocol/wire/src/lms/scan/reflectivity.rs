//! Ranges with remission: F5h (pairs, in parts of the fan) and C4h (S14 devices) (telegram listing, sections
//! 7.37 and 7.29).
//!
//! F5h: number of parts (word), then a part: first and last position from 1, count word with unit, and so
//! many pairs of a range word and a remission word (0 to about 13000). C4h: count word and all ranges, then
//! number, first and last position of the remissions and one byte each. Behind them, as in every scan
//! telegram, two index bytes when the configuration asks for them. Range words have the bits of the measuring
//! mode.

use heapless::Vec;

use crate::WireError;
use crate::cursor::{Reader, Writer};
use crate::lms::frame::DATA_OFFSET;
use crate::lms::scan::{COUNT_MASK, MAX_VALUES, Unit, write_index};
use crate::lms::{frame, status::Status};

/// Most parts that command 75h or mode 2Bh can ask for.
pub const MAX_PARTS: usize = 5;

/// Positions of the values that a request asks for, from 1, both included.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Span {
    /// First value.
    pub first: u16,
    /// Last value.
    pub last: u16,
}

impl Span {
    pub(crate) fn parse(reader: &mut Reader<'_>) -> Result<Self, WireError> {
        Ok(Self { first: reader.u16()?, last: reader.u16()? })
    }

    pub(crate) fn write(self, writer: &mut Writer<'_>) {
        writer.u16(self.first);
        writer.u16(self.last);
    }
}

/// The spans of command 75h and mode 2Bh, with their number in front as a word.
pub(crate) fn parse_spans(reader: &mut Reader<'_>) -> Result<Vec<Span, MAX_PARTS>, WireError> {
    let offset = reader.offset();
    let count = usize::from(reader.u16()?);
    let mut spans = Vec::new();
    for _ in 0..count {
        let span = Span::parse(reader)?;
        spans.push(span).map_err(|_| too_many("parts", MAX_PARTS, count, offset))?;
    }
    Ok(spans)
}

pub(crate) fn write_spans(spans: &[Span], writer: &mut Writer<'_>) {
    writer.u16(spans.len() as u16);
    spans.iter().for_each(|span| span.write(writer));
}

fn too_many(field: &'static str, limit: usize, found: usize, offset: usize) -> WireError {
    WireError::Capacity { field, limit, found, offset }
}

fn counted(word: u16, offset: usize) -> Result<(Unit, usize), WireError> {
    let found = u32::from(word >> 14);
    let field = "unit of the count word";
    let unit = Unit::from_byte((word >> 14) as u8).ok_or(WireError::Value { field, found, offset })?;
    let count = usize::from(word & COUNT_MASK);
    match count {
        0..=MAX_VALUES => Ok((unit, count)),
        _ => Err(too_many("values of a scan", MAX_VALUES, count, offset)),
    }
}

fn index(reader: &mut Reader<'_>) -> Result<Option<(u8, u8)>, WireError> {
    match reader.remaining() {
        0 => Ok(None),
        _ => Ok(Some((reader.u8()?, reader.u8()?))),
    }
}

/// One part of an F5h telegram, in place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PairPart<'a> {
    /// Its positions in the fan.
    pub span: Span,
    /// Unit of its ranges.
    pub unit: Unit,
    count_word: u16,
    pairs: &'a [u8],
}

impl<'a> PairPart<'a> {
    fn parse(reader: &mut Reader<'a>) -> Result<Self, WireError> {
        let span = Span::parse(reader)?;
        let offset = reader.offset();
        let count_word = reader.u16()?;
        let (unit, count) = counted(count_word, offset)?;
        Ok(Self { span, unit, count_word, pairs: reader.take(4 * count)? })
    }

    /// Number of pairs.
    pub fn count(&self) -> usize {
        self.pairs.len() / 4
    }

    /// The count word as sent.
    pub fn count_word(&self) -> u16 {
        self.count_word
    }

    /// Range word and remission word of each beam, in order of ascending angle.
    pub fn pairs(&self) -> impl ExactSizeIterator<Item = (u16, u16)> + Clone + use<'a> {
        let (pairs, _) = self.pairs.as_chunks::<4>();
        pairs.iter().map(|&[a, b, c, d]| (u16::from_le_bytes([a, b]), u16::from_le_bytes([c, d])))
    }
}

/// An F5h telegram's data, in place; all parts are whole.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PairsView<'a> {
    parts: &'a [u8],
    count: u16,
    index: Option<(u8, u8)>,
}

impl<'a> PairsView<'a> {
    pub(crate) fn parse(data: &'a [u8]) -> Result<Self, WireError> {
        let mut reader = Reader::new(data, DATA_OFFSET);
        let count = reader.u16()?;
        if usize::from(count) > MAX_PARTS {
            return Err(too_many("parts", MAX_PARTS, usize::from(count), DATA_OFFSET));
        }
        let (start, mut values) = (reader.offset() - DATA_OFFSET, 0);
        for _ in 0..count {
            values += PairPart::parse(&mut reader)?.count();
        }
        if values > MAX_VALUES {
            return Err(too_many("values of a scan", MAX_VALUES, values, DATA_OFFSET));
        }
        let parts = data.get(start..reader.offset() - DATA_OFFSET).unwrap_or(&[]);
        let index = index(&mut reader)?;
        reader.end_with(Self { parts, count, index })
    }

    /// The parts in the order in which they were asked for.
    pub fn parts(&self) -> impl Iterator<Item = PairPart<'a>> + Clone + use<'a> {
        let mut reader = Reader::new(self.parts, DATA_OFFSET + 2);
        (0..self.count).map_while(move |_| PairPart::parse(&mut reader).ok())
    }

    /// Scan index and telegram index, if the device sends them.
    pub fn index(&self) -> Option<(u8, u8)> {
        self.index
    }

    /// The owned form. `status` is the telegram's status byte.
    pub fn to_owned(&self, status: Status) -> Pairs {
        let mut owned = Pairs { index: self.index, status, ..Pairs::default() };
        for part in self.parts() {
            // The view has checked that all parts and pairs fit.
            let _ = owned.parts.push((part.span, part.unit, part.count() as u16));
            owned.pairs.extend(part.pairs());
        }
        owned
    }

    pub(crate) fn write(&self, writer: &mut Writer<'_>) {
        writer.u16(self.count);
        writer.bytes(self.parts);
        write_index(self.index, writer);
    }
}

/// An F5h telegram of its own, without the address.
#[derive(Clone, Debug, PartialEq, Eq, Default)]
pub struct Pairs {
    /// Of each part: positions, unit, number of pairs.
    pub parts: Vec<(Span, Unit, u16), MAX_PARTS>,
    /// Range and remission words of all parts, one after the other.
    pub pairs: Vec<(u16, u16), MAX_VALUES>,
    /// Scan index and telegram index.
    pub index: Option<(u8, u8)>,
    /// Status byte of the telegram.
    pub status: Status,
}

impl Pairs {
    /// Bytes of the whole telegram.
    pub fn encoded_len(&self) -> usize {
        frame::framed_len(true, |writer| self.write(writer))
    }

    /// Writes the whole telegram from a device (`address` 80h to FFh) and returns its length.
    ///
    /// # Errors
    /// `out` is too small, or `address` is that of a request.
    pub fn emit(&self, address: u8, out: &mut [u8]) -> Result<usize, WireError> {
        frame::emit(out, address, Some(self.status), |writer| self.write(writer))
    }

    fn write(&self, writer: &mut Writer<'_>) {
        writer.u8(0xF5);
        writer.u16(self.parts.len() as u16);
        let mut pairs = self.pairs.iter();
        for &(span, unit, count) in &self.parts {
            span.write(writer);
            writer.u16(count & COUNT_MASK | u16::from(unit.byte()) << 14);
            for &(range, remission) in pairs.by_ref().take(usize::from(count)) {
                writer.u16(range);
                writer.u16(remission);
            }
        }
        write_index(self.index, writer);
    }
}

/// A C4h telegram's data, in place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct S14View<'a> {
    count_word: u16,
    /// Unit of the ranges.
    pub unit: Unit,
    ranges: &'a [u8],
    /// Positions of the remissions.
    pub span: Span,
    remissions: &'a [u8],
    index: Option<(u8, u8)>,
}

impl<'a> S14View<'a> {
    pub(crate) fn parse(data: &'a [u8]) -> Result<Self, WireError> {
        let mut reader = Reader::new(data, DATA_OFFSET);
        let count_word = reader.u16()?;
        let (unit, count) = counted(count_word, DATA_OFFSET)?;
        let ranges = reader.take(2 * count)?;
        let offset = reader.offset();
        let remission_count = usize::from(reader.u16()?);
        if remission_count > MAX_VALUES {
            return Err(too_many("remissions", MAX_VALUES, remission_count, offset));
        }
        let span = Span::parse(&mut reader)?;
        let remissions = reader.take(remission_count)?;
        let index = index(&mut reader)?;
        reader.end_with(Self { count_word, unit, ranges, span, remissions, index })
    }

    /// The count word of the ranges as sent.
    pub fn count_word(&self) -> u16 {
        self.count_word
    }

    /// The range words, in order of ascending angle.
    pub fn values(&self) -> impl ExactSizeIterator<Item = u16> + Clone + use<'a> {
        let (words, _) = self.ranges.as_chunks::<2>();
        words.iter().map(|&word| u16::from_le_bytes(word))
    }

    /// Remissions from position `span.first` on.
    pub fn remissions(&self) -> &'a [u8] {
        self.remissions
    }

    /// Scan index and telegram index, if the device sends them.
    pub fn index(&self) -> Option<(u8, u8)> {
        self.index
    }

    /// The owned form. `status` is the telegram's status byte.
    pub fn to_owned(&self, status: Status) -> S14Scan {
        S14Scan {
            unit: self.unit,
            values: self.values().collect(),
            span: self.span,
            // The view has checked that they fit.
            remissions: Vec::from_slice(self.remissions).unwrap_or_default(),
            index: self.index,
            status,
        }
    }

    pub(crate) fn write(&self, writer: &mut Writer<'_>) {
        writer.u16(self.count_word);
        writer.bytes(self.ranges);
        writer.u16(self.remissions.len() as u16);
        self.span.write(writer);
        writer.bytes(self.remissions);
        write_index(self.index, writer);
    }
}

/// A C4h telegram of its own, without the address. Flags of the count word are not kept.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct S14Scan {
    /// Unit of the ranges.
    pub unit: Unit,
    /// Range words in order of ascending angle.
    pub values: Vec<u16, MAX_VALUES>,
    /// Positions of the remissions.
    pub span: Span,
    /// Remissions, one byte each.
    pub remissions: Vec<u8, MAX_VALUES>,
    /// Scan index and telegram index.
    pub index: Option<(u8, u8)>,
    /// Status byte of the telegram.
    pub status: Status,
}

impl S14Scan {
    /// Bytes of the whole telegram.
    pub fn encoded_len(&self) -> usize {
        frame::framed_len(true, |writer| self.write(writer))
    }

    /// Writes the whole telegram from a device (`address` 80h to FFh) and returns its length.
    ///
    /// # Errors
    /// `out` is too small, or `address` is that of a request.
    pub fn emit(&self, address: u8, out: &mut [u8]) -> Result<usize, WireError> {
        frame::emit(out, address, Some(self.status), |writer| self.write(writer))
    }

    fn write(&self, writer: &mut Writer<'_>) {
        writer.u8(0xC4);
        writer.u16(self.values.len() as u16 | u16::from(self.unit.byte()) << 14);
        self.values.iter().for_each(|&value| writer.u16(value));
        writer.u16(self.remissions.len() as u16);
        self.span.write(writer);
        writer.bytes(&self.remissions);
        write_index(self.index, writer);
    }
}
