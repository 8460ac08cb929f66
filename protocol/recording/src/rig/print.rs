//! From rig to text: everything resolved, nothing left to defaults.

use super::laser::{cola, scip};
use super::{Base, BaseProtocol, InertialUnit, Laser, LaserProtocol, Mount};
use std::fmt::Write;

/// A TOML string with what must be escaped in it.
fn quoted(text: &str) -> String {
    toml::Value::String(text.to_owned()).to_string()
}

fn laser(out: &mut String, name: &str, laser: &Laser) -> std::fmt::Result {
    let Laser { mount, delay_ms, .. } = laser;
    writeln!(out, "[{name}]")?;
    match &laser.protocol {
        LaserProtocol::Cola(cola) => cola::print(out, cola)?,
        LaserProtocol::Scip(scip) => scip::print(out, scip, laser)?,
        LaserProtocol::Lms2xx => serial_laser(out, laser)?,
    }
    place(out, mount)?;
    writeln!(out, "delay_ms = {delay_ms:?}\n")
}

fn place(out: &mut String, Mount { x, y, z, roll, pitch, yaw }: &Mount) -> std::fmt::Result {
    write!(out, "mount = {{ x = {x:?}, y = {y:?}, z = {z:?}, ")?;
    writeln!(out, "roll = {roll:?}, pitch = {pitch:?}, yaw = {yaw:?} }}")
}

fn imu(out: &mut String, unit: &InertialUnit) -> std::fmt::Result {
    let InertialUnit { protocol, port, baud, rate_hz, mount } = unit;
    writeln!(out, "\n[imu]")?;
    writeln!(out, "protocol = {}", quoted(protocol.name()))?;
    if unit.is_serial() {
        writeln!(out, "port = {}", quoted(port))?;
        writeln!(out, "baud = {baud}")?;
        writeln!(out, "rate_hz = {rate_hz}")?;
    }
    place(out, mount)
}

fn serial_laser(out: &mut String, laser: &Laser) -> std::fmt::Result {
    let Laser { port, baud, fov_deg, resolution_deg, units, .. } = laser;
    writeln!(out, "port = {}", quoted(port))?;
    writeln!(out, "baud = {baud}")?;
    writeln!(out, "fov_deg = {fov_deg}")?;
    // `{:?}` keeps the point of a whole number, and every digit of the others.
    writeln!(out, "resolution_deg = {resolution_deg:?}")?;
    writeln!(out, "units = {}", quoted(units.name()))?;
    settings(out, laser)
}

/// What may be left to the device is printed only where the rig says it.
fn settings(out: &mut String, laser: &Laser) -> std::fmt::Result {
    let Laser { range_max_m, index_bytes, remission, dazzle_tolerant, .. } = laser;
    if let Some(range_max_m) = range_max_m {
        writeln!(out, "range_max_m = {range_max_m}")?;
    }
    if let Some(index_bytes) = index_bytes {
        writeln!(out, "index_bytes = {index_bytes}")?;
    }
    writeln!(out, "remission = {remission}")?;
    if let Some(dazzle_tolerant) = dazzle_tolerant {
        writeln!(out, "dazzle_tolerant = {dazzle_tolerant}")?;
    }
    Ok(())
}

fn base(out: &mut String, base: &Base) -> std::fmt::Result {
    let Base { protocol, port, baud } = base;
    writeln!(out, "[base]")?;
    writeln!(out, "protocol = {}", quoted(protocol.name()))?;
    if *protocol == BaseProtocol::None {
        return Ok(());
    }
    writeln!(out, "port = {}", quoted(port))?;
    writeln!(out, "baud = {baud}")?;
    match protocol {
        BaseProtocol::None => Ok(()),
        BaseProtocol::P2os { metres_per_tick: Some(meters) } => writeln!(out, "metres_per_tick = {meters:?}"),
        BaseProtocol::P2os { metres_per_tick: None } => {
            writeln!(out, "# metres_per_tick: by the subclass that the base tells")
        }
        BaseProtocol::RoboClaw { address, wheel_base_m, metres_per_count_left, metres_per_count_right } => {
            writeln!(out, "address = {address}")?;
            writeln!(out, "wheel_base_m = {wheel_base_m:?}")?;
            writeln!(out, "metres_per_count_left = {metres_per_count_left:?}")?;
            writeln!(out, "metres_per_count_right = {metres_per_count_right:?}")
        }
        BaseProtocol::Rflex { counts_per_m, counts_per_rad } => {
            writeln!(out, "counts_per_m = {counts_per_m:?}")?;
            writeln!(out, "counts_per_rad = {counts_per_rad:?}")
        }
    }
}

/// The text of a rig with these devices.
pub(crate) fn print(
    horizontal: &Laser,
    vertical: Option<&Laser>,
    own_base: &Base,
    unit: Option<&InertialUnit>,
) -> String {
    let mut out = String::new();
    // Writing to a string does not fail.
    let _ = laser(&mut out, "horizontal", horizontal);
    if let Some(vertical) = vertical {
        let _ = laser(&mut out, "vertical", vertical);
    }
    let _ = base(&mut out, own_base);
    if let Some(unit) = unit {
        let _ = imu(&mut out, unit);
    }
    out
}
