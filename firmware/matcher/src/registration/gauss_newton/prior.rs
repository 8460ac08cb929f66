//! What is known of a pose before the scan is looked at.
//!
//! Frame: map. Units: meters, radians.

use biplane_geometry::PortableMath;
use nalgebra::{Matrix3, Vector3};

use crate::registration::gauss_newton::params::{BEAMS_PER_INDEPENDENT_ONE, WEAK_M};
use biplane_geometry::Pose2;

/// Where the base is expected, and how surely.
#[derive(Copy, Clone, Debug)]
pub(crate) struct Prior {
    /// Expected `map_from_base`.
    pub mean: Pose2,
    /// Inverse covariance of x, y, theta in the map's axes.
    pub information: Matrix3<f64>,
    /// Whether odometry measured it. A weak direction is left to odometry; a mere guess gives way to what
    /// little a scan knows there, or it would drift on from guess to guess.
    pub measured: bool,
    /// Whether it gives way to a scan that contradicts it (Cauchy), as odometry has to when the base slips or
    /// is carried. If not, it holds like a spring (Gauss), however far off.
    pub gives_way: bool,
}

/// A prior off by so many standard deviations counts half: odometry slips, or the base is carried.
pub(crate) const CAUCHY_SCALE: f64 = 4.0;

impl Prior {
    /// The way from the expected pose: x, y in the map's axes, theta wrapped.
    pub(crate) fn residual(&self, pose: &Pose2) -> Vector3<f64> {
        Vector3::from(pose.step_from(&self.mean))
    }

    /// Squared Mahalanobis distance of a pose.
    pub(crate) fn squared(&self, pose: &Pose2) -> f64 {
        let residual = self.residual(pose);
        residual.dot(&(self.information * residual))
    }

    /// Whether a pose is so far off that the prior counts less than half.
    pub(crate) fn is_contradicted_by(&self, pose: &Pose2) -> bool {
        self.squared(pose) > CAUCHY_SCALE * CAUCHY_SCALE
    }

    /// The information that is left to the prior when this pose is the truth (Cauchy weight).
    pub(crate) fn information_at(&self, pose: &Pose2) -> Matrix3<f64> {
        if !self.gives_way {
            return self.information;
        }
        self.information / (1.0 + self.squared(pose) / (CAUCHY_SCALE * CAUCHY_SCALE))
    }

    /// Below this, 1 / m^2, a direction is left to the prior.
    pub(crate) fn min_information(&self) -> f64 {
        if self.measured { BEAMS_PER_INDEPENDENT_ONE / (WEAK_M * WEAK_M) } else { 0.0 }
    }

    /// What speaks against a pose: minus its log-likelihood, up to a constant.
    pub(crate) fn neg_log_likelihood(&self, pose: &Pose2) -> f64 {
        if !self.gives_way {
            return 0.5 * self.squared(pose);
        }
        cauchy(self.squared(pose), CAUCHY_SCALE)
    }
}

/// What speaks against an error of so many squared standard deviations, when one of `scale` of them counts
/// half: minus its log-likelihood, up to a constant.
pub(crate) fn cauchy(squared: f64, scale: f64) -> f64 {
    0.5 * scale * scale * (squared / (scale * scale)).portable_ln_1p()
}
