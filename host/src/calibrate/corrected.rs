//! The rig with what was observed put in.

use biplane_recording::Rig;
use biplane_recording::rig::BaseProtocol;

use super::odometry::Scales;
use super::placement::{Placement, Step, rounded};

/// Puts in the laser's place: the step's elements that are not zero.
pub(super) fn with_placement(rig: &mut Rig, start: &Placement, step: &Step) {
    let Some(laser) = &mut rig.vertical else { return };
    let at = start.stepped(step);
    if step.fixed_rows::<6>(0).iter().any(|value| *value != 0.0) {
        let before = laser.mount;
        laser.mount = at.mount(&before);
        if step.fixed_rows::<3>(3).iter().all(|value| *value == 0.0) {
            (laser.mount.roll, laser.mount.pitch, laser.mount.yaw) = (before.roll, before.pitch, before.yaw);
        }
    }
    if step[6] != 0.0 {
        laser.delay_ms = rounded(laser.delay_ms + step[6] * 1e3);
    }
}

/// Which of the odometry's scales were observed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Observed {
    /// That of the way.
    pub way: bool,
    /// That of turns.
    pub turn: bool,
    /// The drift with the way.
    pub drift: bool,
}

/// Puts in what the base's counts are worth, as far as its keys can say it; which of way, turn and drift they
/// can.
pub(super) fn with_scales(rig: &mut Rig, scales: &Scales, observed: Observed) -> [bool; 3] {
    let way = if observed.way { scales.way.value } else { 1.0 };
    let turn = if observed.turn { scales.turn.value } else { 1.0 };
    match &mut rig.base.protocol {
        BaseProtocol::P2os { metres_per_tick: Some(meters) } => {
            *meters = precise(*meters * way);
            [true, false, false]
        }
        BaseProtocol::P2os { metres_per_tick: None } | BaseProtocol::None => [false; 3],
        BaseProtocol::RoboClaw { wheel_base_m, metres_per_count_left, metres_per_count_right, .. } => {
            // Way (l + r) / 2, turn (r - l) / wheel base: both must come out times `way`, times `turn` plus
            // the drift.
            *wheel_base_m = precise(*wheel_base_m * way / turn);
            let drift = if observed.drift { scales.drift_rad_per_m.value } else { 0.0 };
            let half = 0.5 * drift * *wheel_base_m;
            *metres_per_count_left = precise(*metres_per_count_left * (way - half));
            *metres_per_count_right = precise(*metres_per_count_right * (way + half));
            [true; 3]
        }
        BaseProtocol::Rflex { counts_per_m, counts_per_rad } => {
            *counts_per_m = precise(*counts_per_m / way);
            *counts_per_rad = precise(*counts_per_rad / turn);
            [true, true, false]
        }
    }
}

/// Seven digits: counts may be worth a millionth of a meter.
fn precise(value: f64) -> f64 {
    format!("{value:.6e}").parse().unwrap_or(value)
}
