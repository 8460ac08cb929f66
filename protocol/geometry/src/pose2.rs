//! Rigid motions of the plane: `Pose2` is both a place and the change of coordinates that belongs to it.
//!
//! Frames: a pose named `a_from_b` takes coordinates in frame b to coordinates in frame a, so that in a
//! product the neighboring names match: `a_from_b * b_from_c = a_from_c`. Units: meters and radians, angles
//! counter-clockwise (REP 103).

use crate::elementary::PortableMath;
use std::ops::Mul;

use crate::wrap_angle;

/// A pose in the plane: position in meters and heading in radians.
#[derive(Copy, Clone, PartialEq, Debug, Default)]
pub struct Pose2 {
    /// Position along x, meters.
    pub x_m: f64,
    /// Position along y, meters.
    pub y_m: f64,
    /// Heading, radians, counter-clockwise; products and inverses keep it in (-pi, pi].
    pub theta_rad: f64,
}

impl Pose2 {
    /// The pose that changes nothing.
    pub const IDENTITY: Self = Self { x_m: 0.0, y_m: 0.0, theta_rad: 0.0 };

    /// A pose from meters, meters and radians.
    #[must_use]
    pub const fn new(x_m: f64, y_m: f64, theta_rad: f64) -> Self {
        Self { x_m, y_m, theta_rad }
    }

    /// `b_from_a` of this `a_from_b`.
    #[must_use]
    pub fn inverse(&self) -> Self {
        let (sin, cos) = self.theta_rad.portable_sin_cos();
        Self::new(
            -cos * self.x_m - sin * self.y_m,
            sin * self.x_m - cos * self.y_m,
            wrap_angle(-self.theta_rad),
        )
    }

    /// Pose `to` seen from this one: with `self = a_from_b` and `to = a_from_c`, the result is `b_from_c`.
    #[must_use]
    pub fn between(&self, to: &Self) -> Self {
        self.inverse() * *to
    }

    /// A point's coordinates in the outer frame, meters: `p_in_a = a_from_b.transform(p_in_b)`.
    #[must_use]
    pub fn transform(&self, point_m: [f64; 2]) -> [f64; 2] {
        let (sin, cos) = self.theta_rad.portable_sin_cos();
        [self.x_m + cos * point_m[0] - sin * point_m[1], self.y_m + sin * point_m[0] + cos * point_m[1]]
    }

    /// The pose the fraction `u` of the way to `to`: position on the straight line, heading the shorter way
    /// round. `u = 0` is this pose, `u = 1` is `to`; beyond [0, 1] it extrapolates.
    #[must_use]
    pub fn interpolate(&self, to: &Self, u: f64) -> Self {
        Self::new(
            self.x_m + u * (to.x_m - self.x_m),
            self.y_m + u * (to.y_m - self.y_m),
            wrap_angle(self.theta_rad + u * wrap_angle(to.theta_rad - self.theta_rad)),
        )
    }

    /// The step from `from` to this pose in their common outer frame: along its x and y axes (meters), and
    /// the turn, wrapped (radians). [`Pose2::stepped`] undoes it.
    #[must_use]
    pub fn step_from(&self, from: &Self) -> [f64; 3] {
        [self.x_m - from.x_m, self.y_m - from.y_m, wrap_angle(self.theta_rad - from.theta_rad)]
    }

    /// This pose after a step along the outer frame's axes (meters) and a turn about itself (radians).
    #[must_use]
    pub fn stepped(&self, [x_m, y_m, turn_rad]: [f64; 3]) -> Self {
        Self::new(self.x_m + x_m, self.y_m + y_m, wrap_angle(self.theta_rad + turn_rad))
    }

    /// Distance between this pose's origin and its outer frame's, meters.
    #[must_use]
    pub fn distance_m(&self) -> f64 {
        self.x_m.portable_hypot(self.y_m)
    }

    /// Whether every number is finite.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        self.x_m.is_finite() && self.y_m.is_finite() && self.theta_rad.is_finite()
    }
}

impl Mul for Pose2 {
    type Output = Self;

    /// `a_from_b * b_from_c = a_from_c`.
    #[allow(clippy::suspicious_arithmetic_impl)] // Headings do add up in a product of rigid motions.
    fn mul(self, inner: Self) -> Self {
        let [x_m, y_m] = self.transform([inner.x_m, inner.y_m]);
        Self::new(x_m, y_m, wrap_angle(self.theta_rad + inner.theta_rad))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{FRAC_PI_2, PI};

    fn assert_near(a: Pose2, b: Pose2) {
        let turn = wrap_angle(a.theta_rad - b.theta_rad);
        assert!(
            (a.x_m - b.x_m).abs() < 1e-12 && (a.y_m - b.y_m).abs() < 1e-12 && turn.abs() < 1e-12,
            "{a:?} is not {b:?}"
        );
    }

    #[test]
    fn one_meter_ahead_of_a_pose_that_looks_along_y_lies_one_meter_up() {
        let map_from_base = Pose2::new(2.0, 3.0, FRAC_PI_2);
        let product = map_from_base * Pose2::new(1.0, 0.5, 0.25);
        assert_near(product, Pose2::new(1.5, 4.0, FRAC_PI_2 + 0.25));
        assert_eq!(Pose2::new(2.0, 3.0, 0.0).transform([1.0, -1.0]), [3.0, 2.0]);
    }

    #[test]
    fn inverse_undoes_a_pose_from_both_sides() {
        let pose = Pose2::new(-1.25, 7.5, 2.9);
        assert_near(pose * pose.inverse(), Pose2::IDENTITY);
        assert_near(pose.inverse() * pose, Pose2::IDENTITY);
        // By hand: looking along y from (2, 3), the origin lies 3 m behind and 2 m to the left.
        assert_near(Pose2::new(2.0, 3.0, FRAC_PI_2).inverse(), Pose2::new(-3.0, 2.0, -FRAC_PI_2));
    }

    #[test]
    fn between_gives_back_the_inner_pose_of_a_product() {
        let outer = Pose2::new(0.3, -2.0, -3.0);
        let inner = Pose2::new(1.0, 2.0, -0.5);
        assert_near(outer.between(&(outer * inner)), inner);
    }

    #[test]
    fn a_step_between_two_poses_leads_from_one_to_the_other_the_shorter_way_round() {
        let (from, to) = (Pose2::new(1.0, -2.0, PI - 0.1), Pose2::new(0.5, 2.0, -PI + 0.3));
        let step = to.step_from(&from);
        assert!((step[2] - 0.4).abs() < 1e-12 && step[..2] == [-0.5, 4.0], "{step:?}");
        assert_near(from.stepped(step), to);
    }

    #[test]
    fn interpolation_turns_the_shorter_way_across_half_a_turn() {
        let from = Pose2::new(0.0, 0.0, PI - 0.1);
        let to = Pose2::new(2.0, 4.0, -PI + 0.3);
        assert_near(from.interpolate(&to, 0.5), Pose2::new(1.0, 2.0, -PI + 0.1));
        assert_near(from.interpolate(&to, 0.0), from);
        assert_near(from.interpolate(&to, 1.0), to);
    }
}
