//! What a host asks of a laser (telegram listing, section 7).

use heapless::Vec;

use super::telegram::DATA_OFFSET;
use super::{Config, Mode, emit};
use crate::WireError;
use crate::cursor::{Reader, Writer};

/// Which values command 30h asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ScanKind {
    /// 01: all values of a complete scan.
    All,
    /// 08: the current partial scan.
    Partial,
    /// 02 minimum vertical distance, 03 taught-in, 06 every 2nd, 07 every 20th value, and unknown kinds.
    Other(u8),
}

impl ScanKind {
    fn from_byte(byte: u8) -> Self {
        match byte {
            0x01 => ScanKind::All,
            0x08 => ScanKind::Partial,
            other => ScanKind::Other(other),
        }
    }

    fn byte(self) -> u8 {
        match self {
            ScanKind::All => 0x01,
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
    OperatingCounter,
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
    /// 3A: type and firmware.
    Type,
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
            Request::OperatingCounter => 0x35,
            Request::MeanScan { .. } => 0x36,
            Request::SubRange { .. } => 0x37,
            Request::Type => 0x3A,
            Request::Variant { .. } => 0x3B,
            Request::PermanentBaud(_) => 0x66,
            Request::ReadConfig => 0x74,
            Request::WriteConfig(_) => 0x77,
            Request::Raw(raw) => raw.code,
        }
    }

    pub(super) fn parse(code: u8, data: &[u8]) -> Result<Self, WireError> {
        let mut reader = Reader::new(data, DATA_OFFSET);
        let request = match code {
            0x10 => Request::Reset,
            0x20 => Request::Mode(Mode::parse(reader.rest())?),
            0x30 => Request::RequestScan(ScanKind::from_byte(reader.u8()?)),
            0x31 => Request::Status,
            0x32 => Request::Errors,
            0x35 => Request::OperatingCounter,
            0x36 => Request::MeanScan { count: reader.u8()? },
            0x37 => Request::SubRange { first: reader.u16()?, last: reader.u16()? },
            0x3A => Request::Type,
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
            | Request::OperatingCounter
            | Request::Type
            | Request::ReadConfig => {}
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
        emit::framed_len(false, |writer| self.write(writer))
    }

    /// Writes the whole telegram to a device (`address` 00h to 7Fh, 00h = any) and returns its length.
    ///
    /// # Errors
    /// `out` is too small, or `address` is that of a reply.
    pub fn emit(&self, address: u8, out: &mut [u8]) -> Result<usize, WireError> {
        emit::emit(out, address, None, |writer| self.write(writer))
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
