//! The 2D map: an occupancy grid in `map`, drawn by ray tracing (Moravec and Elfes 1985), as log-odds.
//!
//! Cell `(i, j)` covers `x` from `i` to `i + 1` resolutions and `y` likewise. A scan touches each cell once:
//! as hit where a beam ends, otherwise as passed where a beam went through. The grid is kept in tiles, so its
//! memory grows with the area seen.

use biplane_geometry::PortableMath;
use std::collections::BTreeMap;

/// How a grid is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct OccupancyParams {
    /// Side of a cell, meters. Smaller draws finer walls, at more memory and time; below the range noise
    /// walls fray.
    pub resolution_m: f64,
    /// Beams are followed this far and no farther, meters; an end point beyond it is no wall. Larger draws
    /// far walls, and also the spokes of beams that left through a window.
    pub max_range_m: f64,
    /// Probability that a cell is occupied after one beam ended in it, above 0.5. Larger believes single
    /// hits.
    pub hit_probability: f64,
    /// Probability that a cell is occupied after one beam passed through it, below 0.5. Smaller erases people
    /// faster, and walls that are seen at a grazing angle.
    pub pass_probability: f64,
}

impl Default for OccupancyParams {
    fn default() -> Self {
        Self { resolution_m: 0.05, max_range_m: 40.0, hit_probability: 0.7, pass_probability: 0.4 }
    }
}

/// One beam in `map`, meters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Ray {
    /// Where the laser was.
    pub from_m: [f64; 2],
    /// Where the beam ended.
    pub to_m: [f64; 2],
}

/// A rectangle of cells, `max` included.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct CellBounds {
    /// Smallest column and row.
    pub min: [i32; 2],
    /// Largest column and row.
    pub max: [i32; 2],
}

impl CellBounds {
    /// Grows to hold a cell.
    pub(crate) fn include(&mut self, cell: [i32; 2]) {
        for axis in [0, 1] {
            self.min[axis] = self.min[axis].min(cell[axis]);
            self.max[axis] = self.max[axis].max(cell[axis]);
        }
    }

    /// Columns and rows.
    pub(crate) fn size(&self) -> [u64; 2] {
        [0, 1].map(|axis| (i64::from(self.max[axis]) - i64::from(self.min[axis]) + 1).max(0).unsigned_abs())
    }
}

const TILE_BITS: u32 = 6;
const TILE: usize = 1 << TILE_BITS;
/// Log-odds are kept as whole hundredths, so that sums do not depend on their order.
const UNITS: f64 = 100.0;
/// Bound of the log-odds: 0.993, so that a door that opens is believed after some scans.
const LIMIT: i16 = 500;
/// Sizes of cells are whole nanometers, so that multiples of theirs read well.
const PER_NM: f64 = 1e9;
/// Cell numbers beyond this are outside of any building; rays there are left out.
const FARTHEST_CELL: f64 = 1e7;

#[derive(Clone)]
struct Tile {
    log_odds: [i16; TILE * TILE],
    /// Number of the scan that touched the cell last; 0 for a cell never seen.
    touched: [u32; TILE * TILE],
}

impl Tile {
    fn probability(&self, inside: usize) -> Option<f64> {
        (self.touched[inside] > 0)
            .then(|| 1.0 / (1.0 + (-f64::from(self.log_odds[inside]) / UNITS).portable_exp()))
    }
}

/// The grid. See the module's text.
#[derive(Clone)]
pub(crate) struct OccupancyGrid {
    params: OccupancyParams,
    hit: i16,
    pass: i16,
    scan: u32,
    tiles: Vec<Tile>,
    index: BTreeMap<[i32; 2], usize>,
    /// The tile used last: beams stay in a tile for many cells.
    last: Option<([i32; 2], usize)>,
}

fn log_odds(probability: f64) -> i16 {
    let probability = probability.clamp(0.01, 0.99);
    ((probability / (1.0 - probability)).portable_ln() * UNITS).round() as i16
}

