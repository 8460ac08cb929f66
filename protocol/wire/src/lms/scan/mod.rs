//! Scan telegrams: B0h (whole), B6h (mean), B7h (part), BFh (part of a mean) (telegram listing, section 7.6).
//!
//! Behind the head of each kind stands a count word: number of values (bits 0-9), quarter-degree offset of a
//! partial scan (11-12), partial scan (13), unit (14-15); then the values, one word each, and two index bytes
//! when the configuration asks for them. What the bits of a value mean is not in the telegram: see
//! [`super::MeasuringMode`].

pub(crate) mod reflectivity;

use heapless::Vec;

use super::frame::DATA_OFFSET;
use super::{frame, status::Status};
use crate::WireError;
use crate::cursor::{Reader, Writer};

/// Most values that a scan can have: 100 degrees in steps of 0.25.
pub const MAX_VALUES: usize = 401;

pub(crate) const COUNT_MASK: u16 = 0x03FF;
const PARTIAL: u16 = 0x2000;

/// Unit of measured values.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub enum Unit {
    /// Centimeters.
    #[default]
    Cm,
    /// Millimeters.
    Mm,
    /// Ten centimeters: reserved in the listing, but known to drivers.
    TenCm,
}

impl Unit {
    /// Meters of one count.
    pub const fn meters(self) -> f64 {
        match self {
            Unit::Cm => 0.01,
            Unit::Mm => 0.001,
            Unit::TenCm => 0.1,
        }
    }

    /// The code in configuration, status and count word.
    pub const fn byte(self) -> u8 {
        match self {
            Unit::Cm => 0,
            Unit::Mm => 1,
            Unit::TenCm => 2,
        }
    }

    /// The unit with that code; 3 and above have no meaning.
    pub const fn from_byte(byte: u8) -> Option<Self> {
        match byte {
            0 => Some(Unit::Cm),
            1 => Some(Unit::Mm),
            2 => Some(Unit::TenCm),
            _ => None,
        }
    }
}

/// Which values of a scan a telegram holds. Positions count from 1, both ends included.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub enum Selection {
    /// B0: all.
    #[default]
    All,
    /// B6: the mean of `count` scans.
    Mean {
        /// Scans averaged.
        count: u8,
    },
    /// B7: a part.
    SubRange {
        /// First value.
        first: u16,
        /// Last value.
        last: u16,
    },
    /// BF: a part of the mean of `count` scans.
    MeanSubRange {
        /// Scans averaged.
        count: u8,
        /// First value.
        first: u16,
        /// Last value.
        last: u16,
    },
}

impl Selection {
    pub(crate) fn code(self) -> u8 {
        match self {
            Selection::All => 0xB0,
            Selection::Mean { .. } => 0xB6,
            Selection::SubRange { .. } => 0xB7,
            Selection::MeanSubRange { .. } => 0xBF,
        }
    }

    fn parse(code: u8, reader: &mut Reader<'_>) -> Result<Self, WireError> {
        Ok(match code {
            0xB6 => Selection::Mean { count: reader.u8()? },
            0xB7 => Selection::SubRange { first: reader.u16()?, last: reader.u16()? },
            0xBF => {
                Selection::MeanSubRange { count: reader.u8()?, first: reader.u16()?, last: reader.u16()? }
            }
            _ => Selection::All,
        })
    }

    fn write(self, writer: &mut Writer<'_>) {
        writer.u8(self.code());
        match self {
            Selection::All => {}
            Selection::Mean { count } => writer.u8(count),
            Selection::SubRange { first, last } => {
                writer.u16(first);
                writer.u16(last);
            }
            Selection::MeanSubRange { count, first, last } => {
                writer.u8(count);
                writer.u16(first);
                writer.u16(last);
            }
        }
    }
}

/// A scan telegram's data, in place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ScanView<'a> {
    selection: Selection,
    count_word: u16,
    unit: Unit,
    values: &'a [u8],
    index: Option<(u8, u8)>,
}

