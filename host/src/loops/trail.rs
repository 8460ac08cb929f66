//! A recording as the optimiser holds it: scans kept every so far along the way (nodes), each with its recorded pose, its odometry
//! and its outline. Memory grows with the way driven, not with the log.

use biplane_matcher::{Pose2, wrap_angle};
use biplane_recording::Topic;
use biplane_recording::msg::LaserScan;

use super::outline::{Outline, Outliner};
use crate::cloud::Fan;
use crate::deskew::{StampedPose, Trajectory};
use crate::run::{Run, RunError, RunPoses, fan_of};

/// Poses farther apart than this are not bridged, nanoseconds.
const LONGEST_GAP_NS: i64 = 1_000_000_000;

/// Which scans become nodes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrailParams {
    /// A node every so far, metres. Smaller: finer corrections, at more time and memory.
    pub every_m: f64,
    /// Or every so much of a turn, degrees. The same.
    pub every_deg: f64,
    /// Longer ranges are not used, metres: sparse, and turned into large errors by small angles. Smaller: less to match in halls.
    pub longest_m: f64,
}

impl Default for TrailParams {
    fn default() -> Self {
        Self { every_m: 0.3, every_deg: 20.0, longest_m: 30.0 }
    }
}

/// A scan that was kept.
#[derive(Clone, Debug)]
pub struct Node {
    /// Its number among the recording's horizontal scans.
    pub scan: usize,
    /// The recorded pose.
    pub recorded: Pose2,
    /// The odometry's pose, where there is one.
    pub odometry: Option<Pose2>,
    /// What it saw.
    pub outline: Outline,
}

/// The nodes of one recording, and the recorded pose of every scan.
#[derive(Clone, Debug, Default)]
pub struct Trail {
    /// The nodes, in file order.
    pub nodes: Vec<Node>,
    /// The recorded pose of each horizontal scan, in file order.
    pub scans: Vec<Option<StampedPose>>,
}

impl Trail {
    /// Reads the nodes of a recording.
    ///
    /// # Errors
    /// When the recording is damaged or says nothing of the robot.
    pub fn read(run: &Run, poses: &RunPoses, params: &TrailParams) -> Result<Self, RunError> {
        let laser = run.rig()?.horizontal;
        let mut trail = Self { nodes: Vec::new(), scans: poses.at_scans() };
        let odometry = poses.odometry_at_scans();
        let trajectory = poses.trajectory();
        let mut fan: Option<Fan> = None;
        let mut outliner = Outliner::new(params.longest_m);
        let mut scan_number = 0;
        run.for_each_scan(Topic::ScanHorizontal, |scan| {
            let number = scan_number;
            scan_number += 1;
            let Some(Some(pose)) = trail.scans.get(number) else { return };
            if !trail.nodes.last().is_none_or(|last| is_news(&last.recorded, &pose.pose(), params)) {
                return;
            }
            if fan.as_ref().is_none_or(|fan| fan.beams.len() != scan.ranges_m.len()) {
                fan = Some(fan_of(&scan, &laser));
            }
            let Some(fan) = &fan else { return };
            let twist = twist(&scan, fan, pose, &trajectory);
            let outline = outliner.outline(&scan, fan, twist);
            let odometry = odometry.get(number).copied().flatten().map(|pose| pose.pose());
            trail.nodes.push(Node { scan: number, recorded: pose.pose(), odometry, outline });
        })?;
        Ok(trail)
    }
}

fn is_news(last: &Pose2, pose: &Pose2, params: &TrailParams) -> bool {
    (pose.x_m - last.x_m).hypot(pose.y_m - last.y_m) >= params.every_m
        || wrap_angle(pose.theta_rad - last.theta_rad).abs() >= params.every_deg.to_radians()
}

/// How the base moved while its mirror turned; zeros where beams have no times of their own.
fn twist(scan: &LaserScan, fan: &Fan, pose: &StampedPose, trajectory: &Trajectory) -> [f64; 3] {
    let delay_ns = fan.beams.iter().map(|beam| beam.delay_ns).max().unwrap_or(0);
    if delay_ns <= 0 {
        return [0.0; 3];
    }
    // Over a little more than a scan: two poses a few milliseconds apart tell the speed badly.
    let span_ns = delay_ns.max(100_000_000);
    let at = |stamp_ns: i64| trajectory.at(stamp_ns, LONGEST_GAP_NS).map_or(pose.pose(), |pose| pose.pose());
    let (from, to) = (at(scan.stamp_ns - span_ns / 2), at(scan.stamp_ns.saturating_add(span_ns / 2)));
    let way = from.between(&to);
    [way.x_m, way.y_m, way.theta_rad].map(|part| part / (span_ns as f64 * 1e-9))
}
