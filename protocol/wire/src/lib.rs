//! Serial telegrams of the devices that Biplane talks to: bytes in, telegrams out, and back.
//!
//! - [`deframe`]: cuts a byte stream into frames, and accounts for every byte that is in none.
//! - [`lms`]: SICK LMS 2xx laser scanners.
//! - [`p2os`]: Pioneer bases (PSOS, P2OS, AROS, ARCOS).
//! - [`roboclaw`]: RoboClaw motor controllers, whose replies have no header and are read question by question.
//! - [`rflex`]: rFLEX bases (B21r, ATRV, Magellan).
//!
//! The crate knows no heap, no file, no clock and no geometry. Numbers stay the device's own integers; their names
//! carry the unit. Both directions are here, so that the same code drives a device and plays one.
//!
//! ```
//! use biplane_wire::Item;
//! use biplane_wire::lms::{DeviceDeframer, ModeResult, Reply, Telegram};
//!
//! let mut line = DeviceDeframer::new();
//! line.push(&[0x55, 0x02, 0x80, 0x03, 0x00, 0xA0, 0x00, 0x10, 0x16, 0x0A]);
//! assert!(matches!(line.next(), Some(Item::Skipped { offset: 0, count: 1, .. })));
//! let Some(Item::Frame { bytes, .. }) = line.next() else { panic!("a telegram") };
//! assert_eq!(Telegram::parse(bytes)?.reply()?, Reply::Mode(ModeResult::Done));
//! assert_eq!(line.counts().bytes(), 10);
//! # Ok::<(), biplane_wire::WireError>(())
//! ```
#![no_std]

mod cursor;
pub mod deframe;
pub mod error;
pub mod lms;
pub mod p2os;
pub mod rflex;
pub mod roboclaw;
pub mod text;

pub use deframe::{Counts, Deframer, Item, SkipReason};
pub use error::WireError;
pub use text::Text;