impl<'a> ScanView<'a> {
    pub(crate) fn parse(code: u8, data: &'a [u8]) -> Result<Self, WireError> {
        let mut reader = Reader::new(data, DATA_OFFSET);
        let selection = Selection::parse(code, &mut reader)?;
        let word_offset = reader.offset();
        let count_word = reader.u16()?;
        let unit = Unit::from_byte((count_word >> 14) as u8).ok_or(WireError::Value {
            field: "unit of the count word",
            found: u32::from(count_word >> 14),
            offset: word_offset,
        })?;
        let count = usize::from(count_word & COUNT_MASK);
        if count > MAX_VALUES {
            let field = "values of a scan";
            return Err(WireError::Capacity { field, limit: MAX_VALUES, found: count, offset: word_offset });
        }
        let values = reader.take(2 * count)?;
        let index = match reader.remaining() {
            0 => None,
            _ => Some((reader.u8()?, reader.u8()?)),
        };
        reader.end_with(Self { selection, count_word, unit, values, index })
    }

    /// Which values these are.
    pub fn selection(&self) -> Selection {
        self.selection
    }

    /// The count word as sent, with all its flags.
    pub fn count_word(&self) -> u16 {
        self.count_word
    }

    /// Unit of the values.
    pub fn unit(&self) -> Unit {
        self.unit
    }

    /// Number of values.
    pub fn count(&self) -> usize {
        self.values.len() / 2
    }

    /// Offset of a partial scan from whole degrees, in quarters of a degree; `None` for a complete scan.
    pub fn partial_offset_quarters(&self) -> Option<u8> {
        (self.count_word & PARTIAL != 0).then_some((self.count_word >> 11 & 0x03) as u8)
    }

    /// The value words as sent, in order of ascending angle.
    pub fn values(&self) -> impl ExactSizeIterator<Item = u16> + DoubleEndedIterator + Clone + use<'a> {
        let (words, _) = self.values.as_chunks::<2>();
        words.iter().map(|&word| u16::from_le_bytes(word))
    }

    /// Scan index (+1 per mirror turn) and telegram index (+1 per telegram), both modulo 256, if the device
    /// sends them.
    pub fn index(&self) -> Option<(u8, u8)> {
        self.index
    }

    /// The owned form. `status` is the telegram's status byte. Unused bits of the count word are not kept.
    pub fn to_owned(&self, status: Status) -> Scan {
        Scan {
            selection: self.selection,
            unit: self.unit,
            partial: self.partial_offset_quarters(),
            values: self.values().collect(),
            index: self.index,
            status,
        }
    }

    pub(crate) fn write(&self, writer: &mut Writer<'_>) {
        self.selection.write(writer);
        writer.u16(self.count_word);
        writer.bytes(self.values);
        write_index(self.index, writer);
    }
}

/// A scan telegram of its own, without the address.
#[derive(Clone, Debug, PartialEq, Eq, Default)]
pub struct Scan {
    /// Which values these are.
    pub selection: Selection,
    /// Unit of the values.
    pub unit: Unit,
    /// Offset of a partial scan in quarters of a degree (0 to 3); `None` for a complete scan.
    pub partial: Option<u8>,
    /// Value words in order of ascending angle, as sent.
    pub values: Vec<u16, MAX_VALUES>,
    /// Scan index and telegram index.
    pub index: Option<(u8, u8)>,
    /// Status byte of the telegram.
    pub status: Status,
}

impl Scan {
    /// The count word that this scan is sent with.
    pub fn count_word(&self) -> u16 {
        let partial = self.partial.map_or(0, |quarters| PARTIAL | u16::from(quarters & 0x03) << 11);
        self.values.len() as u16 | partial | u16::from(self.unit.byte()) << 14
    }

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
        self.selection.write(writer);
        writer.u16(self.count_word());
        for &value in &self.values {
            writer.u16(value);
        }
        write_index(self.index, writer);
    }
}

pub(crate) fn write_index(index: Option<(u8, u8)>, writer: &mut Writer<'_>) {
    if let Some((scan, telegram)) = index {
        writer.u8(scan);
        writer.u8(telegram);
    }
}
