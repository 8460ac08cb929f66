//! A Hokuyo laser in `rig.toml`: `protocol = "scip"`, on a serial line or at an address on the network.
//!
//! What the rig does not ask for stays as the device measures. Nothing is kept in the device.

use super::Laser;
use super::cola::address;
use crate::rig::table::Table;
use std::fmt::Write;

/// Rates of a serial line; on USB any of them will do.
const BAUDS: [f64; 7] = [19_200.0, 38_400.0, 57_600.0, 115_200.0, 250_000.0, 500_000.0, 750_000.0];
const DEFAULT_BAUD: f64 = 115_200.0;
/// Beyond what any device offers; what this one does is known when it answers.
const FOV_DEG: (f64, f64) = (1.0, 360.0);
const RESOLUTION_DEG: (f64, f64) = (0.05, 40.0);
const RATE_HZ: (f64, f64) = (0.5, 100.0);

pub(crate) const KEYS: [&str; 9] =
    ["protocol", "port", "baud", "address", "fov_deg", "resolution_deg", "scan_hz", "remission", "mount"];

/// What is asked of a Hokuyo laser.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct ScipLaser {
    /// Host and port, for example `192.168.0.10:10940`. `None`: on the serial line of
    /// [`port`](Laser::port) at [`baud`](Laser::baud).
    pub address: Option<String>,
    /// Field of view, in degrees, its middle straight ahead. `None`: all that the device measures.
    pub fov_deg: Option<f64>,
    /// From a beam to the next, in degrees: the device's step, or a multiple of it. `None`: its step.
    pub resolution_deg: Option<f64>,
    /// Scans a second: the device's turns, or each second, third, ... tenth of them. `None`: all of them.
    pub scan_hz: Option<f64>,
    /// Whether intensities are asked for and recorded. `None`: they are not.
    pub remission: Option<bool>,
}

/// Reads the table of such a laser; its port and rate are the caller's.
pub(crate) fn parse(table: &Table) -> ScipLaser {
    let some = |key, bounds: (f64, f64)| table.has(key).then(|| table.number(key, bounds.1, bounds));
    let has_address = table.has("address");
    for key in ["port", "baud"] {
        if has_address && table.has(key) {
            table.refuse(key, "nothing beside `address`: a laser is on one line");
        }
    }
    ScipLaser {
        address: has_address.then(|| address(table, "192.168.0.10:10940")),
        fov_deg: some("fov_deg", FOV_DEG),
        resolution_deg: some("resolution_deg", RESOLUTION_DEG),
        scan_hz: some("scan_hz", RATE_HZ),
        remission: table.flag("remission"),
    }
}

/// The rate of the serial line, in Bd.
pub(crate) fn baud(table: &Table) -> u32 {
    table.one_of("baud", DEFAULT_BAUD, &BAUDS) as u32
}

/// Writes what the rig asks of such a laser.
pub(crate) fn print(out: &mut String, scip: &ScipLaser, laser: &Laser) -> std::fmt::Result {
    let ScipLaser { address, fov_deg, resolution_deg, scan_hz, remission } = scip;
    let quoted = |text: &str| toml::Value::String(text.to_owned());
    writeln!(out, "protocol = \"scip\"")?;
    match address {
        Some(address) => writeln!(out, "address = {}", quoted(address))?,
        None => writeln!(out, "port = {}\nbaud = {}", quoted(&laser.port), laser.baud)?,
    }
    for (key, value) in [("fov_deg", fov_deg), ("resolution_deg", resolution_deg), ("scan_hz", scan_hz)] {
        if let Some(value) = value {
            writeln!(out, "{key} = {value:?}")?;
        }
    }
    match remission {
        Some(remission) => writeln!(out, "remission = {remission}"),
        None => Ok(()),
    }
}
