//! Loops found in wide windows, where much looks alike, need others that agree with them.
//!
//! Two loops agree when the cycle of both and the ways between their ends closes within what is known of these (pairwise consistency,
//! after Mangelson et al. 2018). Where a loop has no company yet, the stretches before and after its two are looked for.

use biplane_matcher::wrap_angle;
use nalgebra::Matrix3;
use rayon::prelude::*;

use super::align::difference;
use super::candidate::{Closing, Pair};
use super::checkpoint::Checkpoint;
use super::graph::Edge;
use super::search::Window;
use super::uncertain::{Known, Ways, joined};

/// Up to this window one other loop is company enough, metres.
const NARROW_M: f64 = 4.0;
/// Stretches before and after the two of a loop.
const BESIDE: [(isize, isize); 8] = [(0, 1), (0, -1), (1, 0), (-1, 0), (1, 1), (-1, -1), (1, -1), (-1, 1)];
/// Around where a loop says that they are, metres and radians.
const BESIDE_M: f64 = 0.8;
const BESIDE_RAD: f64 = 0.1;
/// So many points that tell where along a corridor one is are many.
const RICH: usize = 150;

impl Closing<'_> {
    /// For loops that need company: the stretches before and after are looked for where the loop says that they are.
    pub(super) fn seek_company(
        &mut self,
        checkpoint: &mut Checkpoint,
        progress: &mut dyn FnMut(usize, usize),
    ) {
        let mut pairs: Vec<Pair> = Vec::new();
        let needy = self.loops.iter().filter(|found| found.half_m > self.params.alone_up_to_m);
        for found in needy.filter(|found| !self.sought.contains(&found.stretches)) {
            let [a, b] = found.stretches;
            for (da, db) in BESIDE {
                let (Some(one), Some(two)) = (a.checked_add_signed(da), b.checked_add_signed(db)) else {
                    continue;
                };
                let is_there = |stretch: usize, of: usize| {
                    stretch < self.submaps.len() && self.recording_of[stretch] == self.recording_of[of]
                };
                let known = self.loops.iter().any(|other| other.stretches == [one, two])
                    || pairs.iter().any(|pair| pair.stretches == [one, two]);
                if known || !is_there(one, a) || !is_there(two, b) || one >= two {
                    continue;
                }
                let guess = self.poses[one].between(&self.poses[a])
                    * found.found.pose
                    * self.poses[b].between(&self.poses[two]);
                let window = Window { half_m: BESIDE_M, half_rad: BESIDE_RAD };
                pairs.push(Pair { stretches: [one, two], guess, window, doubt_m: found.half_m });
            }
        }
        self.sought.extend(self.loops.iter().map(|found| found.stretches));
        self.search(&pairs, checkpoint, progress);
        self.sought.extend(pairs.iter().map(|pair| pair.stretches));
    }

    /// Whether a loop is narrow, or others agree with it.
    pub(super) fn in_company(&self, edges: &[Edge]) -> Vec<bool> {
        let needed = |at: usize| match self.loops[at].half_m {
            half_m if half_m <= self.params.alone_up_to_m => 0,
            half_m if half_m <= NARROW_M => 1,
            _ => 2,
        };
        // A place with much to tell it by is company to itself.
        let own = |at: usize| usize::from(self.loops[at].found.agreement.along_points >= RICH);
        self.company(edges)
            .into_iter()
            .enumerate()
            .map(|(at, agreeing)| agreeing + own(at) >= needed(at))
            .collect()
    }

    /// How many other loops agree with each.
    pub(super) fn company(&self, edges: &[Edge]) -> Vec<usize> {
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
            edges.iter().enumerate().filter(|(other, edge)| *other != at && agrees(edge)).count()
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

fn covariance(information: &Matrix3<f64>) -> Option<Matrix3<f64>> {
    Some((information + Matrix3::identity() * 1e-3).cholesky()?.inverse())
}
