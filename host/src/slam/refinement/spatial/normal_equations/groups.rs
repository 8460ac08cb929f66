//! What beams say of planes, summed for each place and plane.

use crate::slam::pose_graph::solver::Block;
use rayon::prelude::*;

/// What all beams between two knots say of one plane: blocks of (knot, tilt, next knot, its tilt, plane),
/// lower triangle row by row, and the right hand side.
#[derive(Clone, Debug)]
pub(crate) struct Group {
    pub knot: usize,
    pub plane: usize,
    /// Both knots stay: what it says of its plane is all that counts, and the rest is left out.
    pub is_fixed: bool,
    pub(super) blocks: [Block; 15],
    pub(super) right: [[f64; 3]; 5],
    /// Sums of weights, and of weighted residuals.
    weight: f64,
    weighted: f64,
}

impl Group {
    /// Nothing yet.
    pub(crate) fn new(knot: usize, plane: usize, is_fixed: bool) -> Self {
        let (blocks, right) = ([[0.0; 9]; 15], [[0.0; 3]; 5]);
        Self { knot, plane, is_fixed, blocks, right, weight: 0.0, weighted: 0.0 }
    }

    /// Nothing again.
    pub(crate) fn clear(&mut self) {
        *self = Self::new(self.knot, self.plane, self.is_fixed);
    }

    /// Adds a residual.
    pub(crate) fn add(&mut self, row: &[[f64; 3]; 5], residual: f64, weight: f64) {
        self.weight += weight;
        self.weighted += weight * residual;
        let mut at = 0;
        for i in 0..5 {
            let scaled = row[i].map(|v| v * weight);
            for other in &row[..=i] {
                add_product(&mut self.blocks[at], scaled, other);
                at += 1;
            }
            for (sum, scaled) in self.right[i].iter_mut().zip(scaled) {
                *sum -= scaled * residual;
            }
        }
    }

    /// Adds what a residual says of the plane.
    pub(crate) fn add_fixed(&mut self, of_plane: &[f64; 3], residual: f64, weight: f64) {
        self.weight += weight;
        self.weighted += weight * residual;
        let scaled = of_plane.map(|v| v * weight);
        add_product(&mut self.blocks[14], scaled, of_plane);
        for (sum, scaled) in self.right[4].iter_mut().zip(scaled) {
            *sum -= scaled * residual;
        }
    }
}

fn add_product(block: &mut Block, scaled: [f64; 3], other: &[f64; 3]) {
    for (r, scaled) in scaled.iter().enumerate() {
        for (c, other) in other.iter().enumerate() {
            block[3 * r + c] += scaled * other;
        }
    }
}

/// Planes are asked for the error that their beams share as if they were seen from so many knots at least: a
/// mean of few squares tells little.
const FEW_KNOTS: f64 = 4.0;

/// Beams that meet a plane from one place share an error where it is not quite what stands there: a curved
/// wall, frames. Their means tell how large: they are off by more than the beams' own noise. However many the
/// beams are, together they count as surely as that error leaves it.
pub(crate) fn let_share_errors(groups: &mut [Group], planes: usize) {
    let mut sums = vec![[0.0; 2]; planes];
    for group in groups.iter().filter(|group| group.weight > 0.0) {
        let mean = group.weighted / group.weight;
        let [squares, count] = &mut sums[group.plane];
        *squares += mean * mean - 1.0 / group.weight;
        *count += 1.0;
    }
    groups.par_iter_mut().for_each(|group| {
        let [squares, count] = sums[group.plane];
        let shared = f64::max(squares / f64::max(count, FEW_KNOTS), 0.0);
        let by = 1.0 / (1.0 + shared * group.weight);
        let (blocks, right) = if group.is_fixed { (14, 4) } else { (0, 0) };
        group.blocks[blocks..].iter_mut().flatten().for_each(|part| *part *= by);
        group.right[right..].iter_mut().flatten().for_each(|part| *part *= by);
    });
}

#[cfg(test)]
mod tests {
    use super::{Group, let_share_errors};

    /// Seen from 40 knots, 50 beams each, with noise of 1 cm that the beams do not share and what they share.
    fn weights(shared_m: f64) -> Vec<f64> {
        let row = [[1.0, 0.0, 0.0]; 5];
        let mut groups: Vec<Group> = (0..40)
            .map(|knot| {
                let mut group = Group::new(knot, 0, false);
                for beam in 0..50 {
                    let noise_m = if beam % 2 == 0 { 0.01 } else { -0.01 };
                    let sign = if knot % 2 == 0 { 1.0 } else { -1.0 };
                    group.add(&row, noise_m + sign * shared_m, 1e4);
                }
                group
            })
            .collect();
        let_share_errors(&mut groups, 1);
        groups.iter().map(|group| group.blocks[0][0]).collect()
    }

    #[test]
    fn beams_that_share_an_error_count_as_surely_as_it_leaves_it() {
        assert!(weights(0.0).iter().all(|weight| (weight - 50.0 * 1e4).abs() < 1e-3), "{:?}", weights(0.0));
        // 2 cm shared by all that a place sees: no more is known than that.
        for weight in weights(0.02) {
            assert!((weight * 0.02 * 0.02 - 1.0).abs() < 0.02, "{weight}");
        }
    }
}
