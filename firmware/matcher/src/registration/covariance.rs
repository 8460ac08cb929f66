//! From information to covariance, and which direction is weak.
//!
//! Units: x, y in meters, theta in radians; map's axes.

use biplane_geometry::PortableMath;
use nalgebra::{Matrix3, Vector3};

/// Inverse of a symmetric positive matrix; `None` when it is not positive or not finite.
pub(crate) fn inverse(matrix: &Matrix3<f64>) -> Option<Matrix3<f64>> {
    let inverse = matrix.cholesky()?.inverse();
    inverse.iter().all(|value| value.is_finite()).then(|| 0.5 * (inverse + inverse.transpose()))
}

/// The unit direction of the plane that an information knows least about, the heading being unknown too, and
/// how much it knows there (1 / variance, never negative); `None` when it knows nothing of the heading.
pub(crate) fn weakest_direction(information: &Matrix3<f64>) -> Option<(f64, [f64; 2])> {
    let turn = information[(2, 2)];
    if turn.is_nan() || turn <= 0.0 {
        return None;
    }
    // What is left of the position's information when the heading is found as well (Schur complement).
    let xx = information[(0, 0)] - information[(0, 2)] * information[(0, 2)] / turn;
    let xy = information[(0, 1)] - information[(0, 2)] * information[(1, 2)] / turn;
    let yy = information[(1, 1)] - information[(1, 2)] * information[(1, 2)] / turn;
    let half_difference = 0.5 * (xx - yy);
    let root = half_difference.portable_hypot(xy);
    let smallest = (0.5 * (xx + yy) - root).max(0.0);
    let direction =
        if half_difference >= 0.0 { [-xy, half_difference + root] } else { [root - half_difference, -xy] };
    let length = direction[0].portable_hypot(direction[1]);
    Some((smallest, if length > 0.0 { direction.map(|part| part / length) } else { [1.0, 0.0] }))
}

/// Standard deviation along the weakest direction, meters; infinite along a bare corridor.
pub(crate) fn weakest_sigma_m(information: &Matrix3<f64>) -> f64 {
    match weakest_direction(information) {
        Some((information, _)) if information > 0.0 => information.sqrt().recip(),
        _ => f64::INFINITY,
    }
}

/// A covariance whose error along a direction of the plane has nothing to do with the others, and is `most_m`
/// (standard deviation) at most.
pub(crate) fn apart(covariance: &Matrix3<f64>, [x, y]: [f64; 2], max_m: f64) -> Matrix3<f64> {
    let direction = Vector3::new(x, y, 0.0);
    let line = direction * direction.transpose();
    let rest = Matrix3::identity() - line;
    let along = direction.dot(&(covariance * direction)).min(max_m * max_m);
    rest * covariance * rest + along * line
}

/// The matrix as rows.
pub(crate) fn rows(matrix: &Matrix3<f64>) -> [[f64; 3]; 3] {
    std::array::from_fn(|row| std::array::from_fn(|column| matrix[(row, column)]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_diagonal_information_inverts_to_its_reciprocals() {
        let information = Matrix3::from_diagonal(&Vector3::new(4.0, 25.0, 100.0));
        let covariance = inverse(&information).unwrap();
        assert!((covariance[(0, 0)] - 0.25).abs() < 1e-12 && (covariance[(2, 2)] - 0.01).abs() < 1e-12);
        assert!((weakest_sigma_m(&information) - 0.5).abs() < 1e-12);
    }

    #[test]
    fn a_direction_without_information_has_no_finite_sigma_and_no_inverse() {
        let information = Matrix3::from_diagonal(&Vector3::new(0.0, 25.0, 100.0));
        assert!(inverse(&information).is_none());
        assert_eq!(weakest_sigma_m(&information), f64::INFINITY);
    }

    #[test]
    fn an_error_set_apart_keeps_the_others_and_is_cut_to_the_most() {
        let covariance = Matrix3::new(4.0, 1.0, 1.0, 1.0, 2.0, 0.5, 1.0, 0.5, 3.0);
        let apart = apart(&covariance, [1.0, 0.0], 0.5);
        assert_eq!(apart, Matrix3::new(0.25, 0.0, 0.0, 0.0, 2.0, 0.5, 0.0, 0.5, 3.0));
    }

    #[test]
    fn a_wall_ahead_with_an_unknown_heading_leaves_less_position_than_with_a_known_one() {
        // Ten beams all strike one point's line x = 5 at the same lever: heading and y trade off completely.
        let information = Matrix3::new(1.0, 0.0, -2.0, 0.0, 0.0, 0.0, -2.0, 0.0, 4.0);
        assert_eq!(weakest_sigma_m(&information), f64::INFINITY);
    }
}
