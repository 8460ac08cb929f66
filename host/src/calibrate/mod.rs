//! Where the vertical laser sits, how late it is, and what the odometry's counts are worth, from a posed
//! recording.
//!
//! With the matched poses of the horizontal laser, what the vertical laser saw must agree with the walls that
//! the horizontal one saw, with what it saw of the same surface from another heading, and with the floor
//! (`agreement`). The place and the delay for which it does are found by least squares (`solve`), from far to
//! near: the agreements are sought anew after each step. What a drive does not tell is told as such
//! (`report`).

mod agreement;
mod corrected;
mod observations;
mod odometry;
mod placement;
mod readings;
mod report;
mod robust_scale;
mod solve;
mod strips;
mod walls;

pub use report::{Calibration, Fit, Row};

use biplane_recording::rig::Laser;

use crate::calibrate::observations::{Patches, posed};
use crate::recordings::mounts::base_from_mount;
use crate::recordings::run::{Run, RunError};
use agreement::agreements;
use placement::Placement;
use readings::Readings;
use solve::{Solution, solve};
use walls::Walls;

/// Distances beyond which a strip does not belong to a surface, meters, from guess to guess.
const GATES_M: [f64; 14] = [0.5, 0.4, 0.3, 0.25, 0.2, 0.17, 0.14, 0.12, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1];

/// Reads a posed recording and calibrates. The same recording gives the same result on any number of threads.
///
/// # Errors
/// When the recording is damaged, has no pose, or says nothing of the robot.
pub fn calibrate(run: &Run) -> Result<Calibration, RunError> {
    let readings = Readings::of(run)?;
    let is_refined = readings.flaws.is_empty();
    let start = readings.rig.vertical.as_ref().map(placed).filter(|_| is_refined);
    let found = start.and_then(|start| Some((start, place(&readings, start)?)));
    let scales = odometry::scales(&readings.poses, &readings.odometry).filter(|_| is_refined);
    Ok(report::of(readings, found, scales))
}

fn placed(laser: &Laser) -> Placement {
    Placement { base_from_laser: base_from_mount(&laser.mount), late_s: 0.0 }
}

/// Where the vertical laser sits; `None` when either laser saw nothing while the robot moved.
fn place(readings: &Readings, start: Placement) -> Option<(Placement, Solution)> {
    let (geometry, range_scans) = readings.horizontal.as_ref()?;
    let strips = readings.strips.as_ref().filter(|strips| !strips.is_empty())?;
    let walls = Walls::of(geometry, range_scans, &readings.trajectory);
    let mut at = start;
    let mut last = None;
    for gate_m in GATES_M {
        let observations = posed(strips, &at, &readings.trajectory);
        let patches = Patches::of(&observations, &at);
        let all = agreements(&observations, &walls, &patches, &at, gate_m);
        let solution = solve(&all, &at.since(&start));
        at = at.stepped(&solution.step);
        last = Some(solution);
    }
    last.map(|solution| (at, solution))
}
