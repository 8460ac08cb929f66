//! Where the base was at a beam's own time: interpolation of the planar trajectory.
//!
//! A fast robot moves while its mirror turns, so a scan has no one pose: it is posed beam by beam. Frame
//! `map`.

pub use biplane_geometry::{StampedPose, Trajectory};

use nalgebra::{Quaternion, UnitQuaternion};

/// How far from the origin a pose may be, meters.
pub(crate) const FARTHEST_M: f64 = 1e6;

/// Heading of an orientation given as x, y, z, w, radians; zero for a quaternion of length zero.
pub(crate) fn heading_rad(orientation_xyzw: [f64; 4]) -> f64 {
    let [x, y, z, w] = orientation_xyzw;
    UnitQuaternion::try_new(Quaternion::new(w, x, y, z), f64::EPSILON).map_or(0.0, |q| q.euler_angles().2)
}
