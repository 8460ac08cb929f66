//! Several recordings in one frame: where no way leads from one to another, every place of the one is looked
//! for in the other.
//!
//! Nothing is known of the start, so a window is a whole turn around each submap; a place found so is
//! believed only when two more, of other submaps, agree with it over the ways that both recordings drove
//! between them.

use biplane_matcher::{Pose2, Window};

use super::checkpoint::Checkpoint;
use crate::slam::loop_closure::candidate::{LoopCloser, Pair};
use crate::slam::loop_closure::search_region::SearchRegion;
use crate::slam::pose_graph::Edge;
use crate::slam::pose_graph::breaks::groups;

/// Of all submaps every so many-th is looked for: they overlap by half, so every place is still in one of
/// them.
const EVERY: usize = 2;
/// So many other loops have to agree with the one that joins two recordings: chance puts two in one place,
/// hardly ever three.
const MIN_SUPPORT: usize = 2;
/// With so many a recording is looked for nowhere else. With fewer the best place in all recordings counts:
/// rooms may be alike.
const SURE_SUPPORT: usize = 6;
/// Nor may the same submap lie elsewhere with more than this share of the support: a building may have
/// corridors alike.
const RIVAL_SHARE: f64 = 0.5;

impl LoopCloser<'_> {
    /// Which recordings the believed loops join.
    pub(crate) fn groups(&self, recordings: usize) -> Vec<usize> {
        let inlier = self.loops.iter().zip(&self.inlier).filter(|(_, inlier)| **inlier);
        groups(
            recordings,
            inlier.map(|(found, _)| found.submap_ids.map(|submap_id| self.recording_of[submap_id])),
        )
    }

    /// Brings together two recordings of which nothing is known of each other; whether any came together.
    ///
    /// Each recording is looked for in those before it, one after the other, until it is surely found in one:
    /// to look for all in all costs the square of their number.
    pub(crate) fn join(
        &mut self,
        recordings: usize,
        checkpoint: &mut Checkpoint,
        progress: &mut dyn FnMut(usize, usize),
    ) -> bool {
        // What was found before may be enough, now that others have come together.
        if self.join_found(recordings, SURE_SUPPORT) {
            return true;
        }
        for later in 1..recordings {
            for earlier in 0..later {
                let groups = self.groups(recordings);
                let is_apart = groups[earlier] != groups[later];
                if is_apart && self.look_for([earlier, later], recordings, checkpoint, progress) {
                    return true;
                }
            }
            if self.join_found(recordings, MIN_SUPPORT) {
                return true;
            }
        }
        false
    }

    /// Searches every second submap of one recording in every second one of another, all around, one after
    /// the other until it is surely found; whether it was.
    fn look_for(
        &mut self,
        [earlier, later]: [usize; 2],
        recordings: usize,
        checkpoint: &mut Checkpoint,
        progress: &mut dyn FnMut(usize, usize),
    ) -> bool {
        let window = Window { half_m: self.params.near_m, half_rad: std::f64::consts::PI };
        let (count, recording_of) = (self.submaps.len(), self.recording_of);
        let of = |recording: usize| {
            (0..count).step_by(EVERY).filter(move |submap_id| recording_of[*submap_id] == recording)
        };
        for query in of(later) {
            let asked = of(earlier).filter(|other| !self.tried.contains_key(&[*other, query]));
            let pair = |other: usize| Pair {
                submap_ids: [other, query],
                region: SearchRegion::square(Pose2::IDENTITY, window, f64::INFINITY),
            };
            let pairs: Vec<Pair> = asked.map(pair).collect();
            if pairs.is_empty() {
                continue;
            }
            self.search(&pairs, checkpoint, progress);
            self.find_supporting(checkpoint, progress);
            if self.join_found(recordings, SURE_SUPPORT) {
                return true;
            }
        }
        false
    }

    /// Puts two groups of recordings together over the best of the loops between any; whether there is one
    /// that enough others agree with.
    fn join_found(&mut self, recordings: usize, min_support: usize) -> bool {
        let groups = self.groups(recordings);
        let group_of = |submap_id: usize| groups[self.recording_of[submap_id]];
        let edges = self.edges();
        let apart = |edge: &Edge| group_of(edge.from) != group_of(edge.to);
        let support = self.support(&edges, |at| apart(&edges[at]));
        let joins = |at: &usize| {
            apart(&edges[*at])
                && support[*at].len() >= min_support
                && self.loops[*at].constrains_along(&self.refine)
        };
        let best = (0..edges.len()).filter(joins).max_by(|&a, &b| {
            (support[a].len(), self.loops[a].found.agreement.share)
                .partial_cmp(&(support[b].len(), self.loops[b].found.agreement.share))
                .unwrap_or(std::cmp::Ordering::Equal)
        });
        let Some(best) = best else { return false };
        let is_sure = min_support >= SURE_SUPPORT;
        if is_sure && has_rival(best, &edges, &self.poses, &support, self.params.near_m) {
            return false;
        }
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

/// Whether the submap that a loop finds was found elsewhere too, nearly as well. `poses` are those of the
/// submaps, `support` names the edges that agree with each.
fn has_rival(best: usize, edges: &[Edge], poses: &[Pose2], support: &[Vec<usize>], near_m: f64) -> bool {
    let place = |edge: &Edge| poses[edge.from] * edge.measured;
    let enough = RIVAL_SHARE * support[best].len() as f64;
    (0..edges.len()).any(|at| {
        edges[at].to == edges[best].to
            && support[at].len() as f64 > enough
            && place(&edges[at]).between(&place(&edges[best])).distance_m() > near_m
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Matrix3;

    #[test]
    fn a_submap_that_lies_elsewhere_nearly_as_well_is_not_surely_found() {
        let edge = |from, to| Edge { from, to, measured: Pose2::IDENTITY, information: Matrix3::identity() };
        let edges = [edge(0, 9), edge(1, 9), edge(2, 9), edge(3, 8)];
        let poses = [0.0, 1.0, 20.0, 20.0].map(|x_m| Pose2::new(x_m, 0.0, 0.0));
        let with = |rival: usize| [vec![1; 8], vec![0; 8], vec![0; rival], vec![0; 8]];
        assert!(has_rival(0, &edges, &poses, &with(5), 7.0), "20 m away by five");
        assert!(!has_rival(0, &edges, &poses, &with(4), 7.0), "by half of the support");
        assert!(!has_rival(0, &edges, &poses, &with(5), 30.0), "near");
        assert!(!has_rival(3, &edges, &poses, &with(5), 7.0), "of another submap");
    }
}
