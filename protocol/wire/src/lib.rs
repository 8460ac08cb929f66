//! Serial telegrams of the devices that Biplane talks to: bytes in, telegrams out, and back.
//!
//! - [`deframe`]: cuts a byte stream into frames, and accounts for every byte that is in none.
//! - [`lms`]: SICK LMS 2xx laser scanners.
//! - [`p2os`]: Pioneer bases (PSOS, P2OS, AROS, ARCOS).
//!
//! The crate knows no heap, no file, no clock and no geometry. Numbers stay the device's own integers; their names
//! carry the unit. Both directions are here, so that the same code drives a device and plays one.
#![no_std]

mod cursor;
pub mod deframe;
pub mod error;
pub mod lms;
pub mod p2os;
pub mod text;

pub use deframe::{Counts, Deframer, Item, SkipReason};
pub use error::WireError;
pub use text::Text;
