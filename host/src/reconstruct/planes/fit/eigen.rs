//! Eigenvalues of a symmetric 3x3 matrix in closed form, and the eigenvector of the smallest.
//!
//! Unit-free. Source: O. K. Smith, "Eigenvalues of a symmetric 3x3 matrix", CACM 4 (1961); the vector is the
//! longest cross product of two rows of `A - lambda I`, which all are orthogonal to it.

use biplane_geometry::PortableMath;
use biplane_geometry::vec3::{cross, dot, scaled};

/// A symmetric matrix as its upper triangle: xx, xy, xz, yy, yz, zz.
pub(crate) type Symmetric = [f64; 6];

/// Eigenvalues in ascending order and the unit eigenvector of the smallest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Eigen {
    /// Ascending.
    pub values: [f64; 3],
    /// Unit eigenvector of `values[0]`; its sign is arbitrary. Of several possible ones (a line, a ball) one
    /// is picked.
    pub smallest_vector: [f64; 3],
}

/// Decomposes a symmetric matrix with finite entries.
pub(crate) fn eigen(m: &Symmetric) -> Eigen {
    let values = eigenvalues(m);
    Eigen { values, smallest_vector: null_vector(m, values[0]) }
}

fn eigenvalues(&[xx, xy, xz, yy, yz, zz]: &Symmetric) -> [f64; 3] {
    let mean = (xx + yy + zz) / 3.0;
    let off_diagonal = xy * xy + xz * xz + yz * yz;
    let (a, b, c) = (xx - mean, yy - mean, zz - mean);
    let spread = ((a * a + b * b + c * c + 2.0 * off_diagonal) / 6.0).sqrt();
    if spread <= f64::EPSILON * mean.abs() {
        return [mean; 3];
    }
    let determinant = a * (b * c - yz * yz) - xy * (xy * c - yz * xz) + xz * (xy * yz - b * xz);
    let half = (determinant / (2.0 * spread * spread * spread)).clamp(-1.0, 1.0);
    let angle = half.portable_acos() / 3.0;
    let largest = mean + 2.0 * spread * angle.portable_cos();
    let smallest = mean + 2.0 * spread * (angle + std::f64::consts::TAU / 3.0).portable_cos();
    [smallest, 3.0 * mean - smallest - largest, largest]
}

fn null_vector(&[xx, xy, xz, yy, yz, zz]: &Symmetric, lambda: f64) -> [f64; 3] {
    let rows = [[xx - lambda, xy, xz], [xy, yy - lambda, yz], [xz, yz, zz - lambda]];
    let candidates = [cross(rows[0], rows[1]), cross(rows[0], rows[2]), cross(rows[1], rows[2])];
    let longest = candidates.into_iter().max_by(|a, b| norm2(*a).total_cmp(&norm2(*b))).unwrap_or([0.0; 3]);
    let size: f64 = rows.iter().map(|row| norm2(*row)).sum();
    // All rows parallel: the eigenvalue is double, any vector orthogonal to the longest row will do.
    if norm2(longest) <= 1e-24 * size * size {
        let row = rows.into_iter().max_by(|a, b| norm2(*a).total_cmp(&norm2(*b))).unwrap_or([0.0; 3]);
        return orthogonal_to(row);
    }
    scaled(longest, norm2(longest).sqrt().recip())
}

/// A unit vector orthogonal to another one.
pub(crate) fn orthogonal_to(v: [f64; 3]) -> [f64; 3] {
    if norm2(v) == 0.0 {
        return [0.0, 0.0, 1.0];
    }
    let thinnest = if v[0].abs() <= v[1].abs() && v[0].abs() <= v[2].abs() {
        [1.0, 0.0, 0.0]
    } else if v[1].abs() <= v[2].abs() {
        [0.0, 1.0, 0.0]
    } else {
        [0.0, 0.0, 1.0]
    };
    let w = cross(v, thinnest);
    scaled(w, norm2(w).sqrt().recip())
}

fn norm2(v: [f64; 3]) -> f64 {
    dot(v, v)
}

#[cfg(test)]
mod tests {
    use super::{Symmetric, eigen};
    use crate::reconstruct::planes::paper::random::Random;
    use nalgebra::{Matrix3, SymmetricEigen};

    fn check(m: &Symmetric, vector_tolerance: f64) {
        let [xx, xy, xz, yy, yz, zz] = *m;
        let oracle = SymmetricEigen::new(Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz));
        let mut order = [0, 1, 2];
        order.sort_by(|a, b| oracle.eigenvalues[*a].total_cmp(&oracle.eigenvalues[*b]));
        let ours = eigen(m);
        let size = oracle.eigenvalues.amax().max(1e-300);
        for (value, index) in ours.values.iter().zip(order) {
            assert!((value - oracle.eigenvalues[index]).abs() < 1e-12 * size, "{m:?}: {ours:?}");
        }
        let v = oracle.eigenvectors.column(order[0]);
        let agreement: f64 = (0..3).map(|k| v[k] * ours.smallest_vector[k]).sum();
        assert!((1.0 - agreement.abs()) < vector_tolerance, "{m:?}: {ours:?} against {v}");
    }

    #[test]
    fn thin_patches_in_any_direction_agree_with_nalgebra() {
        let mut random = Random::new(7);
        for _ in 0..2000 {
            let mut m = [0.0; 6];
            for _ in 0..12 {
                let [x, y, z] = [random.unit() - 0.5, random.unit() - 0.5, 0.01 * (random.unit() - 0.5)];
                let (sin, cos) = (0.7_f64).sin_cos();
                let p = [x * cos - z * sin, y, x * sin + z * cos];
                for (slot, (i, j)) in m.iter_mut().zip([(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)]) {
                    *slot += p[i] * p[j];
                }
            }
            check(&m, 1e-9);
        }
    }

    #[test]
    fn diagonal_matrices_in_every_order_are_exact() {
        for m in
            [[1.0, 0.0, 0.0, 2.0, 0.0, 3.0], [3.0, 0.0, 0.0, 1.0, 0.0, 2.0], [2.0, 0.0, 0.0, 3.0, 0.0, 1.0]]
        {
            check(&m, 1e-12);
        }
    }

    #[test]
    fn a_line_a_ball_and_nothing_still_give_a_unit_vector() {
        for m in [
            [4.0, 0.0, 0.0, 0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0, 1.0, 0.0, 1.0],
            [0.0; 6],
            [2.0, 2.0, 2.0, 2.0, 2.0, 2.0],
        ] {
            let v = eigen(&m).smallest_vector;
            assert!((v.iter().map(|x| x * x).sum::<f64>() - 1.0).abs() < 1e-12, "{m:?}: {v:?}");
        }
    }
}
