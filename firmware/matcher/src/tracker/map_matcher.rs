//! The method `map`: every scan against everything mapped so far.
//!
//! Align from the prior; when the result explains too little, search the surroundings and align from what the
//! search finds. A scan that contradicts the map teaches it nothing, until patience ends. Frame: map. Units:
//! meters, radians.

use crate::map::LocalMap;
use crate::params::TrackerParams;
use crate::pose_covariance::Evidence;
use crate::registration::gauss_newton::correspondences::Correspondences;
use crate::registration::gauss_newton::fit::Fit;
use crate::registration::gauss_newton::on_map::OnMap;
use crate::registration::gauss_newton::params::AlignParams;
use crate::registration::gauss_newton::prior::Prior;
use crate::registration::gauss_newton::{Alignment, Laid, align};
use crate::registration::journal::Journal;
use crate::registration::search::correlative::Search;
use crate::registration::search::{Candidate, Window};
use crate::registration::verdict::{Verdict, is_informative};
use crate::scan::end_points::EndPoints;
use crate::tracker::range_noise::RangeNoise;
use biplane_geometry::PortableMath;
use biplane_geometry::{Pose2, wrap_angle};

/// So many results of a search are aligned.
const CANDIDATES: usize = 4;
/// When the alignment from the odometry explains this share of all end points there is no heading search:
/// what fits that well is no wrong heading. Larger: a heading search for more scans, more time; smaller: a
/// turn may be missed. Error 0.0248 m also when halved or doubled.
const HEADING_SEARCH_BELOW_SHARE: f64 = 0.9;
/// Below this share of explained end points the surroundings are searched. Larger: more searches, more time.
/// Error 0.0248 m halved, 0.0246 m doubled. Without odometry 0.0250 m and 0.0267 m.
const SEARCH_BELOW_SCORE: f64 = 0.6;
/// All headings are searched in so many sectors, the one about the prior being the ordinary search's.
const SECTORS: u32 = 6;
/// Width of a sector, radians.
const SECTOR_RAD: f64 = std::f64::consts::TAU / 6.0;
/// How far a sector's search looks each way, meters. Larger: slower.
const SECTOR_HALF_M: f64 = 0.3;
/// A heading that nobody expected is believed from this share of the informative end points on.
const SURE_SCORE: f64 = 0.8;
/// And from this share of all of them on: what sees little of the map may lie anywhere.
const SURE_SHARE: f64 = 0.5;
/// Without a measured prior, places that score at least this share of the best one are aligned as well.
/// Smaller: slower, fewer wrong places taken for right. Starts found 96.0 % halved, 95.1 % doubled.
const RIVAL_SHARE: f32 = 0.8;
/// The map learns from a scan when the base has moved this far since the last one it learned from, meters: a
/// cell. Larger: cheaper, and the map knows less of what is ahead; smaller: the map repeats the same beams'
/// errors. Error 0.0246 m halved, 0.0245 m doubled.
const LEARN_EVERY_M: f64 = 0.05;
/// The same for turning, radians. Error 0.0246 m halved, 0.0247 m doubled.
const LEARN_EVERY_RAD: f64 = 0.05;

/// Map, search and what they remember.
#[derive(Clone, Debug)]
pub(crate) struct MapMatcher {
    params: TrackerParams,
    stated_noise_m: f64,
    range_noise: RangeNoise,
    map: LocalMap,
    search: Search,
    correspondences: Correspondences,
    learned_at: Option<Pose2>,
    lost_in_a_row: u32,
    /// The iterations of the last scan.
    pub journal: Journal,
}

impl MapMatcher {
    /// A matcher with an empty map and all the memory it will ever have.
    pub(crate) fn new(params: &TrackerParams) -> Self {
        Self {
            params: *params,
            stated_noise_m: params.align.range_noise_m,
            range_noise: RangeNoise::default(),
            map: LocalMap::new(params.map),
            search: Search::new(params.search, params.map.cell_m),
            correspondences: Correspondences::with_capacity(params.points.max_beams),
            learned_at: None,
            lost_in_a_row: 0,
            journal: Journal::default(),
        }
    }

