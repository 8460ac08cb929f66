//! Operating modes: command 20h with its sub-commands, and the reply A0h (telegram listing, section 7.5).

use heapless::Vec;

use crate::WireError;
use crate::cursor::{Reader, Writer};
use crate::lms::baud::Baud;
use crate::lms::frame::DATA_OFFSET;
use crate::lms::scan::reflectivity::{MAX_PARTS, Span, parse_spans, write_spans};

/// What command 20h switches to.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Mode {
    /// 00: installation mode, in which the configuration may be written. The switching outputs are blocked.
    Install {
        /// As delivered: [`crate::lms::PASSWORD`].
        password: [u8; 8],
    },
    /// 10: diagnosis.
    Diagnosis,
    /// 20: the smallest value of each segment, streaming.
    StreamSegmentMinima,
    /// 21: the smallest value of each segment, when triggered.
    TriggeredSegmentMinima,
    /// 22: the smallest vertical distance, streaming.
    StreamVerticalMinimum,
    /// 23: the smallest vertical distance, when triggered.
    TriggeredVerticalMinimum,
    /// 24: every scan, complete, without being asked.
    StreamAll,
    /// 25: values on request only. The mode after power-on, and the way to stop streaming.
    OnRequest,
    /// 26: mean values of that many scans (2 to 250), streaming.
    MeanOf(u8),
    /// 27: a part of every scan, streaming. Positions count from 1, both included.
    SubRange {
        /// First value.
        first: u16,
        /// Last value.
        last: u16,
    },
    /// 28: a part of the mean of that many scans, streaming.
    MeanOfSubRange {
        /// Scans to average, 2 to 250. One byte, as drivers send it; the listing's table prints a word.
        count: u8,
        /// First value, from 1.
        first: u16,
        /// Last value.
        last: u16,
    },
    /// 29: a part of every scan with its field values, streaming.
    FieldValues(Span),
    /// 2A: the values of each mirror turn at once (partial scans), streaming.
    StreamPartial,
    /// 2B: ranges and remissions of up to five parts of every scan, streaming. The number of parts is a word,
    /// as drivers send it.
    Pairs(Vec<Span, MAX_PARTS>),
    /// 2C: segments, streaming.
    Segments,
    /// 2E: navigation.
    Navigation,
    /// 30: tests the password without switching.
    TestPassword {
        /// The password to test.
        password: [u8; 8],
    },
    /// 40, 41, 42, 48: another line rate. The reply still comes at the old one.
    Baud(Baud),
    /// 50: range and reflectivity of a part, streaming; S14 devices only.
    Reflectivity {
        /// First value, from 1.
        first: u16,
        /// Last value.
        last: u16,
    },
    /// Any other sub-command with its arguments as sent.
    Other {
        /// Sub-command.
        sub_command: u8,
        /// Bytes behind it.
        arguments: Vec<u8, 32>,
    },
}

impl Mode {
    pub(crate) fn parse(data: &[u8]) -> Result<Self, WireError> {
        let mut reader = Reader::new(data, DATA_OFFSET);
        let sub_command = reader.u8()?;
        let mode = match sub_command {
            0x00 => Mode::Install { password: reader.array()? },
            0x10 => Mode::Diagnosis,
            0x24 => Mode::StreamAll,
            0x25 => Mode::OnRequest,
            0x26 => Mode::MeanOf(reader.u8()?),
            0x27 => Mode::SubRange { first: reader.u16()?, last: reader.u16()? },
            // The same with a word for the count is 6 bytes long and stays as it is.
            0x28 if reader.remaining() == 5 => {
                Mode::MeanOfSubRange { count: reader.u8()?, first: reader.u16()?, last: reader.u16()? }
            }
            0x20 => Mode::StreamSegmentMinima,
            0x21 => Mode::TriggeredSegmentMinima,
            0x22 => Mode::StreamVerticalMinimum,
            0x23 => Mode::TriggeredVerticalMinimum,
            0x29 => Mode::FieldValues(Span::parse(&mut reader)?),
            0x2A => Mode::StreamPartial,
            0x2B => Mode::Pairs(parse_spans(&mut reader)?),
            // Their arguments, if they have any, are in no source: such a telegram stays as it is.
            0x2C if reader.remaining() == 0 => Mode::Segments,
            0x2E if reader.remaining() == 0 => Mode::Navigation,
            0x30 => Mode::TestPassword { password: reader.array()? },
            0x50 => Mode::Reflectivity { first: reader.u16()?, last: reader.u16()? },
            _ => match Baud::from_sub_command(sub_command) {
                Some(baud) => Mode::Baud(baud),
                None => Mode::Other { sub_command, arguments: arguments(&mut reader)? },
            },
        };
        reader.end_with(mode)
    }

