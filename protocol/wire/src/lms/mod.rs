//! SICK LMS 2xx laser scanners (LMS 200, 211, 220, 221, 291 and S14) on RS-232 and RS-422.
//!
//! A telegram is `02 | address | length | code | data | (status) | checksum`, words little-endian; only
//! replies have the status byte, and the length counts it. A good request is answered by the byte `06` and
//! then a reply whose code is the command + 80h; a damaged one by `15`. Source: SICK telegram listing
//! 8007954/Q501, firmware V2.30 / X1.27, with its misprints corrected from logs of real devices.
//!
//! Angles: `angle_deg` is the whole field of view, `resolution_cdeg` the step in hundredths of a degree;
//! values of a scan ascend counter-clockwise seen from above, from right to left.

mod baud;
mod describe;
mod frame;
mod framing;
mod reply;
mod request;
mod scan;
pub(crate) mod settings;
mod status;
mod telegram;

pub use crate::lms::scan::reflectivity::{MAX_PARTS, PairPart, Pairs, PairsView, S14Scan, S14View, Span};
pub use crate::lms::settings::config::{Availability, Config};
pub use crate::lms::settings::measuring::{Flags, Measurement, MeasuringMode, Value, decode, encode};
pub use crate::lms::settings::mode::{Mode, ModeResult, mode_name};
pub use crate::lms::status::faults::{ErrorList, Fault};
pub use crate::lms::status::report::{STATUS_REPORT_BYTES, StatusFields, StatusReport};
pub use crate::text::Text;
pub use baud::Baud;
pub use frame::{ACK, BROADCAST, MIRROR_TURN_NS, NAK, PASSWORD, REPLY_ADDRESS, REPLY_BIT, STX, checksum};
pub use framing::{
    DeviceDeframer, DeviceFraming, HostDeframer, HostFraming, MAX_REPLY_BYTES, MAX_REQUEST_BYTES,
};
pub use reply::Reply;
pub use request::{RawRequest, Request, ScanKind};
pub use scan::{MAX_VALUES, Scan, ScanView, Selection, Unit};
pub use status::{Severity, Status};
pub use telegram::Telegram;