    /// Forgets everything: the next scan begins a new map, in the same memory.
    pub(crate) fn forget(&mut self) {
        self.map.clear();
        self.learned_at = None;
        self.lost_in_a_row = 0;
    }

    /// The map, to be written in.
    pub(crate) fn map_mut(&mut self) -> &mut LocalMap {
        &mut self.map
    }

    /// The map.
    pub(crate) fn map(&self) -> &LocalMap {
        &self.map
    }

    /// Takes over how well a match fits that is believed. Where the base stands the same beams err in the
    /// same way, and the map has learned that.
    pub(crate) fn accept(&mut self, found: &Alignment) {
        if !self.has_moved(&found.pose) {
            return;
        }
        self.range_noise.note(found.fit.squares_m2, found.fit.on_lines);
        self.params.align.range_noise_m = self.range_noise.bounded(self.stated_noise_m);
    }

    /// What alignments take for granted by now.
    pub(crate) fn align_params(&self) -> &AlignParams {
        &self.params.align
    }

    /// What the scan that was located last knows of its pose.
    pub(crate) fn evidence(&mut self, pose: &Pose2) -> Evidence {
        Evidence::gather(&self.map, &mut self.correspondences, pose, &self.params.align)
    }

    /// Finds the scan's pose. `others` are further guesses worth a try when the prior's fails.
    pub(crate) fn locate(
        &mut self,
        points: &EndPoints,
        prior: &Prior,
        others: &[Pose2],
        heading_window: Window,
        window: Window,
    ) -> (Alignment, Verdict) {
        self.correspondences.begin(points.as_slice());
        let mut best = if heading_window.half_m > 0.0 {
            self.coarse_search(points, prior, heading_window)
        } else {
            self.near_prior(points, prior, heading_window)
        };
        if explains_little(&best.fit) {
            for other in others {
                self.try_from(points, *other, prior, &mut best);
            }
            for candidate in self.search.run::<CANDIDATES>(&self.map, points, &prior.mean, window) {
                if candidate.score > 0.0 {
                    self.try_from(points, candidate.pose, prior, &mut best);
                }
            }
        }
        let contradicts = explains_little(&best.fit) && prior.is_contradicted_by(&best.pose);
        if contradicts || Verdict::of(&best.fit) == Verdict::Lost {
            self.all_headings(points, prior, &mut best);
        }
        (best, Verdict::of(&best.fit))
    }

    /// Looks at the headings that the searches before left out: wheels that slipped in a turn, a turn that
    /// the odometry missed, or a base that was turned by hand. What is found there is kept when it explains
    /// nearly all of the scan only: places look alike when they are turned round.
    fn all_headings(&mut self, points: &EndPoints, prior: &Prior, best: &mut Alignment) {
        let sector = Window { half_m: SECTOR_HALF_M, half_rad: 0.5 * SECTOR_RAD };
        let mut seen = Candidate::default();
        for number in sectors_due(self.lost_in_a_row) {
            let theta_rad = wrap_angle(prior.mean.theta_rad + f64::from(number) * SECTOR_RAD);
            let found = self.search.first(&self.map, points, &Pose2 { theta_rad, ..prior.mean }, sector);
            if found.score > seen.score {
                seen = found;
            }
        }
        if seen.score > 0.0 {
            let mut found = *best;
            self.try_from(points, seen.pose, prior, &mut found);
            let is_sure =
                found.fit.score() >= SURE_SCORE && found.fit.explained >= SURE_SHARE * found.fit.total;
            if is_sure {
                *best = found;
            }
        }
    }

    /// Finds the pose of the scan that was located last again, from another prior alone, with no search
    /// around.
    pub(crate) fn locate_near(&mut self, points: &EndPoints, prior: &Prior) -> (Alignment, Verdict) {
        let found = self.align(points, prior.mean, prior);
        (found, Verdict::of(&found.fit))
    }

    /// How much of a scan a pose explains, 0 to 1.
    pub(crate) fn score_at(&mut self, points: &EndPoints, pose: &Pose2) -> f64 {
        let Self { map, correspondences, params, .. } = self;
        OnMap { map, points: points.as_slice(), correspondences }.fit(pose, &params.align).score()
    }

