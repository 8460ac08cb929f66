//! Drives with lasers of today (SICK on a network, Hokuyo), simulated and replayed: ranges, stamps and poses
//! against the simulator's truth. Both lasers of each rig are judged.

use std::path::Path;
use std::sync::atomic::AtomicBool;

use biplane_mock::devices::cola::ColaParams;
use biplane_mock::rig::fan::Fan;
use biplane_mock::rig::simulated::{SimulatedLaser, SimulatedRig};
use biplane_mock::simulate::{self, LaserOptions, SimulateOptions, SimulateReport};
use biplane_mock::world::World;
use biplane_onboard::{ReplayOptions, replay};
use biplane_recording::messages::LaserScan;
use biplane_recording::rig::Laser;
use biplane_recording::{AnyMessage, Reader, Rig, Topic};

use crate::accuracy::recorded::{folder, posed_scans};
use crate::accuracy::{rms, truth};

const SEED: u64 = 41;
/// Standing before the drive.
const STAND_NS: i64 = 500_000_000;
/// Faster than the world's path, which saves time.
const SPEED_M_S: f64 = 1.0;
/// Stamps may be off by so much, milliseconds: their root mean square, and the worst of them behind the first
/// seconds. A Hokuyo laser states whole milliseconds, from many of which the times follow.
const RMS_STAMP_MS: f64 = 0.25;
const MAX_STAMP_MS: f64 = 0.6;
const LEARN_NS: i64 = 2_000_000_000;
/// Position and heading of the localizing laser's poses, root mean squares.
const MAX_RMS_M: f64 = 0.03;
const MAX_RMS_DEG: f64 = 0.3;
/// Share of the ranges that may differ by more than the device's millimeter: rounded directions and beam
/// times make another range of a beam that just touches an edge.
const MAX_OTHER_SHARE: f64 = 0.002;

pub(crate) fn scans(path: &Path, topic: Topic) -> Vec<LaserScan> {
    let entries = Reader::open(path).unwrap().messages().map(Result::unwrap).collect::<Vec<_>>();
    let scan = |entry: &biplane_recording::Entry| match entry.decode().unwrap() {
        AnyMessage::Scan(scan) if entry.topic == Some(topic) => Some(scan),
        _ => None,
    };
    entries.iter().filter_map(scan).collect()
}

/// A laser of a simulated rig.
struct Seen {
    laser: SimulatedLaser,
    /// By how many millionths its mirror turns slower than it says.
    slow_ppm: f64,
}

/// Ranges that differ from what the simulator measures with such a fan at the true time, and all of them.
fn other_ranges(seen: &Seen, scans: &[LaserScan], first_beams_ns: &[i64]) -> (usize, usize) {
    let (mut other, mut all) = (0, 0);
    for (scan, first_beam_ns) in scans.iter().zip(first_beams_ns) {
        let fan = Fan {
            first_beam_ns: *first_beam_ns,
            beam_ns: f64::from(scan.time_increment_s) * 1e9 * (1.0 + seen.slow_ppm * 1e-6),
            first_rad: f64::from(scan.angle_min_rad),
            step_rad: f64::from(scan.angle_increment_rad),
            count: scan.ranges_m.len() as u16,
        };
        let expected = seen.laser.measure_fan(&fan);
        let is_same = |(range_m, expected_mm): (&f32, &u16)| match expected_mm {
            0 => *range_m == f32::INFINITY,
            _ => (f64::from(*range_m) * 1e3 - f64::from(*expected_mm)).abs() <= 1.0,
        };
        other += scan.ranges_m.iter().zip(&expected).filter(|pair| !is_same(*pair)).count();
        all += expected.len();
    }
    (other, all)
}

