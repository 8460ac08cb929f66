//! Where the points of one stretch lie best in another's grid: every place and heading of a window, by branch and bound (Olson 2009;
//! Hess, Kohler, Rapp and Andor 2016). Finds the best cell of the window for certain, or that none is good enough.

use biplane_matcher::Pose2;

use super::submap::{LEVELS, Pyramid};
use biplane_matcher::EndPoint;

/// Where to look, around a guess.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Window {
    /// So far along x and y, metres.
    pub half_m: f64,
    /// So far in heading, radians.
    pub half_rad: f64,
}

/// A place that was found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Peak {
    /// The points' frame in the grid's.
    pub pose: Pose2,
    /// Mean value of the points there, 0 to 1.
    pub score: f64,
}

/// A heading that is tried: the points' cells before they are shifted.
struct Turned {
    theta_rad: f64,
    cells: Vec<[i64; 2]>,
}

/// A square of shifts at one heading.
#[derive(Clone, Copy)]
struct Branch {
    bound: u32,
    turned: usize,
    shift: [i64; 2],
}

/// One search.
pub struct Search<'a> {
    pyramid: &'a Pyramid,
    turned: Vec<Turned>,
    guess: Pose2,
    half: i64,
    points: usize,
    best: Option<Branch>,
    floor: u32,
}

impl<'a> Search<'a> {
    /// A search for points of the given outline around a guess.
    pub fn new(pyramid: &'a Pyramid, points: &[EndPoint], guess: Pose2, window: Window) -> Self {
        let reach_m = points.iter().map(|point| point.at_m[0].hypot(point.at_m[1])).fold(1.0, f32::max);
        // The farthest points move by a cell from one heading to the next.
        let step_rad = f64::from(pyramid.cell_m / reach_m.min(12.0));
        let half_rad = window.half_rad.min(std::f64::consts::PI);
        let steps = (half_rad / step_rad).ceil() as i64;
        let turned = |step: i64| {
            let theta_rad = guess.theta_rad + step as f64 * step_rad;
            let pose = Pose2::new(guess.x_m, guess.y_m, theta_rad);
            Turned { theta_rad, cells: pyramid.cells(points, &pose).collect() }
        };
        Self {
            pyramid,
            turned: (-steps..=steps).map(turned).collect(),
            guess,
            half: (window.half_m / f64::from(pyramid.cell_m)).ceil() as i64,
            points: points.len(),
            best: None,
            floor: 0,
        }
    }

    /// The best place whose score is above `least`.
    pub fn run(&mut self, least: f64) -> Option<Peak> {
        self.best = None;
        let whole = 255.0 * self.points as f64;
        self.floor = (least * whole) as u32;
        let level = (0..=LEVELS).rev().find(|level| 1 << level <= self.half.max(1)).unwrap_or(0);
        let side = 1_i64 << level;
        let mut branches = Vec::new();
        for turned in 0..self.turned.len() {
            for y in (-self.half..=self.half).step_by(side as usize) {
                for x in (-self.half..=self.half).step_by(side as usize) {
                    self.push(&mut branches, level, turned, [x, y]);
                }
            }
        }
        branches.sort_by_key(|branch| std::cmp::Reverse(branch.bound));
        for branch in branches {
            self.descend(level, branch);
        }
        self.best.map(|best| Peak { pose: self.pose(&best), score: f64::from(best.bound) / whole })
    }

    fn push(&self, branches: &mut Vec<Branch>, level: usize, turned: usize, shift: [i64; 2]) {
        if shift[0] > self.half || shift[1] > self.half {
            return;
        }
        let bound = self.bound(level, turned, shift);
        if bound > self.floor {
            branches.push(Branch { bound, turned, shift });
        }
    }

    fn bound(&self, level: usize, turned: usize, shift: [i64; 2]) -> u32 {
        let cells = &self.turned[turned].cells;
        cells
            .iter()
            .map(|cell| u32::from(self.pyramid.bound(level, [cell[0] + shift[0], cell[1] + shift[1]])))
            .sum()
    }

    fn pose(&self, branch: &Branch) -> Pose2 {
        let cell_m = f64::from(self.pyramid.cell_m);
        let [x, y] = branch.shift.map(|shift| shift as f64 * cell_m);
        Pose2::new(self.guess.x_m + x, self.guess.y_m + y, self.turned[branch.turned].theta_rad)
    }

    fn descend(&mut self, level: usize, branch: Branch) {
        if branch.bound <= self.floor {
            return;
        }
        if level == 0 {
            (self.floor, self.best) = (branch.bound, Some(branch));
            return;
        }
        let side = 1_i64 << (level - 1);
        let mut branches = Vec::with_capacity(4);
        for (x, y) in [(0, 0), (side, 0), (0, side), (side, side)] {
            self.push(&mut branches, level - 1, branch.turned, [branch.shift[0] + x, branch.shift[1] + y]);
        }
        branches.sort_by_key(|branch| std::cmp::Reverse(branch.bound));
        for branch in branches {
            self.descend(level - 1, branch);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{Search, Window};
    use crate::loops::submap::Pyramid;
    use biplane_matcher::EndPoint;
    use biplane_matcher::Pose2;

    fn points(shift: Pose2) -> Vec<EndPoint> {
        // An L of walls with a niche.
        let wall = (0..60).map(|at| [f64::from(at) * 0.1, if (20..25).contains(&at) { 3.3 } else { 3.0 }]);
        let other = (0..40).map(|at| [-2.0, f64::from(at) * 0.1 - 1.0]);
        let inside = shift.inverse();
        wall.chain(other)
            .map(|at| EndPoint {
                at_m: inside.transform(at).map(|value| value as f32),
                weight: 1.0,
                ..EndPoint::default()
            })
            .collect()
    }

    #[test]
    fn branch_and_bound_finds_what_trying_everything_finds() {
        let pyramid = Pyramid::new(&points(Pose2::IDENTITY), 0.1);
        let truth = Pose2::new(1.7, -0.8, 0.3);
        let moved = points(truth);
        let window = Window { half_m: 3.0, half_rad: 0.5 };
        let mut search = Search::new(&pyramid, &moved, Pose2::IDENTITY, window);
        let found = search.run(0.3).unwrap();
        assert!((found.pose.x_m - 1.7).abs() < 0.11 && (found.pose.y_m + 0.8).abs() < 0.11, "{found:?}");
        let mut best = 0;
        for turned in 0..search.turned.len() {
            for y in -30..=30 {
                for x in -30..=30 {
                    best = best.max(search.bound(0, turned, [x, y]));
                }
            }
        }
        assert_eq!(f64::from(best) / (255.0 * moved.len() as f64), found.score);
        assert!(search.run(found.score).is_none());
    }

    #[test]
    fn a_square_of_the_pyramid_is_never_below_a_cell_that_it_stands_for() {
        let pyramid = Pyramid::new(&points(Pose2::new(0.3, 0.1, 0.2)), 0.1);
        for level in 1..=crate::loops::submap::LEVELS {
            let side = 1_i64 << level;
            for (column, row) in
                (-80..90).step_by(7).flat_map(|row| (-80..90).step_by(5).map(move |c| (c, row)))
            {
                let bound = pyramid.bound(level, [column, row]);
                for (x, y) in (0..side).flat_map(|y| (0..side).map(move |x| (x, y))) {
                    assert!(
                        pyramid.bound(0, [column + x, row + y]) <= bound,
                        "{level} {column} {row} {x} {y}"
                    );
                }
            }
        }
    }
}
