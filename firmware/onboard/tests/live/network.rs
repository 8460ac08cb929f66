//! The whole onboard process against mock lasers on TCP ports of this machine.

use std::fs;
use std::path::Path;
use std::sync::atomic::AtomicBool;
use std::thread;
use std::time::Duration;

use biplane_mock::devices::cola::ColaParams;
use biplane_mock::serve::{ServeOptions, Source};
use biplane_onboard::{ReplayOptions, RunReport, probe, record, replay};
use biplane_recording::messages::{LaserScan, PoseWithCovarianceStamped};
use biplane_recording::rig::{Base, LaserProtocol};
use biplane_recording::{Rig, Topic};

use crate::in_time::in_time;
use crate::mock::{Mock, all};

/// The rig, its lasers on the network, with a base or without.
fn network_rig(mut rig: Rig, address_of: impl Fn(&str) -> String, has_base: bool) -> Rig {
    let at = |laser: biplane_recording::rig::Laser, name| laser.at_address(address_of(name));
    rig.horizontal = at(rig.horizontal, "lms-horizontal");
    rig.vertical = rig.vertical.map(|laser| at(laser, "lms-vertical"));
    if !has_base {
        rig.base = Base::none();
    }
    rig
}

fn serve_on_network(options: &mut ServeOptions, kind: &str, has_base: bool) {
    if let Source::World { rig, .. } = &mut options.source {
        **rig = network_rig((**rig).clone(), |_| "127.0.0.1:1".to_owned(), has_base);
    }
    options.network_laser = ColaParams::of_name(kind).unwrap();
}

fn address(mock: &Mock, name: &str) -> String {
    let file = mock.folder.join("links").join(format!("{name}.address"));
    fs::read_to_string(file).unwrap().trim().to_owned()
}

/// The rig that finds the mock's devices.
fn rig_of(mock: &Mock, has_base: bool) -> Rig {
    network_rig(mock.rig(), |name| address(mock, name), has_base)
}

/// Seconds, and what stands behind them, of each line.
fn timed_lines(path: &Path) -> Vec<(f64, Vec<f64>)> {
    let text = fs::read_to_string(path).unwrap();
    let line = |line: &str| {
        let mut numbers = line.split_whitespace().map(|word| word.parse().unwrap());
        (numbers.next().unwrap(), numbers.collect())
    };
    text.lines().map(line).collect()
}

/// The median of how far stamps lie from the nearest true one, and the largest, milliseconds.
fn stamp_errors_ms(scans: &[LaserScan], truth: &Path) -> [f64; 2] {
    let truth = timed_lines(truth);
    let error_ms = |scan: &LaserScan| {
        let stamp_s = scan.stamp_ns as f64 * 1e-9;
        truth.iter().map(|(true_s, _)| (true_s - stamp_s).abs() * 1e3).fold(f64::INFINITY, f64::min)
    };
    let mut errors: Vec<f64> = scans.iter().map(error_ms).collect();
    errors.sort_by(f64::total_cmp);
    [errors[errors.len() / 2], errors[errors.len() - 1]]
}

/// The largest distance of a pose from the truth at its stamp, meters.
fn worst_pose_error_m(poses: &[PoseWithCovarianceStamped], truth: &Path) -> f64 {
    let truth = timed_lines(truth);
    let error_m = |pose: &PoseWithCovarianceStamped| {
        let stamp_s = pose.stamp_ns as f64 * 1e-9;
        let (_, true_pose) =
            truth.iter().min_by(|a, b| (a.0 - stamp_s).abs().total_cmp(&(b.0 - stamp_s).abs())).unwrap();
        f64::hypot(pose.position_m[0] - true_pose[0], pose.position_m[1] - true_pose[1])
    };
    poses.iter().map(error_m).fold(0.0, f64::max)
}

/// Whether all that came is kept, undamaged and in order.
#[track_caller]
fn assert_nothing_lost(report: &RunReport) {
    assert_eq!(
        (report.losses.lost, report.exit_code(), report.arrival.backward_stamps),
        (0, 0, 0),
        "{report:?}"
    );
    assert_eq!((report.arrival.damaged, report.arrival.skipped_bytes), (0, 0), "{report:?}");
}

