//! A grid that says of each cell how likely an end point falls there, and its pyramid of ever larger squares,
//! each of which holds the largest value in it: what bounds a branch and bound search (Olson 2009; Hess,
//! Kohler, Rapp and Andor 2016).
//!
//! Frame: that of the points it is made of. Units: meters.

use crate::map::grid::cell_of;
use crate::placement::Placement;
use crate::registration::search::{cells_at, likelihood};
use crate::scan::end_points::EndPoint;
use biplane_geometry::Pose2;

/// How far a point blurs, cells: beyond, its likelihood is below a twentieth.
const BLUR: i32 = 2;
/// Levels of the pyramid above the grid itself. More: wide windows are cut down in larger squares, at more
/// memory around the points.
pub(super) const LEVELS: usize = 5;
/// The value of a cell with a point in it.
pub(super) const CERTAIN: u8 = u8::MAX;

/// The likelihood of an end point for every cell around a set of points, and its pyramid.
#[derive(Clone, Debug)]
pub struct ScorePyramid {
    cell_m: f32,
    cells_per_m: f32,
    origin: [i32; 2],
    levels: Vec<Level>,
}

#[derive(Clone, Debug)]
struct Level {
    columns: i32,
    rows: i32,
    values: Vec<u8>,
}

impl Level {
    #[inline]
    fn at(&self, column: i32, row: i32) -> u8 {
        if column < 0 || row < 0 || column >= self.columns || row >= self.rows {
            return 0;
        }
        self.values[row as usize * self.columns as usize + column as usize]
    }
}

impl ScorePyramid {
    /// Of points, with cells of this side (meters), which is the width of the likelihood about a point, too.
    #[must_use]
    pub fn new(points: &[EndPoint], cell_m: f32) -> Self {
        let cells_per_m = 1.0 / cell_m;
        let cells: Vec<[i32; 2]> = points.iter().map(|point| cell_of(point.at_m, cells_per_m)).collect();
        let bound = |axis: usize, pick: fn(i32, i32) -> i32| {
            cells.iter().map(|cell| cell[axis]).reduce(pick).unwrap_or(0)
        };
        // One empty square of the highest level before the points: a square that begins outside may reach in.
        let largest = 1_i32 << LEVELS;
        let origin = [0, 1].map(|axis| bound(axis, i32::min) - BLUR - largest);
        let [columns, rows] = [0, 1].map(|axis| bound(axis, i32::max) + BLUR + 1 - origin[axis]);
        let mut level = Level { columns, rows, values: vec![0; columns as usize * rows as usize] };
        for [x, y] in &cells {
            level.blur([x - origin[0], y - origin[1]]);
        }
        let mut levels = vec![level];
        for _ in 0..LEVELS {
            levels.push(levels[levels.len() - 1].halved());
        }
        Self { cell_m, cells_per_m, origin, levels }
    }

    /// Side of a cell, meters.
    #[must_use]
    pub fn cell_m(&self) -> f64 {
        f64::from(self.cell_m)
    }

    /// The cells of the grid that points lie in at a pose.
    pub(super) fn cells(&self, points: &[EndPoint], pose: &Pose2) -> impl Iterator<Item = [i32; 2]> {
        cells_at(points.iter(), Placement::new(pose), self.cells_per_m)
    }

    /// Mean likelihood of points at a pose, 0 to 1.
    #[must_use]
    pub fn score(&self, points: &[EndPoint], pose: &Pose2) -> f64 {
        let sum: f64 = self.cells(points, pose).map(|cell| f64::from(self.bound(0, cell))).sum();
        sum / (f64::from(CERTAIN) * points.len().max(1) as f64)
    }

    /// The most that a point in this cell of the grid can find in the `2^level` cells from there on along
    /// both axes.
    #[inline]
    pub(super) fn bound(&self, level: usize, cell: [i32; 2]) -> u8 {
        let [column, row] = [0, 1].map(|axis| cell[axis].wrapping_sub(self.origin[axis]) >> level);
        self.levels[level].at(column, row)
    }
}

impl Level {
    /// A point lies in this cell.
    fn blur(&mut self, [column, row]: [i32; 2]) {
        for y in -BLUR..=BLUR {
            for x in -BLUR..=BLUR {
                let value = (f64::from(CERTAIN) * likelihood(f64::from(x * x + y * y), 1.0)) as u8;
                let at = (row + y) as usize * self.columns as usize + (column + x) as usize;
                self.values[at] = self.values[at].max(value);
            }
        }
    }

    /// The next level: a cell of side 2^l holds the largest value of the square of side 2^(l+1) that begins
    /// there.
    fn halved(&self) -> Self {
        let (columns, rows) = (self.columns / 2 + 1, self.rows / 2 + 1);
        let mut values = Vec::with_capacity(columns as usize * rows as usize);
        for row in 0..rows {
            for column in 0..columns {
                let square = (0..3).flat_map(|y| (0..3).map(move |x| (2 * column + x, 2 * row + y)));
                values.push(square.map(|(x, y)| self.at(x, y)).max().unwrap_or(0));
            }
        }
        Self { columns, rows, values }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::registration::search::branch_and_bound::tests::niche;

    #[test]
    fn a_square_of_the_pyramid_is_never_below_a_cell_that_it_stands_for() {
        let pyramid = ScorePyramid::new(&niche(Pose2::new(0.3, 0.1, 0.2)), 0.1);
        for level in 1..=LEVELS {
            let side = 1_i32 << level;
            let corners = (-80..90).step_by(7).flat_map(|row| (-80..90).step_by(5).map(move |c| [c, row]));
            for [column, row] in corners {
                let bound = pyramid.bound(level, [column, row]);
                let within = (0..side).flat_map(|y| (0..side).map(move |x| [column + x, row + y]));
                let largest = within.map(|cell| pyramid.bound(0, cell)).max().unwrap_or(0);
                assert!(largest <= bound, "{level} {column} {row}");
            }
        }
    }
}
