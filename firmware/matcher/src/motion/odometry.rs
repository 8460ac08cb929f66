//! Whether the odometry can be believed, and why not.
//!
//! Odometry is missing, jumps, or stalls: it stands still while the scans show that the base moves (an
//! unplugged encoder, a base that is pushed or carried). Frames: map and odom, each a pose of the base.
//! Units: meters, radians.

use biplane_geometry::{Pose2, wrap_angle};

/// What became of the odometry of a scan.
#[derive(Copy, Clone, PartialEq, Eq, Debug, Default)]
pub enum Odometry {
    /// It said how the base moved.
    Used,
    /// There was none, or none before: the last motion is taken to go on.
    #[default]
    Missing,
    /// It was no number, or moved more than a base can in one step: the last motion is taken to go on.
    Jumped,
    /// It stands still while the scans move: the last motion is taken to go on.
    Stalled,
    /// Scans have contradicted it for a while: the last motion is taken to go on.
    Contradicted,
    /// It said how the base moved, but for the sign: it counts the way back as a way ahead.
    Reversed,
}

/// The odometry moves when it has come this far, meters or radians: more than its steps, less than a stall
/// shows.
const MOVES: f64 = 0.02;
/// So many scans in a row must show that it stands: odometry that comes late starts a scan or two after the
/// base.
const SCANS: u32 = 4;

/// Odometry that stands still while the scans have moved this far has stalled and is not believed until it
/// moves, meters. Smaller: odometry that comes late looks stalled; larger: more scans are searched for
/// first. Error 0.0248 m also when halved or doubled.
const STALL_M: f64 = 0.15;
/// The same for turning, radians. Scans tell a turn far more surely than a way, and a base that turns in
/// front of a bare corridor drives into it with odometry that nothing there contradicts.
const STALL_RAD: f64 = 0.08;

/// Watches for odometry that stands still while the scans move.
#[derive(Clone, Debug, Default)]
pub(crate) struct StallWatch {
    anchor: Option<Anchor>,
    scans: u32,
    stalled: bool,
}

/// Where the odometry was last seen to move.
#[derive(Copy, Clone, Debug)]
struct Anchor {
    odom_from_base: Pose2,
    /// The heading of a matched pose, radians.
    heading_rad: f64,
    /// The first pose since then that was matched in every direction.
    map_from_base: Option<Pose2>,
}

impl Anchor {
    /// Whether the scans have moved since, by more than a match can be off.
    fn has_been_left(&self, heading_rad: f64, sure_pose: Option<Pose2>) -> bool {
        let is_away = |(from, to): (Pose2, Pose2)| from.between(&to).distance_m() > STALL_M;
        wrap_angle(heading_rad - self.heading_rad).abs() > STALL_RAD
            || self.map_from_base.zip(sure_pose).is_some_and(is_away)
    }
}

impl StallWatch {
    /// Whether this odometry still stands where it stalled.
    pub(crate) fn holds(&self, odom_from_base: &Pose2) -> bool {
        self.stalled && self.anchor.is_some_and(|anchor| !moved(&anchor.odom_from_base, odom_from_base))
    }

    /// Takes note of a matched scan and of its odometry. Along a bare corridor the pose tells the heading
    /// alone.
    pub(crate) fn matched(&mut self, odom_from_base: &Pose2, map_from_base: &Pose2, is_sure: bool) {
        let sure_pose = is_sure.then_some(*map_from_base);
        let heading_rad = map_from_base.theta_rad;
        let Some(anchor) = self.anchor.as_mut().filter(|at| !moved(&at.odom_from_base, odom_from_base))
        else {
            let anchor = Anchor { odom_from_base: *odom_from_base, heading_rad, map_from_base: sure_pose };
            *self = Self { anchor: Some(anchor), ..Self::default() };
            return;
        };
        self.scans = self.scans.saturating_add(1);
        self.stalled |= self.scans >= SCANS && anchor.has_been_left(heading_rad, sure_pose);
        anchor.map_from_base = sure_pose.and(anchor.map_from_base).or(sure_pose);
    }

    /// Takes note of a scan that says nothing of how far the base has come.
    pub(crate) fn unmatched(&mut self) {
        if !self.stalled {
            self.anchor = None;
        }
    }
}

fn moved(from: &Pose2, to: &Pose2) -> bool {
    let step = from.between(to);
    step.distance_m() > MOVES || step.theta_rad.abs() > MOVES
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(x_m: f64) -> Pose2 {
        Pose2::new(x_m, 0.0, 0.0)
    }

    #[test]
    fn odometry_that_stands_while_the_match_moves_is_stalled_until_it_moves_again() {
        let mut watch = StallWatch::default();
        for step in 0..=15 {
            watch.matched(&at(7.0), &at(0.01 * f64::from(step)), true);
            assert!(!watch.holds(&at(7.0)), "{step}");
        }
        watch.matched(&at(7.0), &at(0.16), true);
        assert!(watch.holds(&at(7.0)) && watch.holds(&at(7.01)) && !watch.holds(&at(7.03)));
        watch.matched(&at(7.03), &at(0.2), true);
        assert!(!watch.holds(&at(7.03)) && !watch.holds(&at(7.0)));
    }

    #[test]
    fn odometry_that_counts_too_little_is_not_stalled() {
        let mut watch = StallWatch::default();
        for step in 0..1000 {
            let path_m = 0.003 * f64::from(step);
            watch.matched(&at(0.2 * path_m), &at(path_m), true);
            assert!(!watch.holds(&at(0.2 * path_m)), "{step}");
        }
    }

    #[test]
    fn a_turn_is_seen_along_a_bare_corridor_too_and_a_way_is_not() {
        let turned = |rad: f64| Pose2::new(0.0, 0.0, rad);
        let mut watch = StallWatch::default();
        for step in 0..=20 {
            watch.matched(&at(7.0), &at(0.05 * f64::from(step)), false);
        }
        assert!(!watch.holds(&at(7.0)));
        for step in 0..=3 {
            watch.matched(&at(8.0), &turned(0.03 * f64::from(step)), step > 0);
            assert!(!watch.holds(&at(8.0)), "{step}");
        }
        watch.matched(&at(8.0), &turned(0.09), false);
        assert!(watch.holds(&at(8.0)));
    }

    #[test]
    fn where_the_scans_say_nothing_of_the_way_nothing_is_said_of_a_stall() {
        let mut watch = StallWatch::default();
        watch.matched(&at(0.0), &at(0.0), true);
        watch.unmatched();
        watch.matched(&at(0.0), &at(9.0), true);
        assert!(!watch.holds(&at(0.0)));
    }
}
