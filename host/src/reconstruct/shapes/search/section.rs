//! Points as an axis sees them, sorted into cells across it, so that those near a circle are found without
//! asking all. Meters.

use super::circle::Circle;
use crate::reconstruct::shapes::fit::axis::Axis;

/// Edge of a cell.
const CELL_M: f64 = 0.2;
/// Most cells of a section; a larger one has larger cells.
const MAX_CELLS: f64 = 1e6;

/// Points in the two directions across an axis, sorted into cells.
pub(crate) struct Section {
    /// The points, and along the axis.
    pub points_m: Vec<[f64; 3]>,
    low_m: [f64; 2],
    cell_m: f64,
    size: [usize; 2],
    /// Where the points of each cell begin in `order`.
    starts: Vec<u32>,
    order: Vec<u32>,
}

impl Section {
    /// Sorts points, given in `map`.
    pub(crate) fn new(axis: &Axis, points_m: &[[f64; 3]]) -> Self {
        let points_m: Vec<[f64; 3]> = points_m.iter().map(|p| axis.local(*p)).collect();
        let fold = |k: usize, pick: fn(f64, f64) -> f64, start: f64| {
            points_m.iter().fold(start, |best, p| pick(best, p[k]))
        };
        let low_m = [0, 1].map(|k| fold(k, f64::min, f64::INFINITY));
        let high_m = [0, 1].map(|k| fold(k, f64::max, f64::NEG_INFINITY));
        let extent_m = [0, 1].map(|k| (high_m[k] - low_m[k]).max(0.0));
        let cell_m = CELL_M
            .max((extent_m[0] * extent_m[1] / MAX_CELLS).sqrt())
            .max(extent_m[0].max(extent_m[1]) / MAX_CELLS);
        let size = extent_m.map(|extent_m| (extent_m / cell_m) as usize + 1);
        let mut this =
            Self { points_m, low_m, cell_m, size, starts: vec![0; size[0] * size[1] + 1], order: Vec::new() };
        let cells: Vec<usize> = this.points_m.iter().map(|p| this.cell_of([p[0], p[1]])).collect();
        cells.iter().for_each(|cell| this.starts[cell + 1] += 1);
        for cell in 1..this.starts.len() {
            this.starts[cell] += this.starts[cell - 1];
        }
        let mut next = this.starts.clone();
        this.order = vec![0; this.points_m.len()];
        for (point, cell) in (0..).zip(cells) {
            this.order[next[cell] as usize] = point;
            next[cell] += 1;
        }
        this
    }

    fn column(&self, k: usize, value: f64) -> usize {
        (((value - self.low_m[k]) / self.cell_m).max(0.0) as usize).min(self.size[k] - 1)
    }

    fn cell_of(&self, [x, y]: [f64; 2]) -> usize {
        self.column(0, x) * self.size[1] + self.column(1, y)
    }

    /// The points of all cells that a square about a point meets.
    pub(crate) fn within(&self, [x, y]: [f64; 2], half_m: f64) -> impl Iterator<Item = u32> + '_ {
        let columns = self.column(0, x - half_m)..=self.column(0, x + half_m);
        let (from, to) = (self.column(1, y - half_m), self.column(1, y + half_m));
        columns.flat_map(move |column| {
            let first = column * self.size[1];
            let range = self.starts[first + from] as usize..self.starts[first + to + 1] as usize;
            self.order[range].iter().copied()
        })
    }

    /// A point across the axis.
    pub(crate) fn at_m(&self, point: u32) -> [f64; 2] {
        let [x, y, _] = self.points_m[point as usize];
        [x, y]
    }

    /// How well a circle explains the points about it: more for points on it, less for points within. At most
    /// so many points are asked.
    pub(crate) fn score(&self, circle: &Circle, limit_m: f64, max_asked: usize) -> f64 {
        let half_m = circle.radius_m + limit_m;
        let count = self.within(circle.center_m, half_m).count();
        let step = count.div_ceil(max_asked).max(1);
        let mut score = 0.0;
        for point in self.within(circle.center_m, half_m).step_by(step) {
            let share = circle.off_m(self.at_m(point)) / limit_m;
            score += if share.abs() < 1.0 {
                1.0 - share * share
            } else if share < 0.0 {
                -WITHIN_PRICE
            } else {
                0.0
            };
        }
        score * step as f64
    }
}

/// What a point within a circle costs: a column has none.
const WITHIN_PRICE: f64 = 0.3;
