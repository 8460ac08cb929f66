//! Passages that look alike: groups of loops that all hold one false place, the next door or the next pillar,
//! for the length of a corridor.
//!
//! When it is weighed which loops to believe, each of them counts by itself, so together they outweigh the
//! steps. But all of them are one hypothesis. So a group that bends the steps and the other loops by more
//! than one loop may is looked at again: what lies together where all others expect it is searched there. If
//! it is found there, too, the two groups are two hypotheses, one for one, and the poses that fit better
//! decide.

use std::ops::{ControlFlow, Range};

use biplane_geometry::quantile::upper_median;
use biplane_matcher::{Pose2, Window};
use nalgebra::Matrix3;
use rayon::prelude::*;

use super::candidate::{INLIER_WEIGHT, Loop, LoopCloser, Pair};
use crate::slam::loop_closure::agreement::Agreement;
use crate::slam::loop_closure::checkpoint::Checkpoint;
use crate::slam::loop_closure::pairwise_consistency::{CLOSE, OTHER_PLACE_M};
use crate::slam::loop_closure::search_region::SearchRegion;
use crate::slam::loop_closure::verification::{RIVAL_ALONG, RIVAL_SHARE};
use crate::slam::pose_graph::graduated_non_convexity::{self, MAX_LOOP_SQUARED};
use crate::slam::pose_graph::relative_covariance::PathCovariances;
use crate::slam::pose_graph::{self, Edge};

/// Loops of a group lie within so many submaps of its first one along both ways (4 m each). More: a false
/// group is taken together with true ones; fewer: what is left of a false group holds it.
const PASSAGE_SUBMAPS: usize = 16;
/// So many submaps before and after those of a group are looked at, too: where they lie together has moved.
const BEYOND: usize = 3;
/// So many loops that tell where along a corridor one is have to be found where the others expect them.
/// Fewer: chance suffices.
const MIN_ELSEWHERE: usize = 3;
/// What is believed is taken to be bent by this share at least of what steps and loops allow. Smaller: more
/// groups are looked at. In 50 drives through large buildings it was 0.01 to 0.06, and 0.17 in one with false
/// loops: each loop has a floor that hardly any of them needs.
const MIN_BENT: f64 = 0.125;
/// Groups that are looked at in a round at most, the worst first.
const MAX_SUSPECTS: usize = 8;

/// A group of loops that bends the rest.
struct Suspect {
    /// Which loops, ascending.
    group: Vec<usize>,
    /// By how much the rest fits worse with it, as a squared Mahalanobis distance.
    cost: f64,
    /// The poses by all others.
    expected: Vec<Pose2>,
}

