//! Loops found in wide windows, where much looks alike, need others that agree with them.
//!
//! Two loops agree when the cycle of both and the ways between their ends closes within what is known of
//! these (pairwise consistency, after Mangelson et al. 2018). Where a loop has no support yet, the submaps
//! before and after its two are looked for.

use std::collections::BTreeMap;
use std::ops::ControlFlow;

use biplane_matcher::Window;
use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;

use super::candidate::{Loop, LoopCloser, Pair};
use crate::slam::loop_closure::checkpoint::Checkpoint;
use crate::slam::loop_closure::search_region::SearchRegion;
use crate::slam::pose_graph::Edge;
use crate::slam::pose_graph::relative_covariance::{PathCovariances, joined};

/// Up to this window one other loop is support enough, meters.
const ONE_SUFFICES_UP_TO_M: f64 = 4.0;
/// Up to this one, two others wherever they are: beyond, there are enough places that one of them looks like
/// this one for ten meters.
const TWO_SUFFICE_UP_TO_M: f64 = 16.0;
/// Beyond it the loops that agree have to lie along so many submaps of both ways (4 m each). More: a place
/// passed but shortly is not found again from afar; fewer: chance suffices.
const SUBMAPS_ALONG: usize = 5;
/// A loop is found close to where it is expected when the window is so many times as wide: by chance one of
/// sixteen is.
pub(crate) const CLOSE: f64 = 4.0;
/// Submaps before and after the two of a loop.
const BESIDE: [(isize, isize); 8] = [(0, 1), (0, -1), (1, 0), (-1, 0), (1, 1), (-1, -1), (1, -1), (-1, 1)];
/// Around where a loop says that they are, meters and radians.
const BESIDE_M: f64 = 0.8;
const BESIDE_RAD: f64 = 0.1;
/// So many points that tell where along a corridor one is are many.
const RICH: usize = 150;
/// So many rich ones that agree need not lie along a passage. What comes again along one is poor: a door
/// frame or a pillar has 10 to 45 points. Where two corridors cross, 80 to 350 tell most places, for some
/// meters.
const RICH_SUFFICE: usize = 2;
/// With fewer a loop may hold the next door. In 58 drives through large buildings 276 loops found in windows
/// over 4 m were false. Of these 13 had 40 points or more, and 2 had 60; of 8,312 true ones 6,154 and 5,349
/// had.
const POOR: usize = 60;
/// A way between the ends of two loops tells nothing of them when its variances of x and y add up to more,
/// square meters: a meter of standard deviation lets nearly any cycle close.
const MAX_PATH_VARIANCE_M2: f64 = 1.0;
/// Support is looked for among so many submaps along a way, the surest known ones: some 100 m ahead and
/// back. More: slower; fewer: a loop far from any other stays alone.
const SUBMAPS_ON_WAYS: usize = 50;
/// A cycle closes when the squared Mahalanobis distance of what is left of it is below this, no unit: the
/// chi-square quantile of three degrees of freedom (x, y and the turn) at 99 %. Stricter than what a loop
/// must fulfill in the end ([`crate::slam::pose_graph::graduated_non_convexity`], 99.9 %), because a loop
/// that agrees by chance makes a false one believed.
const MAX_CYCLE_SQUARED: f64 = 11.3;
/// Closer than this to where the others have it a loop is at no other place, meters: doors are not so close
/// together.
pub(crate) const OTHER_PLACE_M: f64 = 2.0;
/// What every loop is taken to know at least, 1/m^2 and 1/rad^2: without it, one that says nothing along a
/// corridor has no covariance.
const MIN_INFORMATION: f64 = 1e-3;