impl OccupancyGrid {
    /// An empty grid. A resolution or range that is not positive falls back on the default.
    pub(crate) fn new(mut params: OccupancyParams) -> Self {
        let default = OccupancyParams::default();
        let positive = |value: f64| value.is_finite() && value > 0.0;
        if !positive(params.resolution_m) {
            params.resolution_m = default.resolution_m;
        }
        if !positive(params.max_range_m) {
            params.max_range_m = default.max_range_m;
        }
        let (hit, pass) = (log_odds(params.hit_probability), log_odds(params.pass_probability));
        Self { params, hit, pass, scan: 0, tiles: Vec::new(), index: BTreeMap::new(), last: None }
    }

    /// How the grid is drawn.
    pub(crate) fn params(&self) -> &OccupancyParams {
        &self.params
    }

    /// Draws one scan. Rays that are not finite are left out.
    pub(crate) fn add_scan(&mut self, rays: &[Ray]) {
        self.scan = self.scan.saturating_add(1);
        for ray in rays {
            if self.ends_in_range(ray)
                && let Some(cell) = self.cell_of(ray.to_m)
            {
                self.touch(cell, self.hit);
            }
        }
        for ray in rays {
            self.pass_along(ray);
        }
    }

    /// The rectangle of all cells that were seen.
    pub(crate) fn bounds(&self) -> Option<CellBounds> {
        let mut bounds: Option<CellBounds> = None;
        for (&tile, &index) in &self.index {
            for (cell, _) in self.tiles[index].touched.iter().enumerate().filter(|(_, scan)| **scan > 0) {
                let at = cell_in_map(tile, cell);
                bounds.get_or_insert(CellBounds { min: at, max: at }).include(at);
            }
        }
        bounds
    }

    /// Probability that a cell is occupied; `None` for a cell never seen.
    #[cfg(test)]
    pub(crate) fn probability(&self, cell: [i32; 2]) -> Option<f64> {
        let (tile, inside) = tile_of(cell);
        self.tiles[*self.index.get(&tile)?].probability(inside)
    }

    /// The probabilities of the cells of a row, from the cell `first` on; `None` for a cell never seen.
    pub(crate) fn fill_row(&self, first: [i32; 2], row: &mut [Option<f64>]) {
        let mut column = 0;
        while column < row.len() {
            let (at, inside) = tile_of([first[0].saturating_add(column as i32), first[1]]);
            let end = row.len().min(column + TILE - inside % TILE);
            let cells = row[column..end].iter_mut().zip(inside..);
            match self.index.get(&at) {
                Some(&index) => cells.for_each(|(cell, at)| *cell = self.tiles[index].probability(at)),
                None => cells.for_each(|(cell, _)| *cell = None),
            }
            column = end;
        }
    }

    /// Visits the cells that were seen with their probabilities, row by row, in each from the smallest column
    /// on.
    pub(crate) fn for_each_seen(&self, mut visit: impl FnMut([i32; 2], f64)) {
        let mut tiles: Vec<([i32; 2], &Tile)> =
            self.index.iter().map(|(&at, &index)| (at, &self.tiles[index])).collect();
        tiles.sort_by_key(|([x, y], _)| [*y, *x]);
        for of_row in tiles.chunk_by(|([_, one], _), ([_, other], _)| one == other) {
            for row in 0..TILE {
                for (at, tile) in of_row {
                    for inside in row * TILE..(row + 1) * TILE {
                        tile.probability(inside).into_iter().for_each(|p| visit(cell_in_map(*at, inside), p));
                    }
                }
            }
        }
    }

