//! What a host commands.

use heapless::Vec;

use super::emit;
use super::{DIGITAL_PORT, MAX_DATA_BYTES, MOTION_PORT, SYSTEM_PORT};
use crate::WireError;
use crate::cursor::{Reader, Writer};

const STATUS: u8 = 1;
const SET_DIRECTION: u8 = 7;
const SET_DEFAULTS: u8 = 10;
const BRAKE_ON: u8 = 11;
const BRAKE_OFF: u8 = 12;
const MOTION_REPORTS: u8 = 34;
const DIGITAL_REPORTS: u8 = 0;

/// Speed, acceleration, torque and direction for one axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AxisMotion {
    /// 0 translation, 1 rotation.
    pub axis: u8,
    /// Counts a second.
    pub speed: u32,
    /// Counts a second squared.
    pub acceleration: u32,
    /// Torque limit in the base's own unit.
    pub torque: u32,
    /// 1 forward or to the left, 0 the other way.
    pub direction: u8,
}

/// A command to a base.
#[derive(Clone, Debug, PartialEq, Eq)]
#[allow(clippy::large_enum_variant)] // there is no heap to put the raw form on
pub enum Command {
    /// Asks for [`super::Report::Status`].
    Status,
    /// Motion reports of the axes in the mask, each after so long; 0 and 0 stop them.
    MotionReports {
        /// Microseconds, though a source says milliseconds: only then 100000 makes sense.
        period_us: u32,
        /// One bit an axis.
        axes: u32,
    },
    /// Reports of the digital inputs, each after so long; 0 stops them.
    DigitalReports {
        /// Microseconds.
        period_us: u32,
    },
    /// The motion parameters to their defaults.
    SetDefaults,
    /// Puts the brake on.
    BrakeOn,
    /// Takes the brake off.
    BrakeOff,
    /// Lets an axis go on in a direction. With speed 0 it stands.
    SetDirection(AxisMotion),
    /// Any other command or form, as sent.
    Raw(RawPacket),
}

/// Port, opcode and data as sent.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RawPacket {
    /// Port.
    pub port: u8,
    /// Opcode.
    pub opcode: u8,
    /// Data.
    pub data: Vec<u8, MAX_DATA_BYTES>,
}

impl Command {
    pub(crate) fn parse(port: u8, opcode: u8, data: &[u8]) -> Self {
        Self::known(port, opcode, data).unwrap_or_else(|| {
            let data = Vec::from_slice(data).unwrap_or_default();
            Command::Raw(RawPacket { port, opcode, data })
        })
    }

    fn known(port: u8, opcode: u8, data: &[u8]) -> Option<Self> {
        let mut reader = Reader::new(data, 0);
        let command = match (port, opcode, data.len()) {
            (SYSTEM_PORT, STATUS, 0) => Command::Status,
            (MOTION_PORT, SET_DEFAULTS, 0) => Command::SetDefaults,
            (MOTION_PORT, BRAKE_ON, 0) => Command::BrakeOn,
            (MOTION_PORT, BRAKE_OFF, 0) => Command::BrakeOff,
            (MOTION_PORT, MOTION_REPORTS, 8) => {
                Command::MotionReports { period_us: reader.be_u32().ok()?, axes: reader.be_u32().ok()? }
            }
            (DIGITAL_PORT, DIGITAL_REPORTS, 4) => {
                Command::DigitalReports { period_us: reader.be_u32().ok()? }
            }
            (MOTION_PORT, SET_DIRECTION, 14) => Command::SetDirection(AxisMotion {
                axis: reader.u8().ok()?,
                speed: reader.be_u32().ok()?,
                acceleration: reader.be_u32().ok()?,
                torque: reader.be_u32().ok()?,
                direction: reader.u8().ok()?,
            }),
            _ => return None,
        };
        Some(command)
    }

    /// Port and opcode.
    fn place(&self) -> (u8, u8) {
        match self {
            Command::Status => (SYSTEM_PORT, STATUS),
            Command::MotionReports { .. } => (MOTION_PORT, MOTION_REPORTS),
            Command::DigitalReports { .. } => (DIGITAL_PORT, DIGITAL_REPORTS),
            Command::SetDefaults => (MOTION_PORT, SET_DEFAULTS),
            Command::BrakeOn => (MOTION_PORT, BRAKE_ON),
            Command::BrakeOff => (MOTION_PORT, BRAKE_OFF),
            Command::SetDirection(_) => (MOTION_PORT, SET_DIRECTION),
            Command::Raw(raw) => (raw.port, raw.opcode),
        }
    }

    fn write(&self, writer: &mut Writer<'_>) {
        match self {
            Command::MotionReports { period_us, axes } => {
                writer.bytes(&period_us.to_be_bytes());
                writer.bytes(&axes.to_be_bytes());
            }
            Command::DigitalReports { period_us } => writer.bytes(&period_us.to_be_bytes()),
            Command::SetDirection(motion) => {
                writer.u8(motion.axis);
                for word in [motion.speed, motion.acceleration, motion.torque] {
                    writer.bytes(&word.to_be_bytes());
                }
                writer.u8(motion.direction);
            }
            Command::Raw(raw) => writer.bytes(&raw.data),
            Command::Status | Command::SetDefaults | Command::BrakeOn | Command::BrakeOff => {}
        }
    }

    /// Bytes of the whole packet.
    pub fn encoded_len(&self) -> usize {
        super::framing::OVERHEAD + Writer::measure(|writer| self.write(writer))
    }

    /// Writes the whole packet with this id (a host sends 0 or 4) and returns its length.
    ///
    /// # Errors
    /// `out` is too small.
    pub fn emit(&self, id: u8, out: &mut [u8]) -> Result<usize, WireError> {
        let (port, opcode) = self.place();
        emit::emit(port, id, opcode, out, |writer| self.write(writer))
    }
}