impl LoopCloser<'_> {
    /// For loops that need support: the submaps before and after are looked for where the loop says that they
    /// are; where much is in doubt, from those found on again, until the ways part.
    pub(crate) fn find_supporting(
        &mut self,
        checkpoint: &mut Checkpoint,
        progress: &mut dyn FnMut(usize, usize),
    ) {
        for round in 0..SUBMAPS_ALONG {
            // On and on only ahead and back: both ways go on by a submap each.
            let pairs = self.beside(if round == 0 { &BESIDE } else { &BESIDE[4..] });
            self.sought.extend(self.loops.iter().map(|found| found.submap_ids));
            if pairs.is_empty() {
                return;
            }
            self.search(&pairs, checkpoint, progress);
            let ends_here = |pair: &&Pair| asked(pair.region.uncertainty_m, self.params.alone_up_to_m).1 == 0;
            self.sought.extend(pairs.iter().filter(ends_here).map(|pair| pair.submap_ids));
        }
    }

    /// The pairs beside loops that need support and were not sought for yet.
    fn beside(&self, steps: &[(isize, isize)]) -> Vec<Pair> {
        let mut pairs: BTreeMap<[usize; 2], Pair> = BTreeMap::new();
        let needy = self.loops.iter().filter(|found| found.half_m > self.params.alone_up_to_m);
        for found in needy.filter(|found| !self.sought.contains(&found.submap_ids)) {
            let [a, b] = found.submap_ids;
            for &(da, db) in steps {
                let (Some(one), Some(two)) = (a.checked_add_signed(da), b.checked_add_signed(db)) else {
                    continue;
                };
                let is_there = |submap_id: usize, of: usize| {
                    submap_id < self.submaps.len() && self.recording_of[submap_id] == self.recording_of[of]
                };
                let known = self.found_pairs.contains(&[one, two]);
                if known || !is_there(one, a) || !is_there(two, b) || one >= two {
                    continue;
                }
                let guess = self.poses[one].between(&self.poses[a])
                    * found.found.pose
                    * self.poses[b].between(&self.poses[two]);
                let window = Window { half_m: BESIDE_M, half_rad: BESIDE_RAD };
                let region = SearchRegion::square(guess, window, found.half_m);
                let pair = Pair { submap_ids: [one, two], region };
                pairs.entry(pair.submap_ids).or_insert(pair);
            }
        }
        pairs.into_values().collect()
    }

    /// Whether a loop is narrow, or others agree with it, along as much of the way as the doubt asks for, and
    /// of it and them one has enough to tell its place by.
    pub(crate) fn supported(&self, edges: &[Edge]) -> Vec<bool> {
        let support = self.support(edges, |at| self.asked(at) != (0, 0));
        let points_of = |at: usize| self.loops[at].found.agreement.along_points;
        let stands = |(at, agreeing): (usize, Vec<usize>)| {
            let found = &self.loops[at];
            let (support, along) = self.asked(at);
            let points = || agreeing.iter().chain([&at]).map(|&at| points_of(at));
            // A place with much to tell it by is support to itself.
            let own = usize::from(points_of(at) >= RICH);
            let rich = points().filter(|points| *points >= RICH).count();
            let is_long = rich >= RICH_SUFFICE || along_both(at, &agreeing, edges) >= along;
            // Doors are farther apart than a window where one other suffices is wide.
            let may_be_next = support > 1 && found.half_m.is_finite() && points().all(|points| points < POOR);
            !self.lies_anywhere(found) && agreeing.len() + own >= support && is_long && !may_be_next
        };
        support.into_iter().enumerate().map(stands).collect()
    }

    fn asked(&self, at: usize) -> (usize, usize) {
        let found = &self.loops[at];
        let away_m = found.away_m(&self.poses);
        let (support, along) = asked(uncertain_m(found.half_m, away_m), self.params.alone_up_to_m);
        // When all that tells its place has been weighed, what lies where that has it is no other place.
        let is_there = self.weighed.with_ambiguous && away_m < OTHER_PLACE_M;
        if is_there { (support.min(1), 0) } else { (support, along) }
    }

    /// Bare corridor found from afar lies anywhere along the corridor: it leads on to what tells, and holds
    /// only where it is when that is known.
    fn lies_anywhere(&self, found: &Loop) -> bool {
        found.half_m > self.refine.narrow_m
            && !found.constrains_along(&self.refine)
            && found.away_m(&self.poses) > self.refine.narrow_m
    }

    /// The other loops that agree with each of those that are asked for; of the others none. Bare corridor
    /// agrees with any other: the way is followed over it, and it counts for nothing.
    pub(crate) fn support(&self, edges: &[Edge], is_asked: impl Fn(usize) -> bool + Sync) -> Vec<Vec<usize>> {
        let path_covariances = PathCovariances::new(self.submaps.len(), self.chain.iter());
        let mut loops_from: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
        for (at, edge) in edges.iter().enumerate() {
            if self.loops[at].constrains_along(&self.refine) && !self.refused[at] {
                loops_from.entry(edge.from).or_default().push(at);
            }
        }
        let agreeing = |at: usize| {
            if !is_asked(at) {
                return Vec::new();
            }
            let one = &edges[at];
            let [at_from, at_to] = [one.from, one.to].map(|end| ways(&path_covariances, end));
            let beside = at_from.iter().filter_map(|(from, way)| Some((loops_from.get(from)?, way)));
            let agrees = |other: usize, from_way: &Matrix3<f64>| {
                let to_way = at_to.get(&edges[other].to);
                other != at && to_way.is_some_and(|to_way| self.agree(one, &edges[other], [from_way, to_way]))
            };
            let mut found: Vec<usize> = beside
                .flat_map(|(others, way)| {
                    others.iter().copied().filter(|&other| agrees(other, way)).collect::<Vec<_>>()
                })
                .collect();
            found.sort_unstable();
            found
        };
        (0..edges.len()).into_par_iter().map(agreeing).collect()
    }

    /// Whether the cycle of two loops and the ways between their ends closes; the ways have to be short for
    /// that to say anything.
    fn agree(&self, one: &Edge, other: &Edge, [at_from, at_to]: [&Matrix3<f64>; 2]) -> bool {
        let Some(own) = covariance(&one.information) else { return false };
        let Some(its) = covariance(&other.information) else { return false };
        // Over the first ends and back over the second ones.
        let from_path_covariance = self.poses[one.from].between(&self.poses[other.from]);
        let to_path_covariance = self.poses[one.to].between(&self.poses[other.to]);
        let (there, there_known) = joined((&one.measured, &own), (&to_path_covariance, at_to));
        let (here, here_known) = joined((&from_path_covariance, at_from), (&other.measured, &its));
        let away = Vector3::from(there.step_from(&here));
        (there_known + here_known)
            .cholesky()
            .is_some_and(|factors| away.dot(&factors.solve(&away)) < MAX_CYCLE_SQUARED)
    }
}

