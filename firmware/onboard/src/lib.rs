//! Acquisition on the robot: device sessions, time stamps, scan matching in real time, recording.
//!
#![doc = include_str!("../README.md")]
// The floors of this crate, from bottom to top: types, session, stamping, engine, output, live, io, record,
// replay, cli. No file imports from a floor above its own.

pub(crate) mod cli;
pub(crate) mod engine;
pub(crate) mod io;
pub(crate) mod live;
pub(crate) mod output;
pub(crate) mod record;
pub(crate) mod replay;
pub(crate) mod session;
pub(crate) mod stamping;
pub(crate) mod types;

pub use crate::cli::run;
pub use crate::engine::Engine;
pub use crate::engine::options::{Command, EngineOptions, Feed};
pub use crate::engine::out::health::{DamagedShare, Health, LineFault, LineHealth, MatcherHealth};
pub use crate::engine::out::sink::Sink;
pub use crate::io::probe::device_report::DeviceReport;
pub use crate::io::probe::probe;
pub use crate::record::{RecordOptions, record};
pub use crate::replay::{ReplayOptions, replay};
pub use crate::session::base::{BaseSession, BaseSettings};
pub use crate::session::cola::event::ColaEvent;
pub use crate::session::device_session::{Input, MAX_INPUT_BYTES, Output, Session};
pub use crate::session::event::Event;
pub use crate::session::lms::LaserSession;
pub use crate::session::lms::setup::settings::LaserSettings;
pub use crate::session::scip::event::ScipEvent;
pub use crate::types::error::OnboardError;
pub use crate::types::foreign_protocol::ForeignProtocol;
pub use crate::types::live_address::LiveAddress;
pub use crate::types::run_report::{
    ArrivalCounts, LossCounts, MapReport, MountingReport, OdometryReport, RecordedCounts, RunEnd, RunReport,
};
pub use crate::types::web_origin::WebOrigin;

/// What the tests of this project reach into, from outside of this crate; no part of what others can rely on.
#[doc(hidden)]
pub mod test_support {
    pub use crate::io::clock::{Clocks, RunClock};
    pub use crate::io::line::tty::Tty;
    #[cfg(feature = "live")]
    pub use crate::live::server::protocol::request as live_request;
    pub use crate::output::diagnostics::message as diagnostics_message;
    pub use crate::output::message_ring::{Head, MessagesIn, MessagesOut, message_ring};
    pub use crate::output::salvage::{Leftover, Salvaged, salvage_on};
    pub use crate::replay::bench::allocations::{CountingAllocator, during};
}
