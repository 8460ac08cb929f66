//! Loops found in wide windows, where much looks alike, need others that agree with them.
//!
//! Two loops agree when the cycle of both and the ways between their ends closes within what is known of these (pairwise consistency,
//! after Mangelson et al. 2018). Where a loop has no company yet, the stretches before and after its two are looked for.

use std::collections::BTreeMap;

use biplane_matcher::wrap_angle;
use nalgebra::Matrix3;
use rayon::prelude::*;

use super::align::difference;
use super::candidate::{Closing, Loop, Pair};
use super::checkpoint::Checkpoint;
use super::graph::Edge;
use super::search::Window;
use super::uncertain::{Known, Ways, joined};

/// Up to this window one other loop is company enough, metres.
const NARROW_M: f64 = 4.0;
/// Up to this one, two others wherever they are: beyond, there are enough places that one of them looks like this one for ten metres.
const WIDE_M: f64 = 16.0;
/// Beyond it the loops that agree have to lie along so many stretches of both ways (4 m each). More: a place passed but shortly is not
/// found again from afar; fewer: chance suffices.
const STRETCHES_ALONG: usize = 5;
/// Stretches before and after the two of a loop.
const BESIDE: [(isize, isize); 8] = [(0, 1), (0, -1), (1, 0), (-1, 0), (1, 1), (-1, -1), (1, -1), (-1, 1)];
/// Around where a loop says that they are, metres and radians.
const BESIDE_M: f64 = 0.8;
const BESIDE_RAD: f64 = 0.1;
/// So many points that tell where along a corridor one is are many.
const RICH: usize = 150;

impl Closing<'_> {
    /// For loops that need company: the stretches before and after are looked for where the loop says that they are; where much is in
    /// doubt, from those found on again, until the ways part.
    pub(super) fn seek_company(
        &mut self,
        checkpoint: &mut Checkpoint,
        progress: &mut dyn FnMut(usize, usize),
    ) {
        for round in 0..STRETCHES_ALONG {
            // On and on only ahead and back: both ways go on by a stretch each.
            let pairs = self.beside(if round == 0 { &BESIDE } else { &BESIDE[4..] });
            self.sought.extend(self.loops.iter().map(|found| found.stretches));
            if pairs.is_empty() {
                return;
            }
            self.search(&pairs, checkpoint, progress);
            let ends_here = |pair: &&Pair| asked(pair.doubt_m, self.params.alone_up_to_m).1 == 0;
            self.sought.extend(pairs.iter().filter(ends_here).map(|pair| pair.stretches));
        }
    }

    /// The pairs beside loops that need company and were not sought for yet.
    fn beside(&self, steps: &[(isize, isize)]) -> Vec<Pair> {
        let mut pairs: BTreeMap<[usize; 2], Pair> = BTreeMap::new();
        let needy = self.loops.iter().filter(|found| found.half_m > self.params.alone_up_to_m);
        for found in needy.filter(|found| !self.sought.contains(&found.stretches)) {
            let [a, b] = found.stretches;
            for &(da, db) in steps {
                let (Some(one), Some(two)) = (a.checked_add_signed(da), b.checked_add_signed(db)) else {
                    continue;
                };
                let is_there = |stretch: usize, of: usize| {
                    stretch < self.submaps.len() && self.recording_of[stretch] == self.recording_of[of]
                };
                let known = self.loops.iter().any(|other| other.stretches == [one, two]);
                if known || !is_there(one, a) || !is_there(two, b) || one >= two {
                    continue;
                }
                let guess = self.poses[one].between(&self.poses[a])
                    * found.found.pose
                    * self.poses[b].between(&self.poses[two]);
                let window = Window { half_m: BESIDE_M, half_rad: BESIDE_RAD };
                let pair = Pair { stretches: [one, two], guess, window, doubt_m: found.half_m };
                pairs.entry(pair.stretches).or_insert(pair);
            }
        }
        pairs.into_values().collect()
    }

    /// Whether a loop is narrow, or others agree with it, along as much of the way as the doubt asks for.
    pub(super) fn in_company(&self, edges: &[Edge]) -> Vec<bool> {
        let stands = |(at, agreeing): (usize, Vec<usize>)| {
            let found = &self.loops[at];
            // A place with much to tell it by is company to itself.
            let own = usize::from(found.found.agreement.along_points >= RICH);
            let (company, along) = asked(found.half_m, self.params.alone_up_to_m);
            !self.lies_anywhere(found)
                && agreeing.len() + own >= company
                && along_both(at, &agreeing, edges) >= along
        };
        self.company(edges).into_iter().enumerate().map(stands).collect()
    }

    /// Bare corridor found from afar lies anywhere along the corridor: it leads on to what tells, and holds only where it is when that is known.
    fn lies_anywhere(&self, found: &Loop) -> bool {
        let [from, to] = found.stretches.map(|stretch| self.poses[stretch]);
        let away = difference(&from.between(&to), &found.found.pose);
        found.half_m > self.refine.narrow_m
            && !self.refine.tells(&found.found.agreement)
            && away[0].hypot(away[1]) > self.refine.narrow_m
    }

    /// The other loops that agree with each. Bare corridor agrees with any other: the way is followed over it, and it counts for nothing.
    pub(super) fn company(&self, edges: &[Edge]) -> Vec<Vec<usize>> {
        let ways = Ways::new(self.submaps.len(), self.chain.iter());
        let mut starts: Vec<usize> = edges.iter().flat_map(|edge| [edge.from, edge.to]).collect();
        starts.sort_unstable();
        starts.dedup();
        let known: Vec<Vec<Option<Known>>> = starts.par_iter().map(|&start| ways.from(start)).collect();
        let from = |start: usize, to: usize| {
            starts.binary_search(&start).ok().and_then(|at| known[at][to]).map(|known| known.covariance)
        };
        let agreeing = |at: usize| {
            let one = &edges[at];
            let agrees =
                |other: &Edge| self.agree(one, other, [from(one.from, other.from), from(one.to, other.to)]);
            let tells = |at: usize| self.refine.tells(&self.loops[at].found.agreement);
            (0..edges.len()).filter(|&other| other != at && tells(other) && agrees(&edges[other])).collect()
        };
        (0..edges.len()).into_par_iter().map(agreeing).collect()
    }

    /// Whether the cycle of two loops and the ways between their ends closes; the ways have to be short for that to say anything.
    fn agree(&self, one: &Edge, other: &Edge, known: [Option<Matrix3<f64>>; 2]) -> bool {
        let [Some(at_from), Some(at_to)] = known else { return false };
        let limit = 1.0;
        if at_from[(0, 0)] + at_from[(1, 1)] > limit || at_to[(0, 0)] + at_to[(1, 1)] > limit {
            return false;
        }
        let Some(own) = covariance(&one.information) else { return false };
        let Some(its) = covariance(&other.information) else { return false };
        // Over the first ends and back over the second ones.
        let from_way = self.poses[one.from].between(&self.poses[other.from]);
        let to_way = self.poses[one.to].between(&self.poses[other.to]);
        let (there, there_known) = joined((&one.measured, &own), (&to_way, &at_to));
        let (here, here_known) = joined((&from_way, &at_from), (&other.measured, &its));
        let away = difference(&there, &here);
        let away = nalgebra::Vector3::new(away[0], away[1], wrap_angle(away[2]));
        (there_known + here_known).cholesky().is_some_and(|factors| away.dot(&factors.solve(&away)) < 11.3)
    }
}

