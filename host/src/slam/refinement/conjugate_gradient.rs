//! One step of all nodes' poses: what they saw in common and the steps between them, by conjugate gradients.
//!
//! Every surface joins all nodes that saw it, so the system is far too full for a factorization. The
//! preconditioner is a sparse one that resembles it: each node compared with some before it, ever farther
//! back, and with the first visits of its place, scaled such that each node is held as strongly as by all.
//! With it some twenty iterations do.

use biplane_geometry::PortableMath;
use std::collections::BTreeMap;

use biplane_matcher::Pose2;
use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;

use crate::slam::pose_graph;
use crate::slam::pose_graph::solver::{Factor, Structure, System};
use crate::slam::pose_graph::{ANCHOR, DAMPING, Edge, Parts};
use crate::slam::refinement::observations::Observations;

/// Nodes so many before are compared with.
const BACK: [usize; 3] = [1, 4, 16];
/// And the nearest node of the nearest other visit, up to this far, meters.
const NEAR_M: f64 = 4.0;
/// One node every so far stands for a place, meters. Smaller: a better likeness, a fuller factor.
const PLACE_M: f64 = 1.0;
/// Nodes closer in the order than this are one visit.
const VISIT: usize = 8;
/// Iterations at most.
const ITERATIONS: usize = 60;
/// The squared error that is left, as a share.
const REST: f64 = 1e-2;
/// The most that a comparison stands for.
const LARGEST_SCALE: f64 = 1e3;
/// Heading counts as much as position this far off, meters squared.
const LEVER_SQUARED: f64 = 25.0;

/// One number a node's unknown.
type Steps = Vec<[f64; 3]>;

/// See the module's text.
#[derive(Debug)]
pub(crate) struct ConjugateGradient<'a> {
    chain: &'a [Edge],
    partners: Vec<(usize, usize)>,
    structure: Structure,
}

impl<'a> ConjugateGradient<'a> {
    /// Of nodes about these poses.
    pub(crate) fn new(poses: &[Pose2], chain: &'a [Edge]) -> Self {
        let partners = partners(poses);
        let joined = partners.iter().copied().chain(chain.iter().map(|edge| (edge.from, edge.to)));
        let structure = Structure::new(poses.len(), joined);
        Self { chain, partners, structure }
    }

    /// The step that makes nodes agree; `None` when there is none to take.
    pub(crate) fn step(&self, observations: &Observations, poses: &[Pose2]) -> Option<Steps> {
        let parts: Vec<Parts> = self.chain.iter().map(|edge| pose_graph::parts(edge, poses)).collect();
        let factor = self.preconditioner(observations, &parts)?;
        self.descend(observations, &parts, &factor)
    }

    fn preconditioner(&self, observations: &Observations, parts: &[Parts]) -> Option<Factor<'_>> {
        let mut system = System::new(&self.structure);
        for (edge, part) in self.chain.iter().zip(parts) {
            pose_graph::add_parts(&mut system, edge, part, 1.0);
        }
        let blocks: Vec<_> =
            self.partners.par_iter().map(|&(one, other)| observations.common(one, other)).collect();
        let size = |block: &Matrix3<f64>| block[(0, 0)] + block[(1, 1)] + block[(2, 2)] / LEVER_SQUARED;
        let mut compared = vec![0.0; self.structure.len()];
        for (&(one, other), blocks) in self.partners.iter().zip(&blocks) {
            compared[one] += size(&blocks[0]);
            compared[other] += size(&blocks[2]);
        }
        let scale = |(node, compared): (usize, &f64)| match *compared > 0.0 {
            true => (size(&observations.diagonal(node)) / compared).clamp(1.0, LARGEST_SCALE),
            false => 1.0,
        };
        let scales: Vec<f64> = compared.iter().enumerate().map(scale).collect();
        for (&(one, other), blocks) in self.partners.iter().zip(&blocks) {
            let scale = (scales[one] * scales[other]).sqrt();
            system.add(one, &pose_graph::block(&(blocks[0] * scale)), [0.0; 3]);
            system.add(other, &pose_graph::block(&(blocks[2] * scale)), [0.0; 3]);
            system.add_pair(one, other, &pose_graph::block(&(blocks[1] * scale)));
        }
        system.damp(DAMPING);
        system.add(0, &pose_graph::block(&(Matrix3::identity() * ANCHOR)), [0.0; 3]);
        system.factor().ok()
    }

    /// Preconditioned conjugate gradients (Hestenes and Stiefel 1952).
    fn descend(&self, observations: &Observations, parts: &[Parts], factor: &Factor<'_>) -> Option<Steps> {
        let mut found = vec![[0.0; 3]; self.structure.len()];
        let mut rest = self.downhill(observations, parts);
        let mut way = factor.solve(&rest);
        let mut left = dot(&rest, &way);
        let enough = REST * left;
        for _ in 0..ITERATIONS {
            if left.is_nan() || left <= enough {
                break;
            }
            let held = self.apply(observations, parts, &way);
            let length = left / dot(&way, &held);
            add(&mut found, length, &way);
            add(&mut rest, -length, &held);
            let next = factor.solve(&rest);
            let after = dot(&rest, &next);
            let turn = after / left;
            for (way, next) in way.as_flattened_mut().iter_mut().zip(next.as_flattened()) {
                *way = next + turn * *way;
            }
            left = after;
        }
        found.as_flattened().iter().all(|value| value.is_finite()).then_some(found)
    }

    /// Minus the gradient. The first pose stays.
    fn downhill(&self, observations: &Observations, parts: &[Parts]) -> Steps {
        let mut down = vec![[0.0; 3]; self.structure.len()];
        observations.gradient(&mut down);
        for value in down.as_flattened_mut() {
            *value = -*value;
        }
        for (edge, part) in self.chain.iter().zip(parts) {
            add_one(&mut down[edge.from], part.right_from);
            add_one(&mut down[edge.to], part.right_to);
        }
        down[0] = [0.0; 3];
        down
    }

    /// The Hessian times steps.
    fn apply(&self, observations: &Observations, parts: &[Parts], steps: &Steps) -> Steps {
        let mut out: Steps = steps.iter().map(|by| by.map(|value| DAMPING * value)).collect();
        observations.apply(steps, &mut out);
        for (edge, part) in self.chain.iter().zip(parts) {
            let (from, to) = (Vector3::from(steps[edge.from]), Vector3::from(steps[edge.to]));
            add_one(&mut out[edge.from], (part.from_from * from + part.from_to * to).into());
            add_one(&mut out[edge.to], (part.from_to.transpose() * from + part.to_to * to).into());
        }
        add_one(&mut out[0], steps[0].map(|value| ANCHOR * value));
        out
    }
}

