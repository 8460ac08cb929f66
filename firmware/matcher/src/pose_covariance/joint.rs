//! A joint covariance of a few errors of three numbers each, of which one at a time becomes a linear mixture
//! of all.
//!
//! Every block is an error (x, y in meters, turn in radians about the map's origin; for the odometry its own
//! three shares). The memory is made once.

use nalgebra::{Matrix3, Vector3};

/// Blocks by blocks of three by three, symmetric.
#[derive(Clone, Debug)]
pub(super) struct Joint {
    /// Rows of `3 * capacity` numbers.
    cells: Vec<f64>,
    /// A row being made: three by `3 * capacity`.
    row: Vec<f64>,
    capacity: usize,
    /// Blocks in use.
    used: usize,
}

impl Joint {
    /// So many blocks, all zero: no error.
    pub(super) fn new(capacity: usize) -> Self {
        let width = 3 * capacity;
        Self { cells: vec![0.0; width * width], row: vec![0.0; 3 * width], capacity, used: 0 }
    }

    /// Blocks in use.
    pub(super) fn used(&self) -> usize {
        self.used
    }

    /// Blocks that there is memory for.
    pub(super) fn capacity(&self) -> usize {
        self.capacity
    }

    /// Covariance of two blocks.
    pub(super) fn block(&self, a: usize, b: usize) -> Matrix3<f64> {
        let width = 3 * self.capacity;
        Matrix3::from_fn(|i, j| self.cells[(3 * a + i) * width + 3 * b + j])
    }

    fn set_block(&mut self, a: usize, b: usize, value: &Matrix3<f64>) {
        let width = 3 * self.capacity;
        for i in 0..3 {
            for j in 0..3 {
                self.cells[(3 * a + i) * width + 3 * b + j] = value[(i, j)];
                self.cells[(3 * b + j) * width + 3 * a + i] = value[(i, j)];
            }
        }
    }

    /// Adds a block that has nothing to do with the others.
    pub(super) fn push(&mut self, variance: &Vector3<f64>) {
        if self.used < self.capacity {
            self.used += 1;
            self.set_block(self.used - 1, self.used - 1, &Matrix3::from_diagonal(variance));
        }
    }

    /// Adds independent noise to a block.
    pub(super) fn add_noise(&mut self, block: usize, noise: &Matrix3<f64>) {
        let sum = self.block(block, block) + noise;
        self.set_block(block, block, &(0.5 * (sum + sum.transpose())));
    }

    /// A block becomes the sum of blocks, each times its matrix; `parts` may name the block itself.
    pub(super) fn mix(&mut self, block: usize, parts: &[(usize, Matrix3<f64>)]) {
        let (width, length) = (3 * self.capacity, 3 * self.used);
        self.row.fill(0.0);
        for (part, factor) in parts {
            let source = &self.cells[3 * part * width..(3 * part + 3) * width];
            let (x, rest) = source.split_at(width);
            let (y, theta) = rest.split_at(width);
            for (i, target) in self.row.chunks_exact_mut(width).enumerate() {
                let [a, b, c] = [0, 1, 2].map(|k| factor[(i, k)]);
                let source = x[..length].iter().zip(&y[..length]).zip(&theta[..length]);
                for (sum, ((x, y), theta)) in target[..length].iter_mut().zip(source) {
                    *sum += a * x + b * y + c * theta;
                }
            }
        }
        let row = |b: usize| Matrix3::from_fn(|i, j| self.row[i * width + 3 * b + j]);
        let own =
            parts.iter().fold(Matrix3::zeros(), |sum, (part, factor)| sum + row(*part) * factor.transpose());
        for i in 0..3 {
            let start = (3 * block + i) * width;
            self.cells[start..start + length].copy_from_slice(&self.row[i * width..i * width + length]);
        }
        for (j, row) in self.cells.chunks_exact_mut(width).take(length).enumerate() {
            for i in 0..3 {
                row[3 * block + i] = self.row[i * width + j];
            }
        }
        self.set_block(block, block, &(0.5 * (own + own.transpose())));
    }

    /// Adds a block that is the same error as another; `None` when there is no memory for it.
    pub(super) fn copy(&mut self, from: usize) -> Option<usize> {
        (self.used < self.capacity).then(|| {
            self.used += 1;
            self.mix(self.used - 1, &[(from, Matrix3::identity())]);
            self.used - 1
        })
    }

    /// Of the blocks from `first` on keeps every second one, the earlier of two.
    pub(super) fn thin(&mut self, first: usize) {
        let left = (self.used - first).div_ceil(2);
        let old = |block: usize| if block < first { block } else { first + 2 * (block - first) };
        for a in 0..first + left {
            for b in 0..=a {
                let value = self.block(old(a), old(b));
                self.set_block(a, b, &value);
            }
        }
        self.used = first + left;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn diagonal(a: f64, b: f64, c: f64) -> Matrix3<f64> {
        Matrix3::from_diagonal(&Vector3::new(a, b, c))
    }

    #[test]
    fn a_mixture_has_the_variances_and_covariances_worked_out_by_hand() {
        let mut joint = Joint::new(3);
        joint.push(&Vector3::new(4.0, 1.0, 1.0));
        joint.push(&Vector3::new(1.0, 9.0, 1.0));
        assert_eq!(joint.copy(0), Some(2));
        // c = a / 2 + b, from then on independent of what was c before.
        joint.mix(2, &[(0, 0.5 * Matrix3::identity()), (1, Matrix3::identity())]);
        assert_eq!(joint.block(2, 2), diagonal(2.0, 9.25, 1.25));
        assert_eq!(joint.block(2, 0), diagonal(2.0, 0.5, 0.5));
        assert_eq!(joint.block(1, 2), diagonal(1.0, 9.0, 1.0));
        // c = c - a: what they have in common goes.
        joint.mix(2, &[(2, Matrix3::identity()), (0, -Matrix3::identity())]);
        assert_eq!(joint.block(2, 2), diagonal(2.0, 9.25, 1.25));
        assert_eq!(joint.block(2, 0), diagonal(-2.0, -0.5, -0.5));
    }

    #[test]
    fn thinning_keeps_every_second_block_with_what_it_has_in_common_with_the_others() {
        let mut joint = Joint::new(5);
        joint.push(&Vector3::new(1.0, 1.0, 1.0));
        for _ in 0..4 {
            let block = joint.copy(joint.used() - 1).unwrap();
            joint.add_noise(block, &Matrix3::identity());
        }
        assert_eq!(joint.copy(0), None);
        joint.thin(1);
        assert_eq!(joint.used(), 3);
        assert_eq!(
            (joint.block(1, 1), joint.block(2, 2)),
            (diagonal(2.0, 2.0, 2.0), diagonal(4.0, 4.0, 4.0))
        );
        assert_eq!(
            (joint.block(2, 1), joint.block(1, 0)),
            (diagonal(2.0, 2.0, 2.0), diagonal(1.0, 1.0, 1.0))
        );
    }
}
