//! Loop closing and pose-graph optimization: better poses for one recording, and one frame for several.
//!
//! The way, step by step: scans kept along the way ([`keyframes`]) -> steps between them
//! ([`pose_graph::odometry_edges`]), and where the way breaks ([`pose_graph::breaks`]) -> submaps with grids
//! ([`keyframes::submap`]) -> pairs that might see one place ([`loop_closure::candidate`]; of several
//! recordings, or parts of one, [`loop_closure::join_recordings`]) -> the place: the matcher's search and
//! alignment, with what differs from the tracker in [`submap_alignment`], and the questions of
//! [`loop_closure::verification`] and [`loop_closure::pairwise_consistency`] -> which loops are inliers
//! ([`pose_graph::graduated_non_convexity`]; of whole passages [`loop_closure::perceptual_aliasing`]) -> kept
//! scans among all kept scans around them ([`refinement`]) -> every scan among these
//! ([`refinement::every_scan`]) -> the recording again ([`rewrite_recording`]).
//!
//! Frame `map`, meters, radians. Results do not depend on the number of threads.

pub(crate) mod corrected_poses;
pub(crate) mod keyframes;
pub(crate) mod loop_closure;
pub(crate) mod map_entropy;
pub(crate) mod occupancy;
pub(crate) mod pose_covariance;
pub(crate) mod pose_graph;
pub(crate) mod refinement;
pub(crate) mod rewrite_recording;
pub(crate) mod submap_alignment;
pub(crate) mod submap_graph;

use std::cmp::Reverse;
use std::ops::Range;

use biplane_matcher::Pose2;
use nalgebra::Matrix3;
use serde::Serialize;

use crate::recordings::deskew::StampedPose;
use crate::recordings::run::{Run, RunError};
use crate::slam::corrected_poses::Corrected;
use crate::slam::keyframes::submap::{Submap, SubmapParams};
use crate::slam::keyframes::{KeyframeParams, Keyframes, Node};
use crate::slam::loop_closure::candidate::{Loop, LoopCloser};
use crate::slam::loop_closure::checkpoint::Checkpoint;
use crate::slam::loop_closure::params::CandidateParams;
use crate::slam::loop_closure::verification::RefineParams;
use crate::slam::pose_graph::Edge;
use crate::slam::pose_graph::breaks::{self, Parts};
use crate::slam::pose_graph::odometry_edges::{self, ChainParams};
use crate::slam::pose_graph::wheel_calibration::{OdometryScale, WheelCalibration};
use crate::slam::refinement::every_scan::Drive;
use crate::slam::refinement::every_scan::fixed_map::FixedMap;
use crate::slam::refinement::params::JointParams;

/// All parameters.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LoopParams {
    /// Which scans are kept.
    pub keyframes: KeyframeParams,
    /// The steps between them.
    pub chain: ChainParams,
    /// Submaps.
    pub submap: SubmapParams,
    /// Which submaps are compared.
    pub candidate: CandidateParams,
    /// When they match.
    pub refine: RefineParams,
    /// The last step.
    pub joint: JointParams,
}

/// What goes on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Progress {
    /// Steps and submaps are made, of so many scans.
    Submaps(usize),
    /// So many pairs were searched, so many loops are believed.
    Searched(usize, usize),
    /// The last step, of so many rounds this one.
    Joint(usize, usize),
}

/// What became of the recordings.
#[derive(Clone, Debug)]
pub struct Optimized {
    /// The poses of the nodes, by recording.
    pub poses: Vec<Vec<Pose2>>,
    /// Their covariances in the axes of the map, the first pose of each group being exact, by recording; none
    /// where recorded poses are kept.
    pub covariances: Vec<Vec<Option<Matrix3<f64>>>>,
    /// For each recording the first one that it is joined to; itself when it is alone.
    pub groups: Vec<usize>,
    /// Whether the poses of each recording are others than the recorded ones.
    pub is_closed: Vec<bool>,
    /// What each drive teaches of its odometry; none where scans do not tell enough.
    pub odometry: Vec<Option<OdometryScale>>,
    /// The same, to read steps with.
    pub(crate) wheels: Vec<Option<WheelCalibration>>,
    /// The steps between nodes that refined them, by recording.
    pub(crate) chain: Vec<Vec<Edge>>,
    /// The scans before which the way breaks, as no sensor tells the step: numbers by recording, ascending.
    pub breaks: Vec<Vec<usize>>,
    /// The loops found, between nodes counted over all recordings.
    pub loops: Vec<LoopFound>,
    /// The figures.
    pub counts: Counts,
}

