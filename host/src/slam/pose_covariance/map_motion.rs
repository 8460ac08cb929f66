//! Small motions of the whole map about its origin, and of a pose in it: x, y in meters, turn in radians.

use biplane_matcher::Pose2;
use nalgebra::Matrix3;

/// From a motion of the map about its origin to that of a pose.
pub(super) fn about(pose: &Pose2) -> Matrix3<f64> {
    Matrix3::new(1.0, 0.0, -pose.y_m, 0.0, 1.0, pose.x_m, 0.0, 0.0, 1.0)
}

/// The other way round.
pub(super) fn back_from(pose: &Pose2) -> Matrix3<f64> {
    Matrix3::new(1.0, 0.0, pose.y_m, 0.0, 1.0, -pose.x_m, 0.0, 0.0, 1.0)
}
