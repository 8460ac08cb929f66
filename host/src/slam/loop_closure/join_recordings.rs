//! Several recordings in one frame: where no way leads from one to another, every place of the one is looked
//! for in the other.
//!
//! Nothing is known of the start, so a window is a whole turn around each submap; a place found so is
//! believed only when two more, of other submaps, agree with it over the ways that both recordings drove
//! between them. Where corridors are alike, many false places are found so. The one that joins two recordings
//! says where all others lie, and those that lie elsewhere are refused. Then the two have to agree where both
//! were ([`super::overlap`]).

use std::collections::BTreeMap;
use std::ops::ControlFlow;

use biplane_matcher::{Pose2, Window};
use rayon::prelude::*;

use super::checkpoint::Checkpoint;
use crate::slam::loop_closure::candidate::{LoopCloser, Pair, sigma_m};
use crate::slam::loop_closure::search_region::SearchRegion;
use crate::slam::pose_graph::Edge;
use crate::slam::pose_graph::breaks::groups;
use crate::slam::pose_graph::relative_covariance::PathCovariances;

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
/// So many places of one recording in another one are refused; then no other is tried. More: of many false
/// places one passes by chance.
const MAX_REFUSED: usize = 3;

/// What goes with a search: what was found before, and who hears of it.
struct Search<'a> {
    recordings: usize,
    checkpoint: &'a mut Checkpoint,
    progress: &'a mut dyn FnMut(usize, usize),
    refused: Refused,
}

/// So many places were refused of each two recordings.
#[derive(Default)]
struct Refused(BTreeMap<[usize; 2], usize>);

impl Refused {
    fn add(&mut self, pair: [usize; 2]) {
        *self.0.entry(pair).or_default() += 1;
    }

    fn are_enough(&self, pair: [usize; 2]) -> bool {
        self.0.get(&pair).is_some_and(|count| *count >= MAX_REFUSED)
    }
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

    /// Brings recordings together of which nothing is known of each other, and closes the loops between them.
    ///
    /// Each recording is looked for in those before it, one after the other, until it is surely found in one:
    /// to look for all in all costs the square of their number.
    pub(crate) fn join(
        &mut self,
        recordings: usize,
        checkpoint: &mut Checkpoint,
        progress: &mut dyn FnMut(usize, usize),
    ) {
        let mut search = Search { recordings, checkpoint, progress, refused: Refused::default() };
        while recordings > 1 && self.join_two(&mut search) {}
    }

    /// Brings together two groups of recordings; whether any came together.
    fn join_two(&mut self, search: &mut Search<'_>) -> bool {
        // What was found before may be enough, now that others have come together.
        if self.join_found(SURE_SUPPORT, search) {
            return true;
        }
        for later in 1..search.recordings {
            for earlier in 0..later {
                let groups = self.groups(search.recordings);
                if groups[earlier] != groups[later] && self.look_for([earlier, later], search) {
                    return true;
                }
            }
            if self.join_found(MIN_SUPPORT, search) {
                return true;
            }
        }
        false
    }