impl LoopCloser<'_> {
    /// Looks for another place of groups that bend the rest; whether one is believed no more.
    pub(crate) fn refuse_aliased(
        &mut self,
        checkpoint: &mut Checkpoint,
        progress: &mut dyn FnMut(usize, usize),
    ) -> bool {
        for suspect in self.suspects() {
            let pairs = self.elsewhere(&suspect);
            let before = self.loops.len();
            self.search(&pairs, checkpoint, progress);
            if self.agrees_as_well(&suspect.group, before) && self.is_aliased(&suspect, before) {
                return true;
            }
            self.loops.truncate(before);
            self.refused.truncate(before);
            self.list_found_pairs();
        }
        false
    }

    /// The groups of believed loops that bend the rest by more than one loop may, the worst first.
    fn suspects(&self) -> Vec<Suspect> {
        let edges = self.edges();
        let inlier: Vec<usize> = (0..edges.len()).filter(|&at| self.inlier[at]).collect();
        let all: Vec<Edge> = self.chain.iter().copied().chain(inlier.iter().map(|&at| edges[at])).collect();
        let squared = all.iter().map(|edge| edge.squared(&self.poses)).sum::<f64>();
        let limit = max_group_squared(squared, inlier.len());
        if squared <= limit {
            return Vec::new();
        }
        let structure = pose_graph::structure(self.poses.len(), &all);
        let suspect = |group: Vec<usize>| {
            let counts = |at: &usize| f64::from(u8::from(group.binary_search(at).is_err()));
            let weights: Vec<f64> = self.chain.iter().map(|_| 1.0).chain(inlier.iter().map(counts)).collect();
            let mut expected = self.poses.clone();
            pose_graph::optimize(&mut expected, &all, &weights, &structure);
            let of_rest = |poses: &[Pose2]| -> f64 {
                all.iter().zip(&weights).map(|(edge, weight)| weight * edge.squared(poses)).sum()
            };
            let cost = of_rest(&self.poses) - of_rest(&expected);
            (cost > limit).then_some(Suspect { group, cost, expected })
        };
        let mut suspects: Vec<Suspect> =
            passages(inlier.clone(), &edges).into_par_iter().filter_map(suspect).collect();
        suspects.sort_by(|a, b| b.cost.total_cmp(&a.cost));
        suspects.truncate(MAX_SUSPECTS);
        suspects
    }

    /// Pairs along both ways of a group that lie together where the others have them, to be searched there
    /// and so closely that the group's own place is none of the answers.
    fn elsewhere(&self, Suspect { group, expected, .. }: &Suspect) -> Vec<Pair> {
        let away_m = self.median_away_m(group, expected);
        if away_m < OTHER_PLACE_M {
            return Vec::new();
        }
        let others = (0..self.loops.len()).filter(|at| self.inlier[*at] && group.binary_search(at).is_err());
        let others: Vec<Edge> = others.map(|at| self.loops[at].edge(|submap_id| submap_id)).collect();
        let path_covariances = PathCovariances::new(self.submaps.len(), self.chain.iter().chain(&others));
        let half_m = (away_m / CLOSE).min(self.refine.narrow_m);
        let [from_ids, to_ids] = [0, 1].map(|end| self.along(group, end));
        let pair = |from: usize| {
            let place = |to: usize| expected[from].between(&expected[to]);
            let later = to_ids.clone().filter(|&to| self.is_before(from, to));
            let to = later.min_by(|&a, &b| place(a).distance_m().total_cmp(&place(b).distance_m()))?;
            let guess = Some(place(to)).filter(|guess| guess.distance_m() < self.params.near_m)?;
            let half_rad = self.half_rad(heading_sigma_rad(&path_covariances, from, to), 1.0);
            let window = Window { half_m, half_rad };
            Some(Pair { submap_ids: [from, to], region: SearchRegion::square(guess, window, half_m) })
        };
        from_ids.filter_map(pair).collect()
    }

    /// How far the loops of a group lie from where the others have them: the median, meters.
    fn median_away_m(&self, group: &[usize], expected: &[Pose2]) -> f64 {
        median(group.iter().map(|&at| self.loops[at].away_m(expected)).collect())
    }

    /// The submaps of one recording along one way of a group, and [`BEYOND`].
    fn along(&self, group: &[usize], end: usize) -> Range<usize> {
        let ids = || group.iter().map(|&at| self.loops[at].submap_ids[end]);
        let (Some(first), Some(last)) = (ids().min(), ids().max()) else { return 0..0 };
        let recording = self.recording_of[first];
        let begin = self.recording_of.partition_point(|of| *of < recording);
        let end = self.recording_of.partition_point(|of| *of <= recording);
        first.saturating_sub(BEYOND).max(begin)..(last + 1 + BEYOND).min(end)
    }

    /// Whether enough loops were found since that tell where along a corridor one is, and agree as well as
    /// those of a group. Places that are truly one agree better than look-alikes.
    fn agrees_as_well(&self, group: &[usize], since: usize) -> bool {
        let informative = |found: &&Loop| found.constrains_along(&self.refine);
        let elsewhere: Vec<&Loop> = self.loops[since..].iter().filter(informative).collect();
        let known: Vec<&Loop> = group.iter().map(|&at| &self.loops[at]).filter(informative).collect();
        let of = |loops: &[&Loop], part: fn(&Agreement) -> f64| {
            median(loops.iter().map(|loop_| part(&loop_.found.agreement)).collect())
        };
        let share = |loops: &[&Loop]| of(loops, |agreement| agreement.share);
        let along = |loops: &[&Loop]| of(loops, |agreement| agreement.along);
        elsewhere.len() >= MIN_ELSEWHERE
            && share(&elsewhere) >= share(&known) - RIVAL_SHARE
            && along(&elsewhere) >= RIVAL_ALONG * along(&known)
    }

    /// Whether poses by the loops found since fit better than those by a group; then it is believed no more.
    /// Each of the two counts as one loop where it does not fit.
    fn is_aliased(&mut self, Suspect { group, expected, .. }: &Suspect, since: usize) -> bool {
        let edges = self.edges();
        let supported = self.supported(&edges);
        let weighed = |at: &usize| supported[*at] && !self.refused[*at];
        let rest: Vec<usize> =
            (0..since).filter(weighed).filter(|at| group.binary_search(at).is_err()).collect();
        let elsewhere: Vec<usize> = (since..edges.len()).filter(weighed).collect();
        let fit = |mut poses: Vec<Pose2>, one: &[usize]| {
            let chosen: Vec<usize> = rest.iter().chain(one).copied().collect();
            let loops: Vec<Edge> = chosen.iter().map(|&at| edges[at]).collect();
            let weights = graduated_non_convexity::optimize(&mut poses, self.chain, &loops);
            let steps: f64 = self.chain.iter().map(|edge| edge.squared(&poses)).sum();
            let of = |at: &usize| edges[*at].squared(&poses).min(MAX_LOOP_SQUARED);
            let of_group = |group: &[usize]| group.iter().map(of).sum::<f64>().min(MAX_LOOP_SQUARED);
            let cost = steps + rest.iter().map(of).sum::<f64>() + of_group(group) + of_group(&elsewhere);
            let accepted = chosen.into_iter().zip(weights).filter(|(_, weight)| *weight > INLIER_WEIGHT);
            (cost, poses, accepted.map(|(at, _)| at).collect::<Vec<usize>>())
        };
        let (with_group, ..) = fit(self.poses.clone(), group);
        let (without, poses, accepted) = fit(expected.clone(), &elsewhere);
        if without >= with_group || accepted.iter().all(|at| *at < since) {
            return false;
        }
        for &at in group {
            self.refused[at] = true;
        }
        self.list_found_pairs();
        self.poses = poses;
        self.inlier = vec![false; self.loops.len()];
        for at in accepted {
            self.inlier[at] = true;
        }
        true
    }

    /// Pairs of refused loops may be found elsewhere.
    pub(crate) fn list_found_pairs(&mut self) {
        let standing = self.loops.iter().zip(&self.refused).filter(|(_, refused)| !**refused);
        self.found_pairs = standing.map(|(found, _)| found.submap_ids).collect();
    }
}

