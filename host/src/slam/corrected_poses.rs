//! From the poses of nodes back to every scan, and to any time between.
//!
//! Between two nodes a scan keeps the place among them that was recorded: it moves with both, with the nearer
//! one more.

use std::collections::{BTreeMap, VecDeque};

use biplane_matcher::Pose2;
use nalgebra::Matrix3;

use crate::recordings::deskew::{StampedPose, Trajectory};
use crate::slam::keyframes::{Keyframes, Node};
use crate::slam::pose_graph::breaks;
use crate::slam::refinement::spatial::choice::Refined;

/// Recorded and optimized poses of the scans of one recording.
#[derive(Clone, Debug, Default)]
pub struct Corrected {
    /// The optimized pose of each horizontal scan, in file order.
    pub scans: Vec<Option<StampedPose>>,
    by_stamp: BTreeMap<i64, Vec<usize>>,
    /// Recorded and optimized, in the order of time.
    in_time: Vec<(StampedPose, StampedPose)>,
    /// Covariances of nodes' poses, in the order of time; empty where they are not known.
    covariances: Vec<(i64, Matrix3<f64>)>,
    /// The poses refined in all six directions, where that explains the beams better.
    pub(crate) refined: Option<Refined>,
}

impl Corrected {
    /// Moves the scans of a trail with its nodes. Before the scans of `breaks`, ascending numbers, the way
    /// breaks: they move with the next node alone, and those before them with the last one.
    pub fn new(keyframes: &Keyframes, nodes: &[Pose2], breaks: &[usize]) -> Self {
        let mut scans = Vec::with_capacity(keyframes.scans.len());
        let mut before = 0;
        for (number, recorded) in keyframes.scans.iter().enumerate() {
            while before + 1 < nodes.len() && keyframes.nodes[before + 1].scan <= number {
                before += 1;
            }
            let broken = keyframes
                .nodes
                .get(before + 1)
                .and_then(|next| breaks::between(breaks, [keyframes.nodes[before].scan, next.scan]));
            scans.push(recorded.map(|recorded| {
                let pose = match broken {
                    Some(first) => beside(keyframes, nodes, before + usize::from(number >= first), &recorded),
                    None => between(keyframes, nodes, before, &recorded.pose()),
                };
                StampedPose::planar(recorded.stamp_ns, pose)
            }));
        }
        Self::of(keyframes, scans)
    }

    /// With these poses of the scans.
    pub(crate) fn of(keyframes: &Keyframes, scans: Vec<Option<StampedPose>>) -> Self {
        let mut by_stamp: BTreeMap<i64, Vec<usize>> = BTreeMap::new();
        for (number, pose) in scans.iter().enumerate().filter_map(|(number, pose)| Some((number, (*pose)?))) {
            by_stamp.entry(pose.stamp_ns).or_default().push(number);
        }
        let mut in_time: Vec<(StampedPose, StampedPose)> =
            keyframes.scans.iter().zip(&scans).filter_map(|(old, new)| Some(((*old)?, (*new)?))).collect();
        in_time.sort_by_key(|(old, _)| old.stamp_ns);
        in_time.dedup_by_key(|(old, _)| old.stamp_ns);
        Self { scans, by_stamp, in_time, covariances: Vec::new(), refined: None }
    }

    /// Adds the covariances of the nodes' poses.
    #[must_use]
    pub fn with_covariances(mut self, keyframes: &Keyframes, covariances: &[Option<Matrix3<f64>>]) -> Self {
        let stamped = |(node, covariance): (&Node, &Option<Matrix3<f64>>)| {
            Some((keyframes.scans[node.scan]?.stamp_ns, (*covariance)?))
        };
        self.covariances = keyframes.nodes.iter().zip(covariances).filter_map(stamped).collect();
        self.covariances.sort_by_key(|(stamp_ns, _)| *stamp_ns);
        self
    }

    /// The covariance of x, y (m) and theta (rad) of the optimized pose at a time, in the axes of `map`;
    /// linear between nodes.
    pub fn covariance_at(&self, stamp_ns: i64) -> Option<Matrix3<f64>> {
        let after = self.covariances.partition_point(|(at_ns, _)| *at_ns < stamp_ns);
        let (next, before) =
            (self.covariances.get(after), after.checked_sub(1).map(|at| &self.covariances[at]));
        match (before, next) {
            (Some((from_ns, from)), Some((to_ns, to))) => {
                let share = (stamp_ns - from_ns) as f64 / (to_ns - from_ns) as f64;
                Some(from * (1.0 - share) + to * share)
            }
            (Some((_, only)), None) | (None, Some((_, only))) => Some(*only),
            (None, None) => None,
        }
    }

