//! `biplane calibrate` on recordings whose lasers truly sit elsewhere than their rig says. Made without any
//! device: the truth is a box.

use std::path::Path;

use biplane_recording::messages::{
    DiagnosticArray, DiagnosticStatus, KeyValue, LaserScan, Odometry, PoseWithCovarianceStamped,
};
use biplane_recording::rig::{BaseProtocol, Laser, Mount};
use biplane_recording::{Reader, Rig, Topic, Writer, WriterOptions};

use crate::room::{self, Content};
use crate::run::Folder;

const LOW: [f64; 3] = [-2.0, -2.5, 0.0];
const HIGH: [f64; 3] = [8.0, 3.0, 2.6];
const START_NS: i64 = 1_700_000_000_000_000_000;
const SECONDS: usize = 26;
const SPEED_M_S: f64 = 0.3;
/// What the base believes to have driven, over what it drove.
const COUNTED: f64 = 1.0 / 1.02;

/// Where the robot is each millisecond: it weaves from wall to wall, half a radian a second at most.
fn way() -> Vec<[f64; 3]> {
    let mut at = [0.0_f64; 3];
    let step = |millisecond: usize| {
        let was = at;
        at[0] += SPEED_M_S * 1e-3 * at[2].cos();
        at[1] += SPEED_M_S * 1e-3 * at[2].sin();
        at[2] = (0.5e-3 * millisecond as f64).sin();
        was
    };
    (0..SECONDS * 1000).map(step).collect()
}

fn pose(way: &[[f64; 3]], stamp_ns: i64) -> [f64; 3] {
    way[((stamp_ns - START_NS).max(0) as usize / 1_000_000).min(way.len() - 1)]
}

/// What a laser sees whose scan is taken `late_ns` before its stamp.
fn scan(laser: &Laser, way: &[[f64; 3]], stamp_ns: i64, late_ns: i64) -> LaserScan {
    let range = |beam: usize| {
        let [x, y, theta] = pose(way, stamp_ns - late_ns + laser.beam_delay_ns(beam));
        let (sin, cos) = theta.sin_cos();
        let turned = |[a, b, c]: [f64; 3]| [cos * a - sin * b, sin * a + cos * b, c];
        let (s, c) = laser.beam_angle_rad(beam).sin_cos();
        let origin = turned(laser.mount.base_from_laser([0.0; 3]));
        let ahead = turned(laser.mount.base_from_laser([c, s, 0.0]));
        let origin_m = [origin[0] + x, origin[1] + y, origin[2]];
        let axis = |i: usize| {
            let direction = ahead[i] - origin[i];
            let wall = if direction > 0.0 { HIGH[i] } else { LOW[i] };
            if direction.abs() < 1e-12 { f64::INFINITY } else { (wall - origin_m[i]) / direction }
        };
        // Counted in centimeters, as the laser does.
        ((0..3).map(axis).fold(f64::INFINITY, f64::min) * 100.0).round() as f32 / 100.0
    };
    let beams = laser.beam_count();
    LaserScan {
        stamp_ns,
        angle_min_rad: laser.beam_angle_rad(0) as f32,
        angle_max_rad: laser.beam_angle_rad(beams - 1) as f32,
        angle_increment_rad: laser.resolution_deg.to_radians() as f32,
        time_increment_s: laser.time_increment_s() as f32,
        range_max_m: 80.0,
        ranges_m: (0..beams).map(range).collect(),
        ..LaserScan::default()
    }
}

/// Writes a drive with a vertical laser that sits at `mount` and is `late_ns` late, while its rig says what
/// is usual.
fn record(path: &Path, mount: Mount, late_ns: i64, mounting: &str) {
    record_of(path, mount, late_ns, ("mounting", mounting), Some(0.001));
}

