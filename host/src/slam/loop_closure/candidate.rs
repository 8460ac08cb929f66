//! Which submaps might see the same place, closest guess first; and the loops found so, believed only in
//! support.
//!
//! The window of a search is three standard deviations of what the graph knows of the two submaps; at first
//! of a fifth of that (see [`CandidateParams::first_share`]). Narrow windows come first: a loop that they
//! find makes the others' windows narrow. In a wide window much looks alike, so a loop found there needs
//! others, of other submaps, that agree with it within what the way between them allows.

use biplane_geometry::PortableMath;
use std::collections::{BTreeMap, BTreeSet};
use std::ops::ControlFlow;

use biplane_matcher::{Pose2, Strip, Window};
use nalgebra::Matrix3;
use rayon::prelude::*;

use crate::slam::keyframes::submap::Submap;
use crate::slam::loop_closure::checkpoint::{Asked, Checkpoint};
use crate::slam::loop_closure::params::CandidateParams;
use crate::slam::loop_closure::search_region::{SearchRegion, smallest};
use crate::slam::loop_closure::verification::{Found, RefineParams, find};
use crate::slam::pose_graph::Edge;
use crate::slam::pose_graph::relative_covariance::{Known, LEVER_M, PathCovariances, reversed};

/// A loop between two submaps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Loop {
    /// The submaps, by number: the first holds the second.
    pub submap_ids: [usize; 2],
    /// What was found.
    pub found: Found,
    /// How wide was searched, meters.
    pub half_m: f64,
}

impl Loop {
    pub(crate) fn edge(&self, pose_of: impl Fn(usize) -> usize) -> Edge {
        let [from, to] = self.submap_ids.map(pose_of);
        Edge { from, to, measured: self.found.pose, information: self.found.information }
    }

    /// Whether it tells where along a corridor one is.
    pub(crate) fn constrains_along(&self, params: &RefineParams) -> bool {
        params.constrains_along(&self.found.agreement, self.half_m)
    }

    /// How far from where these poses have it the second submap was found, meters.
    pub(crate) fn away_m(&self, poses: &[Pose2]) -> f64 {
        let [from, to] = self.submap_ids.map(|submap_id| poses[submap_id]);
        from.between(&to).between(&self.found.pose).distance_m()
    }
}

/// The search for loops: submaps as poses of a graph of their own.
#[derive(Clone, Debug)]
pub(crate) struct LoopCloser<'a> {
    pub(crate) submaps: &'a [Submap],
    /// Which recording each submap is of.
    pub recording_of: &'a [usize],
    /// Steps between the middles of following submaps of one recording.
    pub(crate) chain: &'a [Edge],
    pub(crate) params: CandidateParams,
    pub(crate) refine: RefineParams,
    /// The middles' poses.
    pub poses: Vec<Pose2>,
    /// All loops found.
    pub loops: Vec<Loop>,
    /// Whether each is believed.
    pub inlier: Vec<bool>,
    /// Whether each was refused with its group, as that holds a false place ([`super::perceptual_aliasing`]).
    pub(crate) refused: Vec<bool>,
    /// What was searched, and around which guess.
    pub(crate) tried: BTreeMap<[usize; 2], (Pose2, f64)>,
    /// Loops whose support was looked for, and those found so.
    pub(crate) sought: BTreeSet<[usize; 2]>,
    /// Submaps whose place is known: with nothing left to search around them, they are asked no more.
    pub(crate) settled: Vec<bool>,
    /// The pairs of `loops`.
    pub(crate) found_pairs: BTreeSet<[usize; 2]>,
    /// What was weighed when it was last chosen which to believe.
    pub(crate) weighed: Weighed,
    /// Pairs searched.
    pub searched: usize,
}

/// What was weighed.
#[derive(Clone, Copy, Default, Debug)]
pub(crate) struct Weighed {
    /// So many loops, the first ones found.
    pub count: usize,
    /// Also those that may hold the next door.
    pub with_ambiguous: bool,
}

/// A pair to be searched.
pub(crate) struct Pair {
    pub(crate) submap_ids: [usize; 2],
    pub(crate) region: SearchRegion,
}

/// A submap, another one, and what the graph knows of the two, seen from `query`.
struct Around<'a> {
    other: usize,
    query: usize,
    known: &'a Known,
}

