//! How people call the devices of a rig.

use biplane_recording::Port;

/// How people call the device on a line.
#[must_use]
pub(crate) fn device_name(port: Port) -> &'static str {
    match port {
        Port::Horizontal => "horizontal laser",
        Port::Vertical => "vertical laser",
        Port::Base => "base",
    }
}