    /// The same with cells so many times as large. A cell shows the wall in it, if there is any, otherwise
    /// what is surest free.
    pub(crate) fn coarsened(&self, times: i32) -> Self {
        let exact_m = self.params.resolution_m * f64::from(times);
        let resolution_m = (exact_m * PER_NM).round() / PER_NM;
        let mut coarse = Self::new(OccupancyParams { resolution_m, ..self.params });
        coarse.scan = 1;
        for (&tile, &index) in &self.index {
            let seen = self.tiles[index].touched.iter().enumerate().filter(|(_, scan)| **scan > 0);
            for (inside, _) in seen {
                let at = cell_in_map(tile, inside).map(|value| value.div_euclid(times));
                coarse.merge(at, self.tiles[index].log_odds[inside]);
            }
        }
        coarse
    }

    fn merge(&mut self, cell: [i32; 2], log_odds: i16) {
        let (at, inside) = tile_of(cell);
        let index = self.tile_at(at);
        let tile = &mut self.tiles[index];
        let known = (tile.touched[inside] > 0).then_some(tile.log_odds[inside]);
        let is_wall = log_odds > 0 || known.is_some_and(|known| known > 0);
        tile.log_odds[inside] = match known {
            Some(known) if is_wall => known.max(log_odds),
            Some(known) => known.min(log_odds),
            None => log_odds,
        };
        tile.touched[inside] = self.scan;
    }

    fn ends_in_range(&self, ray: &Ray) -> bool {
        (ray.to_m[0] - ray.from_m[0]).portable_hypot(ray.to_m[1] - ray.from_m[1]) <= self.params.max_range_m
    }

    /// The cell that a point in `map` lies in; `None` far outside of any building.
    pub(crate) fn cell_of(&self, point_m: [f64; 2]) -> Option<[i32; 2]> {
        let cell = point_m.map(|value| (value / self.params.resolution_m).floor());
        cell.iter().all(|value| value.abs() < FARTHEST_CELL).then(|| cell.map(|value| value as i32))
    }

    fn touch(&mut self, cell: [i32; 2], change: i16) {
        let (at, inside) = tile_of(cell);
        let index = match self.last {
            Some((last, index)) if last == at => index,
            _ => self.tile_at(at),
        };
        let tile = &mut self.tiles[index];
        if tile.touched[inside] != self.scan {
            tile.touched[inside] = self.scan;
            tile.log_odds[inside] = (tile.log_odds[inside] + change).clamp(-LIMIT, LIMIT);
        }
    }

    fn tile_at(&mut self, at: [i32; 2]) -> usize {
        let next = self.tiles.len();
        let index = *self.index.entry(at).or_insert(next);
        if index == next {
            self.tiles.push(Tile { log_odds: [0; TILE * TILE], touched: [0; TILE * TILE] });
        }
        self.last = Some((at, index));
        index
    }

    /// Walks the cells of a ray from the laser up to, not including, its last (Amanatides and Woo 1987).
    fn pass_along(&mut self, ray: &Ray) {
        let to_m = self.shortened(ray);
        let (Some(mut cell), Some(end)) = (self.cell_of(ray.from_m), self.cell_of(to_m)) else { return };
        let mut step = [0_i32; 2];
        let mut next = [f64::INFINITY; 2];
        let mut each = [f64::INFINITY; 2];
        let mut left: i64 = 0;
        for axis in [0, 1] {
            let along = (to_m[axis] - ray.from_m[axis]) / self.params.resolution_m;
            let start = ray.from_m[axis] / self.params.resolution_m;
            step[axis] = (end[axis] - cell[axis]).signum();
            left += i64::from(end[axis].abs_diff(cell[axis]));
            if step[axis] != 0 {
                let border = f64::from(cell[axis]) + if step[axis] > 0 { 1.0 } else { 0.0 };
                next[axis] = (border - start) / along;
                each[axis] = (1.0 / along).abs();
            }
        }
        while left > 0 {
            self.touch(cell, self.pass);
            let mut axis = usize::from(next[1] < next[0]);
            if cell[axis] == end[axis] {
                axis = 1 - axis; // rounding at the very end of the ray
            }
            cell[axis] += step[axis];
            next[axis] += each[axis];
            left -= 1;
        }
    }

