//! Xsens MTi inertial units (MTi-1, 10, 100, 600 series and MTi-G-710): the Xbus messages of their serial
//! line.
//!
//! A message is `FA FF | MID | length | data | checksum`, the same frame both ways, numbers big-endian;
//! length `FF` announces two more bytes of length. The sum of all bytes behind `FA` is 0 modulo 256, so one
//! damaged message in 256 passes: its items must fit each other as well. Bytes are not stuffed. Measurements
//! are rows of items in a [`Report::Data`]. Sources: Xsens, MT Low-Level Communication Protocol Documentation
//! (MT0101P) and MTi 1-series datasheet; byte logs of an MTi-300 in the tests of the library xsens-mti; the
//! drivers xsens_driver (ETH) and Xsens' own. Nothing here has been tried on hardware.

mod checksum;
mod command;
mod emit;
mod framing;
mod items;
mod message;
mod number;
mod output;
mod report;
mod sample;
#[cfg(test)]
mod tests;

pub use checksum::checksum;
pub use command::{Command, RawMessage};
pub use framing::{Deframer, MAX_DATA_BYTES, MAX_MESSAGE_BYTES, MIN_EXTENDED_BYTES, PREAMBLE, XsensFraming};
pub use items::{Item, Items, ItemsWriter, MAX_ITEMS_BYTES};
pub use message::Message;
pub use number::Precision;
pub use output::{EVERY_SAMPLE, MAX_OUTPUTS, Output, Outputs};
pub use report::{DeviceId, ErrorCode, Report};
pub use sample::Sample;

/// What the items of a measurement say: the upper twelve bits of their identifier. The lower four say how
/// numbers are written ([`Precision`]) and in which axes (bits 2 and 3).
pub mod quantity {
    /// A count of messages, 16 bits.
    pub const PACKET_COUNTER: u16 = 0x1020;
    /// The moment of the sample in ten-thousandths of a second, 32 bits; wraps after five days.
    pub const SAMPLE_TIME_FINE: u16 = 0x1060;
    /// The same in whole seconds.
    pub const SAMPLE_TIME_COARSE: u16 = 0x1070;
    /// Acceleration with gravity in the unit's axes, m/s^2.
    pub const ACCELERATION: u16 = 0x4020;
    /// Turn rates in the unit's axes, rad/s.
    pub const RATE_OF_TURN: u16 = 0x8020;
    /// Flags, 32 bits.
    pub const STATUS_WORD: u16 = 0xE020;
    /// The bits of an identifier that name the quantity.
    pub const MASK: u16 = 0xFFF0;
}

/// Bits of the status word.
pub mod status {
    /// The self-test was passed.
    pub const SELF_TEST: u32 = 1 << 0;
    /// Some sensor was out of its range during the sample.
    pub const CLIPPING: u32 = 1 << 19;
}