/// What is wrong with the scans of one laser.
fn faults(name: &str, run: &Path, truth_folder: &Path, seen: &Seen, count: usize) -> Vec<String> {
    let is_horizontal = seen.laser.role() == biplane_mock::rig::simulated::LaserRole::Horizontal;
    let (topic, pose, poses) = match is_horizontal {
        true => (Topic::ScanHorizontal, Topic::Pose, "poses.tum"),
        false => (Topic::ScanVertical, Topic::PoseVertical, "poses_vertical.tum"),
    };
    let (scans, truth) = (scans(run, topic), truth(&truth_folder.join(poses)));
    assert_eq!((scans.len(), truth.len()), (count, count), "{name}: {}", topic.name());
    let first_beams_ns: Vec<i64> = truth.iter().map(|(stamp_ns, _)| stamp_ns - START_NS).collect();
    let stamps_ms =
        || scans.iter().zip(&truth).map(|(scan, (stamp_ns, _))| (scan.stamp_ns - stamp_ns) as f64 * 1e-6);
    let learned = truth.iter().take_while(|(stamp_ns, _)| *stamp_ns < START_NS + LEARN_NS).count();
    let worst_ms = stamps_ms().skip(learned).fold(0.0, |worst: f64, error_ms| worst.max(error_ms.abs()));
    let posed = posed_scans(run, topic, pose);
    let pairs = || posed.iter().zip(&truth).map(|(scan, (_, true_pose))| (scan.pose, *true_pose));
    let rms_m = rms(pairs().map(|(pose, true_pose)| (pose[0] - true_pose[0]).hypot(pose[1] - true_pose[1])));
    let turn = |pose: [f64; 3], true_pose: [f64; 3]| (pose[2] - true_pose[2]).sin().asin().to_degrees();
    let rms_deg = rms(pairs().map(|(pose, true_pose)| turn(pose, true_pose)));
    let (other, all) = other_ranges(seen, &scans, &first_beams_ns);
    let text = format!(
        "{name} {}: {count} scans, stamps {:.3} ms RMS, {worst_ms:.3} ms worst, poses {rms_m:.4} m and \
         {rms_deg:.3} deg, {other} of {all} ranges differ",
        topic.name(),
        rms(stamps_ms())
    );
    println!("{text}");
    let is_right = rms(stamps_ms()) <= RMS_STAMP_MS
        && worst_ms <= MAX_STAMP_MS
        && rms_m <= MAX_RMS_M
        && rms_deg <= MAX_RMS_DEG
        && (other as f64) <= MAX_OTHER_SHARE * all as f64;
    if is_right { Vec::new() } else { vec![text] }
}

/// The capture's clock at its start, nanoseconds.
const START_NS: i64 = 1_000_000_000_000_000_000;

#[test]
fn drives_with_lasers_of_today_replay_as_exactly_as_their_devices_measure() {
    let rigs = Path::new(env!("CARGO_MANIFEST_DIR")).join("../hil-fixtures/rigs");
    let mut wrong = Vec::new();
    for name in ["lms111", "tim781", "ust20lx", "mixed"] {
        let work = folder(&format!("fan-{name}"));
        let file = rigs.join(format!("{name}.toml"));
        let options = SimulateOptions {
            rig: Some(file.clone()),
            seed: SEED,
            speed_m_s: Some(SPEED_M_S),
            output: work.join("capture.mcap"),
            truth: Some(work.join("truth")),
            lasers: LaserOptions {
                network_laser: ColaParams::of_name(name).unwrap_or_default(),
                ..LaserOptions::default()
            },
            ..SimulateOptions::default()
        };
        let SimulateReport { scans_horizontal, scans_vertical, .. } = simulate::run(&options).unwrap();
        let replayed = ReplayOptions::new(&options.output, work.join("run.mcap"));
        let report = replay(&replayed, &AtomicBool::new(false)).unwrap();
        assert_eq!(report.losses.lost, 0, "{name}");
        let world = World::named(&options.world).unwrap();
        let mut path = world.path(None).unwrap().clone();
        path.speed_m_s = SPEED_M_S;
        let rig = Rig::load(&file).unwrap();
        let simulated = SimulatedRig::new(&world, &path, &rig, &options.params, SEED).unwrap();
        simulated.start_drive_at(STAND_NS);
        let truth = work.join("truth");
        let seen = |laser, of_rig: &Laser| match of_rig.cola() {
            Some(_) => Seen { laser, slow_ppm: options.lasers.network_laser.slow_ppm },
            None => Seen { laser, slow_ppm: options.lasers.hokuyo.slow_ppm },
        };
        if !rig.horizontal.is_lms2xx() {
            let laser = simulated.horizontal();
            let seen = seen(laser, &rig.horizontal);
            wrong.extend(faults(name, &replayed.output, &truth, &seen, scans_horizontal));
        }
        let (laser, of_rig) = (simulated.vertical().unwrap(), rig.vertical.as_ref().unwrap());
        wrong.extend(faults(name, &replayed.output, &truth, &seen(laser, of_rig), scans_vertical));
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