    fn shortened(&self, ray: &Ray) -> [f64; 2] {
        let along = [ray.to_m[0] - ray.from_m[0], ray.to_m[1] - ray.from_m[1]];
        let part = self.params.max_range_m / along[0].portable_hypot(along[1]);
        if part >= 1.0 { ray.to_m } else { [0, 1].map(|axis| ray.from_m[axis] + part * along[axis]) }
    }
}

fn tile_of(cell: [i32; 2]) -> ([i32; 2], usize) {
    let inside = cell.map(|value| (value & (TILE as i32 - 1)) as usize);
    (cell.map(|value| value >> TILE_BITS), inside[1] * TILE + inside[0])
}

fn cell_in_map(tile: [i32; 2], inside: usize) -> [i32; 2] {
    [(tile[0] << TILE_BITS) + (inside % TILE) as i32, (tile[1] << TILE_BITS) + (inside / TILE) as i32]
}

#[cfg(test)]
mod tests {
    use super::{CellBounds, OccupancyGrid, OccupancyParams, Ray};

    fn grid(resolution_m: f64) -> OccupancyGrid {
        OccupancyGrid::new(OccupancyParams { resolution_m, ..OccupancyParams::default() })
    }

    fn ray(from_m: [f64; 2], to_m: [f64; 2]) -> Ray {
        Ray { from_m, to_m }
    }

    #[test]
    fn a_beam_frees_the_cells_that_it_passed_and_fills_the_one_that_it_ended_in() {
        let mut grid = grid(1.0);
        grid.add_scan(&[ray([0.5, 0.5], [3.5, 0.5])]);
        let row: Vec<Option<bool>> =
            (-1..5).map(|x| grid.probability([x, 0]).map(|probability| probability > 0.5)).collect();
        assert_eq!(row, [None, Some(false), Some(false), Some(false), Some(true), None]);
        assert!((grid.probability([3, 0]).unwrap() - 0.7).abs() < 0.002);
        assert!((grid.probability([0, 0]).unwrap() - 0.4).abs() < 0.002);
        assert_eq!(grid.bounds(), Some(CellBounds { min: [0, 0], max: [3, 0] }));
        assert_eq!(grid.bounds().unwrap().size(), [4, 1]);
    }

