//! From text to rig: every key known, every value allowed, every default filled in.

use super::laser::{cola, scip};
use super::table::{Table, line_at};
use super::{Base, InertialUnit, Laser, LaserProtocol, Mount, RigError, Units};
use toml::de::DeTable;

/// Rates that a laser of the LMS 2xx family can run at, in Bd.
const LASER_BAUDS: [f64; 4] = [9600.0, 19200.0, 38400.0, 500_000.0];
/// Mounts farther away than this are typing errors, in m.
const REACH_M: (f64, f64) = (-100.0, 100.0);
const TURN_DEG: (f64, f64) = (-360.0, 360.0);
const DELAY_MS: (f64, f64) = (-1000.0, 1000.0);

const LASER_KEYS: [&str; 12] = [
    "protocol",
    "port",
    "baud",
    "fov_deg",
    "resolution_deg",
    "units",
    "range_max_m",
    "index_bytes",
    "remission",
    "dazzle_tolerant",
    "mount",
    "delay_ms",
];

/// What a rig's text says of each device.
pub(crate) struct Devices {
    pub(crate) horizontal: Laser,
    pub(crate) vertical: Option<Laser>,
    pub(crate) base: Base,
    pub(crate) imu: Option<InertialUnit>,
}

/// Reads the text of a `rig.toml`.
pub(crate) fn parse(text: &str) -> Result<Devices, RigError> {
    let parsed = DeTable::parse(text).map_err(|error| RigError::Syntax {
        line: line_at(text, error.span().map_or(0, |span| span.start)),
        what: error.message().to_owned(),
    })?;
    let whole = Table::whole(text, parsed.get_ref());
    whole.only(&["horizontal", "vertical", "base", "imu"])?;
    let missing = || RigError::MissingKey { key: "horizontal.port".to_owned() };
    let horizontal = whole.table("horizontal")?.ok_or_else(missing)?;
    let base = whole.table("base")?.ok_or(RigError::NoBase)?;
    let vertical = whole.table("vertical")?;
    let imu = whole.table("imu")?;
    Ok(Devices {
        horizontal: laser(&horizontal, &Laser::horizontal())?,
        vertical: vertical.map(|table| laser(&table, &Laser::vertical())).transpose()?,
        base: Base::parse(&base)?,
        imu: imu.map(|table| InertialUnit::parse(&table, mount_of)).transpose()?,
    })
}

fn laser(table: &Table, template: &Laser) -> Result<Laser, RigError> {
    match table.word("protocol", "lms2xx", &["lms2xx", "cola", "scip"])? {
        "cola" => network_laser(table, template),
        "scip" => hokuyo_laser(table, template),
        _ => serial_laser(table, template),
    }
}

fn network_laser(table: &Table, template: &Laser) -> Result<Laser, RigError> {
    table.only(&[&cola::KEYS[..], &["delay_ms"]].concat())?;
    Ok(Laser {
        protocol: LaserProtocol::Cola(cola::parse(table)?),
        port: String::new(),
        mount: mount_of(table, template.mount)?,
        delay_ms: table.number("delay_ms", template.delay_ms, DELAY_MS)?,
        ..template.clone()
    })
}

fn hokuyo_laser(table: &Table, template: &Laser) -> Result<Laser, RigError> {
    table.only(&[&scip::KEYS[..], &["delay_ms"]].concat())?;
    let scip = scip::parse(table)?;
    let is_serial = scip.address.is_none();
    Ok(Laser {
        port: if is_serial { table.text("port")? } else { String::new() },
        baud: if is_serial { scip::baud(table)? } else { template.baud },
        protocol: LaserProtocol::Scip(scip),
        mount: mount_of(table, template.mount)?,
        delay_ms: table.number("delay_ms", template.delay_ms, DELAY_MS)?,
        ..template.clone()
    })
}

fn mount_of(table: &Table, template: Mount) -> Result<Mount, RigError> {
    match table.table("mount")? {
        Some(inner) => mount(&inner, template),
        None => Ok(template),
    }
}

fn serial_laser(table: &Table, template: &Laser) -> Result<Laser, RigError> {
    table.only(&LASER_KEYS)?;
    let fov_deg = table.one_of("fov_deg", f64::from(template.fov_deg), &[90.0, 100.0, 180.0])? as u16;
    let units = match table.word("units", template.units.name(), &["cm", "mm"])? {
        "mm" => Units::Mm,
        _ => Units::Cm,
    };
    let remission = table.flag("remission")?.unwrap_or(template.remission);
    Ok(Laser {
        protocol: LaserProtocol::Lms2xx,
        port: table.text("port")?,
        baud: table.one_of("baud", f64::from(template.baud), &LASER_BAUDS)? as u32,
        fov_deg,
        resolution_deg: resolution(table, fov_deg, template.resolution_deg)?,
        units,
        range_max_m: range_max(table, units, remission && fov_deg != 90)?,
        index_bytes: table.flag("index_bytes")?,
        remission,
        dazzle_tolerant: table.flag("dazzle_tolerant")?,
        mount: mount_of(table, template.mount)?,
        delay_ms: table.number("delay_ms", template.delay_ms, DELAY_MS)?,
    })
}

/// The step that goes with the field of view; an S14 has but one.
fn resolution(table: &Table, fov_deg: u16, template_deg: f64) -> Result<f64, RigError> {
    let template_deg = if fov_deg == 90 { 0.5 } else { template_deg };
    let resolution_deg = table.one_of("resolution_deg", template_deg, &[0.25, 0.5, 1.0])?;
    if fov_deg == 90 && resolution_deg != 0.5 {
        return Err(table.refuse("resolution_deg", "0.5 with fov_deg = 90 (an LMS S14 has no other)"));
    }
    if fov_deg == 180 && resolution_deg < 0.5 {
        return Err(table.refuse("resolution_deg", "0.5, 1 (0.25 with fov_deg = 100 only)"));
    }
    Ok(resolution_deg)
}

/// The range that 13, 14 or 15 bits can say in the unit; remission leaves 13.
fn range_max(table: &Table, units: Units, remission: bool) -> Result<Option<u16>, RigError> {
    if !table.has("range_max_m") {
        return Ok(None);
    }
    let range_max_m = table.one_of("range_max_m", 0.0, &[8.0, 16.0, 32.0, 80.0, 160.0, 320.0])?;
    match (units, range_max_m > 32.0) {
        (Units::Mm, true) => return Err(table.refuse("range_max_m", "8, 16, 32 with units = \"mm\"")),
        (Units::Cm, false) => return Err(table.refuse("range_max_m", "80, 160, 320 with units = \"cm\"")),
        _ => {}
    }
    if remission && !matches!(range_max_m, 8.0 | 80.0) {
        let allowed = "8 with units = \"mm\", 80 with units = \"cm\" (remission = true leaves no more)";
        return Err(table.refuse("range_max_m", allowed));
    }
    Ok(Some(range_max_m as u16))
}

fn mount(table: &Table, template: Mount) -> Result<Mount, RigError> {
    table.only(&["x", "y", "z", "roll", "pitch", "yaw"])?;
    Ok(Mount {
        x: table.number("x", template.x, REACH_M)?,
        y: table.number("y", template.y, REACH_M)?,
        z: table.number("z", template.z, REACH_M)?,
        roll: table.number("roll", template.roll, TURN_DEG)?,
        pitch: table.number("pitch", template.pitch, TURN_DEG)?,
        yaw: table.number("yaw", template.yaw, TURN_DEG)?,
    })
}