/// Windows beyond this are searched sparingly, meters. Their cost grows with the square; how much support a
/// loop found in them needs is another question (`company`).
const SPARING_BEYOND_M: f64 = 4.0;
/// The widest windows of the first rounds, meters; when nothing more is found, they become wider by
/// `WIDENING`.
const FIRST_WIDEST_M: f64 = 1.0;
/// See [`FIRST_WIDEST_M`]. Larger: fewer rounds, but loops of narrow windows are not there in time to make
/// wide ones narrow.
const WIDENING: f64 = 2.0;
/// What every window has beyond the graph's doubt, meters, so that a place that the graph claims to know well
/// is looked for, too. Larger: slower; smaller: loops are missed where steps claim too much.
const WINDOW_FLOOR_M: f64 = 0.3;
/// The same of the heading, radians.
const WINDOW_FLOOR_RAD: f64 = 0.03;
/// Windows reach this far to each side in the direction that the graph knows best, or farther, meters.
/// Smaller: surer and faster, but what steps claim to know of a short way may be as wrong as that.
const STRIP_FLOOR_M: f64 = 4.0;
/// A window between so many times the size of one that was searched is no other one. Closer to 1: pairs are
/// searched again in vain.
const SAME_SIZE: (f64, f64) = (0.3, 1.5);
/// A guess that has moved by less than this share of the window searched is no other guess, and by less than
/// so many radians.
const SAME_GUESS_SHARE: f64 = 0.5;
/// See [`SAME_GUESS_SHARE`], radians.
const SAME_GUESS_RAD: f64 = 0.1;
/// A loop of more weight than this is believed: weights end at 0 or 1 but for few
/// ([`graduated_non_convexity::optimize`]).
pub(crate) const INLIER_WEIGHT: f64 = 0.5;
/// Groups of loops refused in a run at most: one that is found again and again is left.
const MAX_REFUSALS: usize = 16;
/// Pairs between two savings of what was found.
const BATCH: usize = 256;

impl<'a> LoopCloser<'a> {
    /// A search over submaps at these poses, `recording_of` telling which recording each is of.
    pub(crate) fn new(
        submaps: &'a [Submap],
        recording_of: &'a [usize],
        chain: &'a [Edge],
        poses: Vec<Pose2>,
        (params, refine): (CandidateParams, RefineParams),
    ) -> Self {
        let tried = BTreeMap::new();
        Self {
            submaps,
            recording_of,
            chain,
            params,
            refine,
            poses,
            loops: vec![],
            inlier: vec![],
            refused: vec![],
            tried,
            sought: BTreeSet::new(),
            settled: vec![false; submaps.len()],
            found_pairs: BTreeSet::new(),
            weighed: Weighed::default(),
            searched: 0,
        }
    }

    /// Looks until nothing more is found, with windows of a small drift first. `progress` hears of pairs
    /// searched and loops believed.
    pub(crate) fn run(&mut self, checkpoint: &mut Checkpoint, progress: &mut dyn FnMut(usize, usize)) {
        for (share, weighs_ambiguous) in [(self.params.first_share, false), (1.0, false), (1.0, true)] {
            if !self.weigh_ambiguous(weighs_ambiguous) && weighs_ambiguous {
                return; // nothing new
            }
            self.run_with(share, checkpoint, progress);
            for _ in 0..MAX_REFUSALS {
                if !self.refuse_aliased(checkpoint, progress) {
                    break;
                }
                self.settled.fill(false);
                self.run_with(share, checkpoint, progress);
            }
        }
    }

    /// Looks until nothing more is found in windows of this share of the drift, narrow ones first.
    fn run_with(&mut self, share: f64, checkpoint: &mut Checkpoint, progress: &mut dyn FnMut(usize, usize)) {
        let mut widest_m = FIRST_WIDEST_M.min(self.params.widest_m);
        loop {
            let pairs = self.pairs(widest_m, share);
            let before = self.inlier_count();
            self.search(&pairs, checkpoint, progress);
            self.find_supporting(checkpoint, progress);
            self.select_inliers();
            if self.inlier_count() <= before || pairs.is_empty() {
                let Some(wider_m) = wider(widest_m, self.params.widest_m) else { return };
                widest_m = wider_m;
            }
        }
    }

    /// Loops believed.
    pub(crate) fn inlier_count(&self) -> usize {
        self.inlier.iter().filter(|inlier| **inlier).count()
    }