    #[test]
    fn the_cells_of_a_ray_are_those_that_fine_sampling_finds() {
        let mut seed = 7_u64;
        let mut random = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 40) as f64 / (1_u64 << 24) as f64 * 30.0 - 15.0
        };
        for _ in 0..200 {
            let (from, to) = ([random(), random()], [random(), random()]);
            let mut grid = grid(1.0);
            grid.add_scan(&[ray(from, to)]);
            for sample in 0..=3000 {
                let part = f64::from(sample) / 3000.0;
                let at = [0, 1].map(|axis| (from[axis] + part * (to[axis] - from[axis])).floor() as i32);
                assert!(grid.probability(at).is_some(), "{from:?} {to:?} misses {at:?}");
            }
            let seen = grid.tiles.iter().flat_map(|tile| tile.touched).filter(|scan| *scan > 0).count();
            let end = to.map(|value| value.floor() as i32);
            let start = from.map(|value| value.floor() as i32);
            let expected = end[0].abs_diff(start[0]) + end[1].abs_diff(start[1]) + 1;
            assert_eq!(seen, expected as usize);
            assert!(grid.probability(end).unwrap() > 0.5);
        }
    }

    #[test]
    fn a_scan_touches_a_cell_once_and_a_hit_wins() {
        let mut grid = grid(1.0);
        // The second beam passes through the cell in which the first one ended.
        grid.add_scan(&[
            ray([0.5, 0.5], [2.5, 0.5]),
            ray([0.5, 0.5], [4.5, 0.5]),
            ray([0.5, 0.5], [2.6, 0.5]),
        ]);
        assert!((grid.probability([2, 0]).unwrap() - 0.7).abs() < 0.002);
        assert!((grid.probability([1, 0]).unwrap() - 0.4).abs() < 0.002);
    }

    #[test]
    fn wild_ranges_and_places_neither_draw_walls_nor_take_memory() {
        let mut grid = grid(0.05);
        for far in [1e30, 1e12, 1e6, f64::INFINITY, f64::NAN, -1e6] {
            grid.add_scan(&[ray([0.0, 0.0], [far, 1.0]), ray([far * 1e3, far], [far * 1e3, far])]);
        }
        assert!(grid.tiles.len() < 60, "{} tiles", grid.tiles.len());
        let bounds = grid.bounds().unwrap();
        assert!(bounds.size()[0] <= 2 * 801, "{bounds:?}");
        assert!((-900..900).all(|x| grid.probability([x, 0]).is_none_or(|p| p < 0.5)));
    }

    #[test]
    fn a_row_and_a_visit_find_each_cell_that_was_seen() {
        let mut grid = grid(1.0);
        grid.add_scan(&[ray([0.5, -70.5], [150.5, 90.5]), ray([-70.5, 2.5], [30.5, 2.5])]);
        let bounds = grid.bounds().unwrap();
        let mut visited = Vec::new();
        grid.for_each_seen(|cell, probability| visited.push((cell, probability)));
        let mut by_row = Vec::new();
        for y in bounds.min[1]..=bounds.max[1] {
            let mut row = vec![Some(9.0); bounds.size()[0] as usize];
            grid.fill_row([bounds.min[0], y], &mut row);
            let cells = (bounds.min[0]..).map(|x| [x, y]).zip(row);
            by_row.extend(cells.filter_map(|(cell, probability)| Some((cell, probability?))));
        }
        assert_eq!(visited, by_row);
        assert!(visited.iter().all(|(cell, probability)| grid.probability(*cell) == Some(*probability)));
    }

    #[test]
    fn a_coarse_cell_shows_the_wall_in_it_and_otherwise_what_is_free() {
        let mut grid = grid(0.1);
        for _ in 0..6 {
            grid.add_scan(&[ray([-0.95, 0.05], [0.85, 0.05]), ray([-0.95, -0.25], [0.15, -0.25])]);
        }
        let coarse = grid.coarsened(3);
        assert_eq!(coarse.params().resolution_m, 0.3);
        assert_eq!(coarse.bounds(), Some(CellBounds { min: [-4, -1], max: [2, 0] }));
        for (fine, cell) in [([8, 0], [2, 0]), ([0, 0], [0, 0]), ([1, -3], [0, -1]), ([-4, 0], [-2, 0])] {
            assert_eq!(coarse.probability(cell), grid.probability(fine), "{cell:?}");
        }
        assert_eq!(coarse.probability([1, -1]), None);
    }

    #[test]
    fn beams_take_people_away_again() {
        let mut grid = grid(1.0);
        grid.add_scan(&[ray([0.5, 0.5], [2.5, 0.5])]);
        for _ in 0..5 {
            grid.add_scan(&[ray([0.5, 0.5], [8.5, 0.5])]);
        }
        assert!(grid.probability([2, 0]).unwrap() < 0.3);
    }

    #[test]
    fn every_parameter_changes_the_grid() {
        let default = OccupancyParams::default();
        let drawn = |params: OccupancyParams| {
            let mut grid = OccupancyGrid::new(params);
            grid.add_scan(&[ray([0.0, 0.0], [3.01, 0.01])]);
            (grid.bounds(), grid.probability([60, 0]), grid.probability([0, 0]))
        };
        let changed = [
            OccupancyParams { resolution_m: 0.1, ..default },
            OccupancyParams { max_range_m: 2.0, ..default },
            OccupancyParams { hit_probability: 0.8, ..default },
            OccupancyParams { pass_probability: 0.3, ..default },
        ];
        for params in changed {
            assert_ne!(drawn(params), drawn(default), "{params:?}");
        }
        let broken = OccupancyParams { resolution_m: 0.0, max_range_m: f64::NAN, ..default };
        assert_eq!(drawn(broken), drawn(default));
    }
}