    pub(crate) fn write(&self, writer: &mut Writer<'_>) {
        writer.u8(self.sub_command());
        match self {
            Mode::Install { password } | Mode::TestPassword { password } => writer.bytes(password),
            Mode::MeanOf(count) => writer.u8(*count),
            Mode::SubRange { first, last } | Mode::Reflectivity { first, last } => {
                writer.u16(*first);
                writer.u16(*last);
            }
            Mode::MeanOfSubRange { count, first, last } => {
                writer.u8(*count);
                writer.u16(*first);
                writer.u16(*last);
            }
            Mode::Other { arguments, .. } => writer.bytes(arguments),
            Mode::FieldValues(span) => span.write(writer),
            Mode::Pairs(spans) => write_spans(spans, writer),
            _ => {}
        }
    }

    /// The first data byte of command 20h.
    pub fn sub_command(&self) -> u8 {
        match self {
            Mode::Install { .. } => 0x00,
            Mode::Diagnosis => 0x10,
            Mode::StreamSegmentMinima => 0x20,
            Mode::TriggeredSegmentMinima => 0x21,
            Mode::StreamVerticalMinimum => 0x22,
            Mode::TriggeredVerticalMinimum => 0x23,
            Mode::StreamAll => 0x24,
            Mode::OnRequest => 0x25,
            Mode::MeanOf(_) => 0x26,
            Mode::SubRange { .. } => 0x27,
            Mode::MeanOfSubRange { .. } => 0x28,
            Mode::FieldValues(_) => 0x29,
            Mode::StreamPartial => 0x2A,
            Mode::Pairs(_) => 0x2B,
            Mode::Segments => 0x2C,
            Mode::Navigation => 0x2E,
            Mode::TestPassword { .. } => 0x30,
            Mode::Baud(baud) => baud.sub_command(),
            Mode::Reflectivity { .. } => 0x50,
            Mode::Other { sub_command, .. } => *sub_command,
        }
    }
}

/// The name of a sub-command of 20h, for example `continuous output`; `None` for one that the listing does
/// not name.
pub fn mode_name(sub_command: u8) -> Option<&'static str> {
    Some(match sub_command {
        0x00 => "installation mode",
        0x10 => "diagnosis",
        0x20 => "segment minima, continuous",
        0x21 => "segment minima, triggered",
        0x22 => "smallest vertical distance, continuous",
        0x23 => "smallest vertical distance, triggered",
        0x24 => "continuous output",
        0x25 => "values on request",
        0x26 => "mean values, continuous",
        0x27 => "part of the scan, continuous",
        0x28 => "part of mean values, continuous",
        0x29 => "part of the scan with field values, continuous",
        0x2A => "partial scans, continuous",
        0x2B => "ranges with remission, continuous",
        0x2C => "segments, continuous",
        0x2E => "navigation",
        0x50 => "ranges with remission (S14), continuous",
        _ => return None,
    })
}

fn arguments(reader: &mut Reader<'_>) -> Result<Vec<u8, 32>, WireError> {
    let (offset, found) = (reader.offset(), reader.remaining());
    Vec::from_slice(reader.rest()).map_err(|_| WireError::Capacity {
        field: "arguments of command 20h",
        limit: 32,
        found,
        offset,
    })
}

/// How a mode change went (reply A0h).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ModeResult {
    /// 00: done.
    Done,
    /// 01: not done, wrong password.
    WrongPassword,
    /// 02: not done, the device has a fault.
    Fault,
    /// A result that the listing does not name.
    Other(u8),
}

impl ModeResult {
    pub(crate) fn from_byte(byte: u8) -> Self {
        match byte {
            0 => ModeResult::Done,
            1 => ModeResult::WrongPassword,
            2 => ModeResult::Fault,
            other => ModeResult::Other(other),
        }
    }

    pub(crate) fn byte(self) -> u8 {
        match self {
            ModeResult::Done => 0,
            ModeResult::WrongPassword => 1,
            ModeResult::Fault => 2,
            ModeResult::Other(other) => other,
        }
    }
}