/// The same with a figure of `/diagnostics`, and what the rig says of a tick.
fn record_of(path: &Path, mount: Mount, late_ns: i64, figure: (&str, &str), metres_per_tick: Option<f64>) {
    let mut rig = Rig::default();
    rig.base.protocol = BaseProtocol::P2os { metres_per_tick };
    let way = way();
    let mut writer = Writer::create(path, &WriterOptions::default()).unwrap();
    writer.attach("rig.toml", "application/toml", rig.to_toml().as_bytes()).unwrap();
    let vertical = Laser { mount, ..rig.vertical.clone().unwrap() };
    for tick in 0..(SECONDS as i64 - 1) * 20 {
        let stamp_ns = START_NS + tick * 50_000_000;
        let [x, y, theta] = pose(&way, stamp_ns);
        let orientation_xyzw = [0.0, 0.0, (theta / 2.0).sin(), (theta / 2.0).cos()];
        let posed = PoseWithCovarianceStamped {
            stamp_ns,
            position_m: [x, y, 0.0],
            orientation_xyzw,
            ..PoseWithCovarianceStamped::default()
        };
        writer.write(Topic::Pose, stamp_ns, stamp_ns, &posed).unwrap();
        let position_m = [x * COUNTED, y * COUNTED, 0.0];
        let odometry = Odometry { stamp_ns, position_m, orientation_xyzw, ..Odometry::default() };
        writer.write(Topic::Odom, stamp_ns, stamp_ns, &odometry).unwrap();
        let seen = scan(&rig.horizontal, &way, stamp_ns, 0);
        writer.write(Topic::ScanHorizontal, stamp_ns, stamp_ns, &seen).unwrap();
        let seen = scan(&vertical, &way, stamp_ns, late_ns);
        writer.write(Topic::ScanVertical, stamp_ns, stamp_ns, &seen).unwrap();
    }
    let value = KeyValue { key: figure.0.to_owned(), value: figure.1.to_owned() };
    let name = "biplane: laser_horizontal".to_owned();
    let status = vec![DiagnosticStatus { name, values: vec![value], ..DiagnosticStatus::default() }];
    let state = DiagnosticArray { status, ..DiagnosticArray::default() };
    writer.write(Topic::Diagnostics, START_NS, START_NS, &state).unwrap();
    writer.finish().unwrap();
}

/// The angle between two orientations, degrees, and the distance of two places, meters, z left out.
fn apart(a: &Mount, b: &Mount) -> (f64, f64) {
    let (m, n) = (a.matrix(), b.matrix());
    let trace: f64 = (0..3).flat_map(|i| (0..3).map(move |j| (i, j))).map(|(i, j)| m[i][j] * n[i][j]).sum();
    (((trace - 1.0) / 2.0).min(1.0).acos().to_degrees(), (a.x - b.x).hypot(a.y - b.y))
}

fn row<'a>(report: &'a serde_json::Value, name: &str) -> &'a serde_json::Value {
    report["rows"].as_array().unwrap().iter().find(|row| row["name"] == name).unwrap()
}

#[test]
fn what_a_tick_was_taken_as_is_corrected_where_the_rig_leaves_it_to_the_base() {
    let folder = Folder::new("calibrate-ticks");
    let mount = Rig::default().vertical.unwrap().mount;
    record_of(&folder.path("run.mcap"), mount, 0, ("metres_per_tick", "0.000485"), None);
    let table = folder.expect("calibrate run.mcap -o rig.toml", 0, &["way_scale"]).stdout;
    assert!(!table.contains("enter metres_per_tick"), "{table}");
    let rig = Rig::load(&folder.path("rig.toml")).unwrap();
    let BaseProtocol::P2os { metres_per_tick: Some(meters) } = rig.base.protocol else { panic!("{rig:?}") };
    assert!((meters / 0.000485 - 1.02).abs() < 0.003, "{meters}");
    let lines = folder.expect("calibrate run.mcap", 0, &[]).stdout;
    // The rig has no such line, so none is taken out.
    assert!(lines.contains("[base]\n+ metres_per_tick = 0.00049"), "{lines}");
    assert!(lines.contains("  # instead of 0.000485, what the base says\n"), "{lines}");
    assert!(!lines.contains("- metres_per_tick"), "{lines}");
    // Older recordings do not say it.
    record_of(&folder.path("old.mcap"), mount, 0, ("mounting", "fits"), None);
    folder.expect("calibrate old.mcap", 0, &[]);
    let table = folder.expect("calibrate old.mcap", 0, &[]).stdout;
    assert!(table.contains("enter metres_per_tick = 0.00102"), "{table}");
}

