//! Poses against the simulator's truth: one row a world, range noise and odometry drift, each a gate.
//!
//! The truth is exact: where the simulated base was when a scan's first beam was taken. The simulator shares
//! no code with the sessions, the stamping or the matcher. Errors are those of the pose in `map` over the
//! whole drive, not only its end.

pub(crate) mod captures;
pub(crate) mod encoded;
pub(crate) mod fan_lasers;
pub(crate) mod inertial;
pub(crate) mod mounts;
pub(crate) mod recorded;

use std::path::Path;
use std::sync::atomic::AtomicBool;

use biplane_mock::rig::drive::odometry::OdometryParams;
use biplane_mock::rig::scanner::ScannerParams;
use biplane_mock::rig::simulated::SimulationParams;
use biplane_mock::simulate::{self, SimulateOptions};
use biplane_onboard::{ReplayOptions, replay};
use biplane_recording::Topic;

use crate::accuracy::recorded::{folder, posed_scans};

struct Row {
    world: &'static str,
    sigma_m: f64,
    odometry_drift_deg_per_m: f64,
    /// The root mean square error of the position may be so large, meters.
    rms_m: f64,
    /// The same of the heading, degrees.
    rms_deg: f64,
    /// The stamps' root mean square error, milliseconds.
    stamp_ms: f64,
}

const TABLE: [Row; 4] = [
    Row {
        world: "corridor",
        sigma_m: 0.005,
        odometry_drift_deg_per_m: 0.3,
        rms_m: 0.02,
        rms_deg: 0.3,
        stamp_ms: 0.1,
    },
    Row {
        world: "corridor",
        sigma_m: 0.03,
        odometry_drift_deg_per_m: 0.3,
        rms_m: 0.035,
        rms_deg: 0.5,
        stamp_ms: 0.1,
    },
    Row {
        world: "corridor",
        sigma_m: 0.015,
        odometry_drift_deg_per_m: 3.0,
        rms_m: 0.03,
        rms_deg: 0.45,
        stamp_ms: 0.1,
    },
    Row {
        world: "office",
        sigma_m: 0.015,
        odometry_drift_deg_per_m: 0.6,
        rms_m: 0.03,
        rms_deg: 0.2,
        stamp_ms: 0.1,
    },
];

/// Lines `t x y z qx qy qz qw` with exact stamps.
fn truth(path: &Path) -> Vec<(i64, [f64; 3])> {
    let text = std::fs::read_to_string(path).unwrap();
    let line = |line: &str| {
        let words: Vec<&str> = line.split_whitespace().collect();
        let (seconds, fraction) = words[0].split_once('.').unwrap();
        let stamp_ns = seconds.parse::<i64>().unwrap() * 1_000_000_000 + fraction.parse::<i64>().unwrap();
        let number = |index: usize| words[index].parse::<f64>().unwrap();
        (stamp_ns, [number(1), number(2), 2.0 * number(6).atan2(number(7))])
    };
    text.lines().map(line).collect()
}

fn rms(errors: impl Iterator<Item = f64>) -> f64 {
    let (count, sum) = errors.fold((0_u32, 0.0), |(count, sum), error| (count + 1, sum + error * error));
    (sum / f64::from(count.max(1))).sqrt()
}

fn measure(row: &Row, number: usize) -> (f64, f64, f64) {
    let work = folder(&format!("accuracy-{number}"));
    let simulated = simulate::run(&SimulateOptions {
        world: row.world.to_owned(),
        seed: 20 + number as u64,
        output: work.join("capture.mcap"),
        truth: Some(work.join("truth")),
        params: SimulationParams {
            scanner: ScannerParams { sigma_m: row.sigma_m, ..ScannerParams::default() },
            odometry: OdometryParams {
                drift_deg_per_m: row.odometry_drift_deg_per_m,
                ..OdometryParams::default()
            },
            ..SimulationParams::default()
        },
        ..SimulateOptions::default()
    })
    .unwrap();
    let options = ReplayOptions::new(work.join("capture.mcap"), work.join("run.mcap"));
    let report = replay(&options, &AtomicBool::new(false)).unwrap();
    assert_eq!(report.losses.lost, 0);
    let scans = posed_scans(&options.output, Topic::ScanHorizontal, Topic::Pose);
    let truth = truth(&work.join("truth/poses.tum"));
    assert_eq!((scans.len(), truth.len()), (simulated.scans_horizontal, simulated.scans_horizontal));
    let pairs = || scans.iter().zip(&truth);
    let position_m = rms(pairs()
        .map(|(scan, (_, true_pose))| (scan.pose[0] - true_pose[0]).hypot(scan.pose[1] - true_pose[1])));
    let heading_deg = rms(pairs().map(|(scan, (_, true_pose))| {
        let turn = scan.pose[2] - true_pose[2];
        turn.sin().atan2(turn.cos()).to_degrees()
    }));
    let stamp_ms = rms(pairs().map(|(scan, (stamp_ns, _))| (scan.stamp_ns - stamp_ns) as f64 / 1e6));
    (position_m, heading_deg, stamp_ms)
}

#[test]
fn poses_stay_within_their_gates_whatever_the_noise_and_the_drift() {
    let mut failed = false;
    for (number, row) in TABLE.iter().enumerate() {
        let (position_m, heading_deg, stamp_ms) = measure(row, number);
        println!(
            "{:9} sigma {:.3} m, drift {:.1} deg/m: {position_m:.4} m, {heading_deg:.3} deg, stamps {stamp_ms:.3} ms",
            row.world, row.sigma_m, row.odometry_drift_deg_per_m
        );
        failed |= position_m > row.rms_m || heading_deg > row.rms_deg || stamp_ms > row.stamp_ms;
    }
    assert!(!failed, "a row is outside its gate");
}
