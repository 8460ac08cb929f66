//! A joint covariance of a few errors of three numbers each, of which one at a time becomes a linear mixture
//! of all.
//!
//! Every block is an error (x, y in meters, turn in radians about the map's origin; for the odometry its own
//! three shares). The memory is made once.
//!
//! Two blocks change again and again: the pose and the submap that grows. Their columns in the rows of others
//! are a walk through all of the memory. So they are left as they were until another block takes the place
//! of one of the two: whoever reads a row takes them from the rows of these.

use nalgebra::{Matrix3, Vector3};

use crate::lanes::{InLanes, widest};

/// Numbers between two rows: rows that lie a power of two apart would share few places of a cache.
const GAP: usize = 8;

/// Blocks by blocks of three by three, symmetric.
#[derive(Clone, Debug)]
pub(super) struct Joint {
    /// Rows of `width` numbers; behind those in use they are of no meaning.
    cells: Vec<f64>,
    /// A row being made: three by `width`.
    row: Vec<f64>,
    /// Room for `3 * capacity` numbers and a gap.
    width: usize,
    capacity: usize,
    /// Blocks in use.
    used: usize,
    /// The blocks that were mixed last, the latest first: their columns hold only in their own rows.
    ahead: [Option<usize>; 2],
}

impl Joint {
    /// So many blocks, all zero: no error.
    pub(super) fn new(capacity: usize) -> Self {
        let width = 3 * capacity + GAP;
        let (cells, row) = (vec![0.0; 3 * capacity * width], vec![0.0; 3 * width]);
        Self { cells, row, width, capacity, used: 0, ahead: [None; 2] }
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
        if self.ahead.contains(&Some(b)) { self.in_row(b, a).transpose() } else { self.in_row(a, b) }
    }

    /// The same as the rows of `a` have it.
    fn in_row(&self, a: usize, b: usize) -> Matrix3<f64> {
        Matrix3::from_fn(|i, j| self.cells[(3 * a + i) * self.width + 3 * b + j])
    }

    fn set_block(&mut self, a: usize, b: usize, value: &Matrix3<f64>) {
        let width = self.width;
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
        let (width, length) = (self.width, 3 * self.used);
        self.row.fill(0.0);
        parts.iter().for_each(|(part, _)| self.catch_up(*part));
        widest(AddRows { joint: self, parts });
        let row = |b: usize| Matrix3::from_fn(|i, j| self.row[i * width + 3 * b + j]);
        let own =
            parts.iter().fold(Matrix3::zeros(), |sum, (part, factor)| sum + row(*part) * factor.transpose());
        self.go_ahead(block);
        for i in 0..3 {
            let start = (3 * block + i) * width;
            self.cells[start..start + length].copy_from_slice(&self.row[i * width..i * width + length]);
        }
        if let Some(other) = self.ahead[1] {
            self.set_block(block, other, &self.in_row(block, other));
        }
        self.set_block(block, block, &(0.5 * (own + own.transpose())));
    }

    /// The rows of a block take over the columns of those ahead.
    fn catch_up(&mut self, block: usize) {
        for ahead in self.ahead.into_iter().flatten().filter(|ahead| *ahead != block) {
            self.set_block(ahead, block, &self.in_row(ahead, block));
        }
    }

    /// The rows of a block are about to change: it takes the place of what was ahead longer.
    fn go_ahead(&mut self, block: usize) {
        let [last, before] = self.ahead;
        if last == Some(block) {
            return;
        }
        if let Some(before) = before.filter(|before| *before != block) {
            self.spread(before);
        }
        self.ahead = [Some(block), last];
    }

    /// All rows take over the columns of a block.
    fn spread(&mut self, block: usize) {
        for other in (0..self.used).filter(|other| *other != block) {
            self.set_block(block, other, &self.in_row(block, other));
        }
    }

    /// Adds the rows of a block, times a matrix, to those being made.
    #[inline(always)]
    fn add_rows(&mut self, block: usize, factor: &Matrix3<f64>) {
        let (width, length) = (self.width, 3 * self.used);
        let source = &self.cells[3 * block * width..(3 * block + 3) * width];
        let [x, y, theta] = [0, 1, 2].map(|i| &source[i * width..i * width + length]);
        // What is multiplied by zero adds nothing.
        let is_diagonal = *factor == Matrix3::from_diagonal(&factor.diagonal());
        for (i, target) in self.row.chunks_exact_mut(width).enumerate() {
            let [a, b, c] = [0, 1, 2].map(|k| factor[(i, k)]);
            let target = &mut target[..length];
            if is_diagonal {
                let (own, factor) = ([x, y, theta][i], factor[(i, i)]);
                target.iter_mut().zip(own).for_each(|(sum, own)| *sum += factor * own);
            } else {
                for (sum, ((x, y), theta)) in target.iter_mut().zip(x.iter().zip(y).zip(theta)) {
                    *sum += a * x + b * y + c * theta;
                }
            }
        }
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
        std::mem::take(&mut self.ahead).into_iter().flatten().for_each(|ahead| self.spread(ahead));
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

/// Rows of blocks, each times its matrix, for the row that is being made.
struct AddRows<'a> {
    joint: &'a mut Joint,
    parts: &'a [(usize, Matrix3<f64>)],
}

impl InLanes for AddRows<'_> {
    type Output = ();

    #[inline(always)]
    fn work(self) {
        for (part, factor) in self.parts {
            self.joint.add_rows(*part, factor);
        }
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

    #[test]
    fn whichever_blocks_change_in_turn_all_covariances_are_those_of_the_mixtures_themselves() {
        // Each block is kept as a mixture of five independent ones, too.
        let mut joint = Joint::new(9);
        let mut mixtures: Vec<[Matrix3<f64>; 5]> = Vec::new();
        for block in 0..5 {
            joint.push(&Vector3::new(1.0, 1.0, 1.0));
            mixtures.push([0, 1, 2, 3, 4].map(|other| diagonal(1.0, 1.0, 1.0) * f64::from(block == other)));
        }
        let number = |step: usize, k: usize| ((step * 7919 + k * 104_729) % 1009) as f64 / 504.5 - 1.0;
        for step in 0..60 {
            let is_new = step % 9 == 4 && joint.used() < joint.capacity();
            // Mostly the same two, as pose and submap are.
            let block = if step % 3 == 0 { step % joint.used() } else { 1 + step % 2 };
            if is_new {
                joint.copy(block);
                mixtures.push(mixtures[block]);
                continue;
            }
            let factor = |k: usize| Matrix3::from_fn(|i, j| 0.4 * number(step, 9 * k + 3 * i + j));
            let parts = [(block, factor(1)), ((block + 1) % 5, factor(2)), (step % joint.used(), factor(3))];
            joint.mix(block, &parts);
            mixtures[block] = [0, 1, 2, 3, 4].map(|other| {
                parts
                    .iter()
                    .fold(Matrix3::zeros(), |sum, (part, factor)| sum + factor * mixtures[*part][other])
            });
            for (a, b) in (0..joint.used()).flat_map(|a| (0..=a).map(move |b| (a, b))) {
                let of = |other: usize| mixtures[a][other] * mixtures[b][other].transpose();
                let expected = (0..5).map(of).fold(Matrix3::zeros(), |sum, each| sum + each);
                for (found, expected) in
                    [(joint.block(a, b), expected), (joint.block(b, a), expected.transpose())]
                {
                    assert!((found - expected).norm() < 1e-9, "{step}: {a} {b}: {found}{expected}");
                }
            }
        }
        assert_eq!(joint.used(), 9);
    }
}
