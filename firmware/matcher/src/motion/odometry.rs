//! Whether the odometry can be believed, and why not.
//!
//! Odometry is missing, jumps, or stalls: it stands still while the scans show that the base moves (an
//! unplugged encoder, a base that is pushed or carried). Frames: map and odom, each a pose of the base.
//! Units: meters, radians.

use biplane_geometry::Pose2;

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

/// Odometry that stands still while the scans have moved this far (meters, or radians) has stalled and is not
/// believed until it moves. Smaller: odometry that comes late looks stalled; larger: more scans are searched
/// for first. Error 0.0248 m also when halved or doubled.
const STALL: f64 = 0.15;

/// Watches for odometry that stands still while the scans move.
#[derive(Clone, Debug, Default)]
pub(crate) struct StallWatch {
    /// Odometry and matched pose where the odometry was last seen to move.
    anchor: Option<(Pose2, Pose2)>,
    scans: u32,
    stalled: bool,
}

impl StallWatch {
    /// Whether this odometry still stands where it stalled.
    pub(crate) fn holds(&self, odom_from_base: &Pose2) -> bool {
        self.stalled && self.anchor.is_some_and(|(odom, _)| !moved(&odom, odom_from_base, MOVES))
    }

    /// Takes note of a scan that was matched in every direction, and of its odometry.
    pub(crate) fn matched(&mut self, odom_from_base: &Pose2, map_from_base: &Pose2) {
        match self.anchor {
            Some((odom, map)) if !moved(&odom, odom_from_base, MOVES) => {
                self.scans = self.scans.saturating_add(1);
                self.stalled |= self.scans >= SCANS && moved(&map, map_from_base, STALL);
            }
            _ => *self = Self { anchor: Some((*odom_from_base, *map_from_base)), ..Self::default() },
        }
    }

    /// Takes note of a scan that says nothing of how far the base has come.
    pub(crate) fn unmatched(&mut self) {
        if !self.stalled {
            self.anchor = None;
        }
    }
}

fn moved(from: &Pose2, to: &Pose2, limit: f64) -> bool {
    let step = from.between(to);
    step.distance_m() > limit || step.theta_rad.abs() > limit
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
            watch.matched(&at(7.0), &at(0.01 * f64::from(step)));
            assert!(!watch.holds(&at(7.0)), "{step}");
        }
        watch.matched(&at(7.0), &at(0.16));
        assert!(watch.holds(&at(7.0)) && watch.holds(&at(7.01)) && !watch.holds(&at(7.03)));
        watch.matched(&at(7.03), &at(0.2));
        assert!(!watch.holds(&at(7.03)) && !watch.holds(&at(7.0)));
    }

    #[test]
    fn odometry_that_counts_too_little_is_not_stalled() {
        let mut watch = StallWatch::default();
        for step in 0..1000 {
            let path_m = 0.003 * f64::from(step);
            watch.matched(&at(0.2 * path_m), &at(path_m));
            assert!(!watch.holds(&at(0.2 * path_m)), "{step}");
        }
    }

    #[test]
    fn where_the_scans_say_nothing_of_the_way_nothing_is_said_of_a_stall() {
        let mut watch = StallWatch::default();
        watch.matched(&at(0.0), &at(0.0));
        watch.unmatched();
        watch.matched(&at(0.0), &at(9.0));
        assert!(!watch.holds(&at(0.0)));
    }
}