impl Optimized {
    /// The group of recordings to work with where they do not all join: that with the most scans kept. They
    /// are kept by the way, so it is the one that was driven farthest. Of equal ones the first.
    pub(crate) fn largest_group(&self) -> usize {
        let nodes_of = |group: usize| -> usize {
            let members = self.poses.iter().zip(&self.groups).filter(|(_, of)| **of == group);
            members.map(|(poses, _)| poses.len()).sum()
        };
        let groups = (0..self.groups.len()).filter(|&run| self.groups[run] == run);
        groups.max_by_key(|&group| (nodes_of(group), Reverse(group))).unwrap_or(0)
    }

    /// How many loops are closed within a group of recordings; none where recorded poses are kept.
    pub(crate) fn loops_in(&self, group: usize) -> usize {
        let recording_of = |node: usize| {
            let mut end = 0;
            self.poses.iter().position(|poses| {
                end += poses.len();
                node < end
            })
        };
        let is_in =
            |node| recording_of(node).is_some_and(|run| self.groups[run] == group && self.is_closed[run]);
        self.loops.iter().filter(|found| found.inlier && found.nodes.iter().copied().all(is_in)).count()
    }
}

/// A loop that was found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LoopFound {
    /// The nodes in the middle of both submaps.
    pub nodes: [usize; 2],
    /// The second one seen from the first.
    pub pose: Pose2,
    /// Inverse covariance of the pose.
    pub information: Matrix3<f64>,
    /// How far around the guess was searched, meters.
    pub half_m: f64,
    /// How well it fits.
    pub agreement: loop_closure::agreement::Agreement,
    /// Whether the others agree with it.
    pub inlier: bool,
}

/// Figures of an optimization.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Counts {
    /// Scans kept.
    pub nodes: usize,
    /// Submaps of the way.
    #[serde(rename = "stretches")]
    pub submap_count: usize,
    /// Pairs of submaps searched.
    pub pairs_searched: usize,
    /// Loops found.
    pub loops_found: usize,
    /// Of these, believed.
    pub loops: usize,
    /// Places where a recording's way breaks: the robot was somewhere else than any sensor tells.
    pub breaks: usize,
    /// Of these, where no loop joins what came before and after: the recorded poses go on there.
    pub breaks_left: usize,
    /// Recordings that keep their recorded poses, because the optimized ones drew a worse map.
    pub not_better: usize,
}

