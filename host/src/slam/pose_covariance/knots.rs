//! The errors that neighboring poses share: motions of the map about its origin at knots along the way, and
//! linear between them.
//!
//! A surface moves by the same motion for all nodes that saw it, so each row of the observations is one
//! vector of three numbers and a weight for each node: its part of the Hessian is a small matrix over the
//! knots, times the vector with itself.

use biplane_matcher::Pose2;
use nalgebra::{DMatrix, Matrix3, Vector3};

use crate::slam::pose_covariance::map_motion::about;
use crate::slam::pose_covariance::rows::{Rows, Sight};
use crate::slam::pose_graph::{ANCHOR, DAMPING, Edge, Parts};

/// A knot every so many nodes at the closest. Larger: errors that change within a meter are taken for errors
/// of single scans.
const CLOSEST_NODES: usize = 3;
/// Knots at most: the system is dense, and its cost grows with the cube. On a longer way they are farther
/// apart.
const MAX_KNOTS: usize = 300;

/// Knots, and what is known of their motions.
#[derive(Clone, Debug)]
pub(super) struct Knots {
    /// Nodes from knot to knot.
    every: usize,
    nodes: usize,
    /// Lower triangle of the Hessian of the motions, three rows a knot.
    information: DMatrix<f64>,
}

impl Knots {
    /// What nodes saw in common, its variance being `noise` times what its weights say, and the steps between
    /// them, as far as knots can tell them apart.
    pub(super) fn new(poses: &[Pose2], (chain, parts): (&[Edge], &[Parts]), rows: &Rows, noise: f64) -> Self {
        let every = poses.len().div_ceil(MAX_KNOTS).max(CLOSEST_NODES);
        let count = (poses.len().max(1) - 1).div_ceil(every) + 1;
        let information = DMatrix::zeros(3 * count, 3 * count);
        let mut knots = Self { every, nodes: poses.len(), information };
        for (vector, seen) in rows.iter() {
            knots.add_row(&(vector / noise.sqrt()), seen);
        }
        for (edge, part) in chain.iter().zip(parts) {
            knots.add_step(edge, part, poses);
        }
        for at in 0..3 * count {
            knots.information[(at, at)] += if at < 3 { ANCHOR } else { DAMPING };
        }
        knots
    }

    /// The knots on both sides of a node, and how much it moves with each.
    fn shares(&self, node: usize) -> [(usize, f64); 2] {
        let (knot, rest) = (node / self.every, node % self.every);
        // The last knot is the last node, also where it is nearer.
        let to_next = self.every.min(self.nodes - 1 - knot * self.every).max(1);
        let share = rest as f64 / to_next as f64;
        [(knot, 1.0 - share), (knot + usize::from(rest > 0), share)]
    }

    /// What a row says: the nodes' own terms, less what they know in common of where the surface lies.
    fn add_row(&mut self, vector: &Vector3<f64>, seen: &[Sight]) {
        let mut common: Vec<(usize, f64)> = Vec::new();
        let mut sum = 0.0;
        for &Sight { node, weight, .. } in seen {
            sum += weight;
            let shares = self.shares(node);
            self.add_product(vector, weight, &shares);
            for (knot, share) in shares.into_iter().filter(|(_, share)| *share > 0.0) {
                match common.iter_mut().rev().take(2).find(|(known, _)| *known == knot) {
                    Some((_, total)) => *total += weight * share,
                    None => common.push((knot, weight * share)),
                }
            }
        }
        if sum > 0.0 {
            self.add_product(vector, -1.0 / sum, &common);
        }
    }

    /// Adds `weight * (shares x shares) (vector x vector)`.
    fn add_product(&mut self, vector: &Vector3<f64>, weight: f64, shares: &[(usize, f64)]) {
        let block = vector * vector.transpose() * weight;
        for &(one, share) in shares {
            for &(other, its) in shares.iter().filter(|(other, _)| *other <= one) {
                self.add_block(one, other, &(block * (share * its)));
            }
        }
    }

    fn add_block(&mut self, row: usize, column: usize, block: &Matrix3<f64>) {
        let mut place = self.information.fixed_view_mut::<3, 3>(3 * row, 3 * column);
        place += block;
    }

    fn add_step(&mut self, edge: &Edge, part: &Parts, poses: &[Pose2]) {
        let [from, to] = [edge.from, edge.to].map(|node| about(&poses[node]));
        let blocks = [
            (edge.from, edge.from, from.transpose() * part.from_from * from),
            (edge.from, edge.to, from.transpose() * part.from_to * to),
            (edge.to, edge.from, to.transpose() * part.from_to.transpose() * from),
            (edge.to, edge.to, to.transpose() * part.to_to * to),
        ];
        for (one, other, block) in blocks {
            for (row, share) in self.shares(one) {
                for (column, its) in self.shares(other).into_iter().filter(|(column, _)| *column <= row) {
                    self.add_block(row, column, &(block * (share * its)));
                }
            }
        }
    }

    /// The covariance of each node's motion of the map; `None` when some are held by nothing.
    pub(super) fn covariances(self) -> Option<Vec<Matrix3<f64>>> {
        let size = self.information.nrows();
        let root = self.information.clone().cholesky()?.unpack();
        let mut inverse = DMatrix::identity(size, size);
        root.solve_lower_triangular_mut(&mut inverse);
        let block = |one: usize, other: usize| {
            // Rows above the diagonal are zero.
            let first = 3 * one.max(other);
            let [a, b] =
                [one, other].map(|knot| inverse.view((first, 3 * knot), (size - first, 3)).into_owned());
            Matrix3::from_iterator((a.transpose() * b).iter().copied())
        };
        let count = size / 3;
        let at: Vec<Matrix3<f64>> = (0..count).map(|knot| block(knot, knot)).collect();
        let between: Vec<Matrix3<f64>> = (1..count).map(|knot| block(knot - 1, knot)).collect();
        let of_node = |node: usize| {
            let [(one, share), (other, its)] = self.shares(node);
            let both = if one == other { Matrix3::zeros() } else { between[one] * (share * its) };
            at[one] * (share * share) + at[other] * (its * its) + both + both.transpose()
        };
        Some((0..self.nodes).map(of_node).collect())
    }
}
