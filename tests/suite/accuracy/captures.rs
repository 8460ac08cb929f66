//! The committed captures, twice: through mock devices on pseudo-terminals into the real `record`, and
//! straight through `replay`. Both must give the same scans, stamps and poses to within the timing of the
//! line.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc;
use std::time::Duration;

use biplane_mock::capture::source::Capture;
use biplane_mock::serve::{ServeOptions, Source, serve};
use biplane_onboard::{RecordOptions, ReplayOptions, record, replay};
use biplane_recording::rig::{Laser, LaserProtocol};
use biplane_recording::{Reader, Rig, Topic};

use crate::accuracy::recorded::{PosedScan, folder, posed_scans, seen_from};

/// A scan of one path may be stamped so much otherwise than of the other, relative to the first: two mirror
/// turns. A capture whose adapter stalled says in its sidecar by how much its reads came late: a mock can
/// only serve what was read when it was read.
const STAMP_TOLERANCE_NS: i64 = 2 * 13_320_000;
/// Poses differ by what other odometry stamps make of a match, and by what the robot does while a late read
/// is late.
const POSE_TOLERANCE_M: f64 = 0.02;
const HEADING_TOLERANCE_RAD: f64 = 0.01;
/// The robot of the captures whose reads came late drives no faster.
const SPEED_M_S: f64 = 0.25;
const TURN_RAD_S: f64 = 0.15;

fn captures() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../hil-fixtures/captures");
    let mut files: Vec<PathBuf> = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "mcap"))
        .collect();
    files.sort();
    files
}

pub(crate) fn replayed(capture: &Path, output: &Path) {
    let options = ReplayOptions { overwrite: true, ..ReplayOptions::new(capture, output) };
    replay(&options, &AtomicBool::new(false)).unwrap();
}

/// A laser is where the mock has put it: on a pseudo-terminal, or at an address.
fn find(laser: &mut Laser, links: &Path, name: &str) {
    laser.port = links.join(name).display().to_string();
    let address =
        || std::fs::read_to_string(links.join(format!("{name}.address"))).unwrap().trim().to_owned();
    match &mut laser.protocol {
        LaserProtocol::Cola(cola) => cola.address = address(),
        LaserProtocol::Scip(scip) if scip.address.is_some() => scip.address = Some(address()),
        LaserProtocol::Scip(_) | LaserProtocol::Lms2xx => {}
    }
}

/// Serves `capture` until it is over, and records from its devices.
pub(crate) fn served_and_recorded(capture: &Path, rig: &Rig, work: &Path, output: &Path) {
    let links = work.join("ports");
    let mut rig = rig.clone();
    rig.base.port = links.join("base").display().to_string();
    let source = Source::Capture { capture: Box::new(Capture::read(capture).unwrap()) };
    let options = ServeOptions { once: true, ..ServeOptions::new(source, links.clone()) };
    let (stop_mock, stop_record) = (AtomicBool::new(false), AtomicBool::new(false));
    let (ready, is_ready) = mpsc::channel();
    std::thread::scope(|scope| {
        let mock = scope.spawn(|| {
            let done = serve(&options, &stop_mock, |_| ready.send(()).unwrap());
            stop_record.store(true, Ordering::Relaxed);
            done
        });
        is_ready.recv().unwrap();
        find(&mut rig.horizontal, &links, "lms-horizontal");
        if let Some(vertical) = rig.vertical.as_mut() {
            find(vertical, &links, "lms-vertical");
        }
        let options = RecordOptions {
            duration: Some(Duration::from_secs(90)),
            overwrite: true,
            ..RecordOptions::new(rig, output)
        };
        let recorded = record(&options, &stop_record);
        stop_mock.store(true, Ordering::Relaxed);
        mock.join().unwrap().unwrap();
        assert_eq!(recorded.unwrap().losses.lost, 0);
    });
}

/// For each scan of `live` its twin in `file`, in order; scans alike to the last range are twins.
fn twins<'a>(live: &'a [PosedScan], file: &'a [PosedScan]) -> Vec<(&'a PosedScan, &'a PosedScan)> {
    let mut rest = file;
    let mut pairs = Vec::new();
    for scan in live {
        if let Some(at) = rest.iter().position(|other| other.ranges_mm == scan.ranges_mm) {
            pairs.push((scan, &rest[at]));
            rest = &rest[at + 1..];
        }
    }
    pairs
}

