//! Where points lie best in a [`ScorePyramid`]: every place and heading of a window, by branch and bound
//! (Olson 2009; Hess, Kohler, Rapp and Andor 2016). Finds the best cell of the window for certain, or that
//! none is good enough.
//!
//! A correlative search on one level is cheaper in the small window of a tracker, needs no pyramid and knows
//! free space; this one looks through windows of forty meters, where that one would need a thousand times as
//! long.

use crate::registration::search::score_pyramid::{CERTAIN, LEVELS, ScorePyramid};
use crate::registration::search::{Candidate, Strip, Window};
use crate::scan::end_points::EndPoint;
use biplane_geometry::Pose2;
use biplane_geometry::vec2::norm;

/// From one heading to the next a point this far away moves by a cell, meters. Points farther than that move
/// by more: few of them would make the search as many times slower.
const FARTHEST_M: f32 = 12.0;

/// A heading that is tried: the points' cells before they are shifted.
struct Turned {
    theta_rad: f64,
    cells: Vec<[i32; 2]>,
}

/// A square of shifts at one heading.
#[derive(Clone, Copy)]
struct Branch {
    bound: u32,
    turned: usize,
    shift: [i32; 2],
}

/// One search.
struct Search<'a> {
    pyramid: &'a ScorePyramid,
    turned: Vec<Turned>,
    guess: Pose2,
    half: i32,
    strip: Option<Strip>,
    points: usize,
    best: Option<Branch>,
    floor: u32,
}

impl ScorePyramid {
    /// The best place for points within a window around a guess, or within a strip of it, if its score is
    /// above `min_score` (0 to 1).
    #[must_use]
    pub fn search(
        &self,
        points: &[EndPoint],
        guess: &Pose2,
        (window, strip): (Window, Option<Strip>),
        min_score: f64,
    ) -> Option<Candidate> {
        Search::new(self, points, guess, (window, strip)).run(min_score)
    }
}

impl<'a> Search<'a> {
    fn new(
        pyramid: &'a ScorePyramid,
        points: &[EndPoint],
        guess: &Pose2,
        (window, strip): (Window, Option<Strip>),
    ) -> Self {
        let reach_m = points.iter().map(|point| norm(point.at_m)).fold(1.0, f32::max);
        let step_rad = pyramid.cell_m() / f64::from(reach_m.min(FARTHEST_M));
        let half_rad = window.half_rad.min(std::f64::consts::PI);
        let steps = (half_rad / step_rad).ceil() as i32;
        let turned = |step: i32| {
            let theta_rad = guess.theta_rad + f64::from(step) * step_rad;
            let pose = Pose2 { theta_rad, ..*guess };
            Turned { theta_rad, cells: pyramid.cells(points, &pose).collect() }
        };
        Self {
            pyramid,
            turned: (-steps..=steps).map(turned).collect(),
            guess: *guess,
            half: (window.half_m / pyramid.cell_m()).ceil() as i32,
            strip,
            points: points.len(),
            best: None,
            floor: 0,
        }
    }

    /// The best place whose score is above `min_score`.
    fn run(&mut self, min_score: f64) -> Option<Candidate> {
        self.best = None;
        let whole = f64::from(CERTAIN) * self.points as f64;
        self.floor = (min_score * whole) as u32;
        let level = (0..=LEVELS).rev().find(|level| 1 << level <= self.half.max(1)).unwrap_or(0);
        let side = 1_usize << level;
        let mut branches = Vec::new();
        for turned in 0..self.turned.len() {
            for y in (-self.half..=self.half).step_by(side) {
                for x in (-self.half..=self.half).step_by(side) {
                    self.push(&mut branches, level, turned, [x, y]);
                }
            }
        }
        self.descend_all(level, branches);
        let score = |best: &Branch| (f64::from(best.bound) / whole) as f32;
        self.best.map(|best| Candidate { pose: self.pose(&best), score: score(&best) })
    }

    fn push(&self, branches: &mut Vec<Branch>, level: usize, turned: usize, shift: [i32; 2]) {
        if shift[0] > self.half || shift[1] > self.half || !self.meets_strip(level, shift) {
            return;
        }
        let bound = self.bound(level, turned, shift);
        if bound > self.floor {
            branches.push(Branch { bound, turned, shift });
        }
    }

    /// Whether any shift of a square lies within the strip.
    fn meets_strip(&self, level: usize, shift: [i32; 2]) -> bool {
        let Some(strip) = self.strip else { return true };
        let half_side = 0.5 * f64::from((1 << level) - 1);
        let [x, y] = shift.map(|corner| f64::from(corner) + half_side);
        let [across_x, across_y] = strip.across;
        let away = (x * across_x + y * across_y).abs() - half_side * (across_x.abs() + across_y.abs());
        away * self.pyramid.cell_m() <= strip.half_m
    }

