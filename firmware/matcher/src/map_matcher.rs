//! The method `map`: every scan against everything mapped so far.
//!
//! Align from the prior; when the result explains too little, search the surroundings and align from what the search
//! finds. A scan that contradicts the map teaches it nothing, until patience ends. Frame: map. Units: metres, radians.

use crate::align::{Alignment, Prior, align, fit};
use crate::journal::Journal;
use crate::local_map::LocalMap;
use crate::params::TrackerParams;
use crate::points::EndPoints;
use crate::pose::{Pose2, wrap_angle};
use crate::search::{Search, Window};

/// So many results of a search are aligned.
const CANDIDATES: usize = 4;

/// Map, search and what they remember.
#[derive(Clone, Debug)]
pub struct MapMatcher {
    params: TrackerParams,
    map: LocalMap,
    search: Search,
    learnt_at: Option<Pose2>,
    lost_in_a_row: u32,
    /// The iterations of the last scan.
    pub journal: Journal,
}

/// Whether an alignment is to be believed.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
pub enum Verdict {
    /// It explains the scan.
    Found,
    /// It explains the scan, but nothing else expects it: not to be believed yet, nor to be learnt from.
    Contested,
    /// The map knows too little of what the scan sees: go on from the odometry, and learn.
    NewGround,
    /// The scan contradicts the map everywhere around.
    Lost,
}

impl MapMatcher {
    /// A matcher with an empty map and all the memory it will ever have.
    pub fn new(params: &TrackerParams) -> Self {
        Self {
            params: *params,
            map: LocalMap::new(params.map),
            search: Search::new(params.search, params.map.cell_m),
            learnt_at: None,
            lost_in_a_row: 0,
            journal: Journal::default(),
        }
    }

    /// Forgets everything: the next scan begins a new map, in the same memory.
    pub fn forget(&mut self) {
        self.map.clear();
        self.learnt_at = None;
        self.lost_in_a_row = 0;
    }

    /// The map, to be written in.
    pub fn map_mut(&mut self) -> &mut LocalMap {
        &mut self.map
    }

    /// The map.
    pub fn map(&self) -> &LocalMap {
        &self.map
    }

    /// Finds the scan's pose. `others` are further guesses worth a try when the prior's fails.
    pub fn locate(
        &mut self,
        points: &EndPoints,
        prior: &Prior,
        others: &[Pose2],
        glance: Window,
        window: Window,
    ) -> (Alignment, Verdict) {
        let mut best = if glance.half_m > 0.0 {
            self.by_sight(points, prior, glance)
        } else {
            self.near_prior(points, prior, glance)
        };
        if best.fit.score() < self.params.search.below_score && self.informative(&best) {
            for other in others {
                self.try_from(points, *other, prior, &mut best);
            }
            for candidate in self.search.run::<CANDIDATES>(&self.map, points, &prior.mean, window) {
                if candidate.score > 0.0 {
                    self.try_from(points, candidate.pose, prior, &mut best);
                }
            }
        }
        let verdict = if !self.informative(&best) {
            Verdict::NewGround
        } else if best.fit.score() < self.params.search.lost_below_score {
            Verdict::Lost
        } else {
            Verdict::Found
        };
        (best, verdict)
    }

    /// How much of a scan a pose explains, 0 to 1.
    pub fn score_at(&self, points: &EndPoints, pose: &Pose2) -> f64 {
        fit(&self.map, points, pose, &self.params.align).score()
    }

    /// From where the odometry says; the headings around are looked at when that does not fit.
    fn near_prior(&mut self, points: &EndPoints, prior: &Prior, glance: Window) -> Alignment {
        let mut best = align(&self.map, points, prior.mean, prior, &self.params.align, &mut self.journal);
        if best.fit.explained < self.params.search.glance_below_share * best.fit.total {
            let seen = self.search.first(&self.map, points, &prior.mean, glance);
            if seen.score > 0.0 && !self.search.neighbours(&seen.pose, &best.pose) {
                self.try_from(points, seen.pose, prior, &mut best);
            }
        }
        best
    }

    /// From what a search finds, when the prior is no more than a guess; of several places that look alike all are aligned.
    fn by_sight(&mut self, points: &EndPoints, prior: &Prior, glance: Window) -> Alignment {
        let [first, rivals @ ..] = self.search.run::<CANDIDATES>(&self.map, points, &prior.mean, glance);
        let start = if first.score > 0.0 { first.pose } else { prior.mean };
        let mut best = align(&self.map, points, start, prior, &self.params.align, &mut self.journal);
        let share = self.params.search.rival_share as f32;
        for rival in rivals.iter().filter(|rival| rival.score > 0.0) {
            if !best.at_rest || rival.score > share * first.score {
                self.try_from(points, rival.pose, prior, &mut best);
            }
        }
        best
    }

    fn informative(&self, alignment: &Alignment) -> bool {
        alignment.fit.informative >= self.params.search.min_informative * alignment.fit.total
    }

    /// Aligns from another start and keeps the result when it is the likelier one.
    fn try_from(&mut self, points: &EndPoints, start: Pose2, prior: &Prior, best: &mut Alignment) {
        let found = align(&self.map, points, start, prior, &self.params.align, &mut self.journal);
        let iterations = best.iterations + found.iterations;
        let align = &self.params.align;
        if found.likelihood(prior, align) > best.likelihood(prior, align) {
            *best = found;
        }
        best.iterations = iterations;
    }

    /// Lets the map learn from the scan, when the base has moved enough and the verdict allows it.
    pub fn learn(&mut self, map_from_base: &Pose2, points: &EndPoints, verdict: Verdict) -> bool {
        if verdict == Verdict::Lost {
            self.lost_in_a_row += 1;
            if self.lost_in_a_row <= self.params.search.patience_scans {
                return false;
            }
        } else {
            self.lost_in_a_row = 0;
        }
        if verdict == Verdict::Contested {
            return false;
        }
        let moved_enough = self.learnt_at.is_none_or(|last| {
            let away_m = (map_from_base.x_m - last.x_m).hypot(map_from_base.y_m - last.y_m);
            let turned_rad = wrap_angle(map_from_base.theta_rad - last.theta_rad).abs();
            away_m >= self.params.map.learn_every_m || turned_rad >= self.params.map.learn_every_rad
        });
        if moved_enough {
            self.map.learn(map_from_base, points);
            self.learnt_at = Some(*map_from_base);
        }
        moved_enough
    }
}