/// The largest lateness of a read that the capture's sidecar owns up to, nanoseconds.
fn late_reads_ns(capture: &Path) -> i64 {
    let sidecar: toml::Table =
        std::fs::read_to_string(capture.with_extension("toml")).unwrap().parse().unwrap();
    sidecar.get("late_reads_ms").map_or(0, |value| value.as_integer().unwrap() * 1_000_000)
}

/// Says what differs; prints how much is the same.
fn compare(name: &str, live: &[PosedScan], file: &[PosedScan], late_ns: i64) -> Result<(), String> {
    let pairs = twins(live, file);
    let tolerance_ns = STAMP_TOLERANCE_NS + late_ns;
    let late_s = late_ns as f64 / 1e9;
    let tolerance_m = POSE_TOLERANCE_M + SPEED_M_S * late_s;
    let tolerance_rad = HEADING_TOLERANCE_RAD + TURN_RAD_S * late_s;
    // A start-up may cost a scan. Telegrams that a stalled adapter delivered all at once cannot leave a line
    // all at once: the mock skips some, as a laser does whose line is busy.
    let min_percent = if late_ns > 0 { 90 } else { 98 };
    if pairs.len() * 100 < file.len() * min_percent {
        return Err(format!(
            "{name}: only {} of {} replayed scans were recorded as well ({} recorded)",
            pairs.len(),
            file.len(),
            live.len()
        ));
    }
    let (first_live, first_file) = pairs[0];
    for (scan, twin) in &pairs {
        let apart_ns = (scan.stamp_ns - first_live.stamp_ns) - (twin.stamp_ns - first_file.stamp_ns);
        if apart_ns.abs() > tolerance_ns {
            return Err(format!("{name}: stamps {apart_ns} ns apart at {}", twin.stamp_ns));
        }
        let [x_m, y_m, turn_rad] =
            seen_from(seen_from(first_file.pose, twin.pose), seen_from(first_live.pose, scan.pose));
        if x_m.hypot(y_m) > tolerance_m || turn_rad.abs() > tolerance_rad {
            return Err(format!(
                "{name}: poses {:.4} m and {turn_rad:.4} rad apart at {}",
                x_m.hypot(y_m),
                twin.stamp_ns
            ));
        }
    }
    println!("{name}: {} of {} scans the same in both", pairs.len(), file.len());
    Ok(())
}

/// Serves and records a capture, and compares both lasers' scans with those of its replay; says how many were
/// compared.
fn served_is_as_replayed(capture: &Path) -> Result<usize, String> {
    let name = capture.file_stem().unwrap().to_string_lossy().into_owned();
    let work = folder(&format!("captures-{name}"));
    let (from_file, from_ports) = (work.join("replayed.mcap"), work.join("recorded.mcap"));
    let rig = Reader::open(capture).unwrap().rig().unwrap().unwrap();
    replayed(capture, &from_file);
    served_and_recorded(capture, &rig, &work, &from_ports);
    let mut compared = 0;
    for (topic, pose) in [(Topic::ScanHorizontal, Topic::Pose), (Topic::ScanVertical, Topic::PoseVertical)] {
        let [live, file] = [&from_ports, &from_file].map(|path| posed_scans(path, topic, pose));
        if !file.is_empty() {
            compare(&format!("{name} {}", topic.name()), &live, &file, late_reads_ns(capture))?;
            compared += 1;
        }
    }
    Ok(compared)
}

#[test]
fn a_capture_served_on_pseudo_terminals_and_recorded_is_the_same_as_replayed() {
    // The mock serves in real time, and a machine that stands still for a tenth of a second shows in the
    // stamps: what differs is measured once more, and has to differ again.
    let compared_of = |capture: PathBuf| {
        served_is_as_replayed(&capture).or_else(|found| {
            println!("once more: {found}");
            served_is_as_replayed(&capture)
        })
    };
    let compared: usize = captures().into_iter().map(|capture| compared_of(capture).unwrap()).sum();
    assert!(compared >= 4, "only {compared} streams compared: captures are missing");
}

#[test]
fn every_capture_has_a_sidecar_that_says_how_it_was_made() {
    for capture in captures() {
        let sidecar = std::fs::read_to_string(capture.with_extension("toml"))
            .unwrap_or_else(|error| panic!("{}: no sidecar: {error}", capture.display()));
        let sidecar: toml::Table = sidecar.parse().unwrap();
        for key in ["device", "settings", "origin", "date", "obtained", "crc32"] {
            assert!(sidecar.contains_key(key), "{}: its sidecar does not say {key}", capture.display());
        }
    }
    assert!(captures().len() >= 3);
}