    pub(crate) fn search(
        &mut self,
        pairs: &[Pair],
        checkpoint: &mut Checkpoint,
        progress: &mut dyn FnMut(usize, usize),
    ) {
        for batch in pairs.chunks(BATCH) {
            let known: &Checkpoint = checkpoint;
            let answer = |pair: &Pair| {
                let asked = Asked::new(pair.submap_ids, &pair.region);
                let [a, b] = pair.submap_ids.map(|submap_id| &self.submaps[submap_id]);
                let found = known.answer(&asked).unwrap_or_else(|| find(a, b, &pair.region, &self.refine));
                (asked, found)
            };
            let answers: Vec<(Asked, Option<Found>)> = batch.par_iter().map(answer).collect();
            for (pair, (_, found)) in batch.iter().zip(&answers) {
                let SearchRegion { guess, window, uncertainty_m, .. } = pair.region;
                self.tried.insert(pair.submap_ids, (guess, window.half_m));
                if let Some(found) = *found {
                    self.found_pairs.insert(pair.submap_ids);
                    self.refused.push(false);
                    self.loops.push(Loop {
                        submap_ids: pair.submap_ids,
                        found,
                        half_m: window.half_m.max(uncertainty_m),
                    });
                }
            }
            checkpoint.add(&answers);
            self.searched += batch.len();
            progress(self.searched, self.inlier_count());
        }
    }

    /// Pairs worth a search, with windows up to `widest_m` when the steps have this share of their drift.
    /// That they have is an assumption: what is found so is uncertain by the geometric mean of both.
    fn pairs(&mut self, widest_m: f64, share: f64) -> Vec<Pair> {
        let loops = self.inlier_edges(|submap_id| submap_id);
        let path_covariances = PathCovariances::new(self.submaps.len(), self.chain.iter().chain(&loops));
        let asked: Vec<usize> = (0..self.submaps.len()).filter(|&query| !self.settled[query]).collect();
        let found: Vec<(Vec<Pair>, bool)> =
            asked.par_iter().map(|&query| self.pairs_of(query, &path_covariances, widest_m, share)).collect();
        for (query, (pairs, is_known)) in asked.into_iter().zip(&found) {
            self.settled[query] = *is_known && pairs.is_empty();
        }
        found.into_iter().flat_map(|(pairs, _)| pairs).collect()
    }

    /// The pairs of one submap, and whether its place is known.
    fn pairs_of(
        &self,
        query: usize,
        path_covariances: &PathCovariances,
        widest_m: f64,
        share: f64,
    ) -> (Vec<Pair>, bool) {
        let mut pairs: Vec<(f64, Pair)> = Vec::new();
        let mut known_here = 0;
        path_covariances.visit(query, |other, known| {
            let around = Around { other, query, known };
            known_here += usize::from(self.is_known_here(&around));
            pairs.extend(self.pair(&around, widest_m, share));
            let too_wide = self.half_m(0.0, known.path_m, share) > widest_m;
            match known_here >= self.params.known_enough || too_wide {
                true => ControlFlow::Break(()),
                false => ControlFlow::Continue(()),
            }
        });
        pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
        (self.sparing(query, pairs).collect(), known_here >= self.params.known_enough)
    }

    /// The pairs of a submap to search in this round, of those nearest first. Wide windows, which cost most,
    /// are searched sparingly: one loop found makes the others narrow.
    fn sparing(&self, query: usize, pairs: Vec<(f64, Pair)>) -> impl Iterator<Item = Pair> {
        let mut left = [
            self.params.pairs_per_round,
            if query.is_multiple_of(2) { self.params.pairs_per_round / 2 } else { 0 },
        ];
        pairs.into_iter().map(|(_, pair)| pair).filter(move |pair| {
            let left = &mut left[usize::from(pair.region.window.half_m > SPARING_BEYOND_M)];
            let chosen = *left > 0;
            *left = left.saturating_sub(1);
            chosen
        })
    }

    /// Half the width of a window, of what the graph knows of the two: standard deviation and way.
    pub(crate) fn half_m(&self, sigma_m: f64, path_m: f64, share: f64) -> f64 {
        share * self.uncertainty_m(sigma_m, path_m) + WINDOW_FLOOR_M
    }

    /// The same of the heading, radians.
    pub(crate) fn half_rad(&self, sigma_rad: f64, share: f64) -> f64 {
        share * self.params.sigmas * sigma_rad + WINDOW_FLOOR_RAD
    }

    fn uncertainty_m(&self, sigma_m: f64, path_m: f64) -> f64 {
        self.params.sigmas * sigma_m + self.params.scale_share * path_m
    }

