//! What a host asks of a unit.

use heapless::Vec;

use super::emit::{data_offset, emit, message_bytes};
use super::output::{self, Outputs};
use crate::WireError;
use crate::cursor::Writer;

const ASK_DEVICE_ID: u8 = 0x00;
const GO_TO_MEASUREMENT: u8 = 0x10;
const GO_TO_CONFIG: u8 = 0x30;
const WAKE_UP_ACKNOWLEDGE: u8 = 0x3F;
const RESET: u8 = 0x40;
const OUTPUTS: u8 = 0xC0;

/// Most data bytes of a command that is kept as sent.
const MAX_RAW_BYTES: usize = 254;

/// A command to a unit.
#[derive(Clone, Debug, PartialEq, Eq)]
#[allow(clippy::large_enum_variant)] // there is no heap to put the raw form on
pub enum Command {
    /// Asks for its number: [`super::Report::DeviceId`].
    AskDeviceId,
    /// Out of the measuring state: measurements stop, and it takes settings.
    GoToConfig,
    /// Into the measuring state.
    GoToMeasurement,
    /// Answers [`super::Report::WakeUp`] within half a second: the unit stays in the config state.
    WakeUpAcknowledge,
    /// Starts the unit anew.
    Reset,
    /// Asks which outputs are set.
    AskOutputs,
    /// Sets the outputs; they stay over a power cycle.
    SetOutputs(Outputs),
    /// Any other command or form, as sent.
    Raw(RawMessage),
}

/// Identifier and data as sent.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RawMessage {
    /// Message identifier.
    pub mid: u8,
    /// Data.
    pub data: Vec<u8, MAX_RAW_BYTES>,
}

impl Command {
    pub(super) fn parse(mid: u8, data: &[u8]) -> Result<Self, WireError> {
        Ok(match (mid, data.len()) {
            (ASK_DEVICE_ID, 0) => Self::AskDeviceId,
            (GO_TO_CONFIG, 0) => Self::GoToConfig,
            (GO_TO_MEASUREMENT, 0) => Self::GoToMeasurement,
            (WAKE_UP_ACKNOWLEDGE, 0) => Self::WakeUpAcknowledge,
            (RESET, 0) => Self::Reset,
            (OUTPUTS, 0) => Self::AskOutputs,
            (OUTPUTS, _) => Self::SetOutputs(output::read(data, data_offset(data.len()))?),
            _ => {
                let (limit, offset) = (MAX_RAW_BYTES, data_offset(data.len()));
                let found = data.len();
                let too_long = |_| WireError::Capacity { field: "data", limit, found, offset };
                Self::Raw(RawMessage { mid, data: Vec::from_slice(data).map_err(too_long)? })
            }
        })
    }

    fn mid(&self) -> u8 {
        match self {
            Self::AskDeviceId => ASK_DEVICE_ID,
            Self::GoToConfig => GO_TO_CONFIG,
            Self::GoToMeasurement => GO_TO_MEASUREMENT,
            Self::WakeUpAcknowledge => WAKE_UP_ACKNOWLEDGE,
            Self::Reset => RESET,
            Self::AskOutputs | Self::SetOutputs(_) => OUTPUTS,
            Self::Raw(raw) => raw.mid,
        }
    }

    fn write(&self, writer: &mut Writer<'_>) {
        match self {
            Self::SetOutputs(outputs) => output::write(outputs, writer),
            Self::Raw(raw) => writer.bytes(&raw.data),
            Self::AskDeviceId
            | Self::GoToConfig
            | Self::GoToMeasurement
            | Self::WakeUpAcknowledge
            | Self::Reset
            | Self::AskOutputs => {}
        }
    }

    /// Bytes of the whole message.
    pub fn encoded_len(&self) -> usize {
        message_bytes(Writer::measure(|writer| self.write(writer)))
    }

    /// Writes the whole message and returns its length.
    ///
    /// # Errors
    /// `out` is too small.
    pub fn emit(&self, out: &mut [u8]) -> Result<usize, WireError> {
        emit(self.mid(), out, |writer| self.write(writer))
    }
}
