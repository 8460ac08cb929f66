//! `rig.toml` as tables: what is accepted, what is filled in, what is refused and in which words.

use super::{Base, BaseProtocol, InertialUnit, Laser, Mount, Rig, RigError, Units};

/// The text of the interface page, word for word.
const TEMPLATE: &str = r#"
[horizontal]                     # the laser that localizes
port = "/dev/lms-horizontal"
baud = 38400                     # 9600, 19200, 38400, 500000: the rate to run at; found by itself at start
fov_deg = 180                    # 100 or 180
resolution_deg = 1.0             # 0.25, 0.5 or 1.0
units = "cm"                     # "cm" or "mm"
mount = { x = 0.2, y = 0.0, z = 0.3, roll = 0.0, pitch = 0.0, yaw = 0.0 }   # base_from_laser; yaw then pitch then roll (Z-Y-X)
delay_ms = 0.0                   # correction to the time model below, for a device that differs
[vertical]                       # the laser that sees the building
port = "/dev/lms-vertical"
mount = { x = 0.05, y = 0.0, z = 0.45, roll = 0.0, pitch = -90.0, yaw = 0.0 }   # pitch -90: the fan's middle beam points up
[base]
protocol = "p2os"                # more bases may follow
port = "/dev/base"
baud = 9600
metres_per_tick = 0.001          # distance of one odometry unit; angle unit is 2 pi / 4096
"#;

const PORTS: &str = "[horizontal]\nport = \"/dev/lms-horizontal\"\n[vertical]\nport = \"/dev/lms-vertical\"\n[base]\nport = \"/dev/base\"\n";

/// A rig with one line of its own in a section; the line is number 3, 6 or 9.
fn with(section: &str, line: &str) -> Result<Rig, RigError> {
    let mut text = PORTS.to_owned();
    let at = text.find(&format!("[{section}]")).unwrap() + section.len() + 3;
    text.insert_str(at, &format!("{line}\n"));
    Rig::parse(&text)
}

#[test]
fn the_template_and_ports_alone_are_the_default() {
    let mut template = Rig::default();
    template.base.protocol = BaseProtocol::P2os { metres_per_tick: Some(0.001) };
    assert_eq!(Rig::parse(TEMPLATE).unwrap(), template);
    // Without a word of it, the unit goes by the subclass that the base tells.
    assert_eq!(Rig::parse(PORTS).unwrap(), Rig::default());
    assert_eq!(Rig::parse(&Rig::default().to_toml()).unwrap(), Rig::default());
}

#[test]
fn a_rig_without_a_vertical_laser_is_one() {
    let rig = Rig::parse("[horizontal]\nport = \"a\"\n[base]\nport = \"b\"").unwrap();
    assert_eq!(rig.vertical, None);
    assert_eq!(rig.horizontal, Laser { port: "a".into(), ..Laser::horizontal() });
    assert_eq!(rig.base, Base { port: "b".into(), ..Base::default() });
    assert_eq!(Rig::parse(&rig.to_toml()).unwrap(), rig);
}

#[test]
fn values_are_taken_over_and_integers_are_numbers() {
    let rig = with(
        "vertical",
        "baud = 500000\nfov_deg = 100\nresolution_deg = 0.25\nunits = \"mm\"\ndelay_ms = -2",
    )
    .unwrap();
    let expected = Laser {
        baud: 500_000,
        fov_deg: 100,
        resolution_deg: 0.25,
        units: Units::Mm,
        delay_ms: -2.0,
        ..Laser::vertical()
    };
    assert_eq!(rig.vertical, Some(expected));
    let rig = with("horizontal", "resolution_deg = 1\nfov_deg = 180.0\nmount = { x = 1, yaw = 45 }").unwrap();
    assert_eq!(rig.horizontal.mount, Mount { x: 1.0, yaw: 45.0, z: 0.3, ..Mount::default() });
    let table = Rig::parse(&format!("{PORTS}[horizontal.mount]\npitch = 3\n")).unwrap();
    assert_eq!(table.horizontal.mount.pitch, 3.0);
}

