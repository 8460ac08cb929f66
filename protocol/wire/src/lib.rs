//! Serial telegrams of the devices that Biplane talks to: bytes in, telegrams out, and back.
//!
//! - `deframe`: cuts a byte stream into frames, and accounts for every byte that is in none.
//! - [`lms`]: SICK LMS 2xx laser scanners.
//! - [`cola`]: SICK laser scanners over TCP (LMS1xx, LMS5xx, TiM).
//! - [`scip`]: Hokuyo laser scanners (URG, UTM, UST).
//! - [`p2os`]: Pioneer bases (PSOS, P2OS, AROS, ARCOS).
//! - [`roboclaw`]: RoboClaw motor controllers, whose replies have no header and are read question by
//!   question.
//! - [`rflex`]: rFLEX bases (B21r, ATRV, Magellan).
//! - [`xsens`]: Xsens MTi inertial units.
//!
//! The crate knows no heap, no file, no clock and no geometry. Numbers stay the device's own integers; their
//! names carry the unit. Both directions are here, so that the same code drives a device and plays one.
//!
#![doc = include_str!("../README.md")]
#![no_std]

pub mod cola;
mod cursor;
pub mod error;
pub mod framing;
pub mod lms;
pub mod p2os;
pub mod rflex;
pub mod roboclaw;
pub mod scip;
pub mod text;
pub mod xsens;

pub use crate::framing::{Counts, Deframer, Item, SkipReason};
pub use error::WireError;
pub use text::Text;
