//! What a scan only seems to know.
//!
//! The directions of mapped walls are off by some `nu`, so that J^T W J of the distances to them holds nu^2 T too much, T
//! being the same sum over the walls' tangents: even a bare corridor shows some information along its axis, and a round
//! room about its centre. In the coordinates in which T is the identity, nu^2 is taken off each eigenvalue, down to zero,
//! and off the gradient in proportion; where nothing is left the odometry decides. Coordinates: x, y (m), theta (rad).

use nalgebra::{Matrix3, Vector3};

/// An information matrix taken apart along the directions in which walls' directions matter.
#[derive(Copy, Clone, Debug)]
pub struct Doubt {
    /// From whitened coordinates back; its columns are the directions.
    axes: Matrix3<f64>,
    /// Into whitened coordinates.
    whiten: Matrix3<f64>,
    /// Information along each direction, whitened.
    values: Vector3<f64>,
    /// The share of it that is believed, 0 to 1.
    believed: Vector3<f64>,
}

impl Doubt {
    /// From the walls' information `across` them, the same sum `along` their tangents, and the directions' error.
    pub fn new(across: &Matrix3<f64>, along: &Matrix3<f64>, nu_rad: f64) -> Self {
        let scale = along.trace().max(across.trace()) + f64::MIN_POSITIVE;
        let tangents = along + Matrix3::identity() * (1e-6 * scale);
        let factor = tangents.cholesky().map_or_else(Matrix3::identity, |factors| factors.l());
        let unfactor = factor.try_inverse().unwrap_or_else(Matrix3::identity);
        let eigen = (unfactor * across * unfactor.transpose()).symmetric_eigen();
        let squared = nu_rad * nu_rad;
        Self {
            axes: factor * eigen.eigenvectors,
            whiten: eigen.eigenvectors.transpose() * unfactor,
            values: eigen.eigenvalues,
            believed: eigen
                .eigenvalues
                .map(|value| if value > squared { (value - squared) / value } else { 0.0 }),
        }
    }

    /// The information that is believed.
    pub fn information(&self) -> Matrix3<f64> {
        let kept = Matrix3::from_diagonal(&self.believed.component_mul(&self.values));
        self.axes * kept * self.axes.transpose()
    }

    /// The part of a gradient that is believed.
    pub fn gradient(&self, gradient: &Vector3<f64>) -> Vector3<f64> {
        self.axes * self.believed.component_mul(&(self.whiten * gradient))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Walls along x at y = +-1, seen at x = -3 .. 3, each `nu` off in direction, alternately to either side.
    fn corridor(nu: f64) -> (Matrix3<f64>, Matrix3<f64>) {
        let (mut across, mut along) = (Matrix3::zeros(), Matrix3::zeros());
        for i in -30..=30 {
            for side in [-1.0, 1.0] {
                let arm = [0.1 * f64::from(i), side];
                let tilt = if i % 2 == 0 { nu } else { -nu };
                let n = [tilt, (1.0 - tilt * tilt).sqrt()];
                let row = Vector3::new(n[0], n[1], arm[0] * n[1] - arm[1] * n[0]);
                across += row * row.transpose();
                let row = Vector3::new(-n[1], n[0], arm[0] * n[0] + arm[1] * n[1]);
                along += row * row.transpose();
            }
        }
        (across, along)
    }

    #[test]
    fn what_tilted_walls_say_of_a_corridors_axis_is_not_believed() {
        let (across, along) = corridor(0.05);
        assert!(across[(0, 0)] > 0.1, "the walls seem to say something: {across}");
        let kept = Doubt::new(&across, &along, 0.06).information();
        assert!(kept[(0, 0)].abs() < 1e-6 * across[(1, 1)], "{kept}");
        assert!((kept[(1, 1)] / across[(1, 1)] - 1.0).abs() < 0.01, "{kept}");
    }

    #[test]
    fn a_gradient_along_the_axis_vanishes_and_one_across_stays() {
        let (across, along) = corridor(0.05);
        let doubt = Doubt::new(&across, &along, 0.06);
        assert!(doubt.gradient(&Vector3::new(1.0, 0.0, 0.0)).norm() < 1e-3);
        assert!((doubt.gradient(&Vector3::new(0.0, 1.0, 0.0)) - Vector3::new(0.0, 1.0, 0.0)).norm() < 1e-2);
    }

    #[test]
    fn without_error_everything_is_believed() {
        let (across, along) = corridor(0.05);
        let kept = Doubt::new(&across, &along, 0.0).information();
        assert!((kept - across).norm() < 1e-9 * across.norm(), "{kept}");
    }

    #[test]
    fn nothing_is_made_of_nothing() {
        let kept = Doubt::new(&Matrix3::zeros(), &Matrix3::zeros(), 0.05).information();
        assert!(kept.norm() < 1e-100, "{kept}");
    }
}
