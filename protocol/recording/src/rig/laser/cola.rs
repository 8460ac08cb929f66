//! A laser of today in `rig.toml`: `protocol = "cola"`, at an address on the network instead of a serial
//! port.
//!
//! What the rig does not ask for stays as the device is set. Nothing is written to a device without `login`.

use crate::rig::table::Table;
use std::fmt::Write;

/// Scan rates that any device offers, in Hz.
const RATES_HZ: [f64; 6] = [15.0, 25.0, 35.0, 50.0, 75.0, 100.0];
/// Steps that any device offers, in degrees, as they are written in rigs.
const STEPS_DEG: [f64; 6] = [0.1667, 0.25, 0.3333, 0.5, 0.6667, 1.0];
/// A third of a degree, as many write it.
const SHORT_STEPS_DEG: [f64; 1] = [0.333];
/// The widest fan is that of an LMS1xx or a TiM.
const FOV_DEG: (f64, f64) = (1.0, 270.0);

pub(crate) const KEYS: [&str; 9] =
    ["protocol", "address", "fov_deg", "resolution_deg", "scan_hz", "remission", "login", "save", "mount"];

/// What is asked of a SICK LMS1xx, LMS5xx or TiM.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct ColaLaser {
    /// Host and port, for example `192.168.0.1:2112`.
    pub address: String,
    /// Field of view, in degrees, its middle straight ahead. `None`: as the device is set.
    pub fov_deg: Option<f64>,
    /// From a beam to the next, in degrees. `None`: as the device is set.
    pub resolution_deg: Option<f64>,
    /// Scans a second. `None`: as the device is set.
    pub scan_hz: Option<f64>,
    /// Whether remission is sent. `None`: as the device is set.
    pub remission: Option<bool>,
    /// Whether Biplane may log in to write what differs, and to start a laser that does not measure.
    pub login: bool,
    /// Whether what was written is kept in the device without power. It wears the device's memory.
    pub save: bool,
}

/// Reads the table of such a laser.
pub(crate) fn parse(table: &Table) -> ColaLaser {
    let some = |key, value: f64| table.has(key).then_some(value);
    let step_deg = table.one_of_or("resolution_deg", 1.0, &STEPS_DEG, &SHORT_STEPS_DEG);
    let has_port = table.has("port");
    if has_port {
        table.refuse("port", "nothing: a laser on a network has `address` instead of `port`");
    }
    // Said once: who names a port has no address yet.
    let is_port_alone = has_port && !table.has("address");
    let laser = ColaLaser {
        address: if is_port_alone { String::new() } else { address(table, "192.168.0.1:2112") },
        fov_deg: some("fov_deg", table.number("fov_deg", FOV_DEG.1, FOV_DEG)),
        resolution_deg: some("resolution_deg", step_deg),
        scan_hz: some("scan_hz", table.one_of("scan_hz", 25.0, &RATES_HZ)),
        remission: table.flag("remission"),
        login: table.flag("login").unwrap_or(false),
        save: table.flag("save").unwrap_or(false),
    };
    if laser.save && !laser.login && table.are_sound(&["login"]) {
        table.refuse("save", "false without login = true: who does not log in writes nothing");
    }
    laser
}

/// Host and port: a port is a number, so that a typing error is not looked up on the network.
pub(crate) fn address(table: &Table, example: &str) -> String {
    let address = table.text("address");
    let is_address = address
        .rsplit_once(':')
        .is_some_and(|(host, port)| !host.is_empty() && port.parse::<u16>().is_ok_and(|port| port > 0));
    if !is_address && table.are_sound(&["address"]) {
        table.refuse("address", &format!("host and port, for example {example:?}"));
    }
    address
}

/// Writes what the rig asks of such a laser.
pub(crate) fn print(out: &mut String, cola: &ColaLaser) -> std::fmt::Result {
    let ColaLaser { address, fov_deg, resolution_deg, scan_hz, remission, login, save } = cola;
    writeln!(out, "protocol = \"cola\"")?;
    writeln!(out, "address = {}", toml::Value::String(address.clone()))?;
    for (key, value) in [("fov_deg", fov_deg), ("resolution_deg", resolution_deg), ("scan_hz", scan_hz)] {
        if let Some(value) = value {
            writeln!(out, "{key} = {value:?}")?;
        }
    }
    if let Some(remission) = remission {
        writeln!(out, "remission = {remission}")?;
    }
    writeln!(out, "login = {login}")?;
    writeln!(out, "save = {save}")
}