fn add_one(sum: &mut [f64; 3], more: [f64; 3]) {
    for (sum, more) in sum.iter_mut().zip(more) {
        *sum += more;
    }
}

fn add(sum: &mut Steps, times: f64, more: &Steps) {
    for (sum, more) in sum.as_flattened_mut().iter_mut().zip(more.as_flattened()) {
        *sum += times * more;
    }
}

fn dot(a: &Steps, b: &Steps) -> f64 {
    a.as_flattened().iter().zip(b.as_flattened()).map(|(a, b)| a * b).sum()
}

/// Pairs of nodes for the preconditioner, the earlier one first. Other visits are compared with the first
/// node of a place alone: however often it is visited, what joins the visits stays as large as the place.
fn partners(poses: &[Pose2]) -> Vec<(usize, usize)> {
    let cell = |pose: &Pose2| [pose.x_m, pose.y_m].map(|value| (value / NEAR_M).floor() as i64);
    let away_m =
        |a: usize, b: usize| (poses[a].x_m - poses[b].x_m).portable_hypot(poses[a].y_m - poses[b].y_m);
    let mut cells: BTreeMap<[i64; 2], Vec<usize>> = BTreeMap::new();
    let mut found = Vec::new();
    for (at, pose) in poses.iter().enumerate() {
        found.extend(BACK.iter().filter_map(|back| at.checked_sub(*back)).map(|other| (other, at)));
        let [x, y] = cell(pose);
        let around = (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| [x + dx, y + dy]));
        let firsts: Vec<usize> = around.filter_map(|cell| cells.get(&cell)).flatten().copied().collect();
        if firsts.iter().all(|&other| away_m(at, other) >= PLACE_M) {
            cells.entry([x, y]).or_default().push(at);
        }
        let other_visits =
            firsts.into_iter().filter(|&other| other + VISIT < at && away_m(at, other) < NEAR_M);
        let nearest = other_visits.min_by(|&a, &b| away_m(at, a).total_cmp(&away_m(at, b)).then(a.cmp(&b)));
        found.extend(nearest.filter(|nearest| !BACK.contains(&(at - nearest))).map(|nearest| (nearest, at)));
    }
    found
}

#[cfg(test)]
mod tests {
    use biplane_matcher::Pose2;

    use super::{Structure, partners};

    /// Rounds of a ring of 40 m, a node every 0.4 m, never at quite the same places.
    fn rounds(count: usize) -> Vec<Pose2> {
        let at = |node: usize| {
            let angle = (node as f64 + 0.37 * (node / 100) as f64) * std::f64::consts::TAU / 100.0;
            let radius_m = 6.4 + 0.1 * ((node * 7) % 5) as f64;
            Pose2::new(radius_m * angle.cos(), radius_m * angle.sin(), angle)
        };
        (0..100 * count).map(at).collect()
    }

    #[test]
    fn the_factor_of_a_place_visited_again_and_again_grows_with_the_visits_and_no_faster() {
        let blocks = |count: usize| {
            let poses = rounds(count);
            Structure::new(poses.len(), partners(&poses).into_iter()).blocks()
        };
        let (few, many) = (blocks(5), blocks(40));
        assert!(many < 10 * few, "{many} blocks for 8 times {few}");
    }

    #[test]
    fn every_visit_is_joined_to_an_earlier_one() {
        let found = partners(&rounds(6));
        for visit in 1..6 {
            let nodes = 100 * visit..100 * (visit + 1);
            let across = found.iter().filter(|(one, other)| *one + 50 < *other && nodes.contains(other));
            assert!(across.count() >= 10, "visit {visit}");
        }
    }
}
