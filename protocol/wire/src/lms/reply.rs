//! What a laser answers (telegram listing, section 7).

use super::frame::DATA_OFFSET;
use super::{Config, ErrorList, ModeResult, PairsView, S14View, ScanView, Status, StatusReport, Text, frame};
use crate::WireError;
use crate::cursor::{Reader, Writer};

/// A reply, without address and status byte. Cheap to make: texts, scans and reports stay in the telegram's
/// bytes.
#[derive(Clone, Debug, PartialEq, Eq)]
#[allow(clippy::large_enum_variant)] // a configuration is 72 bytes, and there is no heap to put it on
pub enum Reply<'a> {
    /// 90: after power-on or reset, type and firmware such as `LMS200;301063;V02.10 `.
    PowerOn {
        /// Type and firmware.
        text: Text<'a>,
    },
    /// 91: the reset follows at once.
    ResetDone,
    /// 92: the telegram was good, but the command is unknown or not allowed now.
    Refused,
    /// A0: how the change of mode went.
    Mode(ModeResult),
    /// B0, B6, B7, BF: measured values.
    Scan(ScanView<'a>),
    /// B1: the status report.
    Status(StatusReport<'a>),
    /// B2: the list of faults.
    Errors(ErrorList<'a>),
    /// B5: operating hours.
    OperatingCounter {
        /// The first word: operating time in half hours.
        half_hours: u16,
        /// How often it was switched on.
        switch_ons: u16,
    },
    /// BA: type and firmware.
    Type {
        /// Such as `LMS291;S05;X01.27 `.
        text: Text<'a>,
    },
    /// BB: the field of view and step in force.
    Variant {
        /// Whether what was asked is in force.
        accepted: bool,
        /// Field of view in degrees.
        angle_deg: u16,
        /// Step in hundredths of a degree.
        resolution_cdeg: u16,
    },
    /// F4: the configuration.
    Config(Config),
    /// F7: the configuration in force after writing.
    ConfigWritten {
        /// Whether what was asked is in force.
        accepted: bool,
        /// What is in force.
        config: Config,
    },
    /// F5: ranges and remissions.
    Pairs(PairsView<'a>),
    /// C4: ranges and remissions of an S14.
    S14(S14View<'a>),
    /// BE: a part of a scan with field values. No session with a device shows how they stand, so they stay
    /// bytes.
    FieldValues {
        /// Everything between code and status.
        data: &'a [u8],
    },
    /// F6: a part of a scan in Cartesian coordinates; bytes for the same reason.
    Cartesian {
        /// Everything between code and status.
        data: &'a [u8],
    },
    /// C2: how the change of a password went.
    PasswordSet {
        /// The byte sent; 1 = done.
        result: u8,
    },
    /// E6: which rate the device will have after power-on. (The listing's example has a length of 0 by a
    /// misprint.)
    PermanentBaud {
        /// The byte sent; 1 = done.
        result: u8,
    },
    /// FB: the second half of the configuration, 84 bytes.
    SecondConfig {
        /// The bytes as sent.
        data: &'a [u8],
    },
    /// FC: the second half of the configuration in force after writing.
    SecondConfigWritten {
        /// Whether what was asked is in force.
        accepted: bool,
        /// The bytes as sent.
        data: &'a [u8],
    },
    /// Any other reply.
    Raw {
        /// Reply code, 80h and above.
        code: u8,
        /// Everything between code and status.
        data: &'a [u8],
    },
}

impl<'a> Reply<'a> {
    /// The reply code.
    pub fn code(&self) -> u8 {
        match self {
            Reply::PowerOn { .. } => 0x90,
            Reply::ResetDone => 0x91,
            Reply::Refused => 0x92,
            Reply::Mode(_) => 0xA0,
            Reply::Scan(scan) => scan.selection().code(),
            Reply::Status(_) => 0xB1,
            Reply::Errors(_) => 0xB2,
            Reply::OperatingCounter { .. } => 0xB5,
            Reply::Type { .. } => 0xBA,
            Reply::Variant { .. } => 0xBB,
            Reply::Config(_) => 0xF4,
            Reply::ConfigWritten { .. } => 0xF7,
            Reply::Pairs(_) => 0xF5,
            Reply::S14(_) => 0xC4,
            Reply::FieldValues { .. } => 0xBE,
            Reply::Cartesian { .. } => 0xF6,
            Reply::PasswordSet { .. } => 0xC2,
            Reply::PermanentBaud { .. } => 0xE6,
            Reply::SecondConfig { .. } => 0xFB,
            Reply::SecondConfigWritten { .. } => 0xFC,
            Reply::Raw { code, .. } => *code,
        }
    }

    pub(crate) fn parse(code: u8, data: &'a [u8]) -> Result<Self, WireError> {
        let mut reader = Reader::new(data, DATA_OFFSET);
        let reply = match code {
            0x90 => Reply::PowerOn { text: Text(reader.rest()) },
            0x91 => Reply::ResetDone,
            0x92 => Reply::Refused,
            0xA0 => Reply::Mode(ModeResult::from_byte(reader.u8()?)),
            0xB0 | 0xB6 | 0xB7 | 0xBF => Reply::Scan(ScanView::parse(code, reader.rest())?),
            0xB1 => Reply::Status(StatusReport::new(reader.rest())?),
            0xB2 => Reply::Errors(ErrorList::parse(reader.rest())?),
            0xB5 => Reply::OperatingCounter { half_hours: reader.u16()?, switch_ons: reader.u16()? },
            0xBA => Reply::Type { text: Text(reader.rest()) },
            0xBB => Reply::Variant {
                accepted: accepted(&mut reader)?,
                angle_deg: reader.u16()?,
                resolution_cdeg: reader.u16()?,
            },
            0xF4 => Reply::Config(Config::parse(reader.rest(), DATA_OFFSET)?),
            0xF7 => Reply::ConfigWritten {
                accepted: accepted(&mut reader)?,
                config: Config::parse(reader.rest(), DATA_OFFSET + 1)?,
            },
            0xF5 => Reply::Pairs(PairsView::parse(reader.rest())?),
            0xC4 => Reply::S14(S14View::parse(reader.rest())?),
            0xBE => Reply::FieldValues { data: reader.rest() },
            0xF6 => Reply::Cartesian { data: reader.rest() },
            0xC2 => Reply::PasswordSet { result: reader.u8()? },
            0xE6 => Reply::PermanentBaud { result: reader.u8()? },
            0xFB => Reply::SecondConfig { data: reader.rest() },
            0xFC => Reply::SecondConfigWritten { accepted: accepted(&mut reader)?, data: reader.rest() },
            _ => Reply::Raw { code, data: reader.rest() },
        };
        reader.end_with(reply)
    }

    fn write(&self, writer: &mut Writer<'_>) {
        if let Reply::Scan(scan) = self {
            return scan.write(writer);
        }
        writer.u8(self.code());
        match self {
            Reply::Scan(_) | Reply::ResetDone | Reply::Refused => {}
            Reply::PowerOn { text } | Reply::Type { text } => writer.bytes(text.0),
            Reply::Mode(result) => writer.u8(result.byte()),
            Reply::Status(report) => writer.bytes(report.data()),
            Reply::Errors(errors) => writer.bytes(errors.pairs().as_flattened()),
            Reply::OperatingCounter { half_hours, switch_ons } => {
                writer.u16(*half_hours);
                writer.u16(*switch_ons);
            }
            Reply::Variant { accepted, angle_deg, resolution_cdeg } => {
                writer.u8(u8::from(*accepted));
                writer.u16(*angle_deg);
                writer.u16(*resolution_cdeg);
            }
            Reply::Config(config) => writer.bytes(config.as_bytes()),
            Reply::ConfigWritten { accepted, config } => {
                writer.u8(u8::from(*accepted));
                writer.bytes(config.as_bytes());
            }
            Reply::Pairs(pairs) => pairs.write(writer),
            Reply::S14(scan) => scan.write(writer),
            Reply::PasswordSet { result } | Reply::PermanentBaud { result } => writer.u8(*result),
            Reply::SecondConfigWritten { accepted, data } => {
                writer.u8(u8::from(*accepted));
                writer.bytes(data);
            }
            Reply::FieldValues { data }
            | Reply::Cartesian { data }
            | Reply::SecondConfig { data }
            | Reply::Raw { data, .. } => writer.bytes(data),
        }
    }

    /// Bytes of the whole telegram.
    pub fn encoded_len(&self) -> usize {
        frame::framed_len(true, |writer| self.write(writer))
    }

    /// Writes the whole telegram from a device (`address` 80h to FFh) and returns its length.
    ///
    /// # Errors
    /// `out` is too small, or `address` is that of a request.
    pub fn emit(&self, address: u8, status: Status, out: &mut [u8]) -> Result<usize, WireError> {
        frame::emit(out, address, Some(status), |writer| self.write(writer))
    }
}

fn accepted(reader: &mut Reader<'_>) -> Result<bool, WireError> {
    let offset = reader.offset();
    match reader.u8()? {
        0 => Ok(false),
        1 => Ok(true),
        other => Err(WireError::Value { field: "accepted", found: u32::from(other), offset }),
    }
}
