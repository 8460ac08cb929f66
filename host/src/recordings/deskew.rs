//! Where the base was at a beam's own time: interpolation of the trajectory.
//!
//! A fast robot moves while its mirror turns, so a scan has no one pose: it is posed beam by beam. Frame
//! `map`.

pub use biplane_geometry::{StampedPose, Trajectory};

use biplane_geometry::pose3::quaternion_of_heading_xyzw;
use nalgebra::{Quaternion, UnitQuaternion};

/// How far from the origin a pose may be, meters.
pub(crate) const FARTHEST_M: f64 = 1e6;

/// Heading of an orientation given as x, y, z, w, radians; zero for a quaternion of length zero.
pub(crate) fn heading_rad(orientation_xyzw: [f64; 4]) -> f64 {
    roll_pitch_yaw_rad(orientation_xyzw)[2]
}

/// Roll, pitch and heading of an orientation given as x, y, z, w, radians; zeros for a quaternion of length
/// zero, and no tilt to the bit for one that only turns about z.
pub(crate) fn roll_pitch_yaw_rad([x, y, z, w]: [f64; 4]) -> [f64; 3] {
    let turn = UnitQuaternion::try_new(Quaternion::new(w, x, y, z), f64::EPSILON);
    let (roll, pitch, yaw) = turn.map_or((0.0, 0.0, 0.0), |turn| turn.euler_angles());
    if x == 0.0 && y == 0.0 { [0.0, 0.0, yaw] } else { [roll, pitch, yaw] }
}

/// The orientation of a pose as x, y, z, w.
pub(crate) fn orientation_xyzw(pose: &StampedPose) -> [f64; 4] {
    if pose.is_level() {
        return quaternion_of_heading_xyzw(pose.theta_rad);
    }
    let turn = UnitQuaternion::from_euler_angles(pose.roll_rad, pose.pitch_rad, pose.theta_rad);
    [turn.i, turn.j, turn.k, turn.w]
}
