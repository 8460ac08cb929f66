//! What a base reports (Pioneer 3 manual, "server information packets").

use super::emit::{self, BODY_OFFSET};
use super::{MotorState, Sip};
use crate::WireError;
use crate::cursor::{Reader, Writer};
use crate::text::Text;

const CONFIG: u8 = 0x20;
const ENCODER: u8 = 0x90;

/// A packet from a base.
#[derive(Clone, Debug, PartialEq, Eq)]
#[allow(clippy::large_enum_variant)] // there is no heap to put the information packet on
pub enum Report<'a> {
    /// Echo of SYNC0 or SYNC1.
    Sync(u8),
    /// Answer to SYNC2.
    Identity(Identity<'a>),
    /// The standard information packet.
    Sip(Sip),
    /// 20h: the configuration, its bytes behind the type.
    Config(&'a [u8]),
    /// 90h: wheel encoder counts, free running.
    Encoder {
        /// Left wheel.
        left_counts: i32,
        /// Right wheel.
        right_counts: i32,
    },
    /// Any other packet.
    Raw {
        /// First byte of the body.
        kind: u8,
        /// The rest of the body.
        data: &'a [u8],
    },
}

/// Who a base says it is. The subclass (such as `p3dx-sh`) picks its parameters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Identity<'a> {
    /// Name given by the owner.
    pub name: Text<'a>,
    /// Class, `Pioneer`.
    pub class: Text<'a>,
    /// Subclass.
    pub subclass: Text<'a>,
}

impl<'a> Identity<'a> {
    /// Reads three strings, each closed by a zero byte; the last zero may be missing, and more may follow.
    fn parse(data: &'a [u8]) -> Result<Self, WireError> {
        let found = 1 + BODY_OFFSET + data.len();
        let mut strings = data.split(|&byte| byte == 0).map(Text);
        let mut string = || strings.next().ok_or(WireError::TooShort { needed: found + 1, found });
        Ok(Self { name: string()?, class: string()?, subclass: string()? })
    }

    fn write(&self, writer: &mut Writer<'_>) {
        for text in [self.name, self.class, self.subclass] {
            writer.bytes(text.0);
            writer.u8(0);
        }
    }
}

impl<'a> Report<'a> {
    pub(crate) fn parse(kind: u8, data: &'a [u8]) -> Result<Self, WireError> {
        if let Some(state) = MotorState::from_kind(kind) {
            return Sip::parse(state, data).map(Report::Sip);
        }
        Ok(match (kind, data) {
            (0 | 1, []) => Report::Sync(kind),
            (2, [_, ..]) => Report::Identity(Identity::parse(data)?),
            (CONFIG, _) => Report::Config(data),
            (ENCODER, _) => {
                let mut reader = Reader::new(data, BODY_OFFSET + 1);
                let report = Report::Encoder { left_counts: reader.i32()?, right_counts: reader.i32()? };
                reader.end_with(report)?
            }
            _ => Report::Raw { kind, data },
        })
    }

    fn write(&self, writer: &mut Writer<'_>) {
        match self {
            Report::Sync(step) => writer.u8(*step),
            Report::Identity(identity) => {
                writer.u8(2);
                identity.write(writer);
            }
            Report::Sip(sip) => sip.write(writer),
            Report::Config(data) => {
                writer.u8(CONFIG);
                writer.bytes(data);
            }
            Report::Encoder { left_counts, right_counts } => {
                writer.u8(ENCODER);
                writer.bytes(&left_counts.to_le_bytes());
                writer.bytes(&right_counts.to_le_bytes());
            }
            Report::Raw { kind, data } => {
                writer.u8(*kind);
                writer.bytes(data);
            }
        }
    }

    /// Bytes of the whole packet.
    pub fn encoded_len(&self) -> usize {
        emit::framed_len(|writer| self.write(writer))
    }

    /// Writes the whole packet and returns its length.
    ///
    /// # Errors
    /// `out` is too small, or the body is longer than a packet can hold.
    pub fn emit(&self, out: &mut [u8]) -> Result<usize, WireError> {
        emit::emit(out, |writer| self.write(writer))
    }
}