/// Optimizes the poses of recordings.
pub fn optimize(
    all_keyframes: &[Keyframes],
    params: &LoopParams,
    checkpoint: &mut Checkpoint,
    progress: &mut dyn FnMut(Progress),
) -> Optimized {
    let nodes: Vec<Node> =
        all_keyframes.iter().flat_map(|keyframes| keyframes.nodes.iter().cloned()).collect();
    let runs = runs(all_keyframes);
    progress(Progress::Submaps(nodes.len()));
    let of_run = |run: &Range<usize>| odometry_edges::edges(&nodes[run.clone()], run.start, &params.chain);
    let (by_run, wheels): (Vec<Vec<Edge>>, Vec<_>) = runs.iter().map(of_run).unzip();
    let chain = by_run.concat();
    let parts = Parts::new(&runs, &by_run);
    let mut poses = submap_graph::chained(&nodes, &chain);
    let (submaps, part_of) = submap_graph::cut(&nodes, &poses, &parts.nodes, params);
    let coarse = submap_graph::coarse_chain(&submaps, &part_of, &chain);
    let middles = submaps.iter().map(|submap| poses[submap.middle]).collect();
    let mut loop_closer =
        LoopCloser::new(&submaps, &part_of, &coarse, middles, (params.candidate, params.refine));
    let mut hear = |searched, inlier| progress(Progress::Searched(searched, inlier));
    loop_closer.run(checkpoint, &mut hear);
    let part_count = parts.nodes.len();
    loop_closer.join(part_count, checkpoint, &mut hear);
    let loops = loop_closer.inlier_edges(|submap_id| submaps[submap_id].middle);
    submap_graph::spread(&mut poses, &submaps, &part_of, &parts.nodes, &loop_closer.poses);
    let part_groups = loop_closer.groups(part_count);
    let breaks_left = parts.attach(&mut poses, &by_run, &part_groups);
    let all: Vec<Edge> = chain.iter().chain(&loops).copied().collect();
    let structure = pose_graph::structure(poses.len(), &all);
    pose_graph::optimize(&mut poses, &all, &vec![1.0; all.len()], &structure);
    let groups = parts.groups(runs.len(), &part_groups);
    let mut is_closed = closed(&loop_closer, &groups, &parts);
    let leaning = leaning(&by_run, &wheels);
    let joint = (&params.joint, &leaning.concat()[..]);
    refine_frames(frames(&runs, &groups, &is_closed), &nodes, &mut poses, joint, progress);
    let not_better = keep_recorded(&mut is_closed, &groups, |run: usize| {
        map_entropy::is_worse(&nodes[runs[run].clone()], &poses[runs[run].clone()])
    });
    let counts = Counts {
        nodes: nodes.len(),
        submap_count: submaps.len(),
        pairs_searched: loop_closer.searched,
        loops_found: loop_closer.loops.len(),
        loops: loops.len(),
        breaks: parts.breaks(),
        breaks_left,
        not_better,
    };
    let covariances = covariances(frames(&runs, &groups, &is_closed), &nodes, &poses, &chain, &params.joint);
    let of_run = |(run, closed): (&Range<usize>, &bool)| match closed {
        true => poses[run.clone()].to_vec(),
        false => nodes[run.clone()].iter().map(|node| node.recorded).collect(),
    };
    Optimized {
        poses: runs.iter().zip(&is_closed).map(of_run).collect(),
        covariances: runs.iter().map(|run| covariances[run.clone()].to_vec()).collect(),
        groups,
        is_closed,
        odometry: wheels.iter().map(|wheels| Some(wheels.as_ref()?.scale())).collect(),
        wheels,
        breaks: all_keyframes.iter().zip(&by_run).map(|(of, chain)| breaks::first_scans(of, chain)).collect(),
        chain: leaning,
        loops: loops_found(&loop_closer, &submaps),
        counts,
    }
}

/// The steps of each recording as all scans are weighed against them.
fn leaning(by_run: &[Vec<Edge>], wheels: &[Option<WheelCalibration>]) -> Vec<Vec<Edge>> {
    let of = |(chain, wheels): (&Vec<Edge>, &Option<_>)| odometry_edges::leaning(chain, wheels.as_ref());
    by_run.iter().zip(wheels).map(of).collect()
}

/// The last step, in each frame by itself.
fn refine_frames(
    frames: Vec<Vec<usize>>,
    nodes: &[Node],
    poses: &mut [Pose2],
    (params, chain): (&JointParams, &[Edge]),
    progress: &mut dyn FnMut(Progress),
) {
    for members in frames {
        refinement::refine_some(&members, nodes, poses, chain, params, &mut |round| {
            progress(Progress::Joint(round, params.rounds()));
        });
    }
}

/// The covariances of the poses of each frame; none of the others.
fn covariances(
    frames: Vec<Vec<usize>>,
    nodes: &[Node],
    poses: &[Pose2],
    chain: &[Edge],
    params: &JointParams,
) -> Vec<Option<Matrix3<f64>>> {
    let mut covariances = vec![None; nodes.len()];
    for members in frames {
        let found = pose_covariance::of_poses(&members, nodes, poses, chain, params);
        for (node, covariance) in members.into_iter().zip(found.into_iter().flatten()) {
            covariances[node] = Some(covariance);
        }
    }
    covariances
}

