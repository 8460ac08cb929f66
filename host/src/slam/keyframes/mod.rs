//! A recording as the optimizer holds it: scans kept every so far along the way (nodes), each with its
//! recorded pose, its odometry and its keyframe scan. Memory grows with the way driven, not with the log.

pub(crate) mod cell_index;
pub(crate) mod free_space;
pub(crate) mod keyframe_scan;
mod odometry_stalls;
pub(crate) mod passed_through;
pub(crate) mod submap;
pub(crate) mod viewpoints;

use biplane_geometry::PortableMath;
use biplane_geometry::quantile::nearest_rank;
use biplane_matcher::{EndPoint, Pose2, wrap_angle};
use biplane_recording::Topic;

use crate::recordings::deskew::StampedPose;
use crate::recordings::run::{Run, RunError, RunPoses};
use crate::slam::keyframes::keyframe_scan::{KeyframeScan, KeyframeScanner};
pub(crate) use crate::slam::keyframes::odometry_stalls::Unstalled;

/// This share of all steps from scan to scan is as far as the base drives, or less.
const DRIVEN_SHARE: f64 = 0.95;
/// A step is a leap when it is so many times as far, and this far in meters on top.
const LEAP: f64 = 2.0;
const LEAP_M: f64 = 0.05;
/// A pause between two scans is a gap when it is so many nanoseconds long, and so many usual ones.
const GAP_NS: i64 = 3_000_000_000;
const GAP_PAUSES: i64 = 10;

/// Which scans become nodes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KeyframeParams {
    /// A node every so far, meters. Smaller: finer corrections, at more time and memory.
    pub every_m: f64,
    /// Or every so much of a turn, degrees. The same.
    pub every_deg: f64,
    /// Longer ranges are not used, meters: sparse, and turned into large errors by small angles. Smaller:
    /// less to match in halls.
    pub longest_m: f64,
}

impl Default for KeyframeParams {
    fn default() -> Self {
        Self { every_m: 0.3, every_deg: 20.0, longest_m: 30.0 }
    }
}

/// A scan that was kept.
#[derive(Clone, Debug)]
pub struct Node {
    /// Its number among the recording's horizontal scans.
    pub scan: usize,
    /// Its time.
    pub stamp_ns: i64,
    /// The recorded pose.
    pub recorded: Pose2,
    /// The odometry's pose, where there is one.
    pub odometry: Option<Pose2>,
    /// The odometry if its counters stalled wherever it stands still in the midst of the drive, where
    /// it does so anywhere.
    pub unstalled: Option<Unstalled>,
    /// Whether the recorded poses leap on the way from the last node, and the odometry does not: farther from
    /// one scan to the next than this base drives. That is how a matcher finds back to places that it had
    /// mapped before it drifted.
    pub leaps: bool,
    /// Whether there was no scan for long on the way from the last node.
    pub after_gap: bool,
    /// What it saw.
    pub keyframe_scan: KeyframeScan,
    /// The numbers of its end points on something short that stands free, ascending: it may be somebody who
    /// walks.
    pub free_standing: Vec<usize>,
}

impl Node {
    /// The end points on what cannot be somebody who walks.
    pub(crate) fn rooted(&self) -> impl Iterator<Item = &EndPoint> {
        let mut free = self.free_standing.iter().copied().peekable();
        let is_rooted = move |(number, _): &(usize, &EndPoint)| free.next_if_eq(number).is_none();
        self.keyframe_scan.points.iter().enumerate().filter(is_rooted).map(|(_, point)| point)
    }
}

#[cfg(test)]
impl Node {
    /// One that saw this from there, without odometry.
    pub(crate) fn at(recorded: Pose2, keyframe_scan: KeyframeScan) -> Self {
        Self {
            scan: 0,
            stamp_ns: 0,
            recorded,
            odometry: None,
            unstalled: None,
            leaps: false,
            after_gap: false,
            keyframe_scan,
            free_standing: Vec::new(),
        }
    }
}

/// The nodes of one recording, and the recorded pose of every scan.
#[derive(Clone, Debug, Default)]
pub struct Keyframes {
    /// The nodes, in file order.
    pub nodes: Vec<Node>,
    /// The recorded pose of each horizontal scan, in file order.
    pub scans: Vec<Option<StampedPose>>,
    /// The odometry's pose at each of them.
    pub odometry: Vec<Option<StampedPose>>,
}

