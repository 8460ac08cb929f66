//! What a controller answers. The bytes alone do not say to which question: see [`Answer::accept`].

use super::{Question, Request, StatusBits, checksum};
use crate::WireError;
use crate::cursor::{Reader, Writer};
use crate::text::Text;

/// The acknowledgement of a command that writes.
const ACKNOWLEDGE: u8 = 0xFF;

/// The answer to a question.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Answer<'a> {
    /// Product and firmware version, such as `RoboClaw 2x15a v4.1.34` and a line feed, without the closing
    /// zero.
    Firmware(Text<'a>),
    /// One encoder.
    Encoder {
        /// Count, free running, wraps at 32 bits.
        counts: i32,
        /// What happened since the last reading.
        flags: EncoderFlags,
    },
    /// Both encoders at one moment.
    Encoders {
        /// Count of channel 1, free running, wraps at 32 bits.
        m1_counts: i32,
        /// Count of channel 2.
        m2_counts: i32,
    },
    /// The command has been carried out.
    Done,
    /// Main battery in tenths of a volt.
    MainBattery {
        /// Tenths of a volt.
        decivolts: u16,
    },
    /// Errors and warnings in force.
    Status(StatusBits),
}

/// Flags of one encoder. Bit 0: the count ran below 0 since the last reading; bit 1: it counts backwards; bit
/// 2: it ran over the top.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub struct EncoderFlags(
    /// The byte as sent.
    pub u8,
);

impl EncoderFlags {
    /// The count ran below 0.
    pub fn underflow(self) -> bool {
        self.0 & 1 != 0
    }

    /// The encoder counts backwards.
    pub fn backwards(self) -> bool {
        self.0 & 2 != 0
    }

    /// The count ran over the top.
    pub fn overflow(self) -> bool {
        self.0 & 4 != 0
    }
}

impl<'a> Answer<'a> {
    /// Reads exactly the answer to a request.
    ///
    /// # Errors
    /// The length is not that of the answer, the CRC does not fit address, command and data, or a field is
    /// impossible.
    pub fn accept(to: Request, bytes: &'a [u8]) -> Result<Self, WireError> {
        let Request { address, question } = to;
        let (needed, found) = (question.answer_len(bytes), bytes.len());
        let mut reader = Reader::new(bytes, 0);
        let too_short = |_| WireError::TooShort { needed, found };
        let data = reader.take(needed - question.crc_len()).map_err(too_short)?;
        if question.crc_len() > 0 {
            let offset = reader.offset();
            let found = reader.be_u16().map_err(too_short)?;
            reader.end_with(())?;
            let expected = checksum(&[&[address, question.command()], data]);
            if found != expected {
                return Err(WireError::Checksum { expected, found, offset });
            }
        }
        reader.end_with(())?;
        Answer::parse(question, data)
    }

    fn parse(question: Question, data: &'a [u8]) -> Result<Self, WireError> {
        let mut reader = Reader::new(data, 0);
        Ok(match question {
            Question::Firmware => match data.split_last() {
                Some((0, text)) => Answer::Firmware(Text(text)),
                _ => {
                    let found = u32::from(data.last().copied().unwrap_or_default());
                    let offset = data.len().saturating_sub(1);
                    return Err(WireError::Value { field: "end of the text", found, offset });
                }
            },
            Question::Encoder(_) => {
                Answer::Encoder { counts: reader.be_i32()?, flags: EncoderFlags(reader.u8()?) }
            }
            Question::Encoders => {
                Answer::Encoders { m1_counts: reader.be_i32()?, m2_counts: reader.be_i32()? }
            }
            Question::ResetEncoders => match reader.u8()? {
                ACKNOWLEDGE => Answer::Done,
                found => return Err(WireError::Byte { expected: ACKNOWLEDGE, found, offset: 0 }),
            },
            Question::MainBattery => Answer::MainBattery { decivolts: reader.be_u16()? },
            Question::Status(width) => Answer::Status(StatusBits::parse(width, &mut reader)?),
        })
    }

    /// Whether this can answer the question.
    fn fits(&self, question: Question) -> bool {
        match (self, question) {
            (Answer::Firmware(text), Question::Firmware) => !text.0.contains(&0),
            (Answer::Status(bits), Question::Status(width)) => bits.width == width,
            (Answer::Encoder { .. }, Question::Encoder(_))
            | (Answer::Encoders { .. }, Question::Encoders)
            | (Answer::Done, Question::ResetEncoders)
            | (Answer::MainBattery { .. }, Question::MainBattery) => true,
            _ => false,
        }
    }

    fn write(&self, writer: &mut Writer<'_>) {
        match self {
            Answer::Firmware(text) => {
                writer.bytes(text.0);
                writer.u8(0);
            }
            Answer::Encoder { counts, flags } => {
                writer.bytes(&counts.to_be_bytes());
                writer.u8(flags.0);
            }
            Answer::Encoders { m1_counts, m2_counts } => {
                writer.bytes(&m1_counts.to_be_bytes());
                writer.bytes(&m2_counts.to_be_bytes());
            }
            Answer::Done => writer.u8(ACKNOWLEDGE),
            Answer::MainBattery { decivolts } => writer.bytes(&decivolts.to_be_bytes()),
            Answer::Status(bits) => bits.write(writer),
        }
    }

    /// Bytes of the whole answer.
    pub fn encoded_len(&self) -> usize {
        Writer::measure(|writer| self.write(writer)) + if *self == Answer::Done { 0 } else { 2 }
    }

    /// Writes the answer to a request and returns its length.
    ///
    /// # Errors
    /// `out` is too small, the text is too long, or this answers another question.
    pub fn emit(&self, to: Request, out: &mut [u8]) -> Result<usize, WireError> {
        let command = to.question.command();
        if !self.fits(to.question) {
            let field = "command of another answer";
            return Err(WireError::Value { field, found: u32::from(command), offset: 0 });
        }
        let (needed, found) = (self.encoded_len(), out.len());
        if needed > super::MAX_ANSWER_BYTES {
            let limit = super::MAX_ANSWER_BYTES;
            return Err(WireError::Capacity { field: "text", limit, found: needed, offset: 0 });
        }
        let frame = out.get_mut(..needed).ok_or(WireError::BufferTooSmall { needed, found })?;
        let (data, crc) = frame.split_at_mut(needed - to.question.crc_len());
        let mut writer = Writer::new(data);
        self.write(&mut writer);
        writer.finish()?;
        if let Some(crc) = crc.first_chunk_mut() {
            *crc = checksum(&[&[to.address, command], data]).to_be_bytes();
        }
        Ok(needed)
    }
}
