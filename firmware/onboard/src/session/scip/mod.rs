//! The session of a Hokuyo laser (URG, UTM, UST), on a serial line or on a network: find it in whatever state
//! it was left, ask who it is, let it stream, notice when it stops, begin again.
//!
//! ```text
//! line -> (rate -> stop what runs -> SCIP 2.0, no clock mode) -> who is it -> (rig's rate)? -> stream
//! stream -> line: silence, the connection lost
//! ```
//! A connection is made outside: [`Output::Reconnect`] asks for a new one, [`Input::PortBack`] says that it
//! is there. While scans flow, nothing is asked. Sources: Hokuyo C-42-03320B, byte logs of three devices,
//! complaints of users of other drivers. Never tried on hardware.

pub(crate) mod clock;
mod dialogue;
pub(crate) mod event;
mod geometry;
pub(crate) mod info;
pub(crate) mod machine;
mod query;
mod rates;
pub(crate) mod scan;
pub(crate) mod settings;
#[cfg(test)]
mod tests;

use biplane_wire::scip::{MAX_BLOCK_BYTES, ScipFraming};

use crate::session::machine_session::MachineSession;
use crate::session::scip::machine::Machine;

/// A session with one laser.
pub(crate) type ScipSession = MachineSession<Machine, ScipFraming, MAX_BLOCK_BYTES>;
