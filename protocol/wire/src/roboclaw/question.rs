//! What a host asks, and how many bytes answer it.

use super::{StatusWidth, checksum};
use crate::WireError;
use crate::cursor::{Reader, Writer};

/// Lowest address that a controller can have.
pub const FIRST_ADDRESS: u8 = 0x80;
/// Highest address.
pub const LAST_ADDRESS: u8 = 0x87;
/// Longest request: address, command, CRC.
pub const MAX_REQUEST_BYTES: usize = 4;

/// Longest answer: the firmware text of 48 bytes and its CRC.
pub const MAX_ANSWER_BYTES: usize = 50;

const ENCODER_M1: u8 = 16;
const ENCODER_M2: u8 = 17;
const RESET_ENCODERS: u8 = 20;
const FIRMWARE: u8 = 21;
const MAIN_BATTERY: u8 = 24;
const ENCODERS: u8 = 78;
const STATUS: u8 = 90;

/// One of the controller's two motor channels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Motor {
    /// Channel 1.
    M1,
    /// Channel 2.
    M2,
}

/// A question. The bytes of its answer mean something only together with it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Question {
    /// 21: product and firmware version, a text closed by a zero byte.
    Firmware,
    /// 16, 17: one encoder's count with its flags. Reading clears the flags.
    Encoder(Motor),
    /// 78: both encoders' counts, taken at one moment.
    Encoders,
    /// 20: sets both counts to zero. The only one that changes anything.
    ResetEncoders,
    /// 24: voltage of the main battery.
    MainBattery,
    /// 90: errors and warnings. How wide the answer is depends on the firmware's age, the question does not
    /// tell.
    Status(StatusWidth),
}

impl Question {
    /// The command byte.
    pub fn command(self) -> u8 {
        match self {
            Question::Firmware => FIRMWARE,
            Question::Encoder(Motor::M1) => ENCODER_M1,
            Question::Encoder(Motor::M2) => ENCODER_M2,
            Question::Encoders => ENCODERS,
            Question::ResetEncoders => RESET_ENCODERS,
            Question::MainBattery => MAIN_BATTERY,
            Question::Status(_) => STATUS,
        }
    }

    /// Whether the request carries a CRC: those that write do, those that read do not.
    fn writes(self) -> bool {
        self == Question::ResetEncoders
    }

    /// Bytes of data in the answer; `None` for the text, which says itself where it ends.
    pub(crate) fn data_len(self) -> Option<usize> {
        match self {
            Question::Firmware => None,
            Question::Encoder(_) => Some(5),
            Question::Encoders => Some(8),
            Question::ResetEncoders => Some(1),
            Question::MainBattery => Some(2),
            Question::Status(width) => Some(width.bytes()),
        }
    }

    /// Bytes of CRC behind the data: an acknowledgement has none.
    pub(crate) fn crc_len(self) -> usize {
        if self.writes() { 0 } else { 2 }
    }

    /// Bytes of the whole answer that begins with `head`: exact, except for a text whose end has not come, of
    /// which this is the shortest possible length. Never more than [`MAX_ANSWER_BYTES`].
    pub fn answer_len(self, head: &[u8]) -> usize {
        let data_len = self.data_len().unwrap_or_else(|| {
            let end = head.iter().position(|&byte| byte == 0);
            (end.unwrap_or(head.len()) + 1).min(MAX_ANSWER_BYTES - self.crc_len())
        });
        data_len + self.crc_len()
    }
}

/// A question to the controller of an address, as bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Request {
    /// Whom it is for, [`FIRST_ADDRESS`] to [`LAST_ADDRESS`].
    pub address: u8,
    /// What is asked.
    pub question: Question,
}

impl Request {
    /// Reads exactly one request. The status is taken to be asked for in its wide form: the bytes do not
    /// tell.
    ///
    /// # Errors
    /// No such address or command, a wrong CRC, too few or too many bytes.
    pub fn parse(bytes: &[u8]) -> Result<Self, WireError> {
        let mut reader = Reader::new(bytes, 0);
        let address = checked_address(reader.u8()?)?;
        let command = reader.u8()?;
        let question = match command {
            ENCODER_M1 => Question::Encoder(Motor::M1),
            ENCODER_M2 => Question::Encoder(Motor::M2),
            RESET_ENCODERS => Question::ResetEncoders,
            FIRMWARE => Question::Firmware,
            MAIN_BATTERY => Question::MainBattery,
            ENCODERS => Question::Encoders,
            STATUS => Question::Status(StatusWidth::Wide),
            other => {
                return Err(WireError::Value { field: "command", found: u32::from(other), offset: 1 });
            }
        };
        if question.writes() {
            let (found, expected) = (reader.be_u16()?, checksum(&[&[address, command]]));
            reader.end_with(())?;
            if found != expected {
                return Err(WireError::Checksum { expected, found, offset: 2 });
            }
        }
        reader.end_with(Self { address, question })
    }

    /// Bytes of the request.
    pub fn encoded_len(&self) -> usize {
        if self.question.writes() { 4 } else { 2 }
    }

    /// Writes the request and returns its length.
    ///
    /// # Errors
    /// `out` is too small, or no controller can have the address.
    pub fn emit(&self, out: &mut [u8]) -> Result<usize, WireError> {
        let head = [checked_address(self.address)?, self.question.command()];
        let mut writer = Writer::new(out);
        writer.bytes(&head);
        if self.question.writes() {
            writer.bytes(&checksum(&[&head]).to_be_bytes());
        }
        writer.finish().map(|written| written.len())
    }
}

fn checked_address(address: u8) -> Result<u8, WireError> {
    if (FIRST_ADDRESS..=LAST_ADDRESS).contains(&address) {
        Ok(address)
    } else {
        Err(WireError::Value { field: "address", found: u32::from(address), offset: 0 })
    }
}