/// How much is in doubt of a loop found so far away from where the graph expects it. Found close to that
/// place it is no more in doubt than in a smaller window: of all that looks alike in a wide one, little
/// lies there.
fn uncertain_m(half_m: f64, away_m: f64) -> f64 {
    if half_m.is_finite() { half_m.min((CLOSE * away_m).max(TWO_SUFFICE_UP_TO_M)) } else { half_m }
}

/// How many others have to agree with a loop when so much is uncertain, and along how many submaps. Of
/// another recording's place nothing is known at first: [`super::join_recordings`] asks for more by
/// itself.
fn asked(uncertainty_m: f64, alone_up_to_m: f64) -> (usize, usize) {
    match uncertainty_m {
        uncertainty_m if uncertainty_m <= alone_up_to_m => (0, 0),
        uncertainty_m if uncertainty_m <= ONE_SUFFICES_UP_TO_M => (1, 0),
        uncertainty_m if uncertainty_m > TWO_SUFFICE_UP_TO_M && uncertainty_m.is_finite() => {
            (2, SUBMAPS_ALONG)
        }
        _ => (2, 0),
    }
}

/// Along how many submaps of both ways a loop and those that agree with it lie.
fn along_both(at: usize, agreeing: &[usize], edges: &[Edge]) -> usize {
    let along = |end: fn(&Edge) -> usize| {
        let ends = || agreeing.iter().chain([&at]).map(|&loop_| end(&edges[loop_]));
        ends().max().unwrap_or(0) - ends().min().unwrap_or(0)
    };
    along(|edge| edge.from).min(along(|edge| edge.to))
}

