//! A pose ready to move many points: sine, cosine and translation in single precision, as scans and maps hold
//! their points.
//!
//! Units: meters. As [`Pose2`], it takes coordinates of an inner frame to an outer one.

use biplane_geometry::PortableMath;
use biplane_geometry::Pose2;

/// A pose as sine, cosine and translation.
#[derive(Copy, Clone, PartialEq, Debug)]
pub struct Placement {
    /// Sine of the heading.
    pub sin: f32,
    /// Cosine of the heading.
    pub cos: f32,
    /// Translation, meters.
    pub at_m: [f32; 2],
}

impl Placement {
    /// The placement of a pose.
    #[must_use]
    pub fn new(pose: &Pose2) -> Self {
        let (sin, cos) = pose.theta_rad.portable_sin_cos();
        Self { sin: sin as f32, cos: cos as f32, at_m: [pose.x_m as f32, pose.y_m as f32] }
    }

    /// A direction in the outer frame.
    #[inline]
    #[must_use]
    pub fn turn(&self, v: [f32; 2]) -> [f32; 2] {
        [self.cos * v[0] - self.sin * v[1], self.sin * v[0] + self.cos * v[1]]
    }

    /// A point in the outer frame.
    #[inline]
    #[must_use]
    pub fn place(&self, point_m: [f32; 2]) -> [f32; 2] {
        let turned = self.turn(point_m);
        [turned[0] + self.at_m[0], turned[1] + self.at_m[1]]
    }
}
