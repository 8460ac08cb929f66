//! rFLEX bases of RWI and iRobot: B21r, ATRV, Magellan.
//!
//! A packet is `1B 02 | port | id | opcode | n | n bytes of data | xor | 1B 03`, the same frame both ways,
//! numbers big-endian. Bytes are not stuffed. The base reports path length and bearing, one axis a packet;
//! both count freely and wrap at 32 bits. Sources: the drivers of Player and CARMEN with the description
//! found there; no manufacturer's document is known, and nothing here has been tried on hardware.

mod checksum;
mod command;
mod emit;
mod framing;
mod packet;
mod report;

pub use checksum::checksum;
pub use command::{AxisMotion, Command, RawPacket};
pub use framing::{Deframer, HEADER, MAX_DATA_BYTES, MAX_PACKET_BYTES, RflexFraming, TRAILER};
pub use packet::Packet;
pub use report::{DigitalReport, MotionReport, Report, SystemStatus};

/// Port of the base itself.
pub const SYSTEM_PORT: u8 = 1;
/// Port of the motion axes.
pub const MOTION_PORT: u8 = 2;
/// Port of the digital inputs.
pub const DIGITAL_PORT: u8 = 5;
/// Axis number of the path length.
pub const TRANSLATION: u8 = 0;
/// Axis number of the bearing.
pub const ROTATION: u8 = 1;
/// Both axes, as the motion reports' mask has them.
pub const BOTH_AXES: u32 = 0b11;
