//! A sorted voxel grid: the points of each cube of space together, and each cube's neighbors.
//!
//! Sorting costs less than a tree and gives the same order everywhere, so results depend on nothing but the
//! points. Meters.

use super::cubes::{BITS, Sorted};
use rayon::prelude::*;
use std::ops::Range;
use std::sync::atomic::{AtomicI32, Ordering};

/// Cubes of space that hold at least one point, in the order of their coordinates.
#[derive(Clone, Debug, Default)]
pub(crate) struct Grid {
    /// Indices of the points, cell by cell; points that are not finite or further than a million cells out
    /// are left out.
    pub order: Vec<u32>,
    /// Start of each cell in `order`, and its end as the last element.
    pub starts: Vec<u32>,
    /// Cell coordinates, ascending.
    keys: Vec<u64>,
}

/// Cells that one task looks at: enough to be worth a task, few enough to share out.
pub(crate) const CELLS_PER_TASK: usize = 1024;

impl Grid {
    /// Sorts points into cubes with edges of `cell_m`.
    pub(crate) fn new(points_m: &[[f32; 3]], cell_m: f64) -> Self {
        let Sorted { order, firsts: mut starts, keys } = Sorted::new(points_m, cell_m);
        if !starts.is_empty() {
            starts.push(order.len() as u32);
        }
        Self { order, starts, keys }
    }

    /// Number of cells that hold a point.
    pub(crate) fn len(&self) -> usize {
        self.keys.len()
    }

    /// The points of a cell.
    pub(crate) fn points_of(&self, cell: usize) -> &[u32] {
        &self.order[self.starts[cell] as usize..self.starts[cell + 1] as usize]
    }

    /// How far the second of two cells that touch lies from the first along x and z, cells.
    pub(crate) fn apart(&self, cell: usize, other: usize) -> (i64, i64) {
        let along = |key: u64, axis: u32| ((key >> (axis * BITS)) & ((1 << BITS) - 1)) as i64;
        let (from, to) = (self.keys[cell], self.keys[other]);
        (along(to, 2) - along(from, 2), along(to, 0) - along(from, 0))
    }

    /// A value for each point, from its cell and its place in the order of the cells; `none` for points that
    /// are in no cell.
    pub(crate) fn by_point(
        &self,
        points: usize,
        none: i32,
        of: impl Fn(usize, usize) -> i32 + Sync,
    ) -> Vec<i32> {
        // Every point is in one cell at most: nothing is written twice, in whatever order threads come.
        let found: Vec<AtomicI32> = (0..points).map(|_| AtomicI32::new(none)).collect();
        (0..self.len()).into_par_iter().with_min_len(CELLS_PER_TASK).for_each(|cell| {
            for place in self.starts[cell] as usize..self.starts[cell + 1] as usize {
                found[self.order[place] as usize].store(of(cell, place), Ordering::Relaxed);
            }
        });
        found.into_iter().map(AtomicI32::into_inner).collect()
    }

    /// For each cell the up to 26 others that touch it, ascending.
    pub(crate) fn neighbors(&self) -> Neighbors {
        let firsts: Vec<usize> = (0..self.len()).step_by(CELLS_PER_TASK).collect();
        let run = |first: usize| self.touching(first..(first + CELLS_PER_TASK).min(self.len()));
        Neighbors { parts: firsts.into_par_iter().map(run).collect() }
    }

    /// The cells that touch each of a run of cells.
    fn touching(&self, run: Range<usize>) -> Part {
        // Cells are sorted, so the cells at one offset are too: nine cursors pass over the list once.
        let keys = self.keys.as_slice();
        let low_of = |cell: usize, offset: i64| keys[cell].wrapping_add_signed(offset).wrapping_sub(1);
        let offsets: [i64; 9] = std::array::from_fn(|k| {
            (k as i64 / 3 - 1) * (1 << (2 * BITS)) + (k as i64 % 3 - 1) * (1 << BITS)
        });
        // Where each cursor stands, and the key there: most columns hold nothing near a cell, and that needs
        // no look at the list.
        let at = |place: usize| (place, keys.get(place).copied().unwrap_or(u64::MAX));
        let mut cursors = offsets.map(|offset| {
            let low = low_of(run.start, offset);
            at(keys.partition_point(|key| *key < low))
        });
        let mut found = Part::for_cells(run.len(), 12 * run.len());
        for cell in run {
            for (offset, cursor) in offsets.iter().zip(&mut cursors) {
                let low = low_of(cell, *offset);
                while cursor.1 < low {
                    *cursor = at(cursor.0 + 1);
                }
                let (mut place, mut key) = *cursor;
                while key <= low + 2 {
                    if place != cell {
                        found.cells.push(place as u32);
                    }
                    (place, key) = at(place + 1);
                }
            }
            found.starts.push(found.cells.len() as u32);
        }
        found.cells.shrink_to_fit();
        found
    }
}

/// A list of cells for each cell, in parts of [`CELLS_A_TASK`] lists, so that each can be made by itself and
/// stays where it is.
#[derive(Clone, Debug, Default)]
pub(crate) struct Neighbors {
    parts: Vec<Part>,
}

#[derive(Clone, Debug)]
struct Part {
    /// Where each list starts, and the last one ends.
    starts: Vec<u32>,
    cells: Vec<u32>,
}

