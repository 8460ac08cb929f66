//! Loop closing and pose-graph optimisation: better poses for one recording, and one frame for several.
//!
//! The way, one file a step: scans kept along the way ([`trail`]) -> steps between them ([`chain`]) -> stretches with grids
//! ([`submap`]) -> pairs that might see one place ([`candidate`], [`uncertain`]; of several recordings [`join`]) -> the place
//! ([`search`], [`refine`], [`company`]) -> which loops to believe ([`robust`] over the [`graph`], [`solver`]) -> every scan among all scans around it
//! ([`joint`], [`sights`], [`descent`]) -> the recording again ([`output`]).
//!
//! Frame `map`, metres, radians. Results do not depend on the number of threads.

pub mod align;
pub mod candidate;
pub mod chain;
pub mod checkpoint;
pub mod company;
pub mod corrected;
pub mod descent;
pub mod graph;
pub mod join;
pub mod joint;
pub mod outline;
pub mod output;
pub mod refine;
pub mod robust;
pub mod search;
pub mod sights;
pub mod solver;
pub mod submap;
pub mod surfaces;
pub mod trail;
pub mod uncertain;

use std::ops::Range;

use biplane_matcher::Pose2;
use nalgebra::Matrix3;
use rayon::prelude::*;
use serde::Serialize;

use candidate::{CandidateParams, Closing};
use chain::ChainParams;
use checkpoint::Checkpoint;
use graph::Edge;
use joint::JointParams;
use refine::RefineParams;
use submap::{Submap, SubmapParams, stretches};
use trail::{Node, Trail, TrailParams};

/// All parameters.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LoopParams {
    /// Which scans are kept.
    pub trail: TrailParams,
    /// The steps between them.
    pub chain: ChainParams,
    /// Stretches.
    pub submap: SubmapParams,
    /// Which stretches are compared.
    pub candidate: CandidateParams,
    /// When they match.
    pub refine: RefineParams,
    /// The last step.
    pub joint: JointParams,
    /// This share of the loops found is replaced by random ones before they are judged, for tests of the judging.
    pub spoilt_share: f64,
}

/// What goes on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Progress {
    /// Steps and stretches are made, of so many scans.
    Stretches(usize),
    /// So many pairs were searched, so many loops are believed.
    Searched(usize, usize),
    /// The last step, of so many rounds this one.
    Joint(usize, usize),
}

/// What became of the recordings.
#[derive(Clone, Debug)]
pub struct Optimised {
    /// The poses of the nodes, by recording.
    pub poses: Vec<Vec<Pose2>>,
    /// For each recording the first one that it is joined to; itself when it is alone.
    pub groups: Vec<usize>,
    /// The loops found, between nodes counted over all recordings.
    pub loops: Vec<LoopFound>,
    /// The figures.
    pub counts: Counts,
}

/// A loop that was found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LoopFound {
    /// The nodes in the middle of both stretches.
    pub nodes: [usize; 2],
    /// The second one seen from the first.
    pub pose: Pose2,
    /// Inverse covariance of the pose.
    pub information: Matrix3<f64>,
    /// How far around the guess was searched, metres.
    pub half_m: f64,
    /// How well it fits.
    pub agreement: refine::Agreement,
    /// Whether the others agree with it.
    pub believed: bool,
}

/// Figures of an optimisation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Counts {
    /// Scans kept.
    pub nodes: usize,
    /// Stretches of the way.
    pub stretches: usize,
    /// Pairs of stretches searched.
    pub pairs_searched: usize,
    /// Loops found.
    pub loops_found: usize,
    /// Of these, believed.
    pub loops: usize,
}

/// Optimises the poses of recordings.
pub fn optimise(
    trails: &[Trail],
    params: &LoopParams,
    checkpoint: &mut Checkpoint,
    progress: &mut dyn FnMut(Progress),
) -> Optimised {
    let nodes: Vec<Node> = trails.iter().flat_map(|trail| trail.nodes.iter().cloned()).collect();
    let runs = runs(trails);
    progress(Progress::Stretches(nodes.len()));
    let chain: Vec<Edge> =
        runs.iter().flat_map(|run| chain::edges(&nodes[run.clone()], run.start, &params.chain)).collect();
    let mut poses = chained(&nodes, &chain);
    let (submaps, recording_of) = cut(&nodes, &poses, &runs, params);
    let coarse = coarse_chain(&submaps, &recording_of, &chain);
    let middles = submaps.iter().map(|submap| poses[submap.middle]).collect();
    let mut closing =
        Closing::new(&submaps, &recording_of, &coarse, middles, (params.candidate, params.refine));
    closing.spoilt_share = params.spoilt_share;
    let mut hear = |searched, believed| progress(Progress::Searched(searched, believed));
    closing.run(checkpoint, &mut hear);
    while runs.len() > 1 && closing.join(runs.len(), checkpoint, &mut hear) {
        closing.run(checkpoint, &mut hear);
    }
    let loops = closing.believed_edges(|stretch| submaps[stretch].middle);
    spread(&mut poses, &submaps, &recording_of, &runs, &closing.poses);
    let all: Vec<Edge> = chain.iter().chain(&loops).copied().collect();
    let structure = graph::structure(poses.len(), &all);
    graph::optimise(&mut poses, &all, &vec![1.0; all.len()], &structure);
    let groups = closing.groups(runs.len());
    let is_closed = closed(&closing, &groups);
    for group in (0..runs.len()).filter(|&run| groups[run] == run && is_closed[run]) {
        let members = runs.iter().zip(&groups).filter(|(_, of)| **of == group);
        let members: Vec<usize> = members.flat_map(|(run, _)| run.clone()).collect();
        joint::refine_some(&members, &nodes, &mut poses, &chain, &params.joint, &mut |round| {
            progress(Progress::Joint(round, params.joint.rounds()));
        });
    }
    let found = closing.loops.iter().zip(&closing.believed).map(|(found, &believed)| LoopFound {
        nodes: found.stretches.map(|stretch| submaps[stretch].middle),
        pose: found.found.pose,
        information: found.found.information,
        half_m: found.half_m,
        agreement: found.found.agreement,
        believed,
    });
    let counts = Counts {
        nodes: nodes.len(),
        stretches: submaps.len(),
        pairs_searched: closing.searched,
        loops_found: closing.loops.len(),
        loops: loops.len(),
    };
    let of_run = |(run, closed): (&Range<usize>, &bool)| match closed {
        true => poses[run.clone()].to_vec(),
        false => nodes[run.clone()].iter().map(|node| node.recorded).collect(),
    };
    Optimised {
        poses: runs.iter().zip(&is_closed).map(of_run).collect(),
        groups,
        loops: found.collect(),
        counts,
    }
}

