//! Which stretches might see the same place, closest guess first; and the loops found so, believed only in company.
//!
//! The window of a search is three standard deviations of what the graph knows of the two stretches; at first of a fifth of that (see
//! [`CandidateParams::first_share`]). Narrow windows come first:
//! a loop that they find makes the others' windows narrow. In a wide window much looks alike, so a loop found there needs others,
//! of other stretches, that agree with it within what the way between them allows.

use std::collections::{BTreeMap, BTreeSet};

use biplane_matcher::{Pose2, wrap_angle};
use rayon::prelude::*;

use super::align::difference;
use super::checkpoint::{Asked, Checkpoint};
use super::graph::Edge;
use super::refine::{Found, RefineParams, find};
use super::robust;
use super::search::Window;
use super::submap::Submap;
use super::uncertain::{Known, Ways, reversed};

/// How loops are looked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CandidateParams {
    /// Middles of two stretches may be this far apart to see the same place, metres. Larger: more pairs, of which fewer fit.
    pub near_m: f64,
    /// Standard deviations of the window. Larger: surer to hold the loop, slower.
    pub sigmas: f64,
    /// Share of the drift that steps may have with which is looked first. A matcher that works as it should drifts by so little; loops found in
    /// such windows make the others narrow, so that corridors which look alike are never compared from afar. Larger: more look alike.
    /// Smaller: more is left to the wide windows.
    pub first_share: f64,
    /// Lengths may all be off by this share, so much of the way wider is the window. Larger: the same.
    pub scale_share: f64,
    /// Windows wider than this are not searched, metres each way.
    pub widest_m: f64,
    /// Pairs tried for each stretch in a round.
    pub pairs_a_round: usize,
    /// A loop found in a window wider than this needs company, metres.
    pub alone_up_to_m: f64,
    /// Pairs known better than this already are not searched (standard deviation, metres). Smaller: more loops, slower.
    pub known_m: f64,
}

impl Default for CandidateParams {
    fn default() -> Self {
        Self {
            near_m: 7.0,
            sigmas: 3.0,
            first_share: 0.2,
            scale_share: 0.01,
            widest_m: 40.0,
            pairs_a_round: 4,
            alone_up_to_m: 1.5,
            known_m: 0.15,
        }
    }
}

/// A loop between two stretches.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Loop {
    /// The stretches, by number: the first holds the second.
    pub stretches: [usize; 2],
    /// What was found.
    pub found: Found,
    /// How wide was searched, metres.
    pub half_m: f64,
}

impl Loop {
    fn edge(&self, pose_of: impl Fn(usize) -> usize) -> Edge {
        let [from, to] = self.stretches.map(pose_of);
        Edge { from, to, measured: self.found.pose, information: self.found.information }
    }
}

/// The search for loops: stretches as poses of a graph of their own.
#[derive(Debug)]
pub struct Closing<'a> {
    pub(super) submaps: &'a [Submap],
    /// Which recording each stretch is of.
    pub recording_of: &'a [usize],
    /// Steps between the middles of following stretches of one recording.
    pub(super) chain: &'a [Edge],
    pub(super) params: CandidateParams,
    pub(super) refine: RefineParams,
    /// The middles' poses.
    pub poses: Vec<Pose2>,
    /// All loops found.
    pub loops: Vec<Loop>,
    /// Whether each is believed.
    pub believed: Vec<bool>,
    /// What was searched, and around which guess.
    pub(super) tried: BTreeMap<[usize; 2], (Pose2, f64)>,
    /// Loops whose company was looked for, and those found so.
    pub(super) sought: BTreeSet<[usize; 2]>,
    /// Pairs searched.
    pub searched: usize,
    /// See [`super::LoopParams::spoilt_share`].
    pub spoilt_share: f64,
}

/// A pair to be searched.
pub(super) struct Pair {
    pub(super) stretches: [usize; 2],
    pub(super) guess: Pose2,
    pub(super) window: Window,
    /// How widely the place was searched before: a guess that comes from a loop found in a wide window is as doubtful as that.
    pub(super) doubt_m: f64,
}

/// Windows beyond this are searched sparingly, metres.
const WIDE_M: f64 = 4.0;
/// Pairs between two savings of what was found.
const BATCH: usize = 256;

