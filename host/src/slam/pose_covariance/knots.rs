//! The errors that neighboring poses share: motions of the map about its origin at knots along the way, and
//! linear between them.
//!
//! A surface moves by the same motion for all nodes that saw it, so each row of the observations is one
//! vector of three numbers and a weight for each node: its part of the Hessian is a small matrix over the
//! knots, times the vector with itself.

use std::collections::BTreeMap;

use biplane_matcher::Pose2;
use nalgebra::{DMatrix, Matrix3, Vector3};
use rayon::prelude::*;

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
    /// What nodes saw in common, and the steps between them, as far as knots can tell them apart.
    pub(super) fn new(poses: &[Pose2], (chain, parts): (&[Edge], &[Parts]), rows: &Rows) -> Self {
        let every = poses.len().div_ceil(MAX_KNOTS).max(CLOSEST_NODES);
        let count = (poses.len().max(1) - 1).div_ceil(every) + 1;
        let information = DMatrix::zeros(3 * count, 3 * count);
        let mut knots = Self { every, nodes: poses.len(), information };
        for (vector, seen) in rows.iter() {
            knots.add_row(vector, seen);
        }
        for (edge, part) in chain.iter().zip(parts) {
            knots.add_step(edge, part, poses);
        }
        for at in 0..3 * count {
            knots.information[(at, at)] += if at < 3 { ANCHOR } else { DAMPING };
        }
        knots
    }

    /// Nodes from knot to knot.
    pub(super) fn nodes_apart(&self) -> usize {
        self.every
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

    /// The covariance of the motion of the map where each node looks, against where the first one does.
    ///
    /// A scan lies where the map says that it does, and all nodes that saw a surface made the map there.
    /// Where that says little, it moves with its neighbors on the way, by what `held` has of the steps to
    /// them. `seen` has what nodes saw as it was weighed. `None` when some knots are held by nothing.
    pub(super) fn covariances(self, seen: &Rows, held: &[Matrix3<f64>]) -> Option<Vec<Matrix3<f64>>> {
        let size = self.information.nrows();
        let root = self.information.clone().cholesky()?.unpack();
        let mut inverse = DMatrix::identity(size, size);
        for column in 0..size {
            // Above the diagonal it is zero.
            let mut below = inverse.view_mut((column, column), (size - column, 1));
            root.view((column, column), (size - column, size - column))
                .solve_lower_triangular_mut(&mut below);
        }
        let moves = self.moves(seen, held);
        let first = moves.first()?.clone();
        let of_node = |moves: &Moves| {
            let mut by: BTreeMap<usize, Matrix3<f64>> = BTreeMap::new();
            for (of, sign) in [(moves, 1.0), (&first, -1.0)] {
                for (knot, share) in of {
                    *by.entry(*knot).or_default() += share * sign;
                }
            }
            // Knots that it does not move with add nothing, nor does what is above the diagonal.
            let mut spread = DMatrix::zeros(size, 3);
            for (knot, share) in by {
                for (column, axis) in (0..3).flat_map(|part| (0..3).map(move |axis| (part, axis))) {
                    let at = 3 * knot + column;
                    let mut sum = spread.column_mut(axis);
                    let mut sum = sum.rows_mut(at, size - at);
                    sum.axpy(share[(axis, column)], &inverse.column(at).rows(at, size - at), 1.0);
                }
            }
            let covariance = spread.transpose() * spread;
            covariance.fixed_view::<3, 3>(0, 0).into_owned()
        };
        Some(moves.par_iter().map(of_node).collect())
    }

    /// How much the map where each node looks moves with each knot.
    fn moves(&self, rows: &Rows, held: &[Matrix3<f64>]) -> Vec<Moves> {
        let mut sums: Vec<Sums> = vec![Sums::new(); self.nodes];
        let mut totals: Vec<Matrix3<f64>> = held.to_vec();
        for (vector, seen) in rows.iter() {
            let place = self.place(seen);
            let block = vector * vector.transpose();
            for &Sight { node, weight, .. } in seen {
                totals[node] += block * weight;
                for &(knot, share) in &place {
                    *sums[node].entry(knot).or_default() += block * (weight * share);
                }
            }
        }
        let of_node = |(node, (mut sums, total)): (usize, (Sums, Matrix3<f64>))| {
            let on_the_way = self.shares(node).into_iter().filter(|(_, share)| *share > 0.0);
            let Some(known) = total.cholesky().map(|factors| factors.inverse()) else {
                return on_the_way.map(|(knot, share)| (knot, Matrix3::identity() * share)).collect();
            };
            for (knot, share) in on_the_way {
                *sums.entry(knot).or_default() += held[node] * share;
            }
            sums.into_iter().map(|(knot, sum)| (knot, known * sum)).collect()
        };
        sums.into_iter().zip(totals).enumerate().map(of_node).collect()
    }

    /// How much a row's place moves with each knot: the mean of the nodes that saw it.
    fn place(&self, seen: &[Sight]) -> Vec<(usize, f64)> {
        let mut shares: BTreeMap<usize, f64> = BTreeMap::new();
        let mut sum = 0.0;
        for &Sight { node, weight, .. } in seen {
            sum += weight;
            for (knot, share) in self.shares(node).into_iter().filter(|(_, share)| *share > 0.0) {
                *shares.entry(knot).or_default() += weight * share;
            }
        }
        if sum > 0.0 {
            shares.into_iter().map(|(knot, share)| (knot, share / sum)).collect()
        } else {
            Vec::new()
        }
    }
}

/// Knots, and the shares of their motions that something moves with.
type Moves = Vec<(usize, Matrix3<f64>)>;

/// What a node's surfaces say of each knot.
type Sums = BTreeMap<usize, Matrix3<f64>>;