#[test]
fn what_is_left_to_the_device_is_printed_only_where_it_is_asked_for() {
    let rig = with("horizontal", "fov_deg = 90").unwrap();
    assert_eq!((rig.horizontal.resolution_deg, rig.horizontal.turns()), (0.5, 1));
    assert_eq!(rig.horizontal.beam_count(), 181);
    assert!(!rig.to_toml().contains("range_max_m") && rig.to_toml().contains("remission = false"));
    let lines = "units = \"mm\"\nrange_max_m = 16\nindex_bytes = true\ndazzle_tolerant = false";
    let rig = with("horizontal", lines).unwrap();
    let laser = &rig.horizontal;
    assert_eq!((laser.range_max_m, laser.index_bytes), (Some(16), Some(true)));
    assert_eq!((laser.dazzle_tolerant, laser.remission), (Some(false), false));
    assert_eq!(Rig::parse(&rig.to_toml()).unwrap(), rig);
    let s14 = with("horizontal", "fov_deg = 90\nremission = true\nrange_max_m = 160").unwrap();
    assert!(s14.horizontal.remission, "an S14's remission does not take bits from its ranges");
    let near = with("horizontal", "remission = true\nrange_max_m = 80").unwrap();
    assert_eq!(Rig::parse(&near.to_toml()).unwrap(), near);
}

#[test]
fn other_bases_bring_their_own_keys() {
    let roboclaw = "protocol = \"roboclaw\"\naddress = 129\nwheel_base_m = 0.4\nmetres_per_count_left = 0.0002\nmetres_per_count_right = -0.0003";
    let rig = with("base", roboclaw).unwrap();
    let expected = BaseProtocol::RoboClaw {
        address: 129,
        wheel_base_m: 0.4,
        metres_per_count_left: 0.0002,
        metres_per_count_right: -0.0003,
    };
    assert_eq!((rig.base.protocol, rig.base.baud), (expected, 38400));
    assert_eq!(Rig::parse(&rig.to_toml()).unwrap(), rig);
}

#[test]
fn an_rflex_base_counts_as_its_model_does_or_as_the_robot_was_measured() {
    let scale = |lines: &str| {
        let rig = with("base", &format!("protocol = \"rflex\"\n{lines}")).unwrap();
        assert_eq!(Rig::parse(&rig.to_toml()).unwrap(), rig);
        assert_eq!(rig.base.baud, 115_200);
        match rig.base.protocol {
            BaseProtocol::Rflex { counts_per_m, counts_per_rad } => (counts_per_m, counts_per_rad),
            other => panic!("{other:?}"),
        }
    };
    assert_eq!(scale(""), (101_230.0, 35_343.888));
    assert_eq!(scale("model = \"atrv-jr\""), (87_462.73, 36_277.67));
    assert_eq!(scale("counts_per_m = 103000\ncounts_per_rad = -35000"), (103_000.0, -35_000.0));
    assert_eq!(scale("model = \"magellan\"\ncounts_per_m = 44000"), (44_000.0, 5_818.02));
}

#[test]
fn what_is_printed_is_the_same_rig_with_every_key() {
    let odd = Mount { x: 1e-7, y: -0.1 - 0.2, z: 12.0, roll: 0.1, pitch: -90.0, yaw: 359.999 };
    let mut rig = Rig::default();
    rig.horizontal.mount = odd;
    rig.horizontal.port = "/dev/by-id/a \"quoted\" \\ name".into();
    rig.base.protocol = BaseProtocol::P2os { metres_per_tick: Some(0.000_123_456_789) };
    let text = rig.to_toml();
    assert_eq!(Rig::parse(&text).unwrap(), rig, "{text}");
    for key in ["port", "baud", "fov_deg", "resolution_deg", "units", "mount", "delay_ms"] {
        assert_eq!(
            text.matches(&format!("\n{key} = ")).count(),
            if matches!(key, "port" | "baud") { 3 } else { 2 },
            "{key}\n{text}"
        );
    }
}

