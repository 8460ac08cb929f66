//! The session of a SICK laser on a network (LMS1xx, LMS5xx, TiM): ask who it is, read how it is set, write
//! what differs where the rig allows it, let it stream, notice when it stops, begin again.
//!
//! ```text
//! connection -> who is it -> configuration -> (log in -> write -> measure -> run)? -> stream
//! stream -> connection: silence, the connection lost
//! ```
//! The connection itself is made outside: [`Output::Reconnect`] asks for a new one, [`Input::PortBack`] says
//! that it is there. Sources: SICK telegram listing 8014631, captures of three devices, complaints of users
//! of other drivers. Never tried on hardware.

pub(crate) mod event;
pub(crate) mod hints;
pub(crate) mod info;
pub(crate) mod machine;
pub(crate) mod query;
pub(crate) mod scan;
mod sequence;
pub(crate) mod settings;
#[cfg(test)]
mod tests;

use biplane_wire::cola::{ColaFraming, MAX_TELEGRAM_BYTES};

use crate::session::cola::machine::Machine;
use crate::session::machine_session::MachineSession;

/// A session with one laser.
pub(crate) type ColaSession = MachineSession<Machine, ColaFraming, MAX_TELEGRAM_BYTES>;
