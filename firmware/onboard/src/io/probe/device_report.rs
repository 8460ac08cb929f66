//! What a device told a probe.

use serde::Serialize;

/// What one device said.
#[derive(Clone, PartialEq, Debug, Default, Serialize)]
pub struct DeviceReport {
    /// Which device.
    pub device: &'static str,
    /// Its port.
    pub port: String,
    /// Whether it answered.
    pub answered: bool,
    /// Why not.
    pub problem: Option<String>,
    /// Rate that the rig asks for, bits per second.
    pub baud_configured: u32,
    /// Rate at which it answered, bits per second.
    pub baud_found: Option<u32>,
    /// Type text of a laser, subclass of a base.
    pub kind: Option<String>,
    /// Firmware version of a laser, name of a base.
    pub firmware: Option<String>,
    /// Field of view in force, degrees.
    pub fov_deg: Option<u16>,
    /// Step in force, degrees.
    pub resolution_deg: Option<f64>,
    /// Units in force.
    pub units: Option<&'static str>,
    /// Measuring mode in force.
    pub measuring_mode: Option<u8>,
    /// Whether the device reports a fault.
    pub fault: Option<bool>,
    /// What else it told, a line each: state, faults, configuration, what `record` would change.
    pub remarks: Vec<String>,
}