    /// Searches every second submap of one recording in every second one of another, all around, one after
    /// the other until it is surely found; whether it was.
    fn look_for(&mut self, [earlier, later]: [usize; 2], search: &mut Search<'_>) -> bool {
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
            self.search(&pairs, search.checkpoint, search.progress);
            self.find_supporting(search.checkpoint, search.progress);
            if self.join_found(SURE_SUPPORT, search) {
                return true;
            }
            if search.refused.are_enough([earlier, later]) {
                return false;
            }
        }
        false
    }

    /// Puts two groups of recordings together over the best of the loops between any, and closes the loops
    /// between them; whether there is one that enough others agree with, at a place where the two groups
    /// agree. A place where they do not is refused, and the next best is tried.
    fn join_found(&mut self, min_support: usize, search: &mut Search<'_>) -> bool {
        loop {
            let groups = self.groups(search.recordings);
            let group_of = |submap_id: usize| groups[self.recording_of[submap_id]];
            let recordings_of = |edge: &Edge| [edge.from, edge.to].map(|at| self.recording_of[at]);
            let refused = &search.refused;
            let may_join = |edge: &Edge| {
                group_of(edge.from) != group_of(edge.to) && !refused.are_enough(recordings_of(edge))
            };
            let Some(joining) = self.best_joining(may_join, min_support) else { return false };
            let recordings = recordings_of(&joining);
            let pair = [joining.from, joining.to].map(group_of);
            let before = self.clone();
            self.put_together(&joining, &groups, pair);
            if self.groups(search.recordings) == groups {
                *self = before;
                return false;
            }
            self.run(search.checkpoint, search.progress);
            let holds = self.groups(search.recordings) != groups;
            if holds && !self.overlap(|at| groups[self.recording_of[at]], pair).contradicts() {
                return true;
            }
            search.refused.add(recordings);
            self.separate(before);
        }
    }

    /// The best of the loops that may join two groups, with which enough others agree.
    fn best_joining(&self, may_join: impl Fn(&Edge) -> bool + Sync, min_support: usize) -> Option<Edge> {
        let edges = self.edges();
        let support = self.support(&edges, |at| may_join(&edges[at]));
        let joins = |at: &usize| {
            may_join(&edges[*at])
                && !self.refused[*at]
                && support[*at].len() >= min_support
                && self.loops[*at].constrains_along(&self.refine)
        };
        let best = (0..edges.len()).filter(joins).max_by(|&a, &b| {
            (support[a].len(), self.loops[a].found.agreement.share)
                .partial_cmp(&(support[b].len(), self.loops[b].found.agreement.share))
                .unwrap_or(std::cmp::Ordering::Equal)
        })?;
        let is_sure = min_support >= SURE_SUPPORT;
        let may_lie_elsewhere = is_sure && has_rival(best, &edges, &self.poses, &support, self.params.near_m);
        (!may_lie_elsewhere).then_some(edges[best])
    }

    /// Moves the group of a loop's end to where the loop has it.
    fn put_together(&mut self, joining: &Edge, groups: &[usize], pair: [usize; 2]) {
        let moved = self.poses[joining.from] * joining.measured * self.poses[joining.to].inverse();
        for (submap_id, pose) in self.poses.iter_mut().enumerate() {
            if groups[self.recording_of[submap_id]] == pair[1] {
                *pose = moved * *pose;
            }
        }
        self.keep_allowed(joining, groups, pair);
        self.select_inliers();
    }

    /// Of the loops between two groups that were found when nothing was known of these: those that lie where
    /// the one that joins them, and the ways, allow. The others hold other places.
    fn keep_allowed(&mut self, joining: &Edge, groups: &[usize], pair: [usize; 2]) {
        let mut known = self.inlier_edges(|submap_id| submap_id);
        known.push(*joining);
        let path_covariances = PathCovariances::new(self.submaps.len(), self.chain.iter().chain(&known));
        let mut asked: BTreeMap<usize, BTreeMap<usize, usize>> = BTreeMap::new();
        for (at, found) in self.loops.iter().enumerate().filter(|(_, found)| found.half_m.is_infinite()) {
            let [from, to] = found.submap_ids;
            let of = [from, to].map(|submap_id| groups[self.recording_of[submap_id]]);
            if of == pair || of == [pair[1], pair[0]] {
                asked.entry(from).or_default().insert(to, at);
            }
        }
        let allowed = |(from, mut asked): (usize, BTreeMap<usize, usize>)| {
            let mut allowed = Vec::new();
            path_covariances.visit(from, |to, known| {
                let half_m = || self.half_m(sigma_m(&known.covariance), known.path_m, 1.0);
                allowed.extend(asked.remove(&to).map(|at| (at, half_m())));
                if asked.is_empty() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
            });
            allowed
        };
        let allowed: Vec<Vec<(usize, f64)>> = asked.into_par_iter().map(allowed).collect();
        for (at, half_m) in allowed.into_iter().flatten() {
            if self.loops[at].away_m(&self.poses) < half_m {
                self.loops[at].half_m = half_m;
            } else {
                self.refused[at] = true;
                self.tried.remove(&self.loops[at].submap_ids);
            }
        }
        self.list_found_pairs();
    }

    /// Takes two groups apart again, as they were before. The loops that had put them together are refused.
    fn separate(&mut self, before: Self) {
        let joined = std::mem::replace(self, before);
        self.searched = joined.searched;
        for at in 0..self.loops.len() {
            self.refused[at] |= self.loops[at].half_m.is_infinite() && joined.loops[at].half_m.is_finite();
        }
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
    use nalgebra::Matrix3;

    use super::*;
    use crate::slam::loop_closure::params::CandidateParams;
    use crate::slam::loop_closure::perceptual_aliasing::tests::{add_loops, different, twice};
    use crate::slam::loop_closure::verification::RefineParams;
    use crate::slam::pose_graph::tests::chained;

    /// How far the second recording's beginning was really ahead, meters.
    const AHEAD_M: f64 = 2.0;

    #[test]
    fn of_loops_found_all_around_those_stay_that_lie_where_the_one_that_joins_them_has_them() {
        // Two drives along a corridor are two recordings, each in a frame of its own.
        let (submaps, count, mut chain) = twice(&different(), AHEAD_M, 0.4);
        let poses = chained(&chain);
        chain.remove(count - 1);
        let recording_of: Vec<usize> = (0..submaps.len()).map(|at| usize::from(at >= count)).collect();
        let params = (CandidateParams::default(), RefineParams::default());
        let mut closer = LoopCloser::new(&submaps, &recording_of, &chain, poses, params);
        add_loops(&mut closer, (count, count - 1), AHEAD_M, f64::INFINITY);
        // Three more, 14 m off, that agree with each other.
        for at in 0..3 {
            let mut other = closer.loops[at];
            other.submap_ids[0] += 1;
            other.found.pose = other.found.pose * Pose2::new(14.0, 0.0, 0.0);
            closer.loops.push(other);
            closer.refused.push(false);
        }
        let elsewhere = Pose2::new(100.0, 50.0, 1.0);
        closer.poses[count..].iter_mut().for_each(|pose| *pose = elsewhere * *pose);
        closer.join(2, &mut Checkpoint::default(), &mut |_, _| {});
        let begins = closer.poses[0].between(&closer.poses[count]);
        assert!((begins.x_m - AHEAD_M).abs() < 0.1 && begins.y_m.abs() < 0.1, "{begins:?}");
        let (right, wrong) = closer.loops[..count + 2].split_at(count - 1);
        assert!(right.iter().all(|found| found.half_m.is_finite()), "{right:?}");
        assert!(closer.inlier[..count - 1].iter().all(|inlier| *inlier), "{:?}", closer.inlier);
        assert!(wrong.iter().all(|found| found.half_m.is_infinite()));
        assert_eq!(closer.refused[count - 1..count + 2], [true; 3]);
    }

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