    /// Whether the submap is another visit of the place, known well enough.
    fn is_known_here(&self, around: &Around<'_>) -> bool {
        let Around { other, query, known } = *around;
        (self.is_before(other, query) || self.is_before(query, other))
            && self.is_well_known(&known.covariance)
            && self.poses[query].between(&self.poses[other]).distance_m() < self.params.near_m
    }

    pub(crate) fn is_before(&self, other: usize, query: usize) -> bool {
        other < query && self.submaps[other].nodes.end < self.submaps[query].nodes.start
    }

    fn is_well_known(&self, covariance: &Matrix3<f64>) -> bool {
        sigma_m(covariance) < self.params.known_m && covariance[(2, 2)].sqrt() < self.params.known_m / LEVER_M
    }

    /// Whether a pair is worth a search; how likely it is seen by its distance and by what is in doubt,
    /// nearer and surer ones first: of many visits the last ones.
    fn pair(&self, around: &Around<'_>, widest_m: f64, share: f64) -> Option<(f64, Pair)> {
        let Around { other, query, known } = *around;
        if !self.is_before(other, query) || self.found_pairs.contains(&[other, query]) {
            return None;
        }
        let from_query = self.poses[query].between(&self.poses[other]);
        let (guess, covariance) = reversed(&from_query, &known.covariance);
        if self.is_well_known(&covariance) {
            return None;
        }
        let uncertainty_m = self.uncertainty_m(sigma_m(&covariance), known.path_m);
        let half_m = share * uncertainty_m + WINDOW_FLOOR_M;
        let away_m = guess.distance_m();
        if half_m > widest_m || away_m > self.params.near_m + half_m {
            return None;
        }
        if let Some((tried, tried_m)) = self.tried.get(&[other, query]) {
            let moved = guess.step_from(tried);
            // The same window again finds the same.
            let is_like = half_m > SAME_SIZE.0 * tried_m && half_m < SAME_SIZE.1 * tried_m;
            let is_near = moved[0].portable_hypot(moved[1]) < SAME_GUESS_SHARE * tried_m;
            if is_near && moved[2].abs() < SAME_GUESS_RAD && is_like {
                return None;
            }
        }
        let half_rad = self.half_rad(covariance[(2, 2)].sqrt(), share);
        let (across, variance_m2) = smallest(&covariance);
        let across_m = self.half_m(variance_m2.sqrt(), known.path_m, share).max(STRIP_FLOOR_M);
        let region = SearchRegion {
            guess,
            window: Window { half_m, half_rad },
            strip: (across_m < half_m).then_some(Strip { across, half_m: across_m }),
            uncertainty_m: share.sqrt() * uncertainty_m + WINDOW_FLOOR_M,
        };
        Some((away_m + uncertainty_m, Pair { submap_ids: [other, query], region }))
    }

    pub(crate) fn edges(&self) -> Vec<Edge> {
        self.loops.iter().map(|found| found.edge(|submap_id| submap_id)).collect()
    }

    /// The loops believed, between other poses that stand for the submaps.
    pub(crate) fn inlier_edges(&self, pose_of: impl Fn(usize) -> usize) -> Vec<Edge> {
        let inlier = self.loops.iter().zip(&self.inlier).filter(|(_, inlier)| **inlier);
        inlier.map(|(found, _)| found.edge(&pose_of)).collect()
    }
}

/// Standard deviation of the position along the direction that is known least, meters.
pub(crate) fn sigma_m(covariance: &Matrix3<f64>) -> f64 {
    covariance.fixed_view::<2, 2>(0, 0).symmetric_eigenvalues().max().max(0.0).sqrt()
}

/// How wide windows may be in the next round; `None` after the widest.
fn wider(now_m: f64, widest_m: f64) -> Option<f64> {
    (now_m < widest_m).then(|| (now_m * WIDENING).min(widest_m))
}

#[cfg(test)]
mod tests {
    use super::{CandidateParams, FIRST_WIDEST_M, wider};

    #[test]
    fn windows_become_wider_up_to_the_widest_and_no_wider() {
        let widths = |widest_m: f64| -> Vec<f64> {
            std::iter::successors(Some(FIRST_WIDEST_M), |now_m| wider(*now_m, widest_m)).collect()
        };
        assert_eq!(widths(40.0), [1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 40.0]);
        assert_eq!(widths(CandidateParams::default().widest_m), [1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0]);
    }
}
