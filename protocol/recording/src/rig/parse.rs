//! From text to rig: every key known, every value allowed, every default filled in. All faults are found in
//! one reading; what depends on a refused value is not judged.

use super::laser::{cola, scip};
use super::table::{Faults, Table, line_at};
use super::{Base, InertialUnit, Laser, LaserProtocol, Mount, RigError, Units};
use toml::de::DeTable;

/// Rates that a laser of the LMS 2xx family can run at, in Bd.
const LASER_BAUDS: [f64; 4] = [9600.0, 19200.0, 38400.0, 500_000.0];
/// Mounts farther away than this are typing errors, in m.
const REACH_M: (f64, f64) = (-100.0, 100.0);
const TURN_DEG: (f64, f64) = (-360.0, 360.0);
const DELAY_MS: (f64, f64) = (-1000.0, 1000.0);

/// So many places that are not TOML are named.
const MAX_SYNTAX_FAULTS: usize = 8;

/// What lasers speak, and whose they are.
const LASER_PROTOCOLS: [(&str, &str); 3] =
    [("lms2xx", "SICK LMS 2xx on a serial line"), ("cola", "SICK on a network"), ("scip", "Hokuyo")];

const DEVICES: [&str; 4] = ["horizontal", "vertical", "base", "imu"];

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

/// Whether devices may share a port: those of a recording are not opened any more.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
pub(crate) enum Ports {
    /// They may.
    Any,
    /// Each has its own.
    Apart,
}

/// Reads the text of a `rig.toml`.
pub(crate) fn parse(text: &str, ports: Ports) -> Result<Devices, RigError> {
    let (parsed, errors) = DeTable::parse_recoverable(text);
    // What a text that is not TOML says is not known: its values are judged when it is.
    not_toml(text, &errors).map_or(Ok(()), Err)?;
    let faults = Faults::default();
    let whole = Table::whole(text, parsed.get_ref(), &faults);
    let devices = devices(&whole, &faults);
    if ports == Ports::Apart {
        shared_ports(&whole, &faults);
    }
    RigError::of(faults.into_vec(), 0).map_or(Ok(devices), Err)
}

/// The first of what the TOML reader found wrong: a text of another kind is wrong in every line.
fn not_toml(text: &str, errors: &[toml::de::Error]) -> Option<RigError> {
    let start = |error: &toml::de::Error| error.span().map_or(0, |span| span.start);
    let mut errors: Vec<_> = errors.iter().collect();
    errors.sort_by_key(|error| start(error));
    let more = errors.len().saturating_sub(MAX_SYNTAX_FAULTS);
    let named = errors.iter().take(MAX_SYNTAX_FAULTS).map(|error| RigError::Syntax {
        line: line_at(text, start(error)),
        what: error.message().to_owned(),
    });
    RigError::of(named.collect(), more)
}

fn devices(whole: &Table, faults: &Faults) -> Devices {
    whole.only(&DEVICES);
    if !whole.has("horizontal") {
        faults.note(RigError::MissingKey { line: None, key: "horizontal.port".to_owned() });
    }
    if !whole.has("base") {
        faults.note(RigError::NoBase);
    }
    let horizontal = whole.table("horizontal").map(|table| laser(&table, &Laser::horizontal()));
    Devices {
        horizontal: horizontal.unwrap_or_else(Laser::horizontal),
        vertical: whole.table("vertical").map(|table| laser(&table, &Laser::vertical())),
        base: whole.table("base").map(|table| Base::parse(&table)).unwrap_or_default(),
        imu: whole.table("imu").map(|table| InertialUnit::parse(&table, mount_of)),
    }
}

/// Notes each device that is where one before it is.
fn shared_ports(whole: &Table, faults: &Faults) {
    let mut seen: Vec<(String, usize, &str)> = Vec::new();
    for device in DEVICES {
        let Some(table) = whole.inner(device) else { continue };
        for (key, line, port) in ["port", "address"].iter().filter_map(|key| table.placed_text(key)) {
            if let Some((other, other_line, _)) = seen.iter().find(|(.., other)| *other == port) {
                faults.note(RigError::SharedPort {
                    line,
                    key: key.clone(),
                    port: port.to_owned(),
                    other: other.clone(),
                    other_line: *other_line,
                });
            }
            seen.push((key, line, port));
        }
    }
}

fn laser(table: &Table, template: &Laser) -> Laser {
    let placed = Laser {
        mount: mount_of(table, template.mount),
        delay_ms: table.number("delay_ms", template.delay_ms, DELAY_MS),
        ..template.clone()
    };
    match table.protocol("lms2xx", &LASER_PROTOCOLS) {
        Some("cola") => network_laser(table, &placed),
        Some("scip") => hokuyo_laser(table, &placed),
        Some(_) => serial_laser(table, &placed),
        // Which other keys it has depends on what it speaks.
        None => placed,
    }
}

fn network_laser(table: &Table, placed: &Laser) -> Laser {
    let known = [&cola::KEYS[..], &["delay_ms"]].concat();
    // A port is refused by its reader, with what takes its place.
    table.only_but(&known, "port");
    Laser { protocol: LaserProtocol::Cola(cola::parse(table)), port: String::new(), ..placed.clone() }
}

fn hokuyo_laser(table: &Table, placed: &Laser) -> Laser {
    table.only(&[&scip::KEYS[..], &["delay_ms"]].concat());
    let scip = scip::parse(table);
    let is_serial = scip.address.is_none();
    Laser {
        port: if is_serial { table.text("port") } else { String::new() },
        baud: if is_serial { scip::baud(table) } else { placed.baud },
        protocol: LaserProtocol::Scip(scip),
        ..placed.clone()
    }
}

