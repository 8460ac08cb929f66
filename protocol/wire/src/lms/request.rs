//! What a host asks of a laser (telegram listing, section 7).

use heapless::Vec;

use super::frame::DATA_OFFSET;
use super::{Config, Mode, frame};
use crate::WireError;
use crate::cursor::{Reader, Writer};
use crate::lms::scan::reflectivity::{MAX_PARTS, Span, parse_spans, write_spans};

/// Which values command 30h asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ScanKind {
    /// 01: all values of a complete scan.
    All,
    /// 02: the smallest vertical distance.
    MinVerticalDistance,
    /// 03: the taught-in values.
    TaughtIn,
    /// 06: every 2nd value.
    EverySecond,
    /// 07: every 20th value.
    EveryTwentieth,
    /// 08: the current partial scan.
    Partial,
    /// A kind that the listing does not name.
    Other(u8),
}

impl ScanKind {
    fn from_byte(byte: u8) -> Self {
        match byte {
            0x01 => ScanKind::All,
            0x02 => ScanKind::MinVerticalDistance,
            0x03 => ScanKind::TaughtIn,
            0x06 => ScanKind::EverySecond,
            0x07 => ScanKind::EveryTwentieth,
            0x08 => ScanKind::Partial,
            other => ScanKind::Other(other),
        }
    }

    fn byte(self) -> u8 {
        match self {
            ScanKind::All => 0x01,
            ScanKind::MinVerticalDistance => 0x02,
            ScanKind::TaughtIn => 0x03,
            ScanKind::EverySecond => 0x06,
            ScanKind::EveryTwentieth => 0x07,
            ScanKind::Partial => 0x08,
            ScanKind::Other(other) => other,
        }
    }
}

/// A command that has no form of its own here, with its data as sent.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RawRequest {
    /// Command byte, 10h to 7Fh.
    pub code: u8,
    /// Everything behind it.
    pub data: Vec<u8, 95>,
}

/// A request. Numbers are kept as sent: whether a device can do what is asked, it decides itself.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Request {
    /// 10: restart. Answered by [`super::Reply::ResetDone`], then by [`super::Reply::PowerOn`] at 9600.
    Reset,
    /// 20: change the operating mode or the line rate.
    Mode(Mode),
    /// 30: one scan.
    RequestScan(ScanKind),
    /// 31: the status report.
    Status,
    /// 32: the list of faults.
    Errors,
    /// 35: operating hours and switch-ons.
    OperatingCounter {
        /// A zero word behind the command: LMS 211, 221 and 291 want it, others do not.
        with_word: bool,
    },
    /// 36: the mean of that many scans (2 to 250), once.
    MeanScan {
        /// Scans to average.
        count: u8,
    },
    /// 37: a part of one scan. Positions count from 1.
    SubRange {
        /// First value.
        first: u16,
        /// Last value; bit 15: send the parts at once.
        last: u16,
    },
    /// 3E: a part of one scan with its field values.
    FieldValues(Span),
    /// 3F: a part of the mean of that many scans, once.
    MeanSubRange {
        /// Scans to average, 2 to 250. One byte, as the reply has it.
        count: u8,
        /// Positions.
        span: Span,
    },
    /// 3A: type and firmware.
    Type,
    /// 42: another password for the operating mode in force.
    SetPassword {
        /// The new one.
        password: [u8; 8],
    },
    /// 44: ranges of one scan and remissions of a part of it; S14 devices only.
    S14(Span),
    /// 3B: field of view and angular step. Not on S14; 180 with 25 is refused.
    Variant {
        /// Field of view, 100 or 180 degrees.
        angle_deg: u16,
        /// Step in hundredths of a degree: 100, 50 or 25.
        resolution_cdeg: u16,
    },
    /// 66: which rate to power on with: 0 = 9600, 1 = the present one, 2 = keep the type.
    PermanentBaud(u8),
    /// 74: the configuration.
    ReadConfig,
    /// 77: writes the configuration to EEPROM; needs the installation mode.
    WriteConfig(Config),
    /// 75: ranges and remissions of up to five parts of one scan.
    Pairs(Vec<Span, MAX_PARTS>),
    /// 76: a part of one scan in Cartesian coordinates.
    Cartesian(Span),
    /// 7B: the second half of the configuration.
    ReadSecondConfig,
    /// 7C: writes the second half of the configuration to EEPROM; needs the installation mode.
    WriteSecondConfig(Vec<u8, 95>),
    /// Any other command.
    Raw(RawRequest),
}

impl Request {
    /// The command byte.
    pub fn code(&self) -> u8 {
        match self {
            Request::Reset => 0x10,
            Request::Mode(_) => 0x20,
            Request::RequestScan(_) => 0x30,
            Request::Status => 0x31,
            Request::Errors => 0x32,
            Request::OperatingCounter { .. } => 0x35,
            Request::MeanScan { .. } => 0x36,
            Request::SubRange { .. } => 0x37,
            Request::FieldValues(_) => 0x3E,
            Request::MeanSubRange { .. } => 0x3F,
            Request::Type => 0x3A,
            Request::SetPassword { .. } => 0x42,
            Request::S14(_) => 0x44,
            Request::Pairs(_) => 0x75,
            Request::Cartesian(_) => 0x76,
            Request::ReadSecondConfig => 0x7B,
            Request::WriteSecondConfig(_) => 0x7C,
            Request::Variant { .. } => 0x3B,
            Request::PermanentBaud(_) => 0x66,
            Request::ReadConfig => 0x74,
            Request::WriteConfig(_) => 0x77,
            Request::Raw(raw) => raw.code,
        }
    }