impl<'a> Closing<'a> {
    /// A search over stretches at these poses, `recording_of` telling which recording each is of.
    pub fn new(
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
            believed: vec![],
            tried,
            sought: BTreeSet::new(),
            searched: 0,
            spoilt_share: 0.0,
        }
    }

    /// Looks until nothing more is found, with windows of a small drift first. `progress` hears of pairs searched and loops believed.
    pub fn run(&mut self, checkpoint: &mut Checkpoint, progress: &mut dyn FnMut(usize, usize)) {
        for share in [self.params.first_share, 1.0] {
            self.run_with(share, checkpoint, progress);
        }
    }

    /// Looks until nothing more is found in windows of this share of the drift, narrow ones first.
    fn run_with(&mut self, share: f64, checkpoint: &mut Checkpoint, progress: &mut dyn FnMut(usize, usize)) {
        let mut widest_m = 1.0;
        loop {
            let pairs = self.pairs(widest_m, share);
            let before = self.believed_count();
            self.search(&pairs, checkpoint, progress);
            self.seek_company(checkpoint, progress);
            self.believe();
            if self.believed_count() <= before || pairs.is_empty() {
                if widest_m >= self.params.widest_m {
                    return;
                }
                widest_m *= 2.0;
            }
        }
    }

    /// Loops believed.
    pub fn believed_count(&self) -> usize {
        self.believed.iter().filter(|believed| **believed).count()
    }

    pub(super) fn search(
        &mut self,
        pairs: &[Pair],
        checkpoint: &mut Checkpoint,
        progress: &mut dyn FnMut(usize, usize),
    ) {
        for batch in pairs.chunks(BATCH) {
            let known: &Checkpoint = checkpoint;
            let answer = |pair: &Pair| {
                let asked = Asked::new(pair.stretches, &pair.guess, pair.window, pair.doubt_m);
                if let Some(found) = known.answer(&asked) {
                    return (asked, found);
                }
                let [a, b] = pair.stretches;
                (
                    asked,
                    find(
                        &self.submaps[a],
                        &self.submaps[b],
                        &pair.guess,
                        (pair.window, pair.doubt_m),
                        &self.refine,
                    ),
                )
            };
            let answers: Vec<(Asked, Option<Found>)> = batch.par_iter().map(answer).collect();
            for (pair, (_, found)) in batch.iter().zip(&answers) {
                self.tried.insert(pair.stretches, (pair.guess, pair.window.half_m));
                if let Some(found) = *found {
                    let found = spoilt(found, pair, self.loops.len(), self.spoilt_share);
                    self.loops.push(Loop {
                        stretches: pair.stretches,
                        found,
                        half_m: pair.window.half_m.max(pair.doubt_m),
                    });
                }
            }
            checkpoint.add(&answers);
            self.searched += batch.len();
            progress(self.searched, self.believed_count());
        }
    }

    /// Pairs worth a search, with windows up to `widest_m` when the steps have this share of their drift. That they have is an assumption:
    /// what is found so is in doubt by the geometric mean of both.
    fn pairs(&self, widest_m: f64, share: f64) -> Vec<Pair> {
        let loops = self.believed_edges(|stretch| stretch);
        let ways = Ways::new(self.submaps.len(), self.chain.iter().chain(&loops));
        (0..self.submaps.len())
            .into_par_iter()
            .flat_map_iter(|query| {
                let known = ways.from(query);
                let mut pairs: Vec<(f64, Pair)> = (0..query)
                    .filter_map(|other| self.pair(other, query, known[other].as_ref()?, widest_m, share))
                    .collect();
                pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
                self.sparing(query, pairs)
            })
            .collect()
    }

    /// The pairs of a stretch to search in this round, of those nearest first. Wide windows, which cost most, are searched
    /// sparingly: one loop found makes the others narrow.
    fn sparing(&self, query: usize, pairs: Vec<(f64, Pair)>) -> impl Iterator<Item = Pair> {
        let mut left = [
            self.params.pairs_a_round,
            if query.is_multiple_of(2) { self.params.pairs_a_round / 2 } else { 0 },
        ];
        pairs.into_iter().map(|(_, pair)| pair).filter(move |pair| {
            let left = &mut left[usize::from(pair.window.half_m > WIDE_M)];
            let chosen = *left > 0;
            *left = left.saturating_sub(1);
            chosen
        })
    }

    /// Whether a pair is worth a search; how likely it is seen by its distance, nearer first.
    fn pair(
        &self,
        other: usize,
        query: usize,
        known: &Known,
        widest_m: f64,
        share: f64,
    ) -> Option<(f64, Pair)> {
        let (one, two) = (&self.submaps[other], &self.submaps[query]);
        if one.nodes.end >= two.nodes.start || self.loops.iter().any(|l| l.stretches == [other, query]) {
            return None;
        }
        let from_query = self.poses[query].between(&self.poses[other]);
        let (guess, covariance) = reversed(&from_query, &known.covariance);
        let sigma_m = covariance.fixed_view::<2, 2>(0, 0).symmetric_eigenvalues().max().max(0.0).sqrt();
        if sigma_m < self.params.known_m && covariance[(2, 2)].sqrt() < 0.2 * self.params.known_m {
            return None;
        }
        let doubt_m = self.params.sigmas * sigma_m + self.params.scale_share * known.way_m;
        let half_m = share * doubt_m + 0.3;
        let away_m = guess.distance_m();
        if half_m > widest_m || away_m > self.params.near_m + half_m {
            return None;
        }
        if let Some((tried, tried_m)) = self.tried.get(&[other, query]) {
            let moved = difference(&guess, tried);
            // The same window again finds the same.
            let is_like = half_m > 0.3 * tried_m && half_m < 1.5 * tried_m;
            if moved[0].hypot(moved[1]) < 0.5 * tried_m && moved[2].abs() < 0.1 && is_like {
                return None;
            }
        }
        let half_rad = share * self.params.sigmas * covariance[(2, 2)].sqrt() + 0.03;
        Some((
            away_m,
            Pair {
                stretches: [other, query],
                guess,
                window: Window { half_m, half_rad },
                doubt_m: share.sqrt() * doubt_m + 0.3,
            },
        ))
    }

    pub(super) fn edges(&self) -> Vec<Edge> {
        self.loops.iter().map(|found| found.edge(|stretch| stretch)).collect()
    }

    /// The loops believed, between other poses that stand for the stretches.
    pub fn believed_edges(&self, pose_of: impl Fn(usize) -> usize) -> Vec<Edge> {
        let believed = self.loops.iter().zip(&self.believed).filter(|(_, believed)| **believed);
        believed.map(|(found, _)| found.edge(&pose_of)).collect()
    }

    /// Which loops are believed now, and the poses that they make.
    pub(super) fn believe(&mut self) {
        let edges = self.edges();
        let in_company = self.in_company(&edges);
        let chosen: Vec<usize> = (0..edges.len()).filter(|&at| in_company[at]).collect();
        let loops: Vec<Edge> = chosen.iter().map(|&at| edges[at]).collect();
        let weights = robust::optimise(&mut self.poses, self.chain, &loops);
        self.believed = vec![false; edges.len()];
        for (&at, weight) in chosen.iter().zip(weights) {
            self.believed[at] = weight > 0.5;
        }
    }
}

/// Of every ten loops as many as the share says are moved somewhere else in their window, as a false loop might be.
fn spoilt(mut found: Found, pair: &Pair, number: usize, share: f64) -> Found {
    let draw = |salt: u64| {
        let mut bits =
            (number as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ salt.wrapping_mul(0xD1B5_4A32_D192_ED03);
        bits = (bits ^ (bits >> 31)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        ((bits ^ (bits >> 27)) >> 11) as f64 / (1_u64 << 53) as f64
    };
    if draw(1) < share {
        let reach_m = pair.window.half_m.max(3.0);
        let off = |salt: u64, most: f64| (2.0 * draw(salt) - 1.0) * most;
        found.pose = Pose2::new(
            found.pose.x_m + off(2, reach_m),
            found.pose.y_m + off(3, reach_m),
            wrap_angle(found.pose.theta_rad + off(4, 0.5)),
        );
    }
    found
}