/// Section, the line put into it, and what is said of it.
const MISTAKES: &[(&str, &str, &str)] = &[
    (
        "horizontal",
        "buad = 9600",
        "line 2: unknown key `horizontal.buad`; known here: protocol, port, baud, fov_deg, resolution_deg, units, range_max_m, index_bytes, remission, dazzle_tolerant, mount, delay_ms",
    ),
    ("horizontal", "baud = 57600", "line 2: `horizontal.baud` is 57600; allowed: 9600, 19200, 38400, 500000"),
    ("vertical", "fov_deg = 270", "line 4: `vertical.fov_deg` is 270; allowed: 90, 100, 180"),
    ("vertical", "resolution_deg = 0.3", "line 4: `vertical.resolution_deg` is 0.3; allowed: 0.25, 0.5, 1"),
    (
        "vertical",
        "resolution_deg = 0.25",
        "line 4: `vertical.resolution_deg` is 0.25; allowed: 0.5, 1 (0.25 with fov_deg = 100 only)",
    ),
    (
        "vertical",
        "fov_deg = 90\nresolution_deg = 1",
        "line 5: `vertical.resolution_deg` is 1; allowed: 0.5 with fov_deg = 90 (an LMS S14 has no other)",
    ),
    (
        "horizontal",
        "range_max_m = 20",
        "line 2: `horizontal.range_max_m` is 20; allowed: 8, 16, 32, 80, 160, 320",
    ),
    (
        "horizontal",
        "range_max_m = 8",
        "line 2: `horizontal.range_max_m` is 8; allowed: 80, 160, 320 with units = \"cm\"",
    ),
    (
        "horizontal",
        "units = \"mm\"\nrange_max_m = 80",
        "line 3: `horizontal.range_max_m` is 80; allowed: 8, 16, 32 with units = \"mm\"",
    ),
    (
        "horizontal",
        "units = \"mm\"\nremission = true\nrange_max_m = 16",
        "line 4: `horizontal.range_max_m` is 16; allowed: 8 with units = \"mm\", 80 with units = \"cm\" (remission = true leaves no more)",
    ),
    ("horizontal", "index_bytes = 1", "line 2: `horizontal.index_bytes` is 1; allowed: true, false"),
    ("horizontal", "units = \"m\"", "line 2: `horizontal.units` is \"m\"; allowed: \"cm\", \"mm\""),
    ("horizontal", "units = 5", "line 2: `horizontal.units` is 5; allowed: \"cm\", \"mm\""),
    (
        "horizontal",
        "baud = \"9600\"",
        "line 2: `horizontal.baud` is \"9600\"; allowed: 9600, 19200, 38400, 500000",
    ),
    ("horizontal", "mount = 5", "line 2: `horizontal.mount` is 5; allowed: a table"),
    (
        "horizontal",
        "mount = { x = 0, tilt = 1 }",
        "line 2: unknown key `horizontal.mount.tilt`; known here: x, y, z, roll, pitch, yaw",
    ),
    (
        "horizontal",
        "mount = { z = 300 }",
        "line 2: `horizontal.mount.z` is 300; allowed: a number from -100 to 100",
    ),
    (
        "horizontal",
        "delay_ms = nan",
        "line 2: `horizontal.delay_ms` is nan; allowed: a number from -1000 to 1000",
    ),
    (
        "horizontal",
        "delay_ms = inf",
        "line 2: `horizontal.delay_ms` is inf; allowed: a number from -1000 to 1000",
    ),
    (
        "base",
        "metres_per_tick = 0",
        "line 6: `base.metres_per_tick` is 0; allowed: a number from 0.000000001 to 10",
    ),
    (
        "base",
        "address = 128",
        "line 6: unknown key `base.address`; known here: protocol, port, baud, metres_per_tick",
    ),
    (
        "base",
        "protocol = \"rflex\"\nmetres_per_tick = 1",
        "line 7: unknown key `base.metres_per_tick`; known here: protocol, port, baud, model, counts_per_m, counts_per_rad",
    ),
    (
        "base",
        "protocol = \"rflex\"\nmodel = \"b22\"",
        "line 7: `base.model` is \"b22\"; allowed: \"atrv\", \"atrv-2\", \"atrv-jr\", \"atrv-mini\", \"b14r\", \"b21r\", \"magellan\", \"magellan-pro\"",
    ),
    (
        "base",
        "protocol = \"rflex\"\ncounts_per_m = 100000",
        "line 5: missing key `base.counts_per_rad`: it has no default",
    ),
    (
        "base",
        "protocol = \"rflex\"\nmodel = \"b21r\"\ncounts_per_rad = 0",
        "line 8: `base.counts_per_rad` is 0; allowed: 1 or more, negative when it counts the other way",
    ),
    (
        "base",
        "protocol = \"roboclaw\"\naddress = 5",
        "line 7: `base.address` is 5; allowed: 128, 129, 130, 131, 132, 133, 134, 135",
    ),
    (
        "base",
        "protocol = \"roboclaw\"\nmetres_per_count_left = 0",
        "line 7: `base.metres_per_count_left` is 0; allowed: a number that is not 0, negative when the wheel counts backwards",
    ),
];

