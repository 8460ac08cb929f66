//! Cells of the floor: masks, distances, pieces that hang together. Frame `map`, meters.

/// Side of a cell, meters: that of the floor map; areas come from lines, not from cells.
pub(crate) const CELL_M: f64 = 0.05;

/// Which cells there are.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Grid {
    /// Corner of the first cell.
    pub origin_m: [f64; 2],
    /// Columns and rows.
    pub size: [usize; 2],
}

/// Number of cells to the right of and above which a grid is cut off: 1 km.
const MAX_SIDE: f64 = 20_000.0;

impl Grid {
    /// Cells that hold a rectangle.
    pub(crate) fn around(min_m: [f64; 2], max_m: [f64; 2]) -> Self {
        let first = min_m.map(|value| (value / CELL_M).floor());
        let side = |axis: usize| ((max_m[axis] / CELL_M).ceil() - first[axis]).clamp(0.0, MAX_SIDE);
        Self { origin_m: first.map(|value| value * CELL_M), size: [side(0) as usize, side(1) as usize] }
    }

    /// Number of cells.
    pub(crate) fn len(&self) -> usize {
        self.size[0] * self.size[1]
    }

    /// The cell that holds a point.
    pub(crate) fn cell(&self, point_m: [f64; 2]) -> Option<usize> {
        let at = [0, 1].map(|axis| ((point_m[axis] - self.origin_m[axis]) / CELL_M).floor());
        let is_inside = (0..2).all(|axis| at[axis] >= 0.0 && at[axis] < self.size[axis] as f64);
        is_inside.then(|| at[1] as usize * self.size[0] + at[0] as usize)
    }

    /// The middle of a cell.
    pub(crate) fn center_m(&self, cell: usize) -> [f64; 2] {
        let at = [cell % self.size[0], cell / self.size[0]];
        [0, 1].map(|axis| self.origin_m[axis] + (at[axis] as f64 + 0.5) * CELL_M)
    }

    /// Cells that share an edge with a cell.
    pub(crate) fn neighbors(&self, cell: usize) -> impl Iterator<Item = usize> + use<> {
        let [width, height] = self.size;
        let (x, y) = (cell % width, cell / width);
        [
            (x > 0).then(|| cell - 1),
            (x + 1 < width).then(|| cell + 1),
            (y > 0).then(|| cell - width),
            (y + 1 < height).then(|| cell + width),
        ]
        .into_iter()
        .flatten()
    }

    /// Cells that share a corner with a cell alone, and the two between.
    pub(crate) fn diagonals(&self, cell: usize) -> impl Iterator<Item = (usize, [usize; 2])> + use<> {
        let [width, height] = self.size;
        let (x, y) = (cell % width, cell / width);
        let left_and_right = [(x > 0).then(|| cell - 1), (x + 1 < width).then(|| cell + 1)];
        let rows = [(y > 0).then(|| cell - width), (y + 1 < height).then(|| cell + width)];
        rows.into_iter().flatten().flat_map(move |row| {
            left_and_right.into_iter().flatten().map(move |beside| (row + beside - cell, [row, beside]))
        })
    }

    /// Visits the cells whose middle is in an area bounded by rings (even-odd).
    pub(crate) fn fill<'a>(
        &self,
        rings_m: &(impl Iterator<Item = &'a [[f64; 2]]> + Clone),
        mut visit: impl FnMut(usize),
    ) {
        let [mut low_m, mut high_m] = [f64::INFINITY, f64::NEG_INFINITY];
        for point in rings_m.clone().flatten() {
            (low_m, high_m) = (low_m.min(point[1]), high_m.max(point[1]));
        }
        let row_of = |y_m: f64| ((y_m - self.origin_m[1]) / CELL_M).clamp(0.0, self.size[1] as f64) as usize;
        let (first, last) = (row_of(low_m), (row_of(high_m) + 1).min(self.size[1]));
        let mut passed = Vec::new();
        for row in first..last {
            let y_m = self.origin_m[1] + (row as f64 + 0.5) * CELL_M;
            passed.clear();
            for ring in rings_m.clone() {
                let ends = ring.iter().zip(ring.iter().cycle().skip(1));
                passed.extend(ends.filter(|(a, b)| (a[1] <= y_m) != (b[1] <= y_m)).map(|(a, b)| {
                    let share = (y_m - a[1]) / (b[1] - a[1]);
                    a[0] + share * (b[0] - a[0])
                }));
            }
            passed.sort_by(f64::total_cmp);
            for [from_m, to_m] in passed.as_chunks().0 {
                let column = |x_m: f64| ((x_m - self.origin_m[0]) / CELL_M - 0.5).ceil();
                let from = column(*from_m).clamp(0.0, self.size[0] as f64) as usize;
                let to = column(*to_m).clamp(0.0, self.size[0] as f64) as usize;
                (from..to).for_each(|at| visit(row * self.size[0] + at));
            }
        }
    }

    /// Squared distance of each cell to the nearest cell of a mask, in cells (Felzenszwalb and
    /// Huttenlocher 2012); cells beyond the grid are none of the mask.
    pub(crate) fn squared_distances(&self, mask: &[bool]) -> Vec<f32> {
        let far = (self.size[0] * self.size[0] + self.size[1] * self.size[1]) as f32;
        let mut squares: Vec<f32> = mask.iter().map(|is_set| if *is_set { 0.0 } else { far }).collect();
        let longest = self.size[0].max(self.size[1]);
        let mut line = LowerEnvelope::new(longest);
        for row in 0..self.size[1] {
            line.pass(&mut squares, row * self.size[0], 1, self.size[0]);
        }
        for column in 0..self.size[0] {
            line.pass(&mut squares, column, self.size[0], self.size[1]);
        }
        squares
    }