/// The submaps along the way from one, with what the steps between know of each.
fn ways(path_covariances: &PathCovariances, start: usize) -> BTreeMap<usize, Matrix3<f64>> {
    let mut found = BTreeMap::new();
    let mut visited = 0;
    path_covariances.visit(start, |to, known| {
        let way = known.covariance;
        if way[(0, 0)] + way[(1, 1)] <= MAX_PATH_VARIANCE_M2 {
            found.insert(to, way);
        }
        visited += 1;
        if visited < SUBMAPS_ON_WAYS { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
    });
    found
}

fn covariance(information: &Matrix3<f64>) -> Option<Matrix3<f64>> {
    Some((information + Matrix3::identity() * MIN_INFORMATION).cholesky()?.inverse())
}

#[cfg(test)]
mod tests {
    use biplane_matcher::Pose2;

    use super::{MAX_CYCLE_SQUARED, along_both, asked, uncertain_m};
    use crate::slam::pose_graph::graduated_non_convexity::MAX_LOOP_SQUARED;
    use crate::slam::pose_graph::tests::edge;

    /// The share of squared Mahalanobis distances of three degrees of freedom below a limit: the integral of
    /// their density.
    fn share_below(limit: f64) -> f64 {
        let density = |x: f64| (x / std::f64::consts::TAU).sqrt() * (-0.5 * x).exp();
        let width = limit / 10_000.0;
        (0..10_000).map(|at| width * density((f64::from(at) + 0.5) * width)).sum()
    }

    #[test]
    fn limits_of_squared_distances_are_the_quantiles_that_they_say() {
        for (limit, share) in [(MAX_CYCLE_SQUARED, 0.99), (MAX_LOOP_SQUARED, 0.999)] {
            let found = share_below(limit);
            assert!((found - share).abs() < 0.03 * (1.0 - share), "{limit}: {found} and not {share}");
        }
    }

    #[test]
    fn the_more_is_in_doubt_the_more_has_to_agree_and_along_more_of_the_way() {
        let cases = [1.0, 3.0, 10.0, 60.0, f64::INFINITY].map(|uncertainty_m| asked(uncertainty_m, 1.5));
        assert_eq!(cases, [(0, 0), (1, 0), (2, 0), (2, 5), (2, 0)]);
    }

    #[test]
    fn a_loop_found_close_to_where_it_is_expected_is_less_in_doubt() {
        let cases = [(30.0, 2.0), (30.0, 5.0), (30.0, 20.0), (3.0, 2.0), (f64::INFINITY, 2.0)];
        assert_eq!(
            cases.map(|(half_m, away_m)| uncertain_m(half_m, away_m)),
            [16.0, 20.0, 30.0, 3.0, f64::INFINITY]
        );
    }

    #[test]
    fn ten_loops_at_one_place_are_short_company_and_three_along_the_way_are_long() {
        let at = |from, to| edge(from, to, Pose2::IDENTITY, [0.1; 3]);
        let edges = [at(1, 50), at(2, 51), at(3, 50), at(1, 52), at(7, 44), at(4, 47), at(30, 51)];
        assert_eq!(along_both(0, &[1, 2, 3], &edges), 2);
        assert_eq!(along_both(0, &[4, 5], &edges), 6);
        assert_eq!(along_both(0, &[6], &edges), 1, "far along one way only");
        assert_eq!(along_both(0, &[], &edges), 0);
    }
}