    /// The optimized pose for one that was recorded at a time between two scans.
    pub fn at(&self, recorded: &StampedPose) -> Pose2 {
        let after = self.in_time.partition_point(|(old, _)| old.stamp_ns < recorded.stamp_ns);
        let moved =
            |(old, new): &(StampedPose, StampedPose)| new.pose() * old.pose().between(&recorded.pose());
        let (before, next) =
            (after.checked_sub(1).and_then(|at| self.in_time.get(at)), self.in_time.get(after));
        match (before, next) {
            (Some(one), Some(other)) => {
                let whole = (other.0.stamp_ns - one.0.stamp_ns) as f64;
                let share = (recorded.stamp_ns - one.0.stamp_ns) as f64 / whole;
                moved(one).interpolate(&moved(other), share)
            }
            (Some(only), None) | (None, Some(only)) => moved(only),
            (None, None) => recorded.pose(),
        }
    }

    /// All optimized poses, in the plane: those of the scans, and of others that were recorded between them.
    pub(crate) fn trajectory(&self, between: &[StampedPose]) -> Trajectory {
        let mut poses: Vec<StampedPose> = self.scans.iter().flatten().copied().collect();
        poses.extend(between.iter().map(|pose| StampedPose::planar(pose.stamp_ns, self.at(pose))));
        Trajectory::new(poses)
    }

    /// Finds scans by their stamps, each once.
    pub fn by_stamps(&self) -> ByStamps<'_> {
        let numbers =
            self.by_stamp.iter().map(|(stamp, numbers)| (*stamp, numbers.iter().copied().collect()));
        ByStamps { corrected: self, numbers: numbers.collect() }
    }
}

/// See [`Corrected::by_stamps`].
#[derive(Clone, Debug)]
pub struct ByStamps<'a> {
    corrected: &'a Corrected,
    numbers: BTreeMap<i64, VecDeque<usize>>,
}

impl ByStamps<'_> {
    /// The optimized pose of the next scan with this stamp; of none, for the recorded one's own time.
    pub fn next(&mut self, recorded: &StampedPose) -> Pose2 {
        let scan = match self.numbers.get_mut(&recorded.stamp_ns) {
            Some(numbers) if numbers.len() > 1 => numbers.pop_front(),
            Some(numbers) => numbers.front().copied(),
            None => None,
        };
        let known = scan.and_then(|scan| self.corrected.scans[scan]);
        known.map_or_else(|| self.corrected.at(recorded), |pose| pose.pose())
    }
}

/// The pose of a scan that moves with one node alone.
fn beside(keyframes: &Keyframes, nodes: &[Pose2], at: usize, recorded: &StampedPose) -> Pose2 {
    nodes[at] * keyframes.nodes[at].recorded.between(&recorded.pose())
}

fn between(keyframes: &Keyframes, nodes: &[Pose2], before: usize, recorded: &Pose2) -> Pose2 {
    let away = |at: usize| keyframes.nodes[at].recorded.between(recorded);
    let length = |way: &Pose2| way.distance_m() + way.theta_rad.abs();
    let Some(first) = nodes.get(before) else { return *recorded };
    let one = away(before);
    let Some(next) = nodes.get(before + 1) else { return *first * one };
    let other = away(before + 1);
    let whole = length(&one) + length(&other);
    let share = if whole > 0.0 { length(&one) / whole } else { 0.0 };
    (*first * one).interpolate(&(*next * other), share)
}

#[cfg(test)]
mod tests {
    use nalgebra::Matrix3;

    use super::Corrected;

    #[test]
    fn a_covariance_between_two_nodes_is_between_theirs_and_beyond_them_that_of_the_last() {
        let covariances = [(10, 1.0), (20, 3.0)].map(|(at, value)| (at, Matrix3::identity() * value));
        let corrected = Corrected { covariances: covariances.to_vec(), ..Corrected::default() };
        let at = |stamp_ns| corrected.covariance_at(stamp_ns).unwrap()[(0, 0)];
        assert_eq!([5, 10, 15, 20, 25].map(at), [1.0, 1.0, 2.0, 3.0, 3.0]);
        assert!(Corrected::default().covariance_at(15).is_none());
    }
}