    fn align(&mut self, points: &EndPoints, start: Pose2, prior: &Prior) -> Alignment {
        let Self { map, correspondences, params, journal, .. } = self;
        let mut laid = OnMap { map, points: points.as_slice(), correspondences };
        align(&mut laid, start, prior, &params.align, journal)
    }

    /// From where the odometry says; the headings around are looked at when that does not fit.
    fn near_prior(&mut self, points: &EndPoints, prior: &Prior, heading_window: Window) -> Alignment {
        let mut best = self.align(points, prior.mean, prior);
        if best.fit.explained < HEADING_SEARCH_BELOW_SHARE * best.fit.total {
            let seen = self.search.first(&self.map, points, &prior.mean, heading_window);
            if seen.score > 0.0 && !self.search.neighbors(&seen.pose, &best.pose) {
                self.try_from(points, seen.pose, prior, &mut best);
            }
        }
        best
    }

    /// From what a search finds, when the prior is no more than a guess; of several places that look alike
    /// all are aligned.
    fn coarse_search(&mut self, points: &EndPoints, prior: &Prior, heading_window: Window) -> Alignment {
        let [first, rivals @ ..] =
            self.search.run::<CANDIDATES>(&self.map, points, &prior.mean, heading_window);
        let start = if first.score > 0.0 { first.pose } else { prior.mean };
        let mut best = self.align(points, start, prior);
        for rival in rivals.iter().filter(|rival| rival.score > 0.0) {
            if !best.at_rest || rival.score > RIVAL_SHARE * first.score {
                self.try_from(points, rival.pose, prior, &mut best);
            }
        }
        best
    }

    /// Aligns from another start and keeps the result when it is the likelier one.
    fn try_from(&mut self, points: &EndPoints, start: Pose2, prior: &Prior, best: &mut Alignment) {
        let found = self.align(points, start, prior);
        let iterations = best.iterations + found.iterations;
        if found.likelihood(prior) > best.likelihood(prior) {
            *best = found;
        }
        best.iterations = iterations;
    }

    /// Lets the map learn from the scan, when the base has moved enough and the verdict allows it.
    pub(crate) fn learn(&mut self, map_from_base: &Pose2, points: &EndPoints, verdict: Verdict) -> bool {
        if verdict == Verdict::Lost {
            self.lost_in_a_row += 1;
            if self.lost_in_a_row <= self.params.search.patience_scans {
                return false;
            }
        } else {
            self.lost_in_a_row = 0;
        }
        if verdict == Verdict::Unconfirmed {
            return false;
        }
        let moved_enough = self.has_moved(map_from_base);
        if moved_enough {
            self.map.learn(map_from_base, points);
            self.learned_at = Some(*map_from_base);
        }
        moved_enough
    }

    /// Whether the base has moved since the map last learned from a scan.
    fn has_moved(&self, map_from_base: &Pose2) -> bool {
        self.learned_at.is_none_or(|last| {
            let away_m = (map_from_base.x_m - last.x_m).portable_hypot(map_from_base.y_m - last.y_m);
            let turned_rad = wrap_angle(map_from_base.theta_rad - last.theta_rad).abs();
            away_m >= LEARN_EVERY_M || turned_rad >= LEARN_EVERY_RAD
        })
    }
}

/// Whether an alignment explains so little of a scan that the surroundings are searched.
fn explains_little(fit: &Fit) -> bool {
    fit.score() < SEARCH_BELOW_SCORE && is_informative(fit)
}

/// The sectors to search, after so many lost scans in a row: all of them at the first lost scan, when the
/// place is still known, then one a scan in turn. So a long loss costs a fifth of that a scan.
fn sectors_due(lost_in_a_row: u32) -> std::ops::Range<u32> {
    match lost_in_a_row {
        0 => 1..SECTORS,
        lost => {
            let number = 1 + (lost - 1) % (SECTORS - 1);
            number..number + 1
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_lost_scan_looks_into_every_sector_and_the_later_ones_into_one_each_in_turn() {
        assert!(sectors_due(0).eq(1..SECTORS));
        let later: Vec<u32> = (1..=10).flat_map(sectors_due).collect();
        assert_eq!(later, [1, 2, 3, 4, 5, 1, 2, 3, 4, 5]);
        assert_eq!(sectors_due(u32::MAX).len(), 1);
    }
}