#[test]
fn each_mistake_is_named_with_line_key_found_and_allowed() {
    for &(section, line, message) in MISTAKES {
        let error = with(section, line).expect_err(line);
        assert_eq!(error.to_string(), message, "{line}");
    }
}

const NO_BASE: &str = "missing section [base] with its `port`; a rig whose base tells nothing, or a laser alone on the \
    bench, has `protocol = \"none\"` there and is matched without odometry";

#[test]
fn what_is_missing_or_is_no_toml_is_named() {
    let table = [
        ("[base]\nport = \"b\"", "missing key `horizontal.port`: it has no default"),
        ("[horizontal]\n[base]\nport = \"b\"", "line 1: missing key `horizontal.port`: it has no default"),
        ("[horizontal]\nport = \"a\"\n[base]", "line 3: missing key `base.port`: it has no default"),
        ("[horizontal]\nport = \"a\"", NO_BASE),
        (
            "[horizontal]\nport = \"\"\n[base]\nport = \"b\"",
            "line 2: `horizontal.port` is \"\"; allowed: a text, for example \"/dev/ttyUSB0\"",
        ),
        (
            "[horizontal]\nport = 1\n[base]\nport = \"b\"",
            "line 2: `horizontal.port` is 1; allowed: a text, for example \"/dev/ttyUSB0\"",
        ),
        ("horizontal = 3\n[base]\nport = \"b\"", "line 1: `horizontal` is 3; allowed: a table"),
    ];
    for (text, message) in table {
        assert_eq!(Rig::parse(text).expect_err(text).to_string(), message, "{text}");
    }
    assert_eq!(
        Rig::parse("").expect_err("").to_string(),
        format!("2 faults:\n  missing key `horizontal.port`: it has no default\n  {NO_BASE}")
    );
    for (text, line) in
        [("[horizontal]\nport = \"a\nbaud = 1", 2), ("[base]\nport = \"b\"\nport = \"c\"", 3), ("x", 1)]
    {
        match Rig::parse(text) {
            Err(RigError::Syntax { line: found, .. }) => assert_eq!(found, line, "{text}"),
            other => panic!("{text}: {other:?}"),
        }
    }
}

#[test]
fn all_mistakes_are_named_at_once_in_the_order_of_the_text() {
    let text = "[horizontal]\nbuad = 9600\nfov_deg = 270\nresolution_deg = 0.25\nmount = { x = 500, tilt = 3 }\n\
                [vertical]\nprotocol = \"cola\"\naddress = \"laser\"\nsave = true\n\
                [base]\nport = \"b\"\nprotocol = \"p3os\"\nmetres_per_tick = 0\n[lidar]\n";
    let error = Rig::parse(text).expect_err(text).to_string();
    let places: Vec<&str> = error.lines().map(|line| line.split("`; ").next().unwrap()).collect();
    let starts = [
        "9 faults:",
        "  line 1: missing key `horizontal.port`",
        "  line 2: unknown key `horizontal.buad",
        "  line 3: `horizontal.fov_deg` is 270",
        // Not line 4: whether 0.25 is allowed depends on the field of view.
        "  line 5: unknown key `horizontal.mount.tilt",
        "  line 5: `horizontal.mount.x` is 500",
        "  line 8: `vertical.address` is \"laser\"",
        "  line 9: `vertical.save` is true",
        // Not line 13: which keys a base has depends on its protocol.
        "  line 12: `base.protocol` is \"p3os\"",
        "  line 14: unknown key `lidar",
    ];
    assert_eq!(places.len(), starts.len(), "{error}");
    for (place, start) in places.iter().zip(starts) {
        assert!(place.starts_with(start), "{place:?} does not start with {start:?}\n{error}");
    }
    let no_toml = Rig::parse("[horizontal]\nport = \"a\nbaud = = 1\n").unwrap_err().to_string();
    assert!(
        no_toml.contains("\n  line 2: not TOML") && no_toml.contains("\n  line 3: not TOML"),
        "{no_toml}"
    );
}

