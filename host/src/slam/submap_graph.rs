//! Nodes and submaps: the ways of parts cut into submaps, the steps between these, and back to the nodes.

use std::ops::Range;

use biplane_matcher::Pose2;
use nalgebra::Matrix3;
use rayon::prelude::*;

use crate::slam::LoopParams;
use crate::slam::keyframes::Node;
use crate::slam::keyframes::submap::{Submap, submap_ranges};
use crate::slam::pose_graph::{self, Edge};

/// Poses by the steps alone; each recording begins at its recorded pose.
pub(crate) fn chained(nodes: &[Node], chain: &[Edge]) -> Vec<Pose2> {
    let mut poses: Vec<Pose2> = nodes.iter().map(|node| node.recorded).collect();
    for edge in chain {
        poses[edge.to] = poses[edge.from] * edge.measured;
    }
    poses
}

/// The submaps of all parts, and which part each is of.
pub(crate) fn cut(
    nodes: &[Node],
    poses: &[Pose2],
    parts: &[Range<usize>],
    params: &LoopParams,
) -> (Vec<Submap>, Vec<usize>) {
    let mut ranges = Vec::new();
    for (number, part) in parts.iter().enumerate() {
        let of_part = submap_ranges(&poses[part.clone()], &params.submap);
        let moved = |range: Range<usize>| (number, range.start + part.start..range.end + part.start);
        ranges.extend(of_part.into_iter().map(moved));
    }
    let submaps = ranges
        .par_iter()
        .map(|(_, range)| {
            Submap::new(&nodes[range.clone()], &poses[range.clone()], range.start, &params.submap)
        })
        .collect();
    (submaps, ranges.into_iter().map(|(number, _)| number).collect())
}

/// Steps between the middles of following submaps of a part, added up over the nodes between. `chain` holds
/// the steps of all parts, ascending.
pub(crate) fn coarse_chain(submaps: &[Submap], part_of: &[usize], chain: &[Edge]) -> Vec<Edge> {
    let join = |at: usize| {
        let first = chain.partition_point(|edge| edge.from < submaps[at].middle);
        let last = chain.partition_point(|edge| edge.from < submaps[at + 1].middle);
        let mut sum = (Pose2::IDENTITY, Matrix3::zeros());
        for edge in &chain[first..last] {
            sum = pose_graph::relative_covariance::joined(
                (&sum.0, &sum.1),
                (&edge.measured, &inverse(&edge.information)),
            );
        }
        Edge { from: at, to: at + 1, measured: sum.0, information: inverse(&sum.1) }
    };
    let follows = |at: &usize| part_of[*at] == part_of[*at + 1];
    (0..submaps.len().saturating_sub(1)).filter(follows).map(join).collect()
}

fn inverse(matrix: &Matrix3<f64>) -> Matrix3<f64> {
    matrix.cholesky().map_or_else(Matrix3::identity, |factors| factors.inverse())
}

/// Moves each node with the middle of the submap nearest to it: a start for the graph of all nodes.
pub(crate) fn spread(
    poses: &mut [Pose2],
    submaps: &[Submap],
    part_of: &[usize],
    parts: &[Range<usize>],
    middles: &[Pose2],
) {
    let old = poses.to_vec();
    for (number, part) in parts.iter().enumerate() {
        let first = part_of.partition_point(|of| *of < number);
        let last = part_of.partition_point(|of| *of <= number);
        let mut at = first;
        for node in part.clone() {
            let away = |at: usize| submaps[at].middle.abs_diff(node);
            while at + 1 < last && away(at + 1) <= away(at) {
                at += 1;
            }
            poses[node] = middles[at] * old[submaps[at].middle].between(&old[node]);
        }
    }
}
