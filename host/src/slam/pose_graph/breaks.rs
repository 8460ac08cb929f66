//! Breaks: steps that no sensor tells. The robot was carried, its laser was covered while it drove, or the
//! matcher lost its way, and what the scan shows next lies nowhere among what was seen before.
//!
//! Such a step says nothing of where the way goes on. The way falls into parts, which are looked for in each
//! other like recordings of their own ([`crate::slam::loop_closure::join_recordings`]). A part that is found
//! nowhere goes on where it was recorded.

use std::ops::Range;

use biplane_matcher::Pose2;
use nalgebra::Matrix3;

use crate::slam::keyframes::{Keyframes, Node};
use crate::slam::pose_graph::Edge;

/// A scan of which less is explained by the last ones was taken somewhere else. Larger: people in front of
/// the laser break the way (they leave 0.38 and more), and so do ramps (0.31 and more); smaller: places that
/// look alike hide a break.
const STRANGE_SHARE: f64 = 0.3;
/// The same of the first scan after a gap, in which the robot may have been carried.
const STRANGE_SHARE_AFTER_GAP: f64 = 0.5;
/// The same where the recorded step over the gap is not the odometry's: then the matcher has looked for the
/// place that explains most. Carried along a corridor it found 0.5 to 0.6; where it agrees with the odometry
/// it is 0.6 and more.
const STRANGE_SHARE_OFF_ODOMETRY: f64 = 0.7;
/// So far apart two steps are not the same, meters and radians.
const SAME_STEP_M: f64 = 0.25;
const SAME_STEP_RAD: f64 = 0.25;
/// So many nodes behind a strange one must be no better explained by those before it. Fewer: somebody who
/// stands in front of the laser for a meter of way breaks it; more: a short visit of another place is missed.
pub(crate) const NEXT_NODES: usize = 4;
/// After a longer step much is new, meters.
const LONGEST_M: f64 = 2.0;
/// A scan that has turned by more than this share of half a turn looks elsewhere, and so much less is asked
/// of it.
const TURN_SHARE: f64 = 0.3;
/// A scan with fewer end points says nothing: outdoors a scan of 20 that hit trees and posts may be new.
const MIN_POINTS: usize = 40;
/// What an edge across a break tells, 1/m^2 and 1/rad^2: nothing, but the parts stay in one system.
const NOTHING: f64 = 1e-6;

/// The share of a node that the scans before it explain at least, when it shows the same place; by its steps
/// as recorded and by odometry.
pub(crate) fn min_share(node: &Node, recorded: &Pose2, odometry: Option<&Pose2>) -> f64 {
    let is_other_step = |odometry: &Pose2| {
        let off = odometry.between(recorded);
        off.distance_m() > SAME_STEP_M || off.theta_rad.abs() > SAME_STEP_RAD
    };
    match node.after_gap {
        false => STRANGE_SHARE,
        true if odometry.is_some_and(is_other_step) => STRANGE_SHARE_OFF_ODOMETRY,
        true => STRANGE_SHARE_AFTER_GAP,
    }
}

/// Whether a node shows another place than the scans before it, which explain this share of it, after a step
/// like this; at least `min_share` of it when nothing has turned away.
pub(crate) fn is_strange(node: &Node, explained_share: f64, step: &Pose2, min_share: f64) -> bool {
    let turn_share = step.theta_rad.abs() / std::f64::consts::PI;
    let seen_again = (1.0 + TURN_SHARE - turn_share).min(1.0);
    node.keyframe_scan.points.len() >= MIN_POINTS && explained_share < min_share * seen_again
}

/// Whether a step is short enough for the scan after it to see what was seen before.
pub(crate) fn sees_again(step: &Pose2) -> bool {
    step.distance_m() <= LONGEST_M
}

/// The edge across a break.
pub(crate) fn broken(edge: &Edge) -> Edge {
    Edge { information: Matrix3::identity() * NOTHING, ..*edge }
}

/// Whether an edge is one across a break.
pub(crate) fn is_broken(edge: &Edge) -> bool {
    edge.information == broken(edge).information
}

/// The numbers of the scans before which the way of a recording breaks, ascending: between the nodes of a
/// broken edge, behind the longest pause.
pub(crate) fn first_scans(keyframes: &Keyframes, chain: &[Edge]) -> Vec<usize> {
    let stamp_ns = |scan: usize| Some(keyframes.scans.get(scan)?.as_ref()?.stamp_ns);
    let behind_pause = |(before, _): (usize, &Edge)| {
        let [last, next] = [before, before + 1].map(|node| keyframes.nodes[node].scan);
        let posed: Vec<(usize, i64)> =
            (last..=next).filter_map(|scan| Some((scan, stamp_ns(scan)?))).collect();
        let pauses = posed.windows(2).map(|pair| (pair[1].1 - pair[0].1, pair[1].0));
        pauses.max().map_or(next, |(_, scan)| scan)
    };
    chain.iter().enumerate().filter(|(_, edge)| is_broken(edge)).map(behind_pause).collect()
}

