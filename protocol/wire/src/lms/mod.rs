//! SICK LMS 2xx laser scanners (LMS 200, 211, 220, 221, 291 and S14) on RS-232 and RS-422.
//!
//! A telegram is `02 | address | length | code | data | (status) | checksum`, words little-endian; only replies have
//! the status byte, and the length counts it. A good request is answered by the byte `06` and then a reply whose code
//! is the command + 80h; a damaged one by `15`. Source: SICK telegram listing 8007954/Q501, firmware V2.30 / X1.27,
//! with its misprints corrected from logs of real devices.
//!
//! Angles: `angle_deg` is the whole field of view, `resolution_cdeg` the step in hundredths of a degree; values of a
//! scan ascend counter-clockwise seen from above, from right to left.

mod baud;
mod checksum;
mod config;
mod emit;
mod faults;
mod framing;
mod measuring;
mod mode;
mod reflectivity;
mod reply;
mod request;
mod scan;
mod status;
mod status_report;
mod telegram;
mod words;

pub use crate::text::Text;
pub use baud::Baud;
pub use checksum::checksum;
pub use config::{Availability, Config};
pub use faults::{ErrorList, Fault};
pub use framing::{
    DeviceDeframer, DeviceFraming, HostDeframer, HostFraming, MAX_REPLY_BYTES, MAX_REQUEST_BYTES,
};
pub use measuring::{Flags, Measurement, MeasuringMode, Value, decode, encode};
pub use mode::{Mode, ModeResult, mode_name};
pub use reflectivity::{MAX_PARTS, PairPart, Pairs, PairsView, S14Scan, S14View, Span};
pub use reply::Reply;
pub use request::{RawRequest, Request, ScanKind};
pub use scan::{MAX_VALUES, Scan, ScanView, Selection, Unit};
pub use status::{Severity, Status};
pub use status_report::{STATUS_REPORT_BYTES, StatusFields, StatusReport};
pub use telegram::Telegram;

/// First byte of every telegram.
pub const STX: u8 = 0x02;
/// Acknowledge: the request was understood.
pub const ACK: u8 = 0x06;
/// Refusal: the request was damaged; wait at least 30 ms and send it again.
pub const NAK: u8 = 0x15;
/// Address of a request to any device.
pub const BROADCAST: u8 = 0x00;
/// Address of a reply from a device that has no address of its own.
pub const REPLY_ADDRESS: u8 = 0x80;
/// Set in the address of every reply, and in its code.
pub const REPLY_BIT: u8 = 0x80;
/// One turn of the mirror (75 Hz), in nanoseconds.
pub const MIRROR_TURN_NS: i64 = 13_320_000;
/// Password of the installation mode as delivered.
pub const PASSWORD: [u8; 8] = *b"SICK_LMS";
