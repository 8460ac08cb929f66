//! What a base reports.

use super::emit;
use super::framing::DATA_OFFSET;
use super::{DIGITAL_PORT, MOTION_PORT, SYSTEM_PORT};
use crate::WireError;
use crate::cursor::{Reader, Writer};

const STATUS: u8 = 1;
const MOTION: u8 = 33;
const DIGITAL: u8 = 1;

/// Motion of one axis. Counts are integers of the base; how many make a meter or a radian depends on its
/// model.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct MotionReport {
    /// Meaning not known; 0 as far as is known.
    pub return_value: u32,
    /// The base's own clock, unit not known for certain.
    pub time: u32,
    /// 0 translation, 1 rotation.
    pub axis: u8,
    /// Counts, free running, wraps at 32 bits.
    pub position: i32,
    /// Counts a second.
    pub velocity: i32,
    /// Counts a second squared.
    pub acceleration: i32,
    /// The base's own unit.
    pub torque: i32,
}

/// State of the base.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct SystemStatus {
    /// The base's own clock.
    pub time: u32,
    /// Battery in hundredths of a volt, short of an offset that depends on the model.
    pub centivolts: u32,
    /// Not 0 while the brake is on.
    pub brake: u8,
}

/// State of the digital inputs at one address; bumpers begin at address 40h.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct DigitalReport {
    /// The base's own clock.
    pub time: u32,
    /// Which inputs.
    pub address: u8,
    /// Their state.
    pub data: u16,
}

/// A packet from a base.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Report<'a> {
    /// Motion of one axis.
    Motion(MotionReport),
    /// State of the base.
    Status(SystemStatus),
    /// Digital inputs.
    Digital(DigitalReport),
    /// Any other packet.
    Raw {
        /// Port.
        port: u8,
        /// Opcode.
        opcode: u8,
        /// Data.
        data: &'a [u8],
    },
}

impl<'a> Report<'a> {
    pub(crate) fn parse(port: u8, opcode: u8, data: &'a [u8]) -> Result<Self, WireError> {
        let mut reader = Reader::new(data, DATA_OFFSET);
        let report = match (port, opcode) {
            (MOTION_PORT, MOTION) => Report::Motion(MotionReport {
                return_value: reader.be_u32()?,
                time: reader.be_u32()?,
                axis: reader.u8()?,
                position: reader.be_i32()?,
                velocity: reader.be_i32()?,
                acceleration: reader.be_i32()?,
                torque: reader.be_i32()?,
            }),
            (SYSTEM_PORT, STATUS) => Report::Status(SystemStatus {
                time: reader.be_u32()?,
                centivolts: reader.be_u32()?,
                brake: reader.u8()?,
            }),
            (DIGITAL_PORT, DIGITAL) => Report::Digital(DigitalReport {
                time: reader.be_u32()?,
                address: reader.u8()?,
                data: reader.be_u16()?,
            }),
            (port, opcode) => Report::Raw { port, opcode, data: reader.rest() },
        };
        reader.end_with(report)
    }

    /// Port and opcode.
    fn place(&self) -> (u8, u8) {
        match *self {
            Report::Motion(_) => (MOTION_PORT, MOTION),
            Report::Status(_) => (SYSTEM_PORT, STATUS),
            Report::Digital(_) => (DIGITAL_PORT, DIGITAL),
            Report::Raw { port, opcode, .. } => (port, opcode),
        }
    }

    fn write(&self, writer: &mut Writer<'_>) {
        match self {
            Report::Motion(motion) => {
                writer.bytes(&motion.return_value.to_be_bytes());
                writer.bytes(&motion.time.to_be_bytes());
                writer.u8(motion.axis);
                for word in [motion.position, motion.velocity, motion.acceleration, motion.torque] {
                    writer.bytes(&word.to_be_bytes());
                }
            }
            Report::Status(status) => {
                writer.bytes(&status.time.to_be_bytes());
                writer.bytes(&status.centivolts.to_be_bytes());
                writer.u8(status.brake);
            }
            Report::Digital(digital) => {
                writer.bytes(&digital.time.to_be_bytes());
                writer.u8(digital.address);
                writer.bytes(&digital.data.to_be_bytes());
            }
            Report::Raw { data, .. } => writer.bytes(data),
        }
    }

    /// Bytes of the whole packet.
    pub fn encoded_len(&self) -> usize {
        super::framing::OVERHEAD + Writer::measure(|writer| self.write(writer))
    }

    /// Writes the whole packet with this id (a base counts it up) and returns its length.
    ///
    /// # Errors
    /// `out` is too small, or the data is longer than a packet can hold.
    pub fn emit(&self, id: u8, out: &mut [u8]) -> Result<usize, WireError> {
        let (port, opcode) = self.place();
        emit::emit(port, id, opcode, out, |writer| self.write(writer))
    }
}
