//! A recording as the calibration wants it: poses, and the scans of both lasers while the robot moved.
//!
//! What a robot sees while it stands tells nothing more than one scan. Of long recordings every second,
//! fourth, ... scan is kept, so that the memory does not grow with their length.

use biplane_recording::rig::Laser;
use biplane_recording::{Rig, Topic};

use super::strips::{self, Strip};
use crate::recordings::deskew::{StampedPose, Trajectory};
use crate::recordings::run::{Run, RunError, scan_geometry_of};
use crate::recordings::scan_geometry::RangeScan;
use crate::recordings::scan_geometry::ScanGeometry;
use crate::recordings::step_back;

/// Scans of a laser that are kept at most.
const MAX_SCANS: usize = 16_384;
/// The robot has moved when it drove or turned so far since the last scan.
const MOVED_M: f64 = 0.005;
const TURNED_RAD: f64 = 0.002;
const LONGEST_GAP_NS: i64 = 500_000_000;

/// What a calibration reads.
#[derive(Debug)]
pub(super) struct Readings {
    /// The robot as the recording has it.
    pub rig: Rig,
    /// What a unit of the base's position was taken as, meters; `None` where the recording does not have it.
    pub metres_per_tick: Option<f64>,
    /// Where the robot was.
    pub trajectory: Trajectory,
    /// The poses of horizontal scans, in order of time.
    pub poses: Vec<StampedPose>,
    /// The base's odometry, in order of time.
    pub odometry: Vec<StampedPose>,
    /// The horizontal laser's fan and scans.
    pub horizontal: Option<(ScanGeometry, Vec<RangeScan>)>,
    /// What the vertical laser saw, in strips; `None` when there is none.
    pub strips: Option<Vec<Strip>>,
    /// Vertical scans kept.
    pub vertical_scans: usize,
    /// Why nothing is refined: what the robot said of lasers that do not sit as the rig says, and poses that
    /// cannot be found by their times.
    pub flaws: Vec<String>,
}

impl Readings {
    /// Reads a posed recording.
    ///
    /// # Errors
    /// When it is damaged, has no pose, or says nothing of the robot.
    pub(super) fn of(run: &Run) -> Result<Self, RunError> {
        let rig = run.rig()?;
        let found = run.poses()?;
        let trajectory = found.trajectory();
        let horizontal = scans(run, Topic::ScanHorizontal, &rig.horizontal, &trajectory)?;
        let vertical = match &rig.vertical {
            Some(laser) => scans(run, Topic::ScanVertical, laser, &trajectory)?,
            None => None,
        };
        let vertical_scans = vertical.as_ref().map_or(0, |(_, range_scans)| range_scans.len());
        let strips = vertical.map(|(geometry, range_scans)| {
            let mut all = Vec::new();
            range_scans.iter().for_each(|range_scan| strips::cut(&geometry, range_scan, &mut all));
            all
        });
        let of_mounting = |mounting: String| {
            format!("the recording says of itself: {mounting}; put that right first (docs/recording.md)")
        };
        let mut flaws: Vec<String> = found.mountings.into_iter().map(of_mounting).collect();
        flaws.extend(step_back::words(found.step_back_ns));
        Ok(Self {
            rig,
            metres_per_tick: found.metres_per_tick,
            trajectory,
            poses: in_time(found.poses),
            odometry: in_time(found.odometry),
            horizontal,
            strips,
            vertical_scans,
            flaws,
        })
    }
}

fn in_time(poses: Vec<StampedPose>) -> Vec<StampedPose> {
    Trajectory::new(poses).poses().to_vec()
}

/// The scans of a laser in order of time, those of one geometry.
fn scans(
    run: &Run,
    topic: Topic,
    laser: &Laser,
    trajectory: &Trajectory,
) -> Result<Option<(ScanGeometry, Vec<RangeScan>)>, RunError> {
    let mut geometry: Option<ScanGeometry> = None;
    let mut range_scans: Vec<RangeScan> = Vec::new();
    let mut last: Option<StampedPose> = None;
    let (mut every, mut moved) = (1, 0_usize);
    run.for_each_scan(topic, |scan| {
        let geometry = geometry.get_or_insert_with(|| scan_geometry_of(&scan, laser));
        let Some(pose) = trajectory.at(scan.stamp_ns, LONGEST_GAP_NS) else { return };
        if scan.ranges_m.len() != geometry.beams.len() || last.is_some_and(|last| stands(&last, &pose)) {
            return;
        }
        last = Some(pose);
        moved += 1;
        if moved.is_multiple_of(every) {
            range_scans.push(RangeScan { stamp_ns: scan.stamp_ns, ranges_m: scan.ranges_m });
        }
        if range_scans.len() >= MAX_SCANS {
            let mut keep = false;
            range_scans.retain(|_| {
                keep = !keep;
                keep
            });
            every *= 2;
        }
    })?;
    range_scans.sort_by_key(|range_scan| range_scan.stamp_ns);
    Ok(geometry.map(|geometry| (geometry, range_scans)))
}

fn stands(last: &StampedPose, now: &StampedPose) -> bool {
    last.step_m(now) < MOVED_M && last.turn_rad(now).abs() < TURNED_RAD
}
