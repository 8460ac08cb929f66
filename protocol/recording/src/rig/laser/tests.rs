//! Lasers of today in a rig: read, written, and refused with what is allowed.

use crate::rig::{Base, Laser, Rig};

/// A laser on a network, and a base that tells nothing.
const NETWORK: &str =
    "[horizontal]\nprotocol = \"cola\"\naddress = \"192.168.0.1:2112\"\n[base]\nprotocol = \"none\"\n";

#[test]
fn a_laser_at_an_address_and_no_base_are_a_rig_that_reads_back() {
    let rig = Rig::parse(NETWORK).unwrap();
    assert_eq!(rig.horizontal, Laser::horizontal().at_address("192.168.0.1:2112"));
    assert_eq!(rig.base, Base::none());
    assert_eq!((rig.horizontal.turns(), rig.horizontal.beam_count()), (1, 0));
    assert_eq!(Rig::parse(&rig.to_toml()).unwrap(), rig);
    assert!(!Rig::default().to_toml().contains("lms2xx"), "old rigs are written as before");
    let keys =
        "fov_deg = 180\nresolution_deg = 0.3333\nscan_hz = 50\nremission = true\nlogin = true\nsave = true\n";
    let rig = Rig::parse(&NETWORK.replace("[base]", &format!("{keys}[base]"))).unwrap();
    let cola = rig.horizontal.cola().unwrap();
    assert_eq!((cola.fov_deg, cola.resolution_deg, cola.scan_hz), (Some(180.0), Some(0.3333), Some(50.0)));
    assert!(cola.login && cola.save && cola.remission == Some(true));
    assert_eq!(Rig::parse(&rig.to_toml()).unwrap(), rig);
}

#[test]
fn what_no_laser_on_a_network_offers_is_refused_with_what_some_do() {
    let with = |keys: &str| {
        Rig::parse(&NETWORK.replace("[base]", &format!("{keys}\n[base]"))).unwrap_err().to_string()
    };
    for (keys, error) in [
        ("scan_hz = 40", "line 4: `horizontal.scan_hz` is 40; allowed: 15, 25, 35, 50, 75, 100"),
        (
            "resolution_deg = 0.1",
            "line 4: `horizontal.resolution_deg` is 0.1; allowed: 0.1667, 0.25, 0.3333, 0.5, 0.6667, 1",
        ),
        ("fov_deg = 360", "line 4: `horizontal.fov_deg` is 360; allowed: a number from 1 to 270"),
        (
            "save = true",
            "line 4: `horizontal.save` is true; allowed: false without login = true: who does not log in writes nothing",
        ),
    ] {
        assert_eq!(with(keys), error);
    }
    let short = Rig::parse(&NETWORK.replace("[base]", "resolution_deg = 0.333\n[base]")).unwrap();
    assert_eq!(short.horizontal.cola().unwrap().resolution_deg, Some(0.333));
    let instead = "allowed: nothing: a laser on a network has `address` instead of `port`";
    let port = NETWORK.replace("address = \"192.168.0.1:2112\"", "port = \"/dev/ttyUSB0\"");
    let port = Rig::parse(&port).unwrap_err().to_string();
    assert_eq!(port, format!("line 3: `horizontal.port` is \"/dev/ttyUSB0\"; {instead}"));
    assert_eq!(with("port = \"a\""), format!("line 4: `horizontal.port` is \"a\"; {instead}"));
    assert!(with("baud = 38400").contains("`horizontal.baud`"), "{}", with("baud = 38400"));
    for address in ["192.168.0.1", "192.168.0.1:", ":2112", "laser:cola", "laser:0"] {
        let refused = Rig::parse(&NETWORK.replace("192.168.0.1:2112", address)).unwrap_err().to_string();
        assert!(refused.contains("allowed: host and port"), "{refused}");
    }
    let unknown = Rig::parse(&NETWORK.replace("\"cola\"", "\"rplidar\"")).unwrap_err().to_string();
    assert!(
        unknown.contains(
            "allowed: \"lms2xx\" (SICK LMS 2xx on a serial line), \"cola\" (SICK on a network), \"scip\" (Hokuyo)"
        ),
        "{unknown}"
    );
    let base = Rig::parse(&NETWORK.replace("\"none\"", "\"ros_odom\"")).unwrap_err().to_string();
    assert!(base.contains("\"rflex\" (B21r, ATRV, Magellan), \"none\" (no base; bags of ROS: "), "{base}");
    let port = Rig::parse(&NETWORK.replace("\"none\"", "\"none\"\nport = \"b\"")).unwrap_err();
    assert!(port.to_string().contains("base.port"), "{port}");
}

/// A Hokuyo laser on a serial line, and another one on the network.
const HOKUYO: &str = "[horizontal]\nprotocol = \"scip\"\nport = \"/dev/ttyACM0\"\n[vertical]\nprotocol = \"scip\"\naddress = \
                      \"192.168.0.10:10940\"\n[base]\nprotocol = \"none\"\n";

#[test]
fn hokuyo_lasers_on_a_port_and_at_an_address_are_a_rig_that_reads_back() {
    let rig = Rig::parse(HOKUYO).unwrap();
    assert_eq!((rig.horizontal.port.as_str(), rig.horizontal.baud), ("/dev/ttyACM0", 115_200));
    assert_eq!((rig.horizontal.address(), rig.horizontal.beam_count()), (None, 0));
    let vertical = rig.vertical.clone().unwrap();
    assert_eq!(vertical, Laser::vertical().scip_at_address("192.168.0.10:10940"));
    assert_eq!((vertical.address(), vertical.turns()), (Some("192.168.0.10:10940"), 1));
    assert_eq!(Rig::parse(&rig.to_toml()).unwrap(), rig);
    let keys =
        "baud = 750000\nfov_deg = 180\nresolution_deg = 0.5\nscan_hz = 20\nremission = true\n[vertical]";
    let rig = Rig::parse(&HOKUYO.replace("[vertical]", keys)).unwrap();
    let scip = rig.horizontal.scip().unwrap();
    assert_eq!((scip.fov_deg, scip.resolution_deg, scip.scan_hz), (Some(180.0), Some(0.5), Some(20.0)));
    assert_eq!((scip.remission, rig.horizontal.baud), (Some(true), 750_000));
    assert_eq!(Rig::parse(&rig.to_toml()).unwrap(), rig);
}

#[test]
fn a_hokuyo_laser_is_on_one_line_and_knows_its_rates() {
    let with = |keys: &str| {
        Rig::parse(&HOKUYO.replace("[vertical]", &format!("{keys}\n[vertical]"))).unwrap_err().to_string()
    };
    assert!(with("baud = 9600").contains("allowed: 19200, 38400, 57600, 115200"), "{}", with("baud = 9600"));
    assert!(with("address = \"a:1\"").contains("a laser is on one line"), "{}", with("address = \"a:1\""));
    assert!(with("login = true").contains("unknown key `horizontal.login`"), "{}", with("login = true"));
    let nowhere = Rig::parse(&HOKUYO.replace("port = \"/dev/ttyACM0\"\n", "")).unwrap_err().to_string();
    assert_eq!(nowhere, "line 1: missing key `horizontal.port`: it has no default");
    let odd = Rig::parse(&HOKUYO.replace(":10940", "")).unwrap_err().to_string();
    assert!(odd.contains("for example \"192.168.0.10:10940\""), "{odd}");
}
