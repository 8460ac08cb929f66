//! The whole onboard process against mock devices on pseudo-terminals: the same serial code as on a robot.

use std::fs;
use std::path::Path;
use std::sync::atomic::AtomicBool;
use std::thread;
use std::time::Duration;

use biplane_onboard::{ReplayOptions, probe, record, replay};
use biplane_recording::messages::{Imu, LaserScan, PoseWithCovarianceStamped};
use biplane_recording::{Direction, Port, Reader, Topic};

use crate::in_time::in_time;
use crate::mock::{Mock, all, with_inertial_unit};

/// Stamps of the truth, nanoseconds (`seconds.nanoseconds` a line).
fn true_stamps_ns(path: &Path) -> Vec<i64> {
    let nanoseconds = |line: &str| {
        let (seconds, fraction) = line.trim().split_once('.').unwrap();
        seconds.parse::<i64>().unwrap() * 1_000_000_000 + fraction.parse::<i64>().unwrap()
    };
    fs::read_to_string(path).unwrap().lines().map(nanoseconds).collect()
}

#[test]
fn a_run_on_mock_devices_is_stamped_like_the_truth_and_its_replay_is_the_same_run() {
    in_time(|| {
        let mut mock = Mock::start("run", |_| {});
        let report = mock.record(mock.rig(), 5.0).unwrap();
        mock.end();
        assert_eq!(
            (report.losses.lost, report.exit_code(), report.arrival.backward_stamps),
            (0, 0, 0),
            "{report:?}"
        );
        assert!(
            report.recorded.scans_horizontal > 20
                && report.recorded.scans_vertical > 20
                && report.recorded.odometry > 35,
            "{report:?}"
        );
        assert_eq!(
            (report.recorded.poses, report.recorded.poses_vertical),
            (report.recorded.scans_horizontal, report.recorded.scans_vertical)
        );

        let run = mock.folder.join("run.mcap");
        for (topic, truth) in
            [(Topic::ScanHorizontal, "scans_horizontal.txt"), (Topic::ScanVertical, "scans_vertical.txt")]
        {
            let truth = true_stamps_ns(&mock.folder.join("truth").join(truth));
            for scan in all::<LaserScan>(&run, topic) {
                let error_ns = truth.iter().map(|t| (scan.stamp_ns - t).abs()).min().unwrap();
                // A busy machine may serve and read late by a few milliseconds.
                assert!(error_ns < 10_000_000, "{topic:?}: {error_ns} ns");
            }
        }

        let again = ReplayOptions::new(&run, mock.folder.join("again.mcap"));
        let replayed = replay(&again, &AtomicBool::new(false)).unwrap();
        assert_eq!(replayed.recorded.scans_horizontal, report.recorded.scans_horizontal);
        assert_eq!(replayed.recorded.odometry, report.recorded.odometry);
        for topic in [Topic::ScanHorizontal, Topic::ScanVertical] {
            let (first, second) = (all::<LaserScan>(&run, topic), all::<LaserScan>(&again.output, topic));
            assert_eq!(first.len(), second.len());
            for (first, second) in first.iter().zip(&second) {
                assert!(
                    first.ranges_m == second.ranges_m && (first.stamp_ns - second.stamp_ns).abs() < 1_000_000
                );
            }
        }
        let poses = |path: &Path| all::<PoseWithCovarianceStamped>(path, Topic::Pose);
        for (first, second) in poses(&run).iter().zip(&poses(&again.output)) {
            let [x, y, _] = std::array::from_fn(|axis| first.position_m[axis] - second.position_m[axis]);
            assert!(f64::hypot(x, y) < 0.005, "{first:?} {second:?}");
        }
    });
}