    pub(crate) fn parse(code: u8, data: &[u8]) -> Result<Self, WireError> {
        let mut reader = Reader::new(data, DATA_OFFSET);
        let request = match code {
            0x10 => Request::Reset,
            0x20 => Request::Mode(Mode::parse(reader.rest())?),
            0x30 => Request::RequestScan(ScanKind::from_byte(reader.u8()?)),
            0x31 => Request::Status,
            0x32 => Request::Errors,
            0x35 if data.is_empty() => Request::OperatingCounter { with_word: false },
            0x35 => Request::OperatingCounter { with_word: zero_word(&mut reader)? },
            0x36 => Request::MeanScan { count: reader.u8()? },
            0x37 => Request::SubRange { first: reader.u16()?, last: reader.u16()? },
            0x3A => Request::Type,
            0x3E => Request::FieldValues(Span::parse(&mut reader)?),
            // The same with a word for the count is 6 bytes long and stays as it is.
            0x3F if data.len() == 5 => {
                Request::MeanSubRange { count: reader.u8()?, span: Span::parse(&mut reader)? }
            }
            0x42 => Request::SetPassword { password: reader.array()? },
            0x44 => Request::S14(Span::parse(&mut reader)?),
            0x75 => Request::Pairs(parse_spans(&mut reader)?),
            0x76 => Request::Cartesian(Span::parse(&mut reader)?),
            0x7B => Request::ReadSecondConfig,
            0x7C => Request::WriteSecondConfig(raw_data(&mut reader)?),
            0x3B => Request::Variant { angle_deg: reader.u16()?, resolution_cdeg: reader.u16()? },
            0x66 => Request::PermanentBaud(reader.u8()?),
            0x74 => Request::ReadConfig,
            0x77 => Request::WriteConfig(Config::parse(reader.rest(), DATA_OFFSET)?),
            _ => Request::Raw(RawRequest { code, data: raw_data(&mut reader)? }),
        };
        reader.end_with(request)
    }

    fn write(&self, writer: &mut Writer<'_>) {
        writer.u8(self.code());
        match self {
            Request::Reset
            | Request::Status
            | Request::Errors
            | Request::Type
            | Request::ReadConfig
            | Request::ReadSecondConfig
            | Request::OperatingCounter { with_word: false } => {}
            Request::OperatingCounter { with_word: true } => writer.u16(0),
            Request::FieldValues(span) | Request::S14(span) | Request::Cartesian(span) => span.write(writer),
            Request::MeanSubRange { count, span } => {
                writer.u8(*count);
                span.write(writer);
            }
            Request::SetPassword { password } => writer.bytes(password),
            Request::Pairs(spans) => write_spans(spans, writer),
            Request::WriteSecondConfig(data) => writer.bytes(data),
            Request::Mode(mode) => mode.write(writer),
            Request::RequestScan(kind) => writer.u8(kind.byte()),
            Request::MeanScan { count } => writer.u8(*count),
            Request::SubRange { first, last } => {
                writer.u16(*first);
                writer.u16(*last);
            }
            Request::Variant { angle_deg, resolution_cdeg } => {
                writer.u16(*angle_deg);
                writer.u16(*resolution_cdeg);
            }
            Request::PermanentBaud(choice) => writer.u8(*choice),
            Request::WriteConfig(config) => writer.bytes(config.as_bytes()),
            Request::Raw(raw) => writer.bytes(&raw.data),
        }
    }

    /// Bytes of the whole telegram.
    pub fn encoded_len(&self) -> usize {
        frame::framed_len(false, |writer| self.write(writer))
    }

    /// Writes the whole telegram to a device (`address` 00h to 7Fh, 00h = any) and returns its length.
    ///
    /// # Errors
    /// `out` is too small, or `address` is that of a reply.
    pub fn emit(&self, address: u8, out: &mut [u8]) -> Result<usize, WireError> {
        frame::emit(out, address, None, |writer| self.write(writer))
    }
}

fn raw_data(reader: &mut Reader<'_>) -> Result<Vec<u8, 95>, WireError> {
    let (offset, found) = (reader.offset(), reader.remaining());
    Vec::from_slice(reader.rest()).map_err(|_| WireError::Capacity {
        field: "request data",
        limit: 95,
        found,
        offset,
    })
}

fn zero_word(reader: &mut Reader<'_>) -> Result<bool, WireError> {
    let offset = reader.offset();
    match reader.u16()? {
        0 => Ok(true),
        other => Err(WireError::Value { field: "word of command 35h", found: u32::from(other), offset }),
    }
}