fn mount_of(table: &Table, template: Mount) -> Mount {
    table.table("mount").map_or(template, |inner| mount(&inner, template))
}

fn serial_laser(table: &Table, placed: &Laser) -> Laser {
    table.only(&LASER_KEYS);
    let fov_deg = table.one_of("fov_deg", f64::from(placed.fov_deg), &[90.0, 100.0, 180.0]) as u16;
    let units = match table.word("units", placed.units.name(), &["cm", "mm"]) {
        Some("mm") => Units::Mm,
        _ => Units::Cm,
    };
    let remission = table.flag("remission").unwrap_or(placed.remission);
    Laser {
        protocol: LaserProtocol::Lms2xx,
        port: table.text("port"),
        baud: table.one_of("baud", f64::from(placed.baud), &LASER_BAUDS) as u32,
        fov_deg,
        resolution_deg: resolution(table, fov_deg, placed.resolution_deg),
        units,
        range_max_m: range_max(table, units, remission && fov_deg != 90),
        index_bytes: table.flag("index_bytes"),
        remission,
        dazzle_tolerant: table.flag("dazzle_tolerant"),
        ..placed.clone()
    }
}

/// The step that goes with the field of view; an S14 has but one.
fn resolution(table: &Table, fov_deg: u16, template_deg: f64) -> f64 {
    let template_deg = if fov_deg == 90 { 0.5 } else { template_deg };
    let resolution_deg = table.one_of("resolution_deg", template_deg, &[0.25, 0.5, 1.0]);
    if !table.are_sound(&["fov_deg", "resolution_deg"]) {
        return resolution_deg;
    }
    if fov_deg == 90 && resolution_deg != 0.5 {
        table.refuse("resolution_deg", "0.5 with fov_deg = 90 (an LMS S14 has no other)");
    }
    if fov_deg == 180 && resolution_deg < 0.5 {
        table.refuse("resolution_deg", "0.5, 1 (0.25 with fov_deg = 100 only)");
    }
    resolution_deg
}

/// The range that 13, 14 or 15 bits can say in the unit; remission leaves 13.
fn range_max(table: &Table, units: Units, remission: bool) -> Option<u16> {
    if !table.has("range_max_m") {
        return None;
    }
    let range_max_m = table.one_of("range_max_m", 80.0, &[8.0, 16.0, 32.0, 80.0, 160.0, 320.0]);
    if table.are_sound(&["range_max_m", "units", "remission", "fov_deg"]) {
        let remission_leaves =
            "8 with units = \"mm\", 80 with units = \"cm\" (remission = true leaves no more)";
        match (units, range_max_m > 32.0) {
            (Units::Mm, true) => table.refuse("range_max_m", "8, 16, 32 with units = \"mm\""),
            (Units::Cm, false) => table.refuse("range_max_m", "80, 160, 320 with units = \"cm\""),
            _ if remission && !matches!(range_max_m, 8.0 | 80.0) => {
                table.refuse("range_max_m", remission_leaves);
            }
            _ => {}
        }
    }
    Some(range_max_m as u16)
}

fn mount(table: &Table, template: Mount) -> Mount {
    table.only(&["x", "y", "z", "roll", "pitch", "yaw"]);
    Mount {
        x: table.number("x", template.x, REACH_M),
        y: table.number("y", template.y, REACH_M),
        z: table.number("z", template.z, REACH_M),
        roll: table.number("roll", template.roll, TURN_DEG),
        pitch: table.number("pitch", template.pitch, TURN_DEG),
        yaw: table.number("yaw", template.yaw, TURN_DEG),
    }
}

#[cfg(test)]
mod tests {
    use super::{MAX_SYNTAX_FAULTS, Ports, parse};

    #[test]
    fn a_text_of_another_kind_is_not_named_line_by_line() {
        let log = "FLASER 180 81.83\n".repeat(50);
        let Err(error) = parse(&log, Ports::Any) else { panic!("a log is no rig") };
        let error = error.to_string();
        assert!(error.starts_with("50 faults, the first of them:\n  line 1: not TOML: "), "{error}");
        assert_eq!(error.lines().count(), 1 + MAX_SYNTAX_FAULTS, "{error}");
    }

    #[test]
    fn devices_that_share_a_port_are_named_with_their_lines_beside_all_other_faults() {
        let text = "[horizontal]\nport = \"/dev/a\"\nbaud = 7\n[vertical]\nport = \"/dev/a\"\n[base]\nport = \"/dev/a\"\n";
        let of = |text: &str, ports| parse(text, ports).err().map(|error| error.to_string());
        let all = of(text, Ports::Apart).unwrap();
        for words in [
            "3 faults:",
            "line 3: `horizontal.baud` is 7",
            "line 5: `vertical.port` is \"/dev/a\", as is `horizontal.port` in line 2: each device needs its own",
            "line 7: `base.port` is \"/dev/a\", as is `horizontal.port` in line 2: each device needs its own",
        ] {
            assert!(all.contains(words), "{all}");
        }
        let sound = text.replace("baud = 7\n", "");
        assert_eq!(of(&sound, Ports::Any), None, "a recording's devices are not opened");
        let lasers = ["horizontal", "vertical"]
            .map(|name| format!("[{name}]\nprotocol = \"cola\"\naddress = \"10.0.0.1:2112\"\n"));
        let network = format!("{}[base]\nprotocol = \"none\"\n", lasers.concat());
        assert!(of(&network, Ports::Apart).unwrap().contains("`vertical.address` is \"10.0.0.1:2112\""));
    }
}