#[test]
fn two_lasers_on_the_network_are_recorded_like_the_truth_and_replayed_from_their_bytes() {
    in_time(|| {
        let mut mock = Mock::start("network", |options| serve_on_network(options, "TIM561-2050101", true));
        let rig = rig_of(&mock, true);
        let report = mock.record(rig, 8.0).unwrap();
        mock.end();
        assert_nothing_lost(&report);
        assert!(report.recorded.scans_horizontal > 90 && report.recorded.scans_vertical > 90, "{report:?}");
        assert_eq!(
            (report.recorded.poses, report.recorded.poses_vertical),
            (report.recorded.scans_horizontal, report.recorded.scans_vertical)
        );
        let (run, truth) = (mock.folder.join("run.mcap"), mock.folder.join("truth"));
        for (topic, file) in
            [(Topic::ScanHorizontal, "scans_horizontal.txt"), (Topic::ScanVertical, "scans_vertical.txt")]
        {
            let scans = all::<LaserScan>(&run, topic);
            assert!(scans.iter().all(|scan| scan.ranges_m.len() == 811 && scan.intensities.is_empty()));
            let [median_ms, worst_ms] = stamp_errors_ms(&scans, &truth.join(file));
            println!("{topic:?}: median {median_ms:.2} ms, worst {worst_ms:.2} ms");
            // A busy machine may serve and read late by a few milliseconds.
            assert!(median_ms < 5.0 && worst_ms < 15.0, "{topic:?}: {median_ms} ms, {worst_ms} ms");
        }
        let poses = all::<PoseWithCovarianceStamped>(&run, Topic::Pose);
        let worst_m = worst_pose_error_m(&poses, &truth.join("trajectory.tum"));
        println!("poses: worst {worst_m:.3} m");
        assert!(worst_m < 0.1, "{worst_m} m");

        let again = ReplayOptions::new(&run, mock.folder.join("again.mcap"));
        replay(&again, &AtomicBool::new(false)).unwrap();
        for topic in [Topic::ScanHorizontal, Topic::ScanVertical] {
            assert_eq!(all::<LaserScan>(&run, topic), all::<LaserScan>(&again.output, topic));
        }
        let replayed = all::<PoseWithCovarianceStamped>(&again.output, Topic::Pose);
        for (first, second) in poses.iter().zip(&replayed) {
            let [x, y] = std::array::from_fn(|axis| first.position_m[axis] - second.position_m[axis]);
            assert!(f64::hypot(x, y) < 0.005, "{first:?} {second:?}");
        }
    });
}

#[test]
fn a_rig_without_a_base_is_matched_and_its_laser_is_set_only_where_the_rig_allows() {
    in_time(|| {
        let mut mock = Mock::start("no-base", |options| serve_on_network(options, "LMS111", false));
        let mut rig = rig_of(&mock, false);
        if let LaserProtocol::Cola(cola) = &mut rig.horizontal.protocol {
            (cola.scan_hz, cola.resolution_deg, cola.fov_deg) = (Some(25.0), Some(0.25), Some(180.0));
            (cola.remission, cola.login) = (Some(true), true);
        }
        let reports = probe(&rig, &[]).unwrap();
        assert_eq!(reports.len(), 2);
        assert!(reports.iter().all(|report| report.answered && report.kind.as_deref() == Some("LMS111")));
        let remarks = reports[0].remarks.join("\n");
        assert!(remarks.contains("record would write: 25 Hz in steps of 0.25 degrees"), "{remarks}");
        let report = mock.record(rig, 6.0).unwrap();
        mock.end();
        assert_eq!(
            (report.losses.lost, report.exit_code(), report.recorded.odometry),
            (0, 0, 0),
            "{report:?}"
        );
        let run = mock.folder.join("run.mcap");
        let scans = all::<LaserScan>(&run, Topic::ScanHorizontal);
        assert!(scans.len() > 90, "{}", scans.len());
        for scan in &scans {
            assert_eq!((scan.ranges_m.len(), scan.intensities.len()), (721, 721));
            assert!((scan.scan_time_s - 0.04).abs() < 1e-6);
        }
        // The other one stays as it was.
        let vertical = all::<LaserScan>(&run, Topic::ScanVertical);
        assert!(
            vertical.iter().all(|scan| scan.ranges_m.len() == 541 && (scan.scan_time_s - 0.02).abs() < 1e-6)
        );
        let poses = all::<PoseWithCovarianceStamped>(&run, Topic::Pose);
        let worst_m = worst_pose_error_m(&poses, &mock.folder.join("truth/trajectory.tum"));
        println!("poses without odometry: worst {worst_m:.3} m");
        assert!(worst_m < 0.2, "{worst_m} m");
    });
}

