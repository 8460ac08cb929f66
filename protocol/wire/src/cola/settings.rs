//! What can be set, and read back: output of scans, field, rate and step, and the words for it.

use super::fields::{FieldWriter, Fields};
use super::telegram::{Dialect, Telegram};
use crate::WireError;

/// User level of an authorized client.
const LEVEL_CLIENT: u8 = 3;
/// What its usual password makes.
pub const CLIENT_HASH: u32 = 0xF472_4744;
/// The same on safety-type units (TiM7xxS, TiM8xxS).
pub const SAFETY_CLIENT_HASH: u32 = 0x6FD6_2C05;

/// `LMDscandatacfg`: what a scan's telegram holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct ScanDataConfig {
    /// Bits of echoes, the low byte first.
    pub channels: [u8; 2],
    /// Whether remissions are sent.
    pub remission: bool,
    /// Whether they have 16 bits; an LMS5xx has 8 only.
    pub is_remission_wide: bool,
    /// 0: digits.
    pub unit: u8,
    /// Bits of encoders, the low byte first.
    pub encoders: [u8; 2],
    /// Whether the position is sent.
    pub position: bool,
    /// Whether the device's name is.
    pub name: bool,
    /// Whether its comment is.
    pub comment: bool,
    /// Whether its calendar is.
    pub clock: bool,
    /// Every so-many-th scan is sent.
    pub every: u16,
}

/// `LMPoutputRange`: which part of the fan is sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct OutputRange {
    /// From beam to beam, in 1/10000 degree.
    pub step_e4deg: u32,
    /// First direction, in 1/10000 degree.
    pub start_e4deg: i32,
    /// Last direction, in 1/10000 degree.
    pub stop_e4deg: i32,
}

/// `LMPscancfg`: rate and step of the measurement.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct ScanConfig {
    /// Scans a second, in 1/100 Hz.
    pub rate_chz: u32,
    /// Sectors; 1.
    pub sectors: u16,
    /// From beam to beam, in 1/10000 degree.
    pub step_e4deg: u32,
    /// First direction, in 1/10000 degree; cannot be changed.
    pub start_e4deg: i32,
    /// Last direction, in 1/10000 degree; cannot be changed.
    pub stop_e4deg: i32,
}

impl ScanDataConfig {
    /// The variable's name.
    pub const NAME: &'static [u8] = b"LMDscandatacfg";

    /// Of a telegram's data.
    ///
    /// # Errors
    /// A field is none, or something is left.
    pub fn parse(telegram: &Telegram<'_>) -> Result<Self, WireError> {
        let mut fields = of(telegram);
        let flag = |fields: &mut Fields<'_>| fields.u8("flag").map(|flag| flag != 0);
        let value = Self {
            channels: fields.pair("channels")?,
            remission: flag(&mut fields)?,
            is_remission_wide: flag(&mut fields)?,
            unit: fields.u8("unit")?,
            encoders: fields.pair("encoders")?,
            position: flag(&mut fields)?,
            name: flag(&mut fields)?,
            comment: flag(&mut fields)?,
            clock: flag(&mut fields)?,
            every: fields.u16("scans of which one is sent")?,
        };
        fields.end_with(value)
    }

    /// Writes the data, and returns its length.
    ///
    /// # Errors
    /// `out` is too small.
    pub fn emit_data(&self, dialect: Dialect, out: &mut [u8]) -> Result<usize, WireError> {
        let mut fields = FieldWriter::new(dialect, out);
        fields.pair(self.channels);
        fields.u8(u8::from(self.remission));
        fields.u8(u8::from(self.is_remission_wide));
        fields.u8(self.unit);
        fields.pair(self.encoders);
        for flag in [self.position, self.name, self.comment, self.clock] {
            fields.u8(u8::from(flag));
        }
        fields.u16(self.every);
        fields.finish()
    }
}

impl OutputRange {
    /// The variable's name.
    pub const NAME: &'static [u8] = b"LMPoutputRange";

    /// Of a telegram's data.
    ///
    /// # Errors
    /// A field is none, or something is left.
    pub fn parse(telegram: &Telegram<'_>) -> Result<Self, WireError> {
        let mut fields = of(telegram);
        fields.u16("sectors")?;
        let value = Self {
            step_e4deg: fields.u32("angular step")?,
            start_e4deg: fields.i32("start angle")?,
            stop_e4deg: fields.i32("stop angle")?,
        };
        fields.end_with(value)
    }

    /// Writes the data, and returns its length.
    ///
    /// # Errors
    /// `out` is too small.
    pub fn emit_data(&self, dialect: Dialect, out: &mut [u8]) -> Result<usize, WireError> {
        let mut fields = FieldWriter::new(dialect, out);
        fields.u16(1);
        fields.u32(self.step_e4deg);
        fields.u32(self.start_e4deg as u32);
        fields.u32(self.stop_e4deg as u32);
        fields.finish()
    }
}

