//! What a unit says.

use super::emit::{data_offset, emit, message_bytes};
use super::items::Items;
use super::output::{self, Outputs};
use crate::WireError;
use crate::cursor::{Reader, Writer};

const DEVICE_ID: u8 = 0x01;
const MEASURES: u8 = 0x11;
const CONFIGURES: u8 = 0x31;
const DATA: u8 = 0x36;
const WAKE_UP: u8 = 0x3E;
const RESET_DONE: u8 = 0x41;
const ERROR: u8 = 0x42;
const OUTPUTS: u8 = 0xC1;

/// A unit's number: four bytes, or eight from the 600 series on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DeviceId {
    /// Of four bytes.
    Short(u32),
    /// Of eight bytes.
    Long([u8; 8]),
}

/// Why a unit did not do what it was told: the first byte of its error message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ErrorCode(pub u8);

impl ErrorCode {
    /// What the code means, where the documentation says so.
    pub fn words(self) -> Option<&'static str> {
        Some(match self.0 {
            0x03 => "period out of range",
            0x04 => "message not known",
            0x1E => "timer overflow",
            0x20 => "rate out of range",
            0x21 => "parameter not valid",
            0x28 => "device error",
            _ => return None,
        })
    }
}

/// A message from a unit.
#[derive(Clone, Debug, PartialEq, Eq)]
#[allow(clippy::large_enum_variant)] // there is no heap to put the outputs on
pub enum Report<'a> {
    /// It was switched on or reset, and waits half a second for an answer before it measures.
    WakeUp,
    /// Its number.
    DeviceId(DeviceId),
    /// It is in the config state.
    ConfigState,
    /// It is in the measuring state.
    MeasuringState,
    /// It starts anew.
    Resets,
    /// The outputs that are set; after a setting, those that it has taken.
    Outputs(Outputs),
    /// A measurement.
    Data(Items<'a>),
    /// It did not do what it was told.
    Error {
        /// Why.
        code: ErrorCode,
        /// Bytes behind the code, where there are any.
        more: &'a [u8],
    },
    /// Any other message or form.
    Raw {
        /// Message identifier.
        mid: u8,
        /// Data.
        data: &'a [u8],
    },
}

impl<'a> Report<'a> {
    pub(super) fn parse(mid: u8, data: &'a [u8]) -> Result<Self, WireError> {
        let offset = data_offset(data.len());
        Ok(match (mid, data) {
            (WAKE_UP, []) => Self::WakeUp,
            (CONFIGURES, []) => Self::ConfigState,
            (MEASURES, []) => Self::MeasuringState,
            (RESET_DONE, []) => Self::Resets,
            (DEVICE_ID, _) => Self::DeviceId(device_id(data, offset)?),
            (OUTPUTS, _) => Self::Outputs(output::read(data, offset)?),
            (DATA, _) => Self::Data(Items::new(data, offset)?),
            (ERROR, [code, more @ ..]) => Self::Error { code: ErrorCode(*code), more },
            _ => Self::Raw { mid, data },
        })
    }

    fn mid(&self) -> u8 {
        match self {
            Self::WakeUp => WAKE_UP,
            Self::DeviceId(_) => DEVICE_ID,
            Self::ConfigState => CONFIGURES,
            Self::MeasuringState => MEASURES,
            Self::Resets => RESET_DONE,
            Self::Outputs(_) => OUTPUTS,
            Self::Data(_) => DATA,
            Self::Error { .. } => ERROR,
            Self::Raw { mid, .. } => *mid,
        }
    }

    fn write(&self, writer: &mut Writer<'_>) {
        match self {
            Self::DeviceId(DeviceId::Short(number)) => writer.bytes(&number.to_be_bytes()),
            Self::DeviceId(DeviceId::Long(number)) => writer.bytes(number),
            Self::Outputs(outputs) => output::write(outputs, writer),
            Self::Data(items) => writer.bytes(items.bytes()),
            Self::Error { code, more } => {
                writer.u8(code.0);
                writer.bytes(more);
            }
            Self::Raw { data, .. } => writer.bytes(data),
            Self::WakeUp | Self::ConfigState | Self::MeasuringState | Self::Resets => {}
        }
    }

    /// Bytes of the whole message.
    pub fn encoded_len(&self) -> usize {
        message_bytes(Writer::measure(|writer| self.write(writer)))
    }

    /// Writes the whole message and returns its length.
    ///
    /// # Errors
    /// `out` is too small, or the data is longer than a message can hold.
    pub fn emit(&self, out: &mut [u8]) -> Result<usize, WireError> {
        emit(self.mid(), out, |writer| self.write(writer))
    }
}

fn device_id(data: &[u8], offset: usize) -> Result<DeviceId, WireError> {
    let mut reader = Reader::new(data, offset);
    let id = match data.len() {
        8 => DeviceId::Long(reader.array()?),
        _ => DeviceId::Short(reader.be_u32()?),
    };
    reader.end_with(id)
}
