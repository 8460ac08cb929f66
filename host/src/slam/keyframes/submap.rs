//! Submaps of the way, each with its points in the frame of its middle node, the grid of where they are, and
//! where nothing is.

use std::ops::Range;
use std::sync::OnceLock;

use biplane_geometry::PortableMath;
use biplane_matcher::{EndPoint, PointMap, Pose2, ScorePyramid};

use crate::slam::keyframes::Node;
use crate::slam::keyframes::free_space::FreeSpace;
use crate::slam::keyframes::passed_through::standing;
use crate::slam::keyframes::viewpoints::Viewpoints;

/// How submaps are cut.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SubmapParams {
    /// Way of a submap, meters. Longer: more to tell one place from another, and more drift within.
    pub path_m: f64,
    /// Way from one submap's beginning to the next one's, meters. Shorter: loops are found at more places, at
    /// more time.
    pub stride_m: f64,
    /// Side of a cell of the search, meters. Larger: faster and rougher; what is found is refined on the
    /// points.
    pub cell_m: f64,
}

impl Default for SubmapParams {
    fn default() -> Self {
        Self { path_m: 8.0, stride_m: 4.0, cell_m: 0.1 }
    }
}

/// Points closer than this share one of the keyframe scan, meters.
const THIN_M: f32 = 0.05;

/// One submap. Its frame is the base at its middle node.
#[derive(Clone, Debug)]
pub(crate) struct Submap {
    /// Its nodes in the graph.
    pub nodes: Range<usize>,
    /// The middle one.
    pub middle: usize,
    /// Its points, thinned.
    pub points: Vec<EndPoint>,
    /// A few of them, evenly chosen, for the search.
    pub few: Vec<EndPoint>,
    /// The points to align with.
    pub surfaces: PointMap,
    /// See [`Submap::pyramid`].
    pyramid: OnceLock<ScorePyramid>,
    cell_m: f32,
    /// Where its beams went through.
    pub free: FreeSpace,
    /// From where it was seen.
    pub viewpoints: Viewpoints,
}

/// Ranges of nodes with about the same way, in order.
pub(crate) fn submap_ranges(poses: &[Pose2], params: &SubmapParams) -> Vec<Range<usize>> {
    let mut way = vec![0.0];
    for pair in poses.windows(2) {
        let turned = pair[0].between(&pair[1]);
        // A turn on the spot sees new things, too.
        way.push(way[way.len() - 1] + turned.distance_m() + 0.5 * turned.theta_rad.abs());
    }
    let mut found = Vec::new();
    let mut first = 0;
    while first < poses.len() {
        let end = way.partition_point(|&path_m| path_m < way[first] + params.path_m).max(first + 1);
        found.push(first..end);
        if end >= poses.len() {
            break;
        }
        first = way.partition_point(|&path_m| path_m < way[first] + params.stride_m).max(first + 1);
    }
    found
}

impl Submap {
    /// Makes a submap of nodes; `poses` are theirs, in any frame, `first` the number of the first one in the
    /// graph.
    pub(crate) fn new(nodes: &[Node], poses: &[Pose2], first: usize, params: &SubmapParams) -> Self {
        let middle = nodes.len() / 2;
        let from_node: Vec<Pose2> = poses.iter().map(|pose| poses[middle].between(pose)).collect();
        let points = thinned(standing(nodes, &from_node));
        let with_normal = points.iter().filter(|point| point.has_normal()).count();
        let pool: Vec<&EndPoint> =
            points.iter().filter(|point| point.has_normal() || with_normal < 40).collect();
        let few = (0..pool.len().min(FEW)).map(|at| *pool[at * pool.len() / pool.len().min(FEW)]).collect();
        let free = FreeSpace::new(nodes, &from_node, &points);
        Self {
            nodes: first..first + nodes.len(),
            middle: first + middle,
            few,
            surfaces: PointMap::new(&points),
            pyramid: OnceLock::new(),
            cell_m: params.cell_m as f32,
            free,
            viewpoints: Viewpoints::new(nodes, &from_node),
            points,
        }
    }

    /// The grid of its points and its pyramid. It spans them all, so it is made when somebody searches here
    /// first: along a way that never comes back there is none.
    pub(crate) fn pyramid(&self) -> &ScorePyramid {
        self.pyramid.get_or_init(|| ScorePyramid::new(&self.points, self.cell_m))
    }
}

/// Points of a search.
const FEW: usize = 100;

/// One point a cell, in the order of the cells.
fn thinned(points: Vec<EndPoint>) -> Vec<EndPoint> {
    let cell = |point: &EndPoint| point.at_m.map(|value| (value / THIN_M).floor_to_i32());
    let mut keyed: Vec<([i32; 2], usize, EndPoint)> =
        points.into_iter().enumerate().map(|(index, point)| (cell(&point), index, point)).collect();
    keyed.sort_by_key(|(cell, index, point)| (*cell, !point.has_normal(), *index));
    keyed.dedup_by_key(|(cell, ..)| *cell);
    keyed.into_iter().map(|(.., point)| point).collect()
}
