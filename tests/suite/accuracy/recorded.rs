//! What a test wants of a recording: its horizontal and vertical scans with the poses they were given.

use std::path::{Path, PathBuf};

use biplane_recording::{AnyMessage, Reader, Topic};

/// A scan with its pose.
#[derive(Clone, Debug)]
pub(crate) struct PosedScan {
    /// Time of its first beam, nanoseconds.
    pub stamp_ns: i64,
    /// Ranges in whole millimeters, so that they compare exactly; no echo is -1, invalid -2.
    pub ranges_mm: Vec<i32>,
    /// x, y (m) and heading (rad) of `base_link` in `map`.
    pub pose: [f64; 3],
}

/// A folder for a test's files, empty at the start.
pub(crate) fn folder(name: &str) -> PathBuf {
    let path = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = std::fs::remove_dir_all(&path);
    std::fs::create_dir_all(&path).unwrap();
    path
}

fn millimeters(range_m: f32) -> i32 {
    match range_m {
        r if r.is_nan() => -2,
        r if r.is_infinite() => -1,
        r => (f64::from(r) * 1000.0).round() as i32,
    }
}

fn heading_rad(q: [f64; 4]) -> f64 {
    2.0 * q[2].atan2(q[3])
}

/// The scans of `topic` with the poses of the same stamp on `pose_topic`.
///
/// # Panics
/// When the recording cannot be read, or a scan has no pose.
pub(crate) fn posed_scans(path: &Path, topic: Topic, pose_topic: Topic) -> Vec<PosedScan> {
    let mut scans = Vec::new();
    let mut poses = std::collections::BTreeMap::new();
    for entry in Reader::open(path).unwrap().messages() {
        let entry = entry.unwrap();
        match entry.decode().unwrap() {
            AnyMessage::Scan(scan) if entry.topic == Some(topic) => scans.push(scan),
            AnyMessage::Pose(pose) if entry.topic == Some(pose_topic) => {
                let heading = heading_rad(pose.orientation_xyzw);
                poses.insert(pose.stamp_ns, [pose.position_m[0], pose.position_m[1], heading]);
            }
            _ => {}
        }
    }
    scans
        .iter()
        .map(|scan| PosedScan {
            stamp_ns: scan.stamp_ns,
            ranges_mm: scan.ranges_m.iter().copied().map(millimeters).collect(),
            pose: *poses.get(&scan.stamp_ns).unwrap_or_else(|| panic!("no pose at {}", scan.stamp_ns)),
        })
        .collect()
}

/// The pose of `b` seen from `a`.
pub(crate) fn seen_from(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
    let (sin, cos) = a[2].sin_cos();
    let turn = b[2] - a[2];
    [cos * dx + sin * dy, -sin * dx + cos * dy, turn.sin().atan2(turn.cos())]
}