    /// Cells of the mask whose surroundings within `radius_m` are in it, and what is within `radius_m` of
    /// those: the mask without what is narrower than twice that.
    pub(crate) fn opened(&self, mask: &[bool], radius_m: f64) -> Vec<bool> {
        let outside: Vec<bool> = mask.iter().map(|is_set| !is_set).collect();
        let limit = ((radius_m / CELL_M) * (radius_m / CELL_M)) as f32;
        let core: Vec<bool> = self.squared_distances(&outside).iter().map(|d| *d > limit).collect();
        let near_core = self.squared_distances(&core);
        mask.iter().zip(near_core).map(|(is_set, d)| *is_set && d <= limit).collect()
    }

    /// The pieces of a mask that hang together by edges: for each cell its piece, and how many cells each
    /// has. Pieces are numbered by their first cell.
    pub(crate) fn pieces(&self, mask: &[bool]) -> (Vec<Option<u32>>, Vec<usize>) {
        let mut piece_of = vec![None; mask.len()];
        let mut sizes = Vec::new();
        let mut open = Vec::new();
        for start in 0..mask.len() {
            if !mask[start] || piece_of[start].is_some() {
                continue;
            }
            let piece = sizes.len() as u32;
            sizes.push(0);
            piece_of[start] = Some(piece);
            open.push(start);
            while let Some(cell) = open.pop() {
                sizes[piece as usize] += 1;
                for next in self.neighbors(cell) {
                    if mask[next] && piece_of[next].is_none() {
                        piece_of[next] = Some(piece);
                        open.push(next);
                    }
                }
            }
        }
        (piece_of, sizes)
    }
}

/// The lower envelope of parabolas along one line of cells.
struct LowerEnvelope {
    values: Vec<f32>,
    roots: Vec<usize>,
    from: Vec<f32>,
}

impl LowerEnvelope {
    fn new(longest: usize) -> Self {
        Self { values: vec![0.0; longest], roots: vec![0; longest], from: vec![0.0; longest + 1] }
    }

    fn pass(&mut self, squares: &mut [f32], first: usize, step: usize, count: usize) {
        if count == 0 {
            return;
        }
        for (at, value) in self.values[..count].iter_mut().enumerate() {
            *value = squares[first + at * step];
        }
        let (values, mut top) = (&self.values, 0);
        (self.roots[0], self.from[0]) = (0, f32::NEG_INFINITY);
        for at in 1..count {
            let meets = |root: usize| {
                let square = |k: usize| (k * k) as f32;
                (values[at] + square(at) - values[root] - square(root)) / (2 * (at - root)) as f32
            };
            let mut place = meets(self.roots[top]);
            while top > 0 && place <= self.from[top] {
                top -= 1;
                place = meets(self.roots[top]);
            }
            top += 1;
            (self.roots[top], self.from[top]) = (at, place);
        }
        let mut segment = 0;
        for at in 0..count {
            while segment < top && self.from[segment + 1] < at as f32 {
                segment += 1;
            }
            let root = self.roots[segment];
            let away = at.abs_diff(root);
            squares[first + at * step] = (away * away) as f32 + self.values[root];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{CELL_M, Grid};

    fn grid() -> Grid {
        Grid::around([-1.0, -0.5], [1.0, 0.5])
    }

    #[test]
    fn a_cell_holds_its_middle_and_areas_are_filled_but_for_their_holes() {
        let grid = grid();
        assert_eq!(grid.size, [40, 20]);
        for cell in [0, 39, 799] {
            assert_eq!(grid.cell(grid.center_m(cell)), Some(cell));
        }
        assert_eq!(grid.cell([1.01, 0.0]), None);
        let square = |half: f64| [[-half, -half], [half, -half], [half, half], [-half, half]];
        let (outer, hole) = (square(0.4), square(0.2));
        let mut count = 0;
        grid.fill(&[&outer[..], &hole[..]].into_iter(), |_| count += 1);
        assert_eq!(count, 16 * 16 - 8 * 8);
    }

    #[test]
    fn distances_are_those_of_trying_all_cells() {
        let grid = grid();
        let mask: Vec<bool> = (0..grid.len()).map(|cell| cell * 7919 % 131 == 5).collect();
        let found = grid.squared_distances(&mask);
        for (cell, square) in found.iter().enumerate() {
            let here = grid.center_m(cell);
            let all = (0..grid.len()).filter(|other| mask[*other]).map(|other| grid.center_m(other));
            let best = all.map(|p| (p[0] - here[0]).powi(2) + (p[1] - here[1]).powi(2));
            let best = best.fold(f64::INFINITY, f64::min) / CELL_M / CELL_M;
            assert!((f64::from(*square) - best).abs() < 1e-3, "{cell}: {square} is not {best}");
        }
    }

    #[test]
    fn opening_takes_necks_away_and_parts_what_they_join() {
        let grid = grid();
        let mask: Vec<bool> = (0..grid.len())
            .map(|cell| {
                let [x, y] = grid.center_m(cell);
                x.abs() > 0.3 || y.abs() < 0.1
            })
            .collect();
        assert_eq!(grid.pieces(&mask).1.len(), 1);
        let (_, sizes) = grid.pieces(&grid.opened(&mask, 0.22));
        assert_eq!(sizes.len(), 2);
    }
}
