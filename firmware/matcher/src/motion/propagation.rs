//! What a step makes of a pose's covariance.
//!
//! Frame: map. Units: meters, radians.

use nalgebra::{Matrix3, Vector3};

use crate::motion::Step;
use crate::registration::covariance::rows;
use biplane_geometry::Pose2;
use biplane_geometry::covariance::compound;

/// Covariance (x, y, theta; map's axes) after a step from a pose with this covariance.
pub(crate) fn propagate(covariance: &Matrix3<f64>, map_from_last: &Pose2, step: &Step) -> Matrix3<f64> {
    let noise = Matrix3::from_diagonal(&Vector3::from(step.sigma.map(|sigma| sigma * sigma)));
    let sum = compound(map_from_last, &rows(covariance), &step.last_from_base, &rows(&noise));
    Matrix3::from_fn(|row, column| sum[row][column])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::motion::odometry::Odometry;
    use std::f64::consts::FRAC_PI_2;

    #[test]
    fn heading_noise_becomes_noise_across_the_way_driven() {
        let step =
            Step { last_from_base: Pose2::new(2.0, 0.0, 0.0), sigma: [0.0; 3], odometry: Odometry::Used };
        let before = Matrix3::from_diagonal(&Vector3::new(0.0, 0.0, 0.01));
        // Looking along y and driving 2 m: sigma 0.1 rad is 0.2 m along x.
        let after = propagate(&before, &Pose2::new(0.0, 0.0, FRAC_PI_2), &step);
        assert!((after[(0, 0)] - 0.04).abs() < 1e-12 && after[(1, 1)].abs() < 1e-12, "{after}");
        assert!((after[(0, 2)] + 0.02).abs() < 1e-12 && (after[(2, 2)] - 0.01).abs() < 1e-12, "{after}");
    }

    #[test]
    fn noise_ahead_turns_with_the_base() {
        let step = Step { last_from_base: Pose2::IDENTITY, sigma: [0.3, 0.1, 0.0], odometry: Odometry::Used };
        let after = propagate(&Matrix3::zeros(), &Pose2::new(0.0, 0.0, FRAC_PI_2), &step);
        assert!((after[(0, 0)] - 0.01).abs() < 1e-12 && (after[(1, 1)] - 0.09).abs() < 1e-12, "{after}");
    }
}