#[test]
fn devices_left_streaming_at_another_rate_are_taken_over_and_left_idle_at_the_end() {
    in_time(|| {
        let mock = Mock::start("left", |options| {
            options.laser.baud = 19200;
            options.laser.left_streaming = true;
        });
        let mut rig = mock.rig();
        rig.horizontal.baud = 500_000;
        rig.horizontal.resolution_deg = 0.5;
        let report = mock.record(rig.clone(), 5.0).unwrap();
        assert!(report.recorded.scans_horizontal > 50, "{report:?}");
        assert_eq!(report.losses.lost, 0);
        let scans = all::<LaserScan>(&mock.folder.join("run.mcap"), Topic::ScanHorizontal);
        assert!(scans.iter().all(|scan| scan.ranges_m.len() == 361));
        // Found at once at its rate, and silent until it is asked.
        let reports = probe(&rig, &[]).unwrap();
        assert!(reports.iter().all(|report| report.answered), "{reports:?}");
        assert_eq!(reports[0].baud_found, Some(500_000));
    });
}

#[test]
fn devices_that_are_unplugged_for_a_moment_stream_again_by_themselves() {
    in_time(|| {
        let mut mock = Mock::start("unplugged", |_| {});
        let options = mock.options(mock.rig(), 11.0);
        let recording = thread::spawn(move || record(&options, &AtomicBool::new(false)));
        thread::sleep(Duration::from_millis(3500));
        // The pseudo-terminals go, as a USB adapter does; others come in their place.
        mock.end();
        mock.serve(|_| {});
        let report = recording.join().unwrap().unwrap();
        assert_eq!(report.losses.lost, 0, "{report:?}");
        let scans = all::<LaserScan>(&mock.folder.join("run.mcap"), Topic::ScanHorizontal);
        let gaps_ms: Vec<_> =
            scans.windows(2).map(|pair| (pair[1].stamp_ns - pair[0].stamp_ns) / 1_000_000).collect();
        assert_eq!(gaps_ms.iter().filter(|&&gap_ms| gap_ms > 500).count(), 1, "{gaps_ms:?}");
        assert!(scans.len() > 45, "{} scans", scans.len());
    });
}

#[test]
fn serial_bytes_of_both_ways_are_recorded_on_request() {
    in_time(|| {
        let mock = Mock::start("raw", with_inertial_unit);
        mock.record(mock.rig_with_inertial_unit(), 2.5).unwrap();
        let reader = Reader::open(&mock.folder.join("run.mcap")).unwrap();
        for port in Port::ALL {
            for direction in [Direction::Rx, Direction::Tx] {
                let bytes = biplane_recording::capture::serial(&reader).map(Result::unwrap);
                let count =
                    bytes.filter(|serial| (serial.port, serial.direction) == (port, direction)).count();
                assert!(count > 3, "{port:?} {direction:?}: {count}");
            }
        }
    });
}

#[test]
fn an_inertial_unit_is_probed_recorded_and_replayed() {
    in_time(|| {
        let mock = Mock::start("imu", with_inertial_unit);
        let rig = mock.rig_with_inertial_unit();
        let reports = probe(&rig, &[Port::Imu]).unwrap();
        assert_eq!(reports[0].kind.as_deref(), Some("Xsens MTi 03800D10"), "{reports:?}");
        let report = mock.record(rig, 4.0).unwrap();
        assert_eq!(report.losses.lost, 0, "{report:?}");
        let run = mock.folder.join("run.mcap");
        let samples = all::<Imu>(&run, Topic::Imu);
        assert_eq!(samples.len() as u64, report.recorded.inertial);
        assert!((200..=400).contains(&samples.len()), "{}", samples.len());
        // Its own clock: a busy machine may read late or lose some, and the stamps are even all the same.
        for pair in samples[100..].windows(2) {
            let interval_us = (pair[1].stamp_ns - pair[0].stamp_ns) / 1000;
            assert!(interval_us > 9_000 && (interval_us + 1_000) % 10_000 < 2_000, "{interval_us} us");
        }
        let mean_up = samples.iter().map(|s| s.acceleration_m_s2[2]).sum::<f64>() / samples.len() as f64;
        assert!((mean_up - 9.8).abs() < 0.8, "{mean_up}");
        // The bytes go before the samples that were made of them.
        let again = ReplayOptions::new(&run, mock.folder.join("again.mcap"));
        let replayed = replay(&again, &AtomicBool::new(false)).unwrap();
        assert_eq!(replayed.recorded.inertial, report.recorded.inertial);
        assert_eq!(all::<Imu>(&again.output, Topic::Imu).len(), samples.len());
    });
}
