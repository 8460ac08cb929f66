//! A recording as the calibration wants it: poses, and the scans of both lasers while the robot moved.
//!
//! What a robot sees while it stands tells nothing more than one scan. Of long recordings every second, fourth, ... scan is kept, so that the memory does
//! not grow with their length.

use biplane_recording::rig::Laser;
use biplane_recording::{Rig, Topic};

use super::strips::{self, Strip};
use crate::cloud::{Fan, Sweep};
use crate::deskew::{StampedPose, Trajectory};
use crate::run::{Run, RunError, fan_of};

/// Scans of a laser that are kept at most.
const MOST_SCANS: usize = 16_384;
/// The robot has moved when it drove or turned so far since the last scan.
const MOVED_M: f64 = 0.005;
const TURNED_RAD: f64 = 0.002;
const LONGEST_GAP_NS: i64 = 500_000_000;

/// What a calibration reads.
#[derive(Debug)]
pub struct Readings {
    /// The robot as the recording has it.
    pub rig: Rig,
    /// Where the robot was.
    pub trajectory: Trajectory,
    /// The poses of horizontal scans, in order of time.
    pub poses: Vec<StampedPose>,
    /// The base's odometry, in order of time.
    pub odometry: Vec<StampedPose>,
    /// The horizontal laser's fan and scans.
    pub horizontal: Option<(Fan, Vec<Sweep>)>,
    /// What the vertical laser saw, in strips; `None` when there is none.
    pub strips: Option<Vec<Strip>>,
    /// Vertical scans kept.
    pub vertical_scans: usize,
    /// What the robot said of lasers that do not sit as the rig says.
    pub mountings: Vec<String>,
}

impl Readings {
    /// Reads a posed recording.
    ///
    /// # Errors
    /// When it is damaged, has no pose, or says nothing of the robot.
    pub fn of(run: &Run) -> Result<Self, RunError> {
        let rig = run.rig()?;
        let found = run.poses()?;
        let trajectory = found.trajectory();
        let horizontal = scans(run, Topic::ScanHorizontal, &rig.horizontal, &trajectory)?;
        let vertical = match &rig.vertical {
            Some(laser) => scans(run, Topic::ScanVertical, laser, &trajectory)?,
            None => None,
        };
        let vertical_scans = vertical.as_ref().map_or(0, |(_, sweeps)| sweeps.len());
        let strips = vertical.map(|(fan, sweeps)| {
            let mut all = Vec::new();
            sweeps.iter().for_each(|sweep| strips::cut(&fan, sweep, &mut all));
            all
        });
        Ok(Self {
            rig,
            trajectory,
            poses: in_time(found.poses),
            odometry: in_time(found.odometry),
            horizontal,
            strips,
            vertical_scans,
            mountings: found.mountings,
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
) -> Result<Option<(Fan, Vec<Sweep>)>, RunError> {
    let mut fan: Option<Fan> = None;
    let mut sweeps: Vec<Sweep> = Vec::new();
    let mut last: Option<StampedPose> = None;
    let (mut every, mut moved) = (1, 0_usize);
    run.for_each_scan(topic, |scan| {
        let fan = fan.get_or_insert_with(|| fan_of(&scan, laser));
        let Some(pose) = trajectory.at(scan.stamp_ns, LONGEST_GAP_NS) else { return };
        if scan.ranges_m.len() != fan.beams.len() || last.is_some_and(|last| stands(&last, &pose)) {
            return;
        }
        last = Some(pose);
        moved += 1;
        if moved.is_multiple_of(every) {
            sweeps.push(Sweep { stamp_ns: scan.stamp_ns, ranges_m: scan.ranges_m });
        }
        if sweeps.len() >= MOST_SCANS {
            let mut keep = false;
            sweeps.retain(|_| {
                keep = !keep;
                keep
            });
            every *= 2;
        }
    })?;
    sweeps.sort_by_key(|sweep| sweep.stamp_ns);
    Ok(fan.map(|fan| (fan, sweeps)))
}

fn stands(last: &StampedPose, now: &StampedPose) -> bool {
    last.step_m(now) < MOVED_M && last.turn_rad(now).abs() < TURNED_RAD
}
