//! The onboard process: device sessions, time stamps, scan matching in real time, recording.
//!
//! Bytes of three serial lines come in with their times; posed scans go out to an MCAP file. The core ([`engine`]) knows no
//! port, no thread and no clock, so that a recorded run and a replayed capture go the same way.

pub mod allocations;
pub mod basin;
pub mod bench;
pub mod cli;
pub mod diagnostics;
pub mod engine;
pub mod error;
pub mod health;
pub mod journal;
pub mod link;
pub mod live;
pub mod message_ring;
pub mod mounting;
pub mod odometry;
pub mod ports;
pub mod probe;
pub mod provenance;
pub mod publish;
pub mod record;
pub mod replay;
pub mod report;
pub mod run_name;
pub mod salvage;
pub mod session;
pub mod sink;
pub mod stamping;
pub mod udev_rule;

pub use error::OnboardError;
pub use report::RunReport;