#[test]
fn a_laser_that_sits_elsewhere_is_found_and_what_no_scan_tells_is_left_and_said() {
    let folder = Folder::new("calibrate");
    let truth = Mount { x: 0.08, y: -0.02, z: 0.45, roll: 1.0, pitch: -88.5, yaw: -3.0 };
    record(&folder.path("run.mcap"), truth, 30_000_000, "fits");
    let ran = folder.expect("calibrate run.mcap --json -o rig.toml", 0, &[]);
    let report: serde_json::Value = serde_json::from_str(&ran.stdout).unwrap();
    let rig = Rig::load(&folder.path("rig.toml")).unwrap();
    let found = rig.vertical.clone().unwrap();
    let (turn_deg, off_m) = apart(&found.mount, &truth);
    assert!(turn_deg < 0.15 && off_m < 0.005, "{turn_deg} {off_m} {found:?}");
    assert!((found.delay_ms - 30.0).abs() < 2.5, "{found:?}");
    // A fan that looks up from a floor that it does not see: the height stays what it was.
    assert!(found.mount.z == 0.45 && row(&report, "z")["observed"] == false, "{report}");
    assert!(row(&report, "z")["sigma"].is_null() && row(&report, "x")["observed"] == true, "{report}");
    let BaseProtocol::P2os { metres_per_tick: Some(meters) } = rig.base.protocol else { panic!("{rig:?}") };
    assert!((meters - 0.00102).abs() < 3e-6, "{meters}");
    assert_eq!(report["rig"], std::fs::read_to_string(folder.path("rig.toml")).unwrap());

    let table = folder.expect("calibrate run.mcap", 0, &[]).stdout;
    for word in [
        "observed  remark\n",
        "unknown  no        the drive does not tell\n",
        "- metres_per_tick = 0.001\n+ metres_per_tick",
        "  yes       not written: a rig with this base has no key for it\n",
        "\n+ delay_ms = ",
        "  # instead of 0.0, the default\n",
    ] {
        assert!(table.contains(word), "{word}: {table}");
    }
    folder.expect("calibrate run.mcap -o rig.toml", 1, &["rig.toml exists already"]);
    folder.expect("calibrate run.mcap -o run.mcap --force", 1, &["name another output"]);
    folder.expect("calibrate", 2, &["RUN.mcap"]);
}

#[test]
fn a_straight_drive_tells_the_scale_and_the_lean_but_neither_aim_nor_delay() {
    let folder = Folder::new("calibrate-straight");
    room::record(&folder.path("run.mcap"), Content { poses: true, vertical: true });
    let ran = folder.expect("calibrate run.mcap --json", 0, &[]);
    let report: serde_json::Value = serde_json::from_str(&ran.stdout).unwrap();
    for (name, observed) in [
        ("x", false),
        ("y", true),
        ("z", false),
        ("about_x", true),
        ("about_z", false),
        ("delay_ms", false),
        ("way_scale", true),
    ] {
        assert_eq!(row(&report, name)["observed"], observed, "{name}: {report}");
    }
    assert!(row(&report, "turn_scale")["observed"] == false, "{report}");
    room::record(&folder.path("flat.mcap"), Content { poses: true, vertical: false });
    folder.expect("calibrate flat.mcap", 0, &[]);
    room::record(&folder.path("unposed.mcap"), Content { poses: false, vertical: true });
    folder.expect("calibrate unposed.mcap -o rig.toml", 1, &["no pose"]);
    assert!(!folder.path("rig.toml").exists());
}

#[test]
fn a_scale_that_the_rig_leaves_to_the_base_is_said_with_what_to_enter() {
    let folder = Folder::new("calibrate-by-hand");
    let mount = Rig::default().vertical.unwrap().mount;
    record(&folder.path("tick.mcap"), mount, 0, "fits");
    // The same, of a rig that does not say what a tick is worth.
    let reader = Reader::open(&folder.path("tick.mcap")).unwrap();
    let mut rig = reader.rig().unwrap().unwrap();
    rig.base.protocol = BaseProtocol::P2os { metres_per_tick: None };
    let mut writer = Writer::create(&folder.path("run.mcap"), &WriterOptions::default()).unwrap();
    writer.attach("rig.toml", "application/toml", rig.to_toml().as_bytes()).unwrap();
    reader.messages().for_each(|entry| writer.copy(&entry.unwrap()).unwrap());
    writer.finish().unwrap();
    let table = folder.expect("calibrate run.mcap", 0, &[]).stdout;
    let words = "enter metres_per_tick = 0.00102";
    assert!(table.contains(words) && table.contains("else 1.02"), "{table}");
    assert!(!table.contains("+ metres_per_tick"), "{table}");
}

#[test]
fn of_a_recording_that_says_of_itself_that_its_lasers_are_swapped_nothing_is_refined_and_all_say_so() {
    let folder = Folder::new("calibrate-swapped");
    let mount = Rig::default().vertical.unwrap().mount;
    record(&folder.path("run.mcap"), mount, 0, "looks swapped with the other laser");
    let words = "laser_horizontal: looks swapped with the other laser";
    folder.expect("calibrate run.mcap -o rig.toml", 1, &["nothing can be determined", words]);
    folder.expect("traj run.mcap -o run.tum --quiet", 0, &[words]);
    folder.expect("map run.mcap -o floor", 0, &[words]);
    folder.expect("optimize run.mcap -o closed.mcap", 0, &[words]);
    folder.expect("build run.mcap -o model --no-optimize", 0, &[words]);
    let built = folder.expect("build run.mcap -o closed", 0, &[words]);
    assert_eq!(built.stderr.matches(words).count(), 1, "{}", built.stderr);
    assert!(!folder.path("rig.toml").exists());
}