impl ScanConfig {
    /// The variable's name.
    pub const NAME: &'static [u8] = b"LMPscancfg";
    /// The method that sets it.
    pub const SETTER: &'static [u8] = b"mLMPsetscancfg";

    /// Of a telegram's data: the variable's, or what the method answers behind its result code.
    ///
    /// # Errors
    /// A field is none, or something is left.
    pub fn parse(telegram: &Telegram<'_>) -> Result<Self, WireError> {
        let mut fields = of(telegram);
        Self::of_fields(&mut fields)
    }

    /// The answer of the method: its result code (0 is good), and what is in force now.
    ///
    /// # Errors
    /// A field is none, or something is left.
    pub fn parse_answer(telegram: &Telegram<'_>) -> Result<(u8, Self), WireError> {
        let mut fields = of(telegram);
        let code = fields.u8("result")?;
        Ok((code, Self::of_fields(&mut fields)?))
    }

    fn of_fields(fields: &mut Fields<'_>) -> Result<Self, WireError> {
        let value = Self {
            rate_chz: fields.u32("scan rate")?,
            sectors: fields.u16("sectors")?,
            step_e4deg: fields.u32("angular step")?,
            start_e4deg: fields.i32("start angle")?,
            stop_e4deg: fields.i32("stop angle")?,
        };
        fields.end_with(value)
    }

    /// Writes the data, and returns its length.
    ///
    /// # Errors
    /// `out` is too small.
    pub fn emit_data(&self, dialect: Dialect, out: &mut [u8]) -> Result<usize, WireError> {
        let mut fields = FieldWriter::new(dialect, out);
        self.write(&mut fields);
        fields.finish()
    }

    /// The answer of the method that sets it.
    ///
    /// # Errors
    /// `out` is too small.
    pub fn emit_answer(&self, code: u8, dialect: Dialect, out: &mut [u8]) -> Result<usize, WireError> {
        let mut fields = FieldWriter::new(dialect, out);
        fields.u8(code);
        self.write(&mut fields);
        fields.finish()
    }

    fn write(&self, fields: &mut FieldWriter<'_>) {
        fields.u32(self.rate_chz);
        fields.u16(self.sectors);
        fields.u32(self.step_e4deg);
        fields.u32(self.start_e4deg as u32);
        fields.u32(self.stop_e4deg as u32);
    }
}

/// Data of one number of a byte: a result, a state, a switch.
///
/// # Errors
/// It is none, or something is left.
pub fn parse_byte(telegram: &Telegram<'_>) -> Result<u8, WireError> {
    let mut fields = of(telegram);
    let value = fields.u8("value")?;
    fields.end_with(value)
}

/// Writes such data, and returns its length.
///
/// # Errors
/// `out` is too small.
pub fn emit_byte(value: u8, dialect: Dialect, out: &mut [u8]) -> Result<usize, WireError> {
    let mut fields = FieldWriter::new(dialect, out);
    fields.u8(value);
    fields.finish()
}

/// Writes the data of `SetAccessMode`, and returns its length.
///
/// # Errors
/// `out` is too small.
pub fn emit_login(hash: u32, dialect: Dialect, out: &mut [u8]) -> Result<usize, WireError> {
    let mut fields = FieldWriter::new(dialect, out);
    match dialect {
        // Two digits, as clients write it.
        Dialect::A => fields.text(b"03"),
        Dialect::B => fields.u8(LEVEL_CLIENT),
    }
    fields.u32(hash);
    fields.finish()
}

/// Level and hash of `SetAccessMode`.
///
/// # Errors
/// A field is none, or something is left.
pub fn parse_login(telegram: &Telegram<'_>) -> Result<(u8, u32), WireError> {
    let mut fields = of(telegram);
    let value = (fields.u8("user level")?, fields.u32("hash")?);
    fields.end_with(value)
}

/// The texts of data that begins with some: at most two, the second empty where there is one. A text that is
/// not where it should be is all the data, as old devices send it.
#[must_use]
pub fn parse_texts<'a>(telegram: &Telegram<'a>) -> [&'a [u8]; 2] {
    let mut fields = of(telegram);
    let text = |fields: &mut Fields<'a>| {
        let length = fields.u16("length of a text")?;
        fields.text(usize::from(length))
    };
    match text(&mut fields) {
        Ok(first) => [first, text(&mut fields).unwrap_or_default()],
        Err(_) => [telegram.data.unwrap_or_default(), &[]],
    }
}

/// Writes texts, and returns their length.
///
/// # Errors
/// `out` is too small.
pub fn emit_texts(texts: &[&[u8]], dialect: Dialect, out: &mut [u8]) -> Result<usize, WireError> {
    let mut fields = FieldWriter::new(dialect, out);
    for text in texts {
        fields.u16(text.len() as u16);
        fields.text(text);
    }
    fields.finish()
}

fn of<'a>(telegram: &Telegram<'a>) -> Fields<'a> {
    Fields::new(telegram.dialect, telegram.data.unwrap_or_default(), telegram.data_offset())
}
