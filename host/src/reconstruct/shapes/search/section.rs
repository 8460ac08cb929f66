//! Points as an axis sees them, sorted into cells across it, so that those near a circle are found without
//! asking all. Meters.

use super::circle::Circle;
use crate::reconstruct::planes::paper::random::Random;
use crate::reconstruct::shapes::fit::axis::Axis;
use biplane_geometry::PortableMath;

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
    /// Where the points of each cell begin in `sorted_m`.
    starts: Vec<u32>,
    /// The points across the axis, in the order of the cells.
    sorted_m: Vec<[f64; 2]>,
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
        let mut this = Self {
            points_m,
            low_m,
            cell_m,
            size,
            starts: vec![0; size[0] * size[1] + 1],
            sorted_m: Vec::new(),
        };
        let cells: Vec<usize> = this.points_m.iter().map(|p| this.cell_of([p[0], p[1]])).collect();
        cells.iter().for_each(|cell| this.starts[cell + 1] += 1);
        for cell in 1..this.starts.len() {
            this.starts[cell] += this.starts[cell - 1];
        }
        let mut next = this.starts.clone();
        this.sorted_m = vec![[0.0; 2]; this.points_m.len()];
        for (point, cell) in this.points_m.iter().zip(cells) {
            this.sorted_m[next[cell] as usize] = [point[0], point[1]];
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

    /// The points of all cells that a square about a point meets, by column.
    fn within(&self, [x, y]: [f64; 2], half_m: f64) -> impl Iterator<Item = &[[f64; 2]]> + Clone {
        let columns = self.column(0, x - half_m)..=self.column(0, x + half_m);
        let (from, to) = (self.column(1, y - half_m), self.column(1, y + half_m));
        columns.map(move |column| {
            let first = column * self.size[1];
            &self.sorted_m[self.starts[first + from] as usize..self.starts[first + to + 1] as usize]
        })
    }

    /// Calls for one in `step` of the points of all cells that a square meets, after having skipped some.
    fn some_within(
        &self,
        middle_m: [f64; 2],
        half_m: f64,
        [skipped, step]: [usize; 2],
        mut call: impl FnMut([f64; 2]),
    ) {
        if step == 1 {
            self.within(middle_m, half_m).flatten().skip(skipped).for_each(|point| call(*point));
            return;
        }
        let mut next = skipped;
        for column in self.within(middle_m, half_m) {
            while let Some(point) = column.get(next) {
                call(*point);
                next += step;
            }
            next -= column.len();
        }
    }

    fn count_within(&self, middle_m: [f64; 2], half_m: f64) -> usize {
        self.within(middle_m, half_m).map(<[_]>::len).sum()
    }

    /// A point across the axis.
    pub(crate) fn at_m(&self, point: usize) -> [f64; 2] {
        let [x, y, _] = self.points_m[point];
        [x, y]
    }

    /// Some of the points about one, across the axis.
    pub(crate) fn near(
        &self,
        at_m: [f64; 2],
        reach_m: f64,
        max_asked: usize,
        random: &mut Random,
        near_m: &mut Vec<[f64; 2]>,
    ) {
        let step = self.count_within(at_m, reach_m).div_ceil(max_asked).max(1);
        near_m.clear();
        self.some_within(at_m, reach_m, [random.below(step), step], |[x, y]| {
            if (x - at_m[0]).portable_hypot(y - at_m[1]) <= reach_m {
                near_m.push([x, y]);
            }
        });
    }

    /// How well a circle explains the points about it: more for points on it, less for points within. At most
    /// so many points are asked.
    pub(crate) fn score(&self, circle: &Circle, limit_m: f64, max_asked: usize) -> Score {
        let half_m = circle.radius_m + limit_m;
        let count = self.count_within(circle.center_m, half_m);
        let step = count.div_ceil(max_asked).max(1);
        let (mut score, per_limit) = (0.0, 1.0 / limit_m);
        self.some_within(circle.center_m, half_m, [0, step], |point| {
            let share = circle.off_m(point) * per_limit;
            let (on, off) = (1.0 - share * share, if share < 0.0 { -WITHIN_PRICE } else { 0.0 });
            score += if on > 0.0 { on } else { off };
        });
        Score { points: score * step as f64, share: score * step as f64 / count.max(1) as f64 }
    }
}

/// How well a circle explains points.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Score {
    /// In points on it.
    pub points: f64,
    /// The same as a share of all points about it.
    pub share: f64,
}

/// What a point within a circle costs: a column has none.
const WITHIN_PRICE: f64 = 0.3;
