//! Poses with stamps: where something was at any time between them.
//!
//! Meters, radians, stamps in nanoseconds.

use crate::elementary::PortableMath;
use alloc::vec::Vec;

use crate::{Pose2, wrap_angle};

/// The pose of `base_link` in `map` at one time. On a flat floor height, roll and pitch are zero.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StampedPose {
    /// Time of the pose, nanoseconds.
    pub stamp_ns: i64,
    /// Position along x of `map`, meters.
    pub x_m: f64,
    /// Position along y of `map`, meters.
    pub y_m: f64,
    /// Heading, counter-clockwise from x of `map`, radians.
    pub theta_rad: f64,
    /// Height above the floor of the start, meters.
    pub z_m: f64,
    /// Tilt about the base's own x axis, right side down positive, radians.
    pub roll_rad: f64,
    /// Tilt about the base's y axis, nose down positive, radians.
    pub pitch_rad: f64,
}

impl StampedPose {
    /// Poses that follow each other farther apart than this are not joined: the robot did not drive from one
    /// to the other, meters.
    pub const LONGEST_STEP_M: f64 = 5.0;

    /// How far it is to another pose, meters. A square root and not `hypot`, whose last bit differs between
    /// systems' libraries.
    pub fn step_m(&self, to: &Self) -> f64 {
        let (x_m, y_m) = (to.x_m - self.x_m, to.y_m - self.y_m);
        (x_m * x_m + y_m * y_m).sqrt()
    }

    /// By how much another pose is turned against this one, radians, in (-pi, pi].
    pub fn turn_rad(&self, to: &Self) -> f64 {
        wrap_angle(to.theta_rad - self.theta_rad)
    }

    /// A pose on the flat floor.
    pub fn planar(stamp_ns: i64, pose: Pose2) -> Self {
        let Pose2 { x_m, y_m, theta_rad } = pose;
        Self { stamp_ns, x_m, y_m, theta_rad, ..Self::default() }
    }

    /// Whether the base stands on the flat floor: neither lifted nor tilted, to the bit.
    pub fn is_level(&self) -> bool {
        self.z_m == 0.0 && self.roll_rad == 0.0 && self.pitch_rad == 0.0
    }

    /// A point given in `base_link`, in `map`, meters.
    pub fn transform(&self, [x_m, y_m, z_m]: [f64; 3]) -> [f64; 3] {
        let (sin, cos) = self.theta_rad.portable_sin_cos();
        let [x_m, y_m, z_m] = if self.is_level() {
            [x_m, y_m, z_m]
        } else {
            let ((sp, cp), (sr, cr)) = (self.pitch_rad.portable_sin_cos(), self.roll_rad.portable_sin_cos());
            let (left_m, up_m) = (cr * y_m - sr * z_m, sr * y_m + cr * z_m);
            [cp * x_m + sp * up_m, left_m, self.z_m + cp * up_m - sp * x_m]
        };
        [self.x_m + cos * x_m - sin * y_m, self.y_m + sin * x_m + cos * y_m, z_m]
    }

    /// The pose without its time, seen from above: `map_from_base`.
    pub fn pose(&self) -> Pose2 {
        Pose2::new(self.x_m, self.y_m, self.theta_rad)
    }
}

/// Poses in time order, to be asked for any time between them.
#[derive(Clone, Debug, Default)]
pub struct Trajectory {
    poses: Vec<StampedPose>,
}

impl Trajectory {
    /// Takes poses in any order. Of several with one stamp the first is kept; poses that are not finite are
    /// left out.
    pub fn new(mut poses: Vec<StampedPose>) -> Self {
        let parts = |pose: &StampedPose| {
            [pose.x_m, pose.y_m, pose.theta_rad, pose.z_m, pose.roll_rad, pose.pitch_rad]
        };
        poses.retain(|pose| parts(pose).iter().all(|v| v.is_finite()));
        poses.sort_by_key(|pose| pose.stamp_ns);
        poses.dedup_by_key(|pose| pose.stamp_ns);
        Self { poses }
    }

    /// The poses in time order.
    pub fn poses(&self) -> &[StampedPose] {
        &self.poses
    }

    /// The pose at `stamp_ns`: on the straight line between the neighbors, heading by the shorter turn.
    ///
    /// Before the first and after the last pose the nearest one holds for `max_gap_ns`. `None` further out,
    /// and between neighbors that are more than `max_gap_ns` apart when neither is nearer than half of that:
    /// nobody knows where the robot was.
    pub fn at(&self, stamp_ns: i64, max_gap_ns: i64) -> Option<StampedPose> {
        let after = self.poses.partition_point(|pose| pose.stamp_ns < stamp_ns);
        let next = self.poses.get(after).copied();
        let previous = after.checked_sub(1).and_then(|index| self.poses.get(index)).copied();
        match (previous, next) {
            (_, Some(next)) if next.stamp_ns == stamp_ns => Some(next),
            (Some(a), Some(b)) if b.stamp_ns.saturating_sub(a.stamp_ns) <= max_gap_ns => {
                Some(between(a, b, stamp_ns))
            }
            (Some(a), Some(b)) => nearest_within(a, b, stamp_ns, max_gap_ns / 2),
            (Some(only), None) | (None, Some(only)) => nearest_within(only, only, stamp_ns, max_gap_ns),
            (None, None) => None,
        }
    }
}