#[test]
fn a_file_is_named_in_what_is_wrong_with_it() {
    let missing = Rig::load(std::path::Path::new("/nowhere/rig.toml")).unwrap_err().to_string();
    assert!(missing.contains("/nowhere/rig.toml") && missing.contains("No such file"), "{missing}");
    let path = std::env::temp_dir().join(format!("biplane-rig-{}.toml", std::process::id()));
    std::fs::write(&path, "[horizontal]\nbaud = 1\n").unwrap();
    let wrong = Rig::load(&path).unwrap_err().to_string();
    std::fs::remove_file(&path).unwrap();
    assert!(wrong.contains(path.to_str().unwrap()) && wrong.ends_with(NO_BASE), "{wrong}");
}

#[test]
fn an_inertial_unit_sits_where_it_is_said_and_is_printed_so() {
    let rig = Rig::parse(&format!("{PORTS}[imu]\nmount = {{ z = 0.4, yaw = 90 }}\n")).unwrap();
    let unit = rig.imu.clone().unwrap();
    assert_eq!(unit.mount, Mount { z: 0.4, yaw: 90.0, ..Mount::default() });
    assert_eq!(Rig::parse(&rig.to_toml()).unwrap(), rig);
    assert!(!Rig::default().to_toml().contains("imu"), "a rig without one says nothing of it");
}

#[test]
fn an_inertial_unit_on_a_line_has_its_port_and_rates_and_one_without_has_none() {
    let parse = |keys: &str| Rig::parse(&format!("{PORTS}[imu]\n{keys}"));
    let rig = parse("protocol = \"xsens\"\nport = \"/dev/ttyUSB3\"\nmount = { z = 0.2 }").unwrap();
    let mount = Mount { z: 0.2, ..Mount::default() };
    assert_eq!(rig.imu, Some(InertialUnit { mount, ..InertialUnit::xsens("/dev/ttyUSB3") }));
    assert_eq!(rig.imu.as_ref().map(|unit| (unit.baud, unit.rate_hz)), Some((115_200, 100)));
    assert_eq!(Rig::parse(&rig.to_toml()).unwrap(), rig);
    let fast = parse("protocol = \"xsens\"\nport = \"i\"\nbaud = 230400\nrate_hz = 400").unwrap();
    assert_eq!(Rig::parse(&fast.to_toml()).unwrap(), fast);
    for (keys, message) in [
        ("protocol = \"xsens\"", "line 7: missing key `imu.port`: it has no default"),
        ("protocol = \"um7\"", "line 8: `imu.protocol` is \"um7\"; allowed: \"none\", \"xsens\""),
        ("protocol = \"none\"\nport = \"i\"", "line 9: unknown key `imu.port`; known here: protocol, mount"),
        (
            "protocol = \"xsens\"\nport = \"i\"\nrate_hz = 60",
            "line 10: `imu.rate_hz` is 60; allowed: 25, 50, 100, 200, 400",
        ),
        (
            "protocol = \"xsens\"\nport = \"i\"\nrate_hz = 400",
            "line 10: `imu.rate_hz` is 400; allowed: 213 or less at 115200 Bd: a sample has 540 bits",
        ),
        (
            "protocol = \"xsens\"\nport = \"i\"\nbaud = 38400",
            "line 10: `imu.baud` is 38400; allowed: 54000 or more for 100 samples a second",
        ),
    ] {
        assert_eq!(parse(keys).expect_err(keys).to_string(), message, "{keys}");
    }
}

#[test]
fn a_home_made_base_without_its_measures_is_told() {
    let base = |more: &str| {
        let text = format!("[horizontal]\nport = \"a\"\n[base]\nport = \"b\"\n{more}");
        Rig::parse(&text).unwrap().base.protocol.unmeasured()
    };
    assert!(base("").is_empty(), "a Pioneer tells its own");
    let all = ["wheel_base_m", "metres_per_count_left", "metres_per_count_right"];
    assert_eq!(base("protocol = \"roboclaw\""), all);
    assert_eq!(
        base("protocol = \"roboclaw\"\nwheel_base_m = 0.41\nmetres_per_count_right = -0.00009"),
        all[1..2]
    );
}
