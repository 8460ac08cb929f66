//! What `bench` measures is what a replay does.

use std::fs;
use std::path::Path;
use std::sync::atomic::AtomicBool;

use biplane_recording::messages::{Message, PoseWithCovarianceStamped};
use biplane_recording::{Direction, Reader, Topic, Writer, WriterOptions};

use super::worst_case::worst_cases;
use super::*;
use crate::engine::synthetic;
use crate::replay::{ReplayOptions, replay};

struct Folder(PathBuf);

impl Folder {
    /// With a capture of `seconds` in it.
    fn new(name: &str, seconds: i64) -> Self {
        let folder = std::env::temp_dir().join(format!("biplane-bench-{name}-{}", std::process::id()));
        let _ = fs::remove_dir_all(&folder);
        fs::create_dir_all(&folder).unwrap();
        let mut writer = Writer::create(&folder.join("in.mcap"), &WriterOptions::default()).unwrap();
        writer.attach("rig.toml", "application/toml", synthetic::rig().to_toml().as_bytes()).unwrap();
        for read in synthetic::drive(seconds, 60) {
            writer.write_serial(read.port, Direction::Rx, read.time_ns, &read.bytes).unwrap();
        }
        writer.finish().unwrap();
        Self(folder)
    }

    fn options(&self, repeat: u32) -> BenchOptions {
        let inputs = vec![self.0.join("in.mcap")];
        BenchOptions { inputs, rig: None, matcher: TrackerParams::default(), repeat }
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

fn poses(path: &Path) -> Vec<[f64; 2]> {
    let reader = Reader::open(path).unwrap();
    let poses = reader.messages().map(Result::unwrap).filter(|entry| entry.topic == Some(Topic::Pose));
    poses
        .map(|entry| PoseWithCovarianceStamped::decode(&entry.bytes).unwrap().position_m)
        .map(|[x_m, y_m, _]| [x_m, y_m])
        .collect()
}

#[test]
fn the_scans_that_are_timed_give_the_poses_of_a_replay() {
    let folder = Folder::new("poses", 3);
    let output = folder.0.join("out.mcap");
    replay(&ReplayOptions::new(folder.0.join("in.mcap"), &output), &AtomicBool::new(false)).unwrap();
    let kept = kept_scans(&[folder.0.join("in.mcap")], None, &TrackerParams::default()).unwrap();
    let mut tracker = Tracker::new(TrackerParams::default());
    let mut beams = Vec::new();
    let found = (0..kept.len()).map(|index| {
        let (scan, odom) = kept.get(index, &mut beams).unwrap();
        let pose = tracker.track(&scan, odom).map_from_base;
        [pose.x_m, pose.y_m]
    });
    assert_eq!(found.collect::<Vec<_>>(), poses(&output));
}

#[test]
fn every_scan_of_every_pass_is_counted_and_timed() {
    let folder = Folder::new("passes", 2);
    let report = bench(&folder.options(3)).unwrap();
    let Outcomes { matched, lost, no_returns, .. } = report.outcomes;
    assert_eq!(matched + lost + no_returns, report.scans as u64 - 1, "{report:?}");
    assert_eq!((report.passes, report.allocations), (3, None), "this program does not count allocations");
    assert!(report.cpu_min_us.mean <= report.cpu_us.mean && report.cpu_us.p50 <= report.cpu_us.max);
    assert!(report.iterations_per_scan >= 1.0 && report.map.surfaces > 100);
    assert!(report.map.bytes_used < report.map.bytes_reserved);
}

#[test]
fn a_log_without_scans_is_told() {
    let folder = Folder::new("empty", 0);
    let error = bench(&folder.options(1)).unwrap_err();
    assert!(matches!(error, OnboardError::NothingToReplay { .. }), "{error}");
}

#[test]
fn every_kind_of_scan_that_nobody_would_send_is_timed_with_both_matchers_with_and_without_odometry() {
    let cases = worst_cases(19);
    let mut kinds: Vec<_> = cases.iter().map(|case| (case.matcher, case.scans, case.with_odometry)).collect();
    kinds.sort_unstable();
    kinds.dedup();
    assert_eq!((kinds.len(), cases.len()), (24, 24));
    assert!(
        cases.iter().all(|case| case.cpu_us.p50 > 0.0 && case.cpu_us.p99 <= case.cpu_us.max),
        "{cases:?}"
    );
}
