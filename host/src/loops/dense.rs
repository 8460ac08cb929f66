//! The last step: every node among the scans of all nodes around it, whenever they were taken.
//!
//! With loops closed, poses are off by centimetres. Each node's points are then laid on the surfaces of the nodes near it, a visit
//! at a time; what that says of their relative pose (gradient and Hessian, not a pose of its own: along a corridor nothing is claimed)
//! goes into the graph. A few rounds, each with new correspondences.

use biplane_matcher::{Pose2, wrap_angle};
use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;

use super::align::{moved, sum_up};
use super::chain::with_floor;
use super::graph::{self, Edge};
use super::surfaces::{Surfaces, merged};
use super::trail::Node;

/// How much is compared.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DenseParams {
    /// Rounds. More: closer to the end, slower.
    pub rounds: usize,
    /// Nodes farther apart than this are not compared, metres.
    pub near_m: f64,
    /// Other visits that each node is compared with.
    pub visits: usize,
    /// Nodes on either side that a node's surfaces are taken from.
    pub beside: usize,
    /// Standard deviation that every comparison has, metres.
    pub floor_m: f64,
    /// The same of the heading, radians.
    pub floor_rad: f64,
}

impl Default for DenseParams {
    fn default() -> Self {
        Self { rounds: 3, near_m: 3.0, visits: 3, beside: 1, floor_m: 0.005, floor_rad: 0.001 }
    }
}

/// Refines the poses of all nodes. `group_of` tells which frame each is in; `progress` hears of each round.
pub fn refine(
    nodes: &[Node],
    poses: &mut [Pose2],
    chain: &[Edge],
    group_of: &[usize],
    params: &DenseParams,
    progress: &mut dyn FnMut(usize),
) {
    for round in 0..params.rounds {
        progress(round);
        let scale_m = if round == 0 { 0.1 } else { 0.05 };
        let mut edges: Vec<Edge> = chain.to_vec();
        let pairs = pairs(poses, group_of, params);
        edges.par_extend(
            pairs
                .par_iter()
                .flat_map_iter(|(at, others)| compare(nodes, poses, *at, others, scale_m, params)),
        );
        let weights = vec![1.0; edges.len()];
        let structure = graph::structure(poses.len(), &edges);
        for _ in 0..3 {
            if graph::step(poses, &edges, &weights, &structure).is_none_or(|largest| largest < 1e-4) {
                break;
            }
        }
    }
}

/// For each node those to compare it with: the nearest one of each visit.
fn pairs(poses: &[Pose2], group_of: &[usize], params: &DenseParams) -> Vec<(usize, Vec<usize>)> {
    let cell = |pose: &Pose2| [pose.x_m, pose.y_m].map(|value| (value / params.near_m).floor() as i64);
    let mut cells: std::collections::BTreeMap<[i64; 2], Vec<usize>> = std::collections::BTreeMap::new();
    for (at, pose) in poses.iter().enumerate() {
        cells.entry(cell(pose)).or_default().push(at);
    }
    let others = |at: usize| {
        let [x, y] = cell(&poses[at]);
        let around = (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| [x + dx, y + dy]));
        let mut near: Vec<usize> = around.filter_map(|cell| cells.get(&cell)).flatten().copied().collect();
        near.retain(|&other| {
            other < at
                && group_of[other] == group_of[at]
                && distance(&poses[at], &poses[other]) < params.near_m
        });
        near.sort_unstable();
        let mut visits: Vec<(f64, usize)> = Vec::new();
        let mut last: Option<usize> = None;
        for other in near {
            let cost = distance(&poses[at], &poses[other]);
            let same = last.is_some_and(|last| other - last <= 8);
            last = Some(other);
            match visits.last_mut() {
                Some(best) if same => {
                    if cost < best.0 {
                        *best = (cost, other);
                    }
                }
                _ => visits.push((cost, other)),
            }
        }
        // The visit that it belongs to itself: the chain says that already, but for what lies some steps back.
        visits.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        visits.truncate(params.visits);
        let mut found: Vec<usize> = visits.into_iter().map(|(_, other)| other).collect();
        for back in [2, 4] {
            if at >= back && group_of[at - back] == group_of[at] && !found.contains(&(at - back)) {
                found.push(at - back);
            }
        }
        found
    };
    (0..poses.len()).into_par_iter().map(|at| (at, others(at))).collect()
}

fn distance(one: &Pose2, other: &Pose2) -> f64 {
    (one.x_m - other.x_m).hypot(one.y_m - other.y_m) + wrap_angle(one.theta_rad - other.theta_rad).abs()
}

fn compare(
    nodes: &[Node],
    poses: &[Pose2],
    at: usize,
    others: &[usize],
    scale_m: f32,
    params: &DenseParams,
) -> Vec<Edge> {
    let mut edges = Vec::with_capacity(others.len());
    for &other in others {
        let from = other.saturating_sub(params.beside);
        let to = (other + params.beside + 1).min(nodes.len());
        let near = (from..to)
            .filter(|&near| near.abs_diff(at) > 0 && poses[other].between(&poses[near]).distance_m() < 1.0);
        let surfaces = Surfaces::new(&merged(
            near.map(|near| (poses[other].between(&poses[near]), &nodes[near].outline)),
        ));
        let pose = poses[other].between(&poses[at]);
        let sums = sum_up(&surfaces, &nodes[at].outline.points, &pose, 3.0 * scale_m, scale_m);
        if sums.share() < 0.35 {
            continue;
        }
        let held = Matrix3::from_diagonal(&Vector3::new(100.0, 100.0, 1000.0));
        let Some(factors) = (sums.information + held).cholesky() else { continue };
        let step = -factors.solve(&sums.gradient);
        let floor = [params.floor_m, params.floor_m, params.floor_rad];
        let information = with_floor(&(sums.information + Matrix3::identity() * 1e-3), &floor);
        edges.push(Edge { from: other, to: at, measured: moved(&pose, &step), information });
    }
    edges
}