/// By how much a group may bend the rest, as a squared Mahalanobis distance, when all that is believed
/// together is bent by so much: as much as a loop may, and less where steps are better than they claim.
fn max_group_squared(squared: f64, loops: usize) -> f64 {
    MAX_LOOP_SQUARED * (squared / (3 * loops.max(1)) as f64).clamp(MIN_BENT, 1.0)
}

/// Loops by passages: the first one left, and all along the same ways.
fn passages(mut left: Vec<usize>, edges: &[Edge]) -> Vec<Vec<usize>> {
    left.sort_by_key(|&at| (edges[at].from, edges[at].to));
    let mut passages = Vec::new();
    while let Some(&first) = left.first() {
        let is_near = |one: usize, other: usize| one.abs_diff(other) <= PASSAGE_SUBMAPS;
        let (mut passage, others): (Vec<usize>, Vec<usize>) = left.iter().partition(|&&at| {
            is_near(edges[at].from, edges[first].from) && is_near(edges[at].to, edges[first].to)
        });
        passage.sort_unstable();
        passages.push(passage);
        left = others;
    }
    passages
}

/// The median; of none zero.
fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    upper_median(&values).unwrap_or(0.0)
}

/// How surely the heading of one submap is known from another, radians.
fn heading_sigma_rad(path_covariances: &PathCovariances, from: usize, to: usize) -> f64 {
    let mut covariance = Matrix3::zeros();
    path_covariances.visit(from, |at, known| {
        covariance = known.covariance;
        if at == to { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    covariance[(2, 2)].sqrt()
}

#[cfg(test)]
pub(crate) mod tests {
    use std::ops::Range;

    use biplane_matcher::{Pose2, Window};

    use super::{Loop, LoopCloser, passages};
    use crate::slam::keyframes::Node;
    use crate::slam::keyframes::submap::{Submap, SubmapParams, submap_ranges};
    use crate::slam::loop_closure::checkpoint::Checkpoint;
    use crate::slam::loop_closure::params::CandidateParams;
    use crate::slam::loop_closure::search_region::SearchRegion;
    use crate::slam::loop_closure::verification::tests::scan_of_corridor;
    use crate::slam::loop_closure::verification::{RefineParams, find};
    use crate::slam::pose_graph::Edge;
    use crate::slam::pose_graph::tests::{chained, edge};

    /// Recesses of a corridor, where they begin and how deep they are: all alike, one so often.
    pub(crate) fn alike(every_m: f64) -> Vec<(f64, f64)> {
        let count = (50.0 / every_m) as i32;
        (-3..count).map(|number| (every_m * f64::from(number), 0.5)).collect()
    }

    /// Recesses that differ in where they are and how deep.
    pub(crate) fn different() -> Vec<(f64, f64)> {
        let depths = [0.3, 0.9, 0.5, 0.7];
        (-3..13)
            .map(|number| {
                let shift = 0.45 * f64::from((7 * number) % 5);
                (4.0 * f64::from(number) + shift, depths[(number + 4) as usize % 4])
            })
            .collect()
    }

    /// Submaps of a corridor that was driven along twice, 40 m each time, the second time really so far
    /// ahead; how many submaps the first time; and the steps between them. They are known within centimeters
    /// but for the one between both drives, of which this is the standard deviation, and know nothing of
    /// being ahead.
    pub(crate) fn twice(
        recesses: &[(f64, f64)],
        really_ahead_m: f64,
        open_m: f64,
    ) -> (Vec<Submap>, usize, Vec<Edge>) {
        let poses: Vec<Pose2> = (0..100).map(|at| Pose2::new(0.4 * f64::from(at), 0.0, 0.0)).collect();
        let params = SubmapParams::default();
        let ranges = submap_ranges(&poses, &params);
        let drive = |first: usize, ahead_m: f64| {
            let node = |&pose: &Pose2| Node::at(pose, scan_of_corridor(pose.x_m + ahead_m, recesses));
            let nodes: Vec<Node> = poses.iter().map(node).collect();
            let of = |range: &Range<usize>| {
                Submap::new(&nodes[range.clone()], &poses[range.clone()], first + range.start, &params)
            };
            ranges.iter().map(of).collect::<Vec<Submap>>()
        };
        let mut submaps = drive(0, 0.0);
        submaps.extend(drive(poses.len(), really_ahead_m));
        let at = |submap: usize| poses[submaps[submap].middle % poses.len()];
        let step = |submap: usize| {
            let sigma = if submap + 1 == ranges.len() { [open_m, open_m, 0.02] } else { [0.05, 0.05, 0.01] };
            edge(submap, submap + 1, at(submap).between(&at(submap + 1)), sigma)
        };
        let chain = (0..submaps.len() - 1).map(step).collect();
        (submaps, ranges.len(), chain)
    }

    /// Adds loops between both drives, of the second one's first submap and those behind it, so many: found
    /// so far ahead of where the poses have them, where so widely was searched.
    pub(crate) fn add_loops(
        closer: &mut LoopCloser<'_>,
        (first_to, loops): (usize, usize),
        ahead_m: f64,
        half_m: f64,
    ) {
        for (from, to) in (first_to..first_to + loops).enumerate() {
            let window = Window { half_m: 0.5, half_rad: 0.02 };
            let guess = closer.poses[from].between(&closer.poses[to]) * Pose2::new(ahead_m, 0.0, 0.0);
            let [reference, query] = [from, to].map(|submap_id| &closer.submaps[submap_id]);
            let found =
                find(reference, query, &SearchRegion::square(guess, window, 0.5), &closer.refine).unwrap();
            closer.loops.push(Loop { submap_ids: [from, to], found, half_m });
            closer.refused.push(false);
        }
    }

    /// Loops between both drives that were found so far ahead, and believed; how many of them are refused,
    /// and how far from where the steps have it the last submap lies then along the corridor.
    fn refused(recesses: &[(f64, f64)], ahead_m: [f64; 2], open_m: f64) -> (usize, f64) {
        let [really_ahead_m, found_ahead_m] = ahead_m;
        let (submaps, count, chain) = twice(recesses, really_ahead_m, open_m);
        let poses = chained(&chain);
        let last_m = poses[poses.len() - 1].x_m;
        let recording_of = vec![0; submaps.len()];
        let params = (CandidateParams::default(), RefineParams::default());
        let mut closer = LoopCloser::new(&submaps, &recording_of, &chain, poses, params);
        add_loops(&mut closer, (count, count - 1), found_ahead_m, 1.0);
        closer.select_inliers();
        assert_eq!(closer.inlier_count(), count - 1, "all of them are believed at first");
        closer.refuse_aliased(&mut Checkpoint::default(), &mut |_, _| {});
        let refused = closer.refused.iter().filter(|refused| **refused).count();
        (refused, closer.poses[closer.poses.len() - 1].x_m - last_m)
    }

    #[test]
    fn loops_that_are_all_a_door_off_are_refused_when_the_way_says_so() {
        let (count, away_m) = refused(&alike(4.0), [0.0, 4.0], 0.4);
        assert!(count >= 7 && away_m.abs() < 0.05, "{count} refused, {away_m} m away");
    }

    #[test]
    fn where_all_else_fits_better_than_it_claims_a_group_may_bend_it_less() {
        let (count, away_m) = refused(&alike(4.0), [0.0, 4.0], 1.6);
        assert!(count >= 7 && away_m.abs() < 0.05, "{count} refused, {away_m} m away");
        let (count, away_m) = refused(&alike(4.0), [0.0, 4.0], 4.0);
        assert!(count == 0 && (away_m - 4.0).abs() < 0.3, "{count} refused, {away_m} m away");
    }

    #[test]
    fn loops_that_are_not_found_where_the_way_has_them_stay_believed() {
        let (count, away_m) = refused(&different(), [4.0, 4.0], 0.4);
        assert!(count == 0 && (away_m - 4.0).abs() < 0.3, "{count} refused, {away_m} m away");
    }

    #[test]
    fn loops_close_to_where_the_way_has_them_stay_believed() {
        let (count, away_m) = refused(&alike(1.8), [0.0, 1.8], 0.4);
        assert!(count == 0 && (away_m - 1.8).abs() < 0.2, "{count} refused, {away_m} m away");
    }

    #[test]
    fn loops_of_two_passages_are_two_groups() {
        let at = |from, to| edge(from, to, Pose2::IDENTITY, [0.1; 3]);
        let edges = [at(1, 100), at(3, 98), at(60, 101), at(17, 100), at(2, 200)];
        assert_eq!(passages((0..5).collect(), &edges), [vec![0, 1, 3], vec![4], vec![2]]);
    }
}