fn between(a: StampedPose, b: StampedPose, stamp_ns: i64) -> StampedPose {
    let share = (stamp_ns - a.stamp_ns) as f64 / (b.stamp_ns - a.stamp_ns) as f64;
    StampedPose {
        stamp_ns,
        x_m: a.x_m + share * (b.x_m - a.x_m),
        y_m: a.y_m + share * (b.y_m - a.y_m),
        theta_rad: a.theta_rad + share * a.turn_rad(&b),
        z_m: a.z_m + share * (b.z_m - a.z_m),
        roll_rad: a.roll_rad + share * (b.roll_rad - a.roll_rad),
        pitch_rad: a.pitch_rad + share * (b.pitch_rad - a.pitch_rad),
    }
}

fn nearest_within(a: StampedPose, b: StampedPose, stamp_ns: i64, limit_ns: i64) -> Option<StampedPose> {
    let distance_ns = |pose: &StampedPose| (i128::from(pose.stamp_ns) - i128::from(stamp_ns)).abs();
    let nearest = if distance_ns(&b) < distance_ns(&a) { b } else { a };
    (distance_ns(&nearest) <= i128::from(limit_ns)).then_some(StampedPose { stamp_ns, ..nearest })
}

#[cfg(test)]
mod tests {
    use super::{StampedPose, Trajectory};

    fn pose(stamp_ns: i64, x_m: f64, theta_rad: f64) -> StampedPose {
        StampedPose { stamp_ns, x_m, y_m: 2.0 * x_m, theta_rad, ..StampedPose::default() }
    }

    #[test]
    fn a_time_between_two_poses_lies_on_their_line_and_on_the_shorter_turn() {
        let trajectory = Trajectory::new(vec![pose(100, 2.0, -3.0), pose(0, 1.0, 3.0)]);
        let middle = trajectory.at(50, 1000).unwrap();
        assert!((middle.x_m - 1.5).abs() < 1e-12 && (middle.y_m - 3.0).abs() < 1e-12);
        // From 3.0 rad to -3.0 rad the shorter turn passes pi, not zero.
        assert!((middle.theta_rad - std::f64::consts::PI).abs() < 1e-12);
    }

    #[test]
    fn a_turn_between_two_poses_is_the_one_that_the_trajectory_makes() {
        use std::f64::consts::PI;
        // Half a turn has two ways round, and both go the same one; the smallest turn is not rounded away.
        for (from_rad, to_rad, turn_rad) in
            [(0.0, PI, PI), (PI, 0.0, PI), (0.0, 1e-20, 1e-20), (0.0, 0.1, 0.1), (3.0, -3.0, 2.0 * PI - 6.0)]
        {
            let (from, to) = (pose(0, 0.0, from_rad), pose(100, 0.0, to_rad));
            assert_eq!(from.turn_rad(&to), turn_rad, "{from_rad} to {to_rad}");
            let halfway = Trajectory::new(vec![from, to]).at(50, 1000).unwrap();
            assert_eq!(halfway.theta_rad, from_rad + 0.5 * turn_rad, "{from_rad} to {to_rad}");
        }
    }

    #[test]
    fn a_tilted_base_turns_points_as_roll_then_pitch_then_yaw_do_and_a_level_one_leaves_heights() {
        let pose = StampedPose {
            x_m: 1.0,
            y_m: -2.0,
            z_m: 0.3,
            theta_rad: 110.0_f64.to_radians(),
            roll_rad: 20.0_f64.to_radians(),
            pitch_rad: -30.0_f64.to_radians(),
            ..StampedPose::default()
        };
        let turn = crate::RollPitchYaw { roll_deg: 20.0, pitch_deg: -30.0, yaw_deg: 110.0 };
        let same = crate::Pose3 { rotation: turn.matrix(), translation_m: [1.0, -2.0, 0.3] };
        let point = [0.7, -0.4, 1.9];
        let (found, expected) = (pose.transform(point), same.transform(point));
        assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12), "{found:?} {expected:?}");
        let level = StampedPose { z_m: 0.0, roll_rad: 0.0, pitch_rad: 0.0, ..pose };
        assert_eq!(level.transform(point)[2], 1.9);
        let half = Trajectory::new(vec![level, StampedPose { stamp_ns: 10, ..pose }]).at(5, 100).unwrap();
        assert!((half.z_m - 0.15).abs() < 1e-12 && (half.pitch_rad - 0.5 * pose.pitch_rad).abs() < 1e-12);
    }

    #[test]
    fn the_ends_hold_for_the_gap_and_no_longer() {
        let trajectory = Trajectory::new(vec![pose(0, 1.0, 0.0), pose(100, 2.0, 0.0)]);
        assert_eq!(trajectory.at(150, 100).unwrap().x_m, 2.0);
        assert_eq!(trajectory.at(-100, 100).unwrap().x_m, 1.0);
        assert!(trajectory.at(201, 100).is_none() && trajectory.at(-101, 100).is_none());
    }

    #[test]
    fn nobody_knows_the_pose_in_the_middle_of_a_long_gap() {
        let trajectory = Trajectory::new(vec![pose(0, 1.0, 0.0), pose(1000, 2.0, 0.0)]);
        assert!(trajectory.at(500, 100).is_none());
        assert_eq!(trajectory.at(40, 100).unwrap().x_m, 1.0);
        assert_eq!(trajectory.at(970, 100).unwrap().x_m, 2.0);
    }

    #[test]
    fn no_poses_and_poses_that_are_not_finite_give_none() {
        assert!(Trajectory::default().at(0, 100).is_none());
        assert!(Trajectory::new(vec![pose(0, f64::NAN, 0.0)]).at(0, 100).is_none());
    }
}