/// How many others have to agree with a loop when so much is in doubt, and along how many stretches. Of another recording's place nothing
/// is known at first: [`super::join`] asks for more by itself.
fn asked(doubt_m: f64, alone_up_to_m: f64) -> (usize, usize) {
    match doubt_m {
        doubt_m if doubt_m <= alone_up_to_m => (0, 0),
        doubt_m if doubt_m <= NARROW_M => (1, 0),
        doubt_m if doubt_m > WIDE_M && doubt_m.is_finite() => (2, STRETCHES_ALONG),
        _ => (2, 0),
    }
}

/// Along how many stretches of both ways a loop and those that agree with it lie.
fn along_both(at: usize, agreeing: &[usize], edges: &[Edge]) -> usize {
    let along = |end: fn(&Edge) -> usize| {
        let ends = || agreeing.iter().chain([&at]).map(|&loop_| end(&edges[loop_]));
        ends().max().unwrap_or(0) - ends().min().unwrap_or(0)
    };
    along(|edge| edge.from).min(along(|edge| edge.to))
}

fn covariance(information: &Matrix3<f64>) -> Option<Matrix3<f64>> {
    Some((information + Matrix3::identity() * 1e-3).cholesky()?.inverse())
}

#[cfg(test)]
mod tests {
    use biplane_matcher::Pose2;

    use super::super::graph::tests::edge;
    use super::{along_both, asked};

    #[test]
    fn the_more_is_in_doubt_the_more_has_to_agree_and_along_more_of_the_way() {
        let cases = [1.0, 3.0, 10.0, 60.0, f64::INFINITY].map(|doubt_m| asked(doubt_m, 1.5));
        assert_eq!(cases, [(0, 0), (1, 0), (2, 0), (2, 5), (2, 0)]);
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