/// Of the scans before which the way breaks, ascending, the one behind a scan and up to a later one.
pub(crate) fn between(breaks: &[usize], [before, now]: [usize; 2]) -> Option<usize> {
    let next = breaks.get(breaks.partition_point(|first| *first <= before));
    next.copied().filter(|first| *first <= now)
}

/// Which recordings or parts came together: for each the number of the first one that it is joined to (itself
/// when it is alone).
pub(crate) fn groups(recordings: usize, pairs: impl Iterator<Item = [usize; 2]>) -> Vec<usize> {
    let mut group: Vec<usize> = (0..recordings).collect();
    for [one, other] in pairs {
        let (low, high) = (group[one].min(group[other]), group[one].max(group[other]));
        for entry in &mut group {
            if *entry == high {
                *entry = low;
            }
        }
    }
    group
}

/// The parts of recordings between breaks.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Parts {
    /// The nodes of each, ascending.
    pub nodes: Vec<Range<usize>>,
    /// The recording of each.
    pub recording_of: Vec<usize>,
}

impl Parts {
    /// Cuts recordings, of these nodes each, at the breaks in their chains.
    pub(crate) fn new(runs: &[Range<usize>], chains: &[Vec<Edge>]) -> Self {
        let (mut nodes, mut recording_of) = (Vec::new(), Vec::new());
        for (recording, (run, chain)) in runs.iter().zip(chains).enumerate() {
            let mut start = run.start;
            for edge in chain.iter().filter(|edge| is_broken(edge)) {
                nodes.push(start..edge.to);
                recording_of.push(recording);
                start = edge.to;
            }
            nodes.push(start..run.end);
            recording_of.push(recording);
        }
        Self { nodes, recording_of }
    }

    /// How many breaks there are.
    pub(crate) fn breaks(&self) -> usize {
        self.recording_of.windows(2).filter(|pair| pair[0] == pair[1]).count()
    }

    /// For each of `recordings` the first one that it is joined to, when parts are joined like this.
    pub(crate) fn groups(&self, recordings: usize, groups: &[usize]) -> Vec<usize> {
        let pairs = self.recording_of.iter().zip(groups).map(|(of, first)| [*of, self.recording_of[*first]]);
        self::groups(recordings, pairs)
    }

    /// Lets parts that were found in no other one go on where they were recorded, and those that are joined
    /// to them move along. Returns how many breaks that leaves.
    pub(crate) fn attach(&self, poses: &mut [Pose2], chains: &[Vec<Edge>], groups: &[usize]) -> usize {
        let part_of = |node: usize| self.nodes.partition_point(|nodes| nodes.end <= node);
        let mut frames = groups.to_vec();
        let mut left = 0;
        for edge in chains.iter().flatten().filter(|edge| is_broken(edge)) {
            let [from, to] = [edge.from, edge.to].map(|node| frames[part_of(node)]);
            if from == to {
                continue;
            }
            left += 1;
            let (stays, moves, moved) = match from < to {
                true => (from, to, poses[edge.from] * edge.measured * poses[edge.to].inverse()),
                false => (to, from, poses[edge.to] * edge.measured.inverse() * poses[edge.from].inverse()),
            };
            for (nodes, frame) in self.nodes.iter().zip(&mut frames).filter(|(_, frame)| **frame == moves) {
                *frame = stays;
                poses[nodes.clone()].iter_mut().for_each(|pose| *pose = moved * *pose);
            }
        }
        left
    }
}

#[cfg(test)]
mod tests {
    use biplane_matcher::{EndPoint, Pose2};
    use nalgebra::Matrix3;

    use super::{Parts, broken, first_scans, groups, is_strange, min_share};
    use crate::recordings::deskew::StampedPose;
    use crate::slam::keyframes::keyframe_scan::KeyframeScan;
    use crate::slam::keyframes::{Keyframes, Node};
    use crate::slam::pose_graph::Edge;

    /// A chain of nodes 1 m apart, broken before these nodes.
    fn chain(nodes: std::ops::Range<usize>, broken_before: &[usize]) -> Vec<Edge> {
        let edge = |from: usize| {
            let to = from + 1;
            let measured = Pose2::new(1.0, 0.0, 0.0);
            let edge = Edge { from, to, measured, information: Matrix3::identity() };
            if broken_before.contains(&to) { broken(&edge) } else { edge }
        };
        nodes.clone().zip(nodes.skip(1)).map(|(from, _)| edge(from)).collect()
    }