#[test]
fn lasers_whose_connections_end_stream_again_by_themselves() {
    in_time(|| {
        let mut mock = Mock::start("network-gone", |options| serve_on_network(options, "TIM781", true));
        let rig = rig_of(&mock, true);
        let options = mock.options(rig, 8.0);
        let addresses = ["lms-horizontal", "lms-vertical"].map(|name| address(&mock, name));
        let recording = thread::spawn(move || record(&options, &AtomicBool::new(false)));
        thread::sleep(Duration::from_millis(3000));
        mock.end();
        mock.serve(|options| serve_on_network(options, "TIM781", true));
        // Others listen now: these are not found again, and nothing ends.
        assert!(addresses != ["lms-horizontal", "lms-vertical"].map(|name| address(&mock, name)));
        let report = recording.join().unwrap().unwrap();
        assert!(report.recorded.scans_horizontal > 25 && report.losses.lost == 0, "{report:?}");
    });
}

/// The rig of an LMS 291 and a UST: the vertical laser alone is on the network.
fn mixed_rig(mut rig: Rig, address: &str) -> Rig {
    rig.vertical = rig.vertical.map(|laser| laser.scip_at_address(address));
    rig
}

#[test]
fn an_lms_291_on_a_serial_line_and_a_ust_on_the_network_are_one_rig() {
    in_time(|| {
        let mut mock = Mock::start("mixed", |options| {
            if let Source::World { rig, .. } = &mut options.source {
                **rig = mixed_rig((**rig).clone(), "127.0.0.1:1");
            }
        });
        let rig = mixed_rig(mock.rig(), &address(&mock, "lms-vertical"));
        let reports = probe(&rig, &[]).unwrap();
        let kinds: Vec<&str> = reports.iter().filter_map(|report| report.kind.as_deref()).collect();
        assert!(kinds[0].starts_with("LMS291") && kinds[1].starts_with("UST-20LX"), "{kinds:?}");
        let remarks = reports[1].remarks.join("\n");
        assert!(
            remarks.contains("serial number H0706400") && remarks.contains("steps 0 to 1080"),
            "{remarks}"
        );
        let report = mock.record(rig, 8.0).unwrap();
        mock.end();
        assert_nothing_lost(&report);
        // 40 a second of the UST; at 38400 Bd each eighth of 75 of the LMS.
        assert!(report.recorded.scans_horizontal > 50 && report.recorded.scans_vertical > 250, "{report:?}");
        assert_eq!(report.recorded.poses_vertical, report.recorded.scans_vertical);
        let (run, truth) = (mock.folder.join("run.mcap"), mock.folder.join("truth"));
        let scans = all::<LaserScan>(&run, Topic::ScanVertical);
        assert!(scans.iter().all(|scan| scan.ranges_m.len() == 1081));
        let [median_ms, worst_ms] = stamp_errors_ms(&scans, &truth.join("scans_vertical.txt"));
        println!("UST: median {median_ms:.2} ms, worst {worst_ms:.2} ms");
        assert!(median_ms < 5.0 && worst_ms < 15.0, "{median_ms} ms, {worst_ms} ms");

        let again = ReplayOptions::new(&run, mock.folder.join("again.mcap"));
        replay(&again, &AtomicBool::new(false)).unwrap();
        for topic in [Topic::ScanHorizontal, Topic::ScanVertical] {
            assert_eq!(all::<LaserScan>(&run, topic), all::<LaserScan>(&again.output, topic));
        }
    });
}