/// Whether a recording is part of any loop. One without keeps its recorded poses: nothing says where they would be wrong.
fn closed(closing: &Closing<'_>, groups: &[usize]) -> Vec<bool> {
    let mut closed = vec![false; groups.len()];
    for edge in closing.believed_edges(|stretch| closing.recording_of[stretch]) {
        closed[edge.from] = true;
        closed[edge.to] = true;
    }
    let group_is = |group: usize| groups.iter().zip(&closed).any(|(of, closed)| *of == group && *closed);
    groups.iter().map(|group| group_is(*group)).collect()
}

/// The nodes of each recording.
fn runs(trails: &[Trail]) -> Vec<Range<usize>> {
    let mut end = 0;
    trails
        .iter()
        .map(|trail| {
            let start = end;
            end += trail.nodes.len();
            start..end
        })
        .collect()
}

/// Poses by the steps alone; each recording begins at its recorded pose.
fn chained(nodes: &[Node], chain: &[Edge]) -> Vec<Pose2> {
    let mut poses: Vec<Pose2> = nodes.iter().map(|node| node.recorded).collect();
    for edge in chain {
        poses[edge.to] = poses[edge.from] * edge.measured;
    }
    poses
}

/// The stretches of all recordings, and which recording each is of.
fn cut(
    nodes: &[Node],
    poses: &[Pose2],
    runs: &[Range<usize>],
    params: &LoopParams,
) -> (Vec<Submap>, Vec<usize>) {
    let mut ranges = Vec::new();
    for (number, run) in runs.iter().enumerate() {
        let of_run = stretches(&poses[run.clone()], &params.submap);
        ranges
            .extend(of_run.into_iter().map(|range| (number, range.start + run.start..range.end + run.start)));
    }
    let submaps = ranges
        .par_iter()
        .map(|(_, range)| {
            Submap::new(&nodes[range.clone()], &poses[range.clone()], range.start, &params.submap)
        })
        .collect();
    (submaps, ranges.into_iter().map(|(number, _)| number).collect())
}

/// Steps between the middles of following stretches of a recording, added up over the nodes between. `chain` holds the steps of all
/// recordings, ascending.
fn coarse_chain(submaps: &[Submap], recording_of: &[usize], chain: &[Edge]) -> Vec<Edge> {
    let join = |at: usize| {
        let first = chain.partition_point(|edge| edge.from < submaps[at].middle);
        let last = chain.partition_point(|edge| edge.from < submaps[at + 1].middle);
        let mut sum = (Pose2::IDENTITY, Matrix3::zeros());
        for edge in &chain[first..last] {
            sum = uncertain::joined((&sum.0, &sum.1), (&edge.measured, &inverse(&edge.information)));
        }
        Edge { from: at, to: at + 1, measured: sum.0, information: inverse(&sum.1) }
    };
    let follows = |at: &usize| recording_of[*at] == recording_of[*at + 1];
    (0..submaps.len().saturating_sub(1)).filter(follows).map(join).collect()
}

fn inverse(matrix: &Matrix3<f64>) -> Matrix3<f64> {
    matrix.cholesky().map_or_else(Matrix3::identity, |factors| factors.inverse())
}

/// Moves each node with the middle of the stretch nearest to it: a start for the graph of all nodes.
fn spread(
    poses: &mut [Pose2],
    submaps: &[Submap],
    recording_of: &[usize],
    runs: &[Range<usize>],
    middles: &[Pose2],
) {
    let old = poses.to_vec();
    for (number, run) in runs.iter().enumerate() {
        let first = recording_of.partition_point(|of| *of < number);
        let last = recording_of.partition_point(|of| *of <= number);
        let mut at = first;
        for node in run.clone() {
            let away = |at: usize| submaps[at].middle.abs_diff(node);
            while at + 1 < last && away(at + 1) <= away(at) {
                at += 1;
            }
            poses[node] = middles[at] * old[submaps[at].middle].between(&old[node]);
        }
    }
}