    #[test]
    fn recordings_come_together_over_others() {
        assert_eq!(groups(5, [[1, 3], [4, 3]].into_iter()), [0, 1, 2, 1, 1]);
        assert_eq!(groups(3, [].into_iter()), [0, 1, 2]);
        assert_eq!(groups(3, [[2, 1], [1, 0]].into_iter()), [0, 0, 0]);
    }

    #[test]
    fn recordings_are_cut_where_the_way_breaks() {
        let parts = Parts::new(&[0..5, 5..9], &[chain(0..5, &[2, 4]), chain(5..9, &[])]);
        assert_eq!(parts.nodes, [0..2, 2..4, 4..5, 5..9]);
        assert_eq!((parts.recording_of.clone(), parts.breaks()), (vec![0, 0, 0, 1], 2));
        assert_eq!(parts.groups(2, &[0, 1, 2, 3]), [0, 1]);
        assert_eq!(parts.groups(2, &[0, 1, 2, 2]), [0, 0]);
    }

    #[test]
    fn what_no_loop_joins_goes_on_where_it_was_recorded_and_takes_along_what_is_joined_to_it() {
        let chains = [chain(0..6, &[2, 4]), chain(6..8, &[])];
        let parts = Parts::new(&[0..6, 6..8], &chains);
        let along = |x_m: f64| Pose2::new(x_m, 0.0, 0.0);
        // The second part was found nowhere, the third one in the first, and the other recording in the
        // second part.
        let start = [0.0, 1.0, 70.0, 71.0, 4.5, 5.5, 80.0, 81.0];
        let mut poses = start.map(along);
        assert_eq!(parts.attach(&mut poses, &chains, &[0, 1, 0, 1]), 1);
        assert_eq!(poses, [0.0, 1.0, 2.0, 3.0, 4.5, 5.5, 12.0, 13.0].map(along));
        let mut poses = start.map(along);
        assert_eq!(parts.attach(&mut poses, &chains, &[0, 0, 0, 0]), 0);
        assert_eq!(poses, start.map(along), "what loops join stays");
    }

    #[test]
    fn the_way_breaks_behind_the_longest_pause_between_two_nodes() {
        let scan = |stamp_s: i64| Some(StampedPose::planar(stamp_s * 1_000_000_000, Pose2::IDENTITY));
        let node = |scan: usize| {
            let keyframe_scan = KeyframeScan { points: Vec::new(), laser_m: [0.0; 2] };
            Node { scan, ..Node::at(Pose2::IDENTITY, keyframe_scan) }
        };
        let keyframes = Keyframes {
            nodes: [0, 4].map(node).to_vec(),
            scans: [0, 1, 20, 21, 22].map(scan).to_vec(),
            odometry: Vec::new(),
        };
        assert_eq!(first_scans(&keyframes, &chain(0..2, &[1])), [2]);
        assert_eq!(first_scans(&keyframes, &chain(0..2, &[])), [0; 0]);
    }

    #[test]
    fn a_scan_is_strange_when_little_of_it_is_explained_unless_it_is_small_or_has_turned() {
        let node = |points: usize, after_gap: bool| {
            let keyframe_scan = KeyframeScan { points: vec![EndPoint::default(); points], laser_m: [0.0; 2] };
            Node { after_gap, ..Node::at(Pose2::IDENTITY, keyframe_scan) }
        };
        let turned = |turn_rad: f64| Pose2::new(0.3, 0.0, turn_rad);
        let strange = |node: &Node, share: f64, step: Pose2, odometry: Option<Pose2>| {
            is_strange(node, share, &step, min_share(node, &step, odometry.as_ref()))
        };
        assert!(strange(&node(180, false), 0.2, turned(0.3), None));
        assert!(!strange(&node(180, false), 0.4, turned(0.3), None));
        assert!(strange(&node(180, true), 0.4, turned(0.3), None), "it may have been carried");
        assert!(!strange(&node(180, true), 0.6, turned(0.3), Some(turned(0.2))));
        assert!(strange(&node(180, true), 0.6, turned(0.3), Some(turned(0.0))), "and was matched elsewhere");
        assert!(!strange(&node(180, false), 0.6, turned(0.3), Some(turned(0.0))), "without a gap");
        assert!(!strange(&node(20, false), 0.2, turned(0.3), None));
        assert!(!strange(&node(180, false), 0.2, turned(2.5), None), "it looks elsewhere");
    }
}
