//! The serial ports that a rig needs, and what can be said of them before they are opened.

use biplane_recording::{Port, Rig};

use crate::error::OnboardError;

/// How people call the device on a line.
#[must_use]
pub fn device_name(port: Port) -> &'static str {
    match port {
        Port::Horizontal => "horizontal laser",
        Port::Vertical => "vertical laser",
        Port::Base => "base",
    }
}

/// The rig's lines in a fixed order: which device, its port's path, its rate in bits per second.
#[must_use]
pub fn of_rig(rig: &Rig) -> Vec<(Port, &str, u32)> {
    let mut ports = vec![(Port::Horizontal, rig.horizontal.port.as_str(), rig.horizontal.baud)];
    ports.extend(rig.vertical.as_ref().map(|laser| (Port::Vertical, laser.port.as_str(), laser.baud)));
    ports.push((Port::Base, rig.base.port.as_str(), rig.base.baud));
    ports
}

/// What of a rig is allowed, and most likely not meant; said once a run.
pub fn warn(rig: &Rig) {
    let unmeasured = rig.base.protocol.unmeasured();
    if !unmeasured.is_empty() {
        tracing::warn!(
            "base: {} have default values, which are not those of your robot: odometry will be wrong until they are measured (docs/bases.md)",
            unmeasured.join(", ")
        );
    }
}

/// Checks what the rig's own reader cannot: that no two devices share a port.
///
/// # Errors
/// The first thing found.
pub fn check(rig: &Rig) -> Result<(), OnboardError> {
    let ports = of_rig(rig);
    for (index, &(port, path, _)) in ports.iter().enumerate() {
        if let Some(&(other, ..)) = ports.iter().take(index).find(|(_, other, _)| *other == path) {
            return Err(OnboardError::SharedPort {
                port: path.to_owned(),
                devices: [device_name(other), device_name(port)],
            });
        }
    }
    Ok(())
}
