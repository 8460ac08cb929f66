//! Several recordings in one frame: where no way leads from one to another, every place of the one is looked
//! for in the other.
//!
//! Nothing is known of the start, so a window is a whole turn around each submap; a place found so is
//! believed only when two more, of other submaps, agree with it over the ways that both recordings drove
//! between them.

use biplane_matcher::{Pose2, Window};

use super::loop_closure::checkpoint::Checkpoint;
use crate::slam::loop_closure::candidate::{LoopCloser, Pair};
use crate::slam::pose_graph::Edge;

/// Of all submaps every so many-th is looked for: they overlap by half, so every place is still in one of
/// them.
const EVERY: usize = 2;
/// So many other loops have to agree with the one that joins two recordings: chance puts two in one place,
/// hardly ever three.
const MIN_SUPPORT: usize = 2;

/// Which recordings came together: for each the number of the first one that it is joined to (itself when it
/// is alone).
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

impl LoopCloser<'_> {
    /// Which recordings the believed loops join.
    pub(crate) fn groups(&self, recordings: usize) -> Vec<usize> {
        let inlier = self.loops.iter().zip(&self.inlier).filter(|(_, inlier)| **inlier);
        groups(
            recordings,
            inlier.map(|(found, _)| found.submap_ids.map(|submap_id| self.recording_of[submap_id])),
        )
    }

    /// Where nothing is known of two recordings: every second submap of one against every second one of the
    /// other, all around. Whether any came together.
    pub(crate) fn join(
        &mut self,
        recordings: usize,
        checkpoint: &mut Checkpoint,
        progress: &mut dyn FnMut(usize, usize),
    ) -> bool {
        let groups = self.groups(recordings);
        let group_of = |submap_id: usize| groups[self.recording_of[submap_id]];
        let window = Window { half_m: self.params.near_m, half_rad: std::f64::consts::PI };
        let mut pairs = Vec::new();
        for query in (0..self.submaps.len()).step_by(EVERY) {
            for other in (0..query).step_by(EVERY) {
                if group_of(query) != group_of(other) && !self.tried.contains_key(&[other, query]) {
                    pairs.push(Pair {
                        submap_ids: [other, query],
                        guess: Pose2::IDENTITY,
                        window,
                        uncertainty_m: f64::INFINITY,
                    });
                }
            }
        }
        self.search(&pairs, checkpoint, progress);
        self.find_supporting(checkpoint, progress);
        let edges = self.edges();
        let apart = |edge: &Edge| group_of(edge.from) != group_of(edge.to);
        let support = self.support(&edges, |at| apart(&edges[at]));
        let joins = |at: &usize| {
            apart(&edges[*at])
                && support[*at].len() >= MIN_SUPPORT
                && self.refine.constrains_along(&self.loops[*at].found.agreement)
        };
        let best = (0..edges.len()).filter(joins).max_by(|&a, &b| {
            (support[a].len(), self.loops[a].found.agreement.share)
                .partial_cmp(&(support[b].len(), self.loops[b].found.agreement.share))
                .unwrap_or(std::cmp::Ordering::Equal)
        });
        let Some(best) = best else { return false };
        let edge = edges[best];
        let moved = self.poses[edge.from] * edge.measured * self.poses[edge.to].inverse();
        let joining = group_of(edge.to);
        for (submap_id, pose) in self.poses.iter_mut().enumerate() {
            if groups[self.recording_of[submap_id]] == joining {
                *pose = moved * *pose;
            }
        }
        self.select_inliers();
        self.groups(recordings) != groups
    }
}

#[cfg(test)]
mod tests {
    use super::groups;

    #[test]
    fn recordings_come_together_over_others() {
        assert_eq!(groups(5, [[1, 3], [4, 3]].into_iter()), [0, 1, 2, 1, 1]);
        assert_eq!(groups(3, [].into_iter()), [0, 1, 2]);
        assert_eq!(groups(3, [[2, 1], [1, 0]].into_iter()), [0, 0, 0]);
    }
}
