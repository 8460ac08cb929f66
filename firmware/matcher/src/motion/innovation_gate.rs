//! Matches that contradict odometry and inertia alike.
//!
//! A cart pushed along a corridor, or a panel carried through it, can be all that a scan sees along the axis:
//! the best match then follows it. Wheels that slip or a base that is carried away look the same in one scan,
//! but not in the next: there the way between the expected and the matched pose stays what it is, while with
//! a moving thing it is another each time. So such a match is believed once it has been confirmed; until then
//! the pose follows the odometry and the map learns nothing. Frames: poses in the map, offsets in the
//! expected base's frame. Units: meters, radians.

use crate::motion::Step;
use crate::registration::gauss_newton::prior::Prior;
use biplane_geometry::PortableMath;
use biplane_geometry::{Pose2, wrap_angle};

/// Two poses further apart than so many standard deviations of a guessed step are not the same.
const APART: f64 = 2.0;
/// A match that contradicts odometry and inertia alike counts from this many scans in a row on. Fewer: moving
/// things lead the base astray; more: a base that was carried or has slipped stays wrong longer. Error 0.0248
/// m also when halved or doubled.
const CONFIRM_SCANS: u32 = 3;

/// What a scan's pose should be, before it is looked at.
#[derive(Copy, Clone, Debug)]
pub(crate) struct Expected<'a> {
    /// By the odometry.
    pub prior: &'a Prior,
    /// By inertia: the pose after the last step again.
    pub again: Pose2,
    /// The last step again, and what it is worth.
    pub inertia: &'a Step,
}

impl Expected<'_> {
    /// Whether odometry and inertia agree with each other, and neither with this pose.
    fn contradicts(&self, pose: &Pose2) -> bool {
        self.prior.is_contradicted_by(pose)
            && self.same(&self.prior.mean, &self.again)
            && !self.same(pose, &self.again)
    }

    fn same(&self, a: &Pose2, b: &Pose2) -> bool {
        let [along_m, _, turn_rad] = self.inertia.sigma;
        (a.x_m - b.x_m).portable_hypot(a.y_m - b.y_m) < APART * along_m
            && wrap_angle(a.theta_rad - b.theta_rad).abs() < APART * turn_rad
    }
}

/// A contradiction, and how often in a row it was the same.
#[derive(Copy, Clone, Debug, Default)]
pub(crate) struct InnovationGate {
    offset: Pose2,
    times: u32,
}

impl InnovationGate {
    /// Whether a match is to be believed: it contradicts nothing, or was confirmed by scan after scan.
    pub(crate) fn confirm(&mut self, found: &Pose2, expected: &Expected) -> bool {
        if !expected.contradicts(found) {
            self.times = 0;
            return true;
        }
        let offset = expected.prior.mean.between(found);
        let again = self.times > 0 && expected.same(&offset, &self.offset);
        *self = Self { offset, times: if again { self.times + 1 } else { 1 } };
        let confirmed = self.times >= CONFIRM_SCANS;
        if confirmed {
            self.times = 0;
        }
        confirmed
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::motion::odometry::Odometry;
    use nalgebra::{Matrix3, Vector3};

    /// What a contest says of matches, given as meters ahead of where odometry (and inertia, at `again_m`)
    /// expect the base.
    fn confirmed_of(again_m: f64, ahead_m: &[f64]) -> Vec<bool> {
        let information = Matrix3::from_diagonal(&Vector3::new(0.02_f64.powi(-2), 0.02_f64.powi(-2), 1e4));
        let prior = Prior { mean: Pose2::new(1.0, 0.0, 0.0), information, measured: true, gives_way: true };
        let inertia =
            Step { last_from_base: Pose2::IDENTITY, sigma: [0.1, 0.1, 0.1], odometry: Odometry::Missing };
        let expected =
            Expected { prior: &prior, again: Pose2::new(1.0 + again_m, 0.0, 0.0), inertia: &inertia };
        let mut innovation_gate = InnovationGate::default();
        ahead_m.iter().map(|m| innovation_gate.confirm(&Pose2::new(1.0 + m, 0.0, 0.0), &expected)).collect()
    }

    #[test]
    fn what_moves_on_is_never_confirmed_and_what_stays_is_by_the_third_scan() {
        assert_eq!(confirmed_of(0.0, &[-0.3, 0.4, -0.6, 0.9]), [false; 4]);
        assert_eq!(confirmed_of(0.0, &[-0.5, -0.52, -0.48]), [false, false, true]);
        assert_eq!(confirmed_of(0.0, &[-0.5, -0.5, 0.0, -0.5]), [false, false, true, false]);
    }

    #[test]
    fn a_match_that_inertia_expects_is_believed_and_so_is_any_when_the_odometry_itself_has_leapt() {
        assert_eq!(confirmed_of(0.15, &[0.25]), [true]);
        assert_eq!(confirmed_of(-0.5, &[0.3]), [true]);
        assert_eq!(confirmed_of(0.0, &[0.07]), [true], "within the odometry's own noise");
    }
}