impl Keyframes {
    /// Reads the nodes of a recording.
    ///
    /// # Errors
    /// When the recording is damaged or says nothing of the robot.
    pub fn read(run: &Run, poses: &RunPoses, params: &KeyframeParams) -> Result<Self, RunError> {
        let mut keyframes = Self { nodes: Vec::new(), scans: poses.at_scans(), odometry: Vec::new() };
        let odometry = poses.odometry_at_scans();
        let unstalled = odometry_stalls::filled(&odometry);
        let trajectory = poses.trajectory();
        let mut scanner = KeyframeScanner::new(run.rig()?.horizontal, params.longest_m);
        let mut scan_number = 0;
        let numbers = [leaps(&keyframes.scans), leaps(&odometry), gaps(&keyframes.scans)];
        let mut met = [false; 3];
        run.for_each_scan(Topic::ScanHorizontal, |scan| {
            let number = scan_number;
            scan_number += 1;
            let Some(Some(pose)) = keyframes.scans.get(number) else { return };
            for (met, numbers) in met.iter_mut().zip(&numbers) {
                *met |= numbers.binary_search(&number).is_ok();
            }
            if !keyframes.nodes.last().is_none_or(|last| is_news(&last.recorded, &pose.pose(), params)) {
                return;
            }
            let keyframe_scan = scanner.keyframe_scan(&scan, pose, &trajectory);
            let pose_of = |poses: &[Option<StampedPose>]| Some((*poses.get(number)?)?.pose());
            let [recorded_leaps, odometry_leaps, after_gap] = std::mem::take(&mut met);
            keyframes.nodes.push(Node {
                scan: number,
                stamp_ns: pose.stamp_ns,
                recorded: pose.pose(),
                odometry: pose_of(&odometry),
                unstalled: unstalled.as_ref().and_then(|poses| *poses.get(number)?),
                leaps: recorded_leaps && !odometry_leaps,
                after_gap,
                keyframe_scan,
                free_standing: scanner.free_standing(),
            });
        })?;
        keyframes.odometry = odometry;
        Ok(keyframes)
    }
}

/// The numbers of the scans to which poses leap, ascending.
fn leaps(scans: &[Option<StampedPose>]) -> Vec<usize> {
    let step_m = |pair: &[Option<StampedPose>]| Some(pair[0]?.pose().between(&pair[1]?.pose()).distance_m());
    let steps_m: Vec<Option<f64>> = scans.windows(2).map(step_m).collect();
    let mut sorted: Vec<f64> = steps_m.iter().flatten().copied().collect();
    sorted.sort_unstable_by(f64::total_cmp);
    let Some(driven_m) = nearest_rank(&sorted, DRIVEN_SHARE) else { return Vec::new() };
    behind(&steps_m, |step_m| step_m > LEAP * driven_m + LEAP_M)
}

/// The numbers of the scans before which there was none for long, ascending.
fn gaps(scans: &[Option<StampedPose>]) -> Vec<usize> {
    let pause_ns = |pair: &[Option<StampedPose>]| Some(pair[1]?.stamp_ns - pair[0]?.stamp_ns);
    let pauses_ns: Vec<Option<i64>> = scans.windows(2).map(pause_ns).collect();
    let mut sorted: Vec<i64> = pauses_ns.iter().flatten().copied().collect();
    sorted.sort_unstable();
    let Some(usual_ns) = nearest_rank(&sorted, 0.5) else { return Vec::new() };
    behind(&pauses_ns, |pause_ns| pause_ns > GAP_NS.max(usual_ns.saturating_mul(GAP_PAUSES)))
}

/// The numbers of the scans behind such steps, ascending; the first step leads to scan 1.
fn behind<T: Copy>(steps: &[Option<T>], is_meant: impl Fn(T) -> bool) -> Vec<usize> {
    let met = steps.iter().enumerate().filter(|(_, step)| step.is_some_and(&is_meant));
    met.map(|(before, _)| before + 1).collect()
}

fn is_news(last: &Pose2, pose: &Pose2, params: &KeyframeParams) -> bool {
    (pose.x_m - last.x_m).portable_hypot(pose.y_m - last.y_m) >= params.every_m
        || wrap_angle(pose.theta_rad - last.theta_rad).abs() >= params.every_deg.to_radians()
}
