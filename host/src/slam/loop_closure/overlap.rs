//! Whether recordings that were put together agree where both were: at a false place walls of one stand in
//! what the other one saw free.

use std::ops::{Add, ControlFlow};

use biplane_matcher::Window;
use rayon::prelude::*;

use super::candidate::{Loop, LoopCloser, sigma_m};
use crate::slam::loop_closure::agreement::Agreement;
use crate::slam::loop_closure::search_region::SearchRegion;
use crate::slam::loop_closure::verification::best_of;
use crate::slam::pose_graph::relative_covariance::{Known, PathCovariances, reversed};

/// Two submaps whose middles are closer see the same, unless a wall is between them, meters.
const SAME_PLACE_M: f64 = 3.0;
/// Places known worse than this from each other are not compared, meters: in so wide a window something
/// alike is found at most places.
const MAX_SIGMA_M: f64 = 2.0;
/// A pair disagrees when its agreement is worse at its best place than in nine of ten loops within the
/// recordings: people, glass and doors that move take their share in each building.
const WORST_SHARE: f64 = 0.1;
/// With fewer loops within the recordings they do not tell.
const MIN_LOOPS: usize = 20;
/// A pair agrees only when so much of it is seen by both, and disagrees only when so large a share of its
/// points speak against the place: the other side of a wall does neither.
const MIN_SEEN: (f64, f64) = (0.4, 0.15);
/// Recordings may lie together when at most this share of the pairs disagree. In places where both really
/// were it is up to 0.12 of many pairs, and 2 of 11 where there are few; at false places 0.13 to 0.85.
const MAX_AGAINST: f64 = 0.2;
/// Fewer pairs that disagree are chance.
const MIN_AGAINST: usize = 4;

/// Pairs of submaps of two groups of recordings that lie together.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Overlap {
    /// So many agree.
    pub agree: usize,
    /// So many disagree.
    pub against: usize,
}

impl Add for Overlap {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self { agree: self.agree + other.agree, against: self.against + other.against }
    }
}

impl Overlap {
    /// What one pair says when so large a share has to agree.
    fn of(agreement: &Agreement, min_agreement: f64) -> Self {
        let Agreement { share, overlap, .. } = *agreement;
        let against = share < min_agreement && overlap * (1.0 - share) > MIN_SEEN.1 * share;
        Self {
            agree: usize::from(share >= min_agreement && overlap >= MIN_SEEN.0),
            against: usize::from(against),
        }
    }

    /// Whether the two groups cannot lie so.
    pub(crate) fn contradicts(&self) -> bool {
        let all = (self.agree + self.against) as f64;
        self.against >= MIN_AGAINST && self.against as f64 > MAX_AGAINST * all
    }
}

impl LoopCloser<'_> {
    /// How well two groups of recordings agree where both were: each submap of the second one with the
    /// nearest one of the first, at the best place that the graph allows. `group_of` tells the group of a
    /// submap.
    pub(crate) fn overlap(&self, group_of: impl Fn(usize) -> usize + Sync, pair: [usize; 2]) -> Overlap {
        let loops = self.inlier_edges(|submap_id| submap_id);
        let path_covariances = PathCovariances::new(self.submaps.len(), self.chain.iter().chain(&loops));
        let min_agreement = self.min_agreement(&group_of);
        let of_query = |query: usize| {
            let (other, known) =
                self.nearest(query, &path_covariances, |other| group_of(other) == pair[0])?;
            let [reference, query_map] = [other, query].map(|submap_id| &self.submaps[submap_id]);
            let best = best_of(reference, query_map, &self.allowed(query, other, &known), 0.0)?;
            Some(Overlap::of(&best.agreement, min_agreement))
        };
        let queries: Vec<usize> = (0..self.submaps.len()).filter(|&at| group_of(at) == pair[1]).collect();
        queries.into_par_iter().filter_map(of_query).reduce(Overlap::default, Overlap::add)
    }

    /// The share that has to agree: as in nine of ten loops within the groups.
    fn min_agreement(&self, group_of: impl Fn(usize) -> usize) -> f64 {
        let is_within = |found: &Loop| group_of(found.submap_ids[0]) == group_of(found.submap_ids[1]);
        let accepted =
            self.loops.iter().zip(&self.inlier).filter(|(found, inlier)| **inlier && is_within(found));
        let mut shares: Vec<f64> = accepted.map(|(found, _)| found.found.agreement.share).collect();
        shares.sort_by(f64::total_cmp);
        if shares.len() < MIN_LOOPS {
            return self.refine.min_agreement;
        }
        shares[(WORST_SHARE * shares.len() as f64) as usize]
    }

    /// The nearest submap of those chosen that sees the same, and what is known of it.
    fn nearest(
        &self,
        query: usize,
        path_covariances: &PathCovariances,
        is_chosen: impl Fn(usize) -> bool,
    ) -> Option<(usize, Known)> {
        let mut nearest = None;
        let mut nearest_m = SAME_PLACE_M;
        path_covariances.visit(query, |other, known| {
            if sigma_m(&known.covariance) > MAX_SIGMA_M {
                return ControlFlow::Break(());
            }
            let away_m = self.poses[query].between(&self.poses[other]).distance_m();
            if is_chosen(other) && away_m < nearest_m {
                nearest_m = away_m;
                nearest = Some((other, *known));
            }
            ControlFlow::Continue(())
        });
        nearest
    }

    /// Where the graph allows a submap to lie, seen from another one.
    fn allowed(&self, query: usize, other: usize, known: &Known) -> SearchRegion {
        let from_query = self.poses[query].between(&self.poses[other]);
        let (guess, covariance) = reversed(&from_query, &known.covariance);
        let half_m = self.half_m(sigma_m(&covariance), known.path_m, 1.0);
        let half_rad = self.half_rad(covariance[(2, 2)].sqrt(), 1.0);
        SearchRegion::square(guess, Window { half_m, half_rad }, half_m)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_other_side_of_a_wall_says_nothing() {
        let pair = |share, overlap| Overlap::of(&Agreement { share, overlap, ..Agreement::default() }, 0.85);
        assert_eq!(pair(0.9, 0.7), Overlap { agree: 1, against: 0 });
        assert_eq!(pair(0.7, 0.5), Overlap { agree: 0, against: 1 });
        assert_eq!(pair(0.4, 0.06), Overlap::default(), "nearly all lies where nobody looked");
        assert_eq!(pair(1.0, 0.1), Overlap::default());
    }

    #[test]
    fn one_pair_of_five_may_disagree_and_three_of_any() {
        let contradicts = |agree, against| Overlap { agree, against }.contradicts();
        assert!(!contradicts(16, 4) && contradicts(15, 4));
        assert!(!contradicts(0, 3) && contradicts(0, 4));
    }
}
