//! Biplane's files: posed scans and serial captures in MCAP, and the `rig.toml` that goes with them.
//!
//! A recording is an MCAP file of profile `ros2`: standard message types in CDR with complete `ros2msg`
//! schemas, so that other people's programs open it. The way through this crate:
//!
//! * [`topics`]: what is written where, under which name and type. [`messages::schema`]: the texts that
//!   describe the types.
//! * `msg`: the messages as owned structs; `cdr`: their bytes.
//! * `mod@write`, `read`: a file, message by message. `mod@recover`: what can be saved of a broken one.
//! * [`capture`]: serial bytes as messages. [`rig`]: mounts, ports and the time model of a scan.
//! * [`file_kind`]: what a file is that is no recording.
//!
//! Frames: `map` -> `odom` -> `base_link` -> `laser_*` (REP 105), x forward, y left, z up (REP 103). Units:
//! meters, radians, seconds; stamps are whole nanoseconds as `i64`, UTC when recorded live.
//!
#![doc = include_str!("../README.md")]

pub mod capture;
pub mod file_kind;
pub mod mcap;
pub mod messages;
pub mod rig;
pub mod topics;

pub use crate::mcap::read::{Entry, ReadError, Reader, Recording};
pub use crate::mcap::recover::{RecoverError, RecoverReport, recover, recover_over, recover_with};
pub use crate::mcap::write::{
    Disk, PartsReport, PartsWriter, Rotation, WriteError, WriteReport, Writer, WriterOptions,
};
pub use crate::messages::cdr::CdrError;
pub use crate::messages::{AnyMessage, Message};
pub use rig::{Rig, RigError};
pub use topics::{Direction, Port, Topic};