/// The poses of all scans of each recording, with the covariances of the nodes: each scan at its own place
/// among what the nodes saw. The first pose of a frame stays, and all others move with it: its scan's own
/// place would turn the whole frame by its noise. Recorded poses that are kept stay as they are.
///
/// # Errors
/// When a recording is damaged.
pub(crate) fn poses_of_scans(
    runs: &[Run],
    all_keyframes: &[Keyframes],
    optimized: &Optimized,
    params: &LoopParams,
) -> Result<Vec<Corrected>, RunError> {
    let moved =
        |run: usize| Corrected::new(&all_keyframes[run], &optimized.poses[run], &optimized.breaks[run]);
    let mut corrected: Vec<Corrected> = (0..runs.len()).map(moved).collect();
    for group in 0..runs.len() {
        let is_member = |run: &usize| optimized.groups[*run] == group && optimized.is_closed[*run];
        let members: Vec<usize> = (0..runs.len()).filter(is_member).collect();
        if members.is_empty() {
            continue;
        }
        let nodes: Vec<&Node> = members.iter().flat_map(|&run| &all_keyframes[run].nodes).collect();
        let poses: Vec<Pose2> = members.iter().flat_map(|&run| optimized.poses[run].clone()).collect();
        let map = FixedMap::new(&nodes, &poses, &params.joint);
        let mut frame = None;
        for run in members {
            let drive = Drive {
                run: &runs[run],
                keyframes: &all_keyframes[run],
                chain: &optimized.chain[run],
                breaks: &optimized.breaks[run],
                wheels: optimized.wheels[run].as_ref(),
                map: &map,
                params: &params.chain,
                longest_m: params.keyframes.longest_m,
            };
            let mut scans = drive.placed(&corrected[run].scans)?;
            let moved = first(&corrected[run].scans).zip(first(&scans));
            let frame = frame.get_or_insert_with(|| moved.map(|(was, now)| was * now.inverse()));
            for pose in scans.iter_mut().flatten() {
                *pose = StampedPose::planar(pose.stamp_ns, frame.unwrap_or_default() * pose.pose());
            }
            corrected[run] = Corrected::of(drive.keyframes, scans);
        }
    }
    let with = |(corrected, (keyframes, of)): (Corrected, (&Keyframes, &Vec<_>))| {
        corrected.with_covariances(keyframes, of)
    };
    Ok(corrected.into_iter().zip(all_keyframes.iter().zip(&optimized.covariances)).map(with).collect())
}

fn first(scans: &[Option<StampedPose>]) -> Option<Pose2> {
    Some(scans.iter().flatten().next()?.pose())
}

/// The nodes of each group of recordings that lie in one frame and have loops.
fn frames(runs: &[Range<usize>], groups: &[usize], is_closed: &[bool]) -> Vec<Vec<usize>> {
    let members = |group: usize| {
        let of_group = runs.iter().zip(groups).filter(|(_, of)| **of == group);
        of_group.flat_map(|(run, _)| run.clone()).collect()
    };
    (0..runs.len()).filter(|&run| groups[run] == run && is_closed[run]).map(members).collect()
}

/// The loops, between nodes.
fn loops_found(loop_closer: &LoopCloser<'_>, submaps: &[Submap]) -> Vec<LoopFound> {
    let of_one = |(found, &inlier): (&Loop, &bool)| LoopFound {
        nodes: found.submap_ids.map(|submap_id| submaps[submap_id].middle),
        pose: found.found.pose,
        information: found.found.information,
        half_m: found.half_m,
        agreement: found.found.agreement,
        inlier,
    };
    loop_closer.loops.iter().zip(&loop_closer.inlier).map(of_one).collect()
}

/// Whether a recording is part of any loop. One without keeps its recorded poses: nothing says where they
/// would be wrong.
fn closed(loop_closer: &LoopCloser<'_>, groups: &[usize], parts: &Parts) -> Vec<bool> {
    let mut closed = vec![false; groups.len()];
    let recording_of = |submap_id: usize| parts.recording_of[loop_closer.recording_of[submap_id]];
    for edge in loop_closer.inlier_edges(recording_of) {
        closed[edge.from] = true;
        closed[edge.to] = true;
    }
    let group_is = |group: usize| groups.iter().zip(&closed).any(|(of, closed)| *of == group && *closed);
    groups.iter().map(|group| group_is(*group)).collect()
}

/// Leaves out recordings whose optimized poses are worse than the recorded ones; those of several that lie in
/// one frame stay together. Returns how many.
fn keep_recorded(is_closed: &mut [bool], groups: &[usize], is_worse: impl Fn(usize) -> bool) -> usize {
    let mut count = 0;
    for run in 0..is_closed.len() {
        let alone = groups.iter().filter(|&&group| group == groups[run]).count() == 1;
        if alone && is_closed[run] && is_worse(run) {
            is_closed[run] = false;
            count += 1;
        }
    }
    count
}

/// The nodes of each recording.
fn runs(all_keyframes: &[Keyframes]) -> Vec<Range<usize>> {
    let mut end = 0;
    all_keyframes
        .iter()
        .map(|keyframes| {
            let start = end;
            end += keyframes.nodes.len();
            start..end
        })
        .collect()
}