impl Part {
    fn for_cells(lists: usize, cells: usize) -> Self {
        let mut starts = Vec::with_capacity(lists + 1);
        starts.push(0);
        Self { starts, cells: Vec::with_capacity(cells) }
    }

    fn of(&self, list: usize) -> &[u32] {
        &self.cells[self.starts[list] as usize..self.starts[list + 1] as usize]
    }

    /// The same lists with others appended, which come as list and cell, ascending; those that a list already
    /// has are left out.
    fn with(self, first: usize, pairs: &[[u32; 2]]) -> Self {
        if pairs.is_empty() {
            return self;
        }
        let lists = self.starts.len() - 1;
        let mut out = Self::for_cells(lists, self.cells.len() + pairs.len());
        let mut rest = pairs;
        for list in 0..lists {
            let own = self.of(list);
            out.cells.extend_from_slice(own);
            let here = |cell: u32| cell as usize == first + list;
            let (extra, others) = rest.split_at(rest.iter().take_while(|[from, _]| here(*from)).count());
            let more = extra.iter().map(|[_, to]| *to);
            out.cells.extend(more.filter(|to| !here(*to) && own.binary_search(to).is_err()));
            rest = others;
            out.starts.push(out.cells.len() as u32);
        }
        out
    }
}

impl Neighbors {
    /// The list of one cell.
    pub(crate) fn of(&self, cell: usize) -> &[u32] {
        self.parts[cell / CELLS_PER_TASK].of(cell % CELLS_PER_TASK)
    }

    /// The same lists with further pairs added in both directions. Pairs may repeat.
    pub(crate) fn with_pairs(self, mut pairs: Vec<[u32; 2]>) -> Self {
        let mirrored: Vec<[u32; 2]> = pairs.iter().map(|[a, b]| [*b, *a]).collect();
        pairs.extend(mirrored);
        pairs.par_sort_unstable();
        pairs.dedup();
        let until = |cell: usize| pairs.partition_point(|[from, _]| (*from as usize) < cell);
        let add = |(which, part): (usize, Part)| {
            let first = which * CELLS_PER_TASK;
            part.with(first, &pairs[until(first)..until(first + CELLS_PER_TASK)])
        };
        Self { parts: self.parts.into_par_iter().enumerate().map(add).collect() }
    }
}

#[cfg(test)]
mod tests {
    use super::Grid;
    use crate::reconstruct::planes::paper::random::Random;

    #[test]
    fn every_point_is_in_exactly_one_cell_with_those_of_its_cube() {
        let mut random = Random::new(3);
        let points: Vec<[f32; 3]> =
            (0..500).map(|_| std::array::from_fn(|_| (random.unit() * 4.0 - 2.0) as f32)).collect();
        let grid = Grid::new(&points, 0.5);
        let cube = |p: [f32; 3]| p.map(|v| (f64::from(v) / 0.5).floor() as i64);
        let mut seen = vec![false; points.len()];
        for cell in 0..grid.len() {
            let first = cube(points[grid.points_of(cell)[0] as usize]);
            for &point in grid.points_of(cell) {
                assert_eq!(cube(points[point as usize]), first);
                assert!(!std::mem::replace(&mut seen[point as usize], true));
            }
        }
        assert!(seen.iter().all(|s| *s));
    }

    #[test]
    fn neighbors_are_the_cells_that_touch_by_brute_force() {
        let mut random = Random::new(4);
        let points: Vec<[f32; 3]> =
            (0..300).map(|_| std::array::from_fn(|_| (random.unit() * 6.0 - 3.0) as f32)).collect();
        let grid = Grid::new(&points, 1.0);
        let neighbors = grid.neighbors();
        let cube =
            |cell: usize| points[grid.points_of(cell)[0] as usize].map(|v| f64::from(v).floor() as i64);
        for a in 0..grid.len() {
            let touching: Vec<u32> = (0..grid.len())
                .filter(|b| *b != a && (0..3).all(|k| (cube(a)[k] - cube(*b)[k]).abs() <= 1))
                .map(|b| b as u32)
                .collect();
            assert_eq!(neighbors.of(a), touching);
        }
    }

    #[test]
    fn further_pairs_join_the_lists_of_both_once() {
        let points = [[0.5, 0.5, 0.5], [1.5, 0.5, 0.5], [5.5, 0.5, 0.5]];
        let grid = Grid::new(&points, 1.0);
        let both = grid.neighbors().with_pairs(vec![[0, 2], [2, 0], [0, 1], [2, 2]]);
        assert_eq!((both.of(0), both.of(1), both.of(2)), (&[1, 2][..], &[0][..], &[0][..]));
    }

    #[test]
    fn points_that_are_nowhere_are_left_out() {
        let points = [[f32::NAN, 0.0, 0.0], [f32::INFINITY, 0.0, 0.0], [1e30, 0.0, 0.0], [1.0, 2.0, 3.0]];
        let grid = Grid::new(&points, 0.1);
        assert_eq!((grid.len(), grid.points_of(0)), (1, &[3][..]));
        assert_eq!(Grid::new(&[], 0.1).len(), 0);
        assert!(Grid::default().neighbors().parts.is_empty());
    }
}
