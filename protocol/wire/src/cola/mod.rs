//! SICK's CoLa over TCP: LMS1xx, LMS5xx, TiM5xx, TiM7xx.
//!
//! Two dialects carry the same telegrams. CoLa A is text between `02` and `03`: tokens with one blank between
//! them, numbers in hex without leading zeros or in decimal with a sign. CoLa B is `02 02 02 02`, a length of
//! four bytes, the name in ASCII with the data in bytes behind it (big-endian), and the XOR of all that.
//! Sources: SICK's telegram listing 8014631 and captures of an LMS111, an LMS511 and a TiM871S; CoLa A was
//! read in print only.

mod family;
mod fields;
mod framing;
mod kind;
mod scan;
mod settings;
mod telegram;

pub use family::{Family, Offer};
pub use framing::{ColaFraming, Deframer, MAX_TELEGRAM_BYTES, checksum};
pub use kind::Kind;
pub use scan::{
    Channel, Clock, Encoder, Event, Head, MAX_CHANNELS, MAX_ENCODERS, Position, Scan, Values, Width,
};
pub use settings::{
    CLIENT_HASH, OutputRange, SAFETY_CLIENT_HASH, ScanConfig, ScanDataConfig, emit_byte, emit_login,
    emit_texts, parse_byte, parse_login, parse_texts,
};
pub use telegram::{Dialect, Telegram};

/// Values below this are no ranges, as counted before scaling: 0 no echo, 1 dazzled, 2 implausible, 3
/// filtered; up to 15 reserved.
pub const FIRST_RANGE: u16 = 16;
