//! Hokuyo's SCIP 2.0 (URG, UBG, UHG, UTM, UXM, UST), on serial lines and over TCP.
//!
//! Requests are lines of text. A reply is a block: the request again, a status, lines of values, an empty
//! line; all but the echo carry a sum. Numbers are written in characters of six bits. Sources: Hokuyo
//! C-42-03320B ("Communication Protocol Specification for SCIP2.0") and byte logs of a URG-04LX, a UTM-30LX
//! and a UXM-30LX-E.

mod block;
mod command;
mod framing;
mod lines;
mod numbers;
mod parameters;
mod scan;

pub use block::{Block, Status};
pub use command::{Command, Delivery, Request, ScanRequest, TimeStep};
pub use framing::{Deframer, MAX_BLOCK_BYTES, ScipFraming};
pub use lines::{KeyValue, emit_clock, emit_key_values};
pub use numbers::sum;
pub use parameters::Parameters;
pub use scan::{Reading, Readings, Scan, Values};

/// The device's clock comes round after so many milliseconds: 4 h 39 min 37.216 s.
pub const CLOCK_ROUND_MS: u32 = 1 << 24;
/// Rates of a serial line that a device may offer, in Bd.
pub const BAUDS: [u32; 7] = [19_200, 38_400, 57_600, 115_200, 250_000, 500_000, 750_000];
