//! Pioneer bases: PSOS, P2OS, AROS and ARCOS controllers.
//!
//! A packet is `FA FB | N | body | checksum`, N = body length + 2, fields of the body little-endian, the
//! checksum big-endian; the same frame both ways. The base sends a standard information packet ([`Sip`])
//! every 100 ms once it is open, and stops when it hears nothing for 2 s. Sources: Pioneer 3 and Pioneer 2/3
//! H8 operations manuals, checked against the drivers in the field.

mod checksum;
mod command;
mod emit;
mod framing;
mod packet;
mod report;
mod sip;
mod wrap;

pub use checksum::checksum;
pub use command::{Argument, Command, MAX_ARGUMENT_BYTES, RawCommand, number};
pub use framing::{Deframer, HEADER, MAX_PACKET_BYTES, P2osFraming};
pub use packet::Packet;
pub use report::{Identity, Report};
pub use sip::{MAX_SIP_EXTRA, MotorState, Sip, SonarReading};
pub use wrap::{ANGLE_UNITS_PER_TURN, wrap_angle_units, wrap15};