    fn bound(&self, level: usize, turned: usize, [x, y]: [i32; 2]) -> u32 {
        let shifted = |cell: &[i32; 2]| [cell[0].wrapping_add(x), cell[1].wrapping_add(y)];
        let cells = self.turned[turned].cells.iter();
        cells.map(|cell| u32::from(self.pyramid.bound(level, shifted(cell)))).sum()
    }

    fn pose(&self, branch: &Branch) -> Pose2 {
        let [x, y] = branch.shift.map(|shift| f64::from(shift) * self.pyramid.cell_m());
        Pose2::new(self.guess.x_m + x, self.guess.y_m + y, self.turned[branch.turned].theta_rad)
    }

    /// The most promising first: what it finds rules out most of the others.
    fn descend_all(&mut self, level: usize, mut branches: Vec<Branch>) {
        branches.sort_by_key(|branch| std::cmp::Reverse(branch.bound));
        for branch in branches {
            self.descend(level, branch);
        }
    }

    fn descend(&mut self, level: usize, branch: Branch) {
        if branch.bound <= self.floor {
            return;
        }
        if level == 0 {
            (self.floor, self.best) = (branch.bound, Some(branch));
            return;
        }
        let side = 1_i32 << (level - 1);
        let mut branches = Vec::with_capacity(4);
        for (x, y) in [(0, 0), (side, 0), (0, side), (side, side)] {
            self.push(&mut branches, level - 1, branch.turned, [branch.shift[0] + x, branch.shift[1] + y]);
        }
        self.descend_all(level - 1, branches);
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// An L of walls with a niche, seen from a pose.
    pub(crate) fn niche(shift: Pose2) -> Vec<EndPoint> {
        let wall = (0..60).map(|at| [f64::from(at) * 0.1, if (20..25).contains(&at) { 3.3 } else { 3.0 }]);
        let other = (0..40).map(|at| [-2.0, f64::from(at) * 0.1 - 1.0]);
        let inside = shift.inverse();
        let point = |at| EndPoint {
            at_m: inside.transform(at).map(|value| value as f32),
            weight: 1.0,
            ..EndPoint::default()
        };
        wall.chain(other).map(point).collect()
    }

    /// The best score of all places of a window that a choice holds, tried one by one.
    fn best_of_all(search: &Search<'_>, is_asked: impl Fn([i32; 2]) -> bool) -> u32 {
        let shifts =
            (-30..=30).flat_map(|y| (-30..=30).map(move |x| [x, y])).filter(|shift| is_asked(*shift));
        let poses = shifts.flat_map(|shift| (0..search.turned.len()).map(move |turned| (turned, shift)));
        poses.map(|(turned, shift)| search.bound(0, turned, shift)).max().unwrap()
    }

    const WINDOW: Window = Window { half_m: 3.0, half_rad: 0.5 };

    #[test]
    fn branch_and_bound_finds_what_trying_everything_finds() {
        let pyramid = ScorePyramid::new(&niche(Pose2::IDENTITY), 0.1);
        let moved = niche(Pose2::new(1.7, -0.8, 0.3));
        let mut search = Search::new(&pyramid, &moved, &Pose2::IDENTITY, (WINDOW, None));
        let found = search.run(0.3).unwrap();
        assert!((found.pose.x_m - 1.7).abs() < 0.11 && (found.pose.y_m + 0.8).abs() < 0.11, "{found:?}");
        let best = best_of_all(&search, |_| true);
        assert_eq!((f64::from(best) / (255.0 * moved.len() as f64)) as f32, found.score);
        assert!(search.run(f64::from(found.score) + 1e-6).is_none());
    }

    #[test]
    fn in_a_strip_it_finds_the_best_place_of_the_strip_and_none_beside_it() {
        let pyramid = ScorePyramid::new(&niche(Pose2::IDENTITY), 0.1);
        let moved = niche(Pose2::new(1.7, -0.8, 0.3));
        // The best place of the window is 0.38 m from the middle of this strip.
        for (half_m, holds_it) in [(0.45, true), (0.25, false)] {
            let strip = Strip { across: [0.6, 0.8], half_m };
            let mut search = Search::new(&pyramid, &moved, &Pose2::IDENTITY, (WINDOW, Some(strip)));
            let found = search.run(0.0).unwrap();
            let away_m = |[x, y]: [f64; 2]| (0.6 * x + 0.8 * y).abs();
            assert!(away_m([found.pose.x_m, found.pose.y_m]) < half_m + 1e-9, "{found:?}");
            let is_there = (found.pose.x_m - 1.7).abs() < 0.11 && (found.pose.y_m + 0.8).abs() < 0.11;
            assert_eq!(is_there, holds_it, "{found:?}");
            let best = best_of_all(&search, |shift| {
                away_m(shift.map(|cells| 0.1 * f64::from(cells))) < half_m + 1e-6
            });
            assert_eq!((f64::from(best) / (255.0 * moved.len() as f64)) as f32, found.score);
        }
    }
}
