//! What an engine is made for, and what it wants done.

use biplane_matcher::TrackerParams;
use biplane_recording::Rig;

use crate::session::device_session::RequestBytes;

/// What the driver of an engine has to do on a serial line.
#[derive(Clone, PartialEq, Debug)]
pub enum Command {
    /// Send these bytes.
    Write(RequestBytes),
    /// Change the port's rate, bits per second.
    SetBaud(u32),
    /// Make the connection to a device on a network anew.
    Reconnect,
}

/// Whether the engine talks to devices or listens to what they once said.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
pub enum Feed {
    /// Devices on serial lines.
    Live,
    /// Bytes of a capture, or decoded scans and odometry.
    Recorded,
}

/// What an engine is made for.
#[derive(Clone, PartialEq, Debug)]
pub struct EngineOptions {
    /// The robot.
    pub rig: Rig,
    /// How scans are matched.
    pub matcher: TrackerParams,
    /// Where the bytes come from.
    pub feed: Feed,
    /// Whether the bytes of the serial lines are recorded too.
    pub raw: bool,
}
