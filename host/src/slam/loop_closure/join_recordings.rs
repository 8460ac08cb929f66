//! Several recordings in one frame: where no way leads from one to another, every place of the one is looked
//! for in the other.
//!
//! Nothing is known of the start, so a window is a whole turn around each submap; a place found so is
//! believed only when two more, of other submaps, agree with it over the ways that both recordings drove
//! between them.

use biplane_matcher::{Pose2, Window};

use super::checkpoint::Checkpoint;
use crate::slam::loop_closure::candidate::{LoopCloser, Pair};
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
                guess: Pose2::IDENTITY,
                window,
                uncertainty_m: f64::INFINITY,
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
