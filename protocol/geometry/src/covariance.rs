//! Covariances of planar motions: rows and columns are x, y (meters) and heading (radians).
//!
//! The covariance of a pose `a_from_b` is along the axes of a. Errors are small, so that turns act linearly.

use crate::Pose2;
use crate::elementary::PortableMath;

/// A covariance of x, y and heading, rows first.
pub type Covariance2 = [[f64; 3]; 3];

/// The covariance of `a_from_b * b_from_c`, along the axes of a, when the errors of the two have nothing to
/// do with each other.
///
/// An error of the first heading swings the second motion round; an error of the second is turned into the
/// axes of a.
#[must_use]
pub fn compound(
    a_from_b: &Pose2,
    first: &Covariance2,
    b_from_c: &Pose2,
    second: &Covariance2,
) -> Covariance2 {
    let whole = *a_from_b * *b_from_c;
    let arm_m = [whole.x_m - a_from_b.x_m, whole.y_m - a_from_b.y_m];
    let swing = [[1.0, 0.0, -arm_m[1]], [0.0, 1.0, arm_m[0]], [0.0, 0.0, 1.0]];
    let (sin, cos) = a_from_b.theta_rad.portable_sin_cos();
    let turn = [[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]];
    let (one, other) = (carried(&swing, first), carried(&turn, second));
    core::array::from_fn(|row| core::array::from_fn(|column| one[row][column] + other[row][column]))
}

/// The covariance of `b_from_a`, along the axes of b, from that of `a_from_b` along the axes of a.
#[must_use]
pub fn inverse(a_from_b: &Pose2, covariance: &Covariance2) -> Covariance2 {
    let back = a_from_b.inverse();
    let (sin, cos) = a_from_b.theta_rad.portable_sin_cos();
    // x' = -R^T x, and the turn swings it.
    carried(&[[-cos, -sin, back.y_m], [sin, -cos, -back.x_m], [0.0, 0.0, -1.0]], covariance)
}

/// `jacobian * covariance * jacobian^T`: the covariance of what follows linearly from something of this
/// covariance.
#[must_use]
pub fn carried(jacobian: &[[f64; 3]; 3], covariance: &Covariance2) -> Covariance2 {
    let product = |a: &dyn Fn(usize, usize) -> f64, b: &dyn Fn(usize, usize) -> f64| -> [[f64; 3]; 3] {
        core::array::from_fn(|i| {
            core::array::from_fn(|j| a(i, 0) * b(0, j) + a(i, 1) * b(1, j) + a(i, 2) * b(2, j))
        })
    };
    let half = product(&|i, j| jacobian[i][j], &|i, j| covariance[i][j]);
    product(&|i, j| half[i][j], &|i, j| jacobian[j][i])
}

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix3, Vector3};

    use super::*;

    const FIRST: Covariance2 = [[0.04, 0.01, 0.002], [0.01, 0.09, -0.003], [0.002, -0.003, 0.0016]];
    const SECOND: Covariance2 = [[0.01, -0.002, 0.001], [-0.002, 0.02, 0.0005], [0.001, 0.0005, 0.0004]];

    fn poses() -> impl Iterator<Item = (Pose2, Pose2)> {
        (0..200).map(|k| {
            let k = f64::from(k);
            (Pose2::new(k.sin(), k.cos(), 0.3 * k - 20.0), Pose2::new(0.1 * k, -2.0, (1.7 * k).sin()))
        })
    }

    /// Columns: how the result changes with each coordinate, by differences. The oracle knows no formula but
    /// the product's.
    fn jacobian(of: impl Fn([f64; 3]) -> Pose2) -> Matrix3<f64> {
        const STEP: f64 = 1e-6;
        Matrix3::from_columns(&[0, 1, 2].map(|k| {
            let moved = |by: f64| {
                let mut error = [0.0; 3];
                error[k] = by;
                of(error)
            };
            let (a, b) = (moved(STEP), moved(-STEP));
            let turn = crate::wrap_angle(a.theta_rad - b.theta_rad);
            Vector3::new(a.x_m - b.x_m, a.y_m - b.y_m, turn) / (2.0 * STEP)
        }))
    }

    fn off(pose: &Pose2, error: [f64; 3]) -> Pose2 {
        Pose2::new(pose.x_m + error[0], pose.y_m + error[1], pose.theta_rad + error[2])
    }

    fn matrix(rows: &Covariance2) -> Matrix3<f64> {
        Matrix3::from_fn(|row, column| rows[row][column])
    }

    #[test]
    fn covariances_of_products_and_inverses_are_those_of_small_differences() {
        for (first, second) in poses() {
            let a = jacobian(|error| off(&first, error) * second);
            let b = jacobian(|error| first * off(&second, error));
            let expected = a * matrix(&FIRST) * a.transpose() + b * matrix(&SECOND) * b.transpose();
            let found = matrix(&compound(&first, &FIRST, &second, &SECOND));
            assert!((found - expected).amax() < 1e-6 * expected.amax(), "{first:?} {second:?}");
            let back = jacobian(|error| off(&first, error).inverse());
            let expected = back * matrix(&FIRST) * back.transpose();
            assert!(
                (matrix(&inverse(&first, &FIRST)) - expected).amax() < 1e-6 * expected.amax(),
                "{first:?}"
            );
        }
    }

    #[test]
    fn the_bits_are_those_of_the_matrix_library() {
        for (first, second) in poses() {
            let whole = first * second;
            let arm = [whole.x_m - first.x_m, whole.y_m - first.y_m];
            let swing = Matrix3::new(1.0, 0.0, -arm[1], 0.0, 1.0, arm[0], 0.0, 0.0, 1.0);
            let (sin, cos) = first.theta_rad.portable_sin_cos();
            let turn = Matrix3::new(cos, -sin, 0.0, sin, cos, 0.0, 0.0, 0.0, 1.0);
            let expected =
                swing * matrix(&FIRST) * swing.transpose() + turn * matrix(&SECOND) * turn.transpose();
            assert_eq!(matrix(&compound(&first, &FIRST, &second, &SECOND)), expected);
        }
    }
}
