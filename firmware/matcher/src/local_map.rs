//! The map that scans are matched against: small surfaces, found through a grid that names the nearest one.
//!
//! Frame: map. Units: metres. The map grows with the area seen, not with time. Both pools (tiles, surfaces) are fixed:
//! when the tiles are used up the place that was not needed for the longest time is forgotten, when the surfaces are,
//! new ones are not taken until some are freed.

use crate::grid::{Cell, Claim, Grid, MAX_SURFACES, TILE};
use crate::paint::Brush;
use crate::points::{EndPoint, EndPoints, Kind};
use crate::pose::Pose2;
use crate::surface::{Placement, Surface, dot, minus};
use crate::tracker::MapSize;

crate::named::named_parameters! { "map";
/// The map that the method `map` matches against.
#[derive(Copy, Clone, PartialEq, Debug)]
pub struct MapParams {
    /// Side of a cell, metres: at most one surface a cell. Smaller: finer, more memory, slower to fill; larger:
    /// the two faces of a thin wall run together.
    pub cell_m: f64 [0.005, 1.0],
    /// From how far an end point finds a surface, metres. Larger: a wider basin of convergence, slower to fill.
    pub reach_m: f64 [0.005, 10.0],
    /// Tiles of 32 x 32 cells in the pool (4 KB each): memory against the area remembered. When all are used, the place not needed for the longest time
    /// is forgotten.
    pub tiles: usize [1.0, 65534.0],
    /// Surfaces in the pool (32 bytes each): memory against the area remembered. When all are used, new ones wait until others go.
    pub surfaces: usize [1.0, MAX_SURFACES as f64],
    /// A surface's mean moves by at least 1 / this many hits. Larger: steadier; smaller: it follows later scans.
    pub memory_hits: f64 [1.0, 1000000.0],
    /// An end point this close to the line of a neighbouring surface joins it, metres. A few times the range noise: more, and
    /// two walls run together; less, and one wall lies in two rows.
    pub merge_across_m: f64,
    /// Spread of the directions seen on a surface (standard deviation) up to which it is a line, radians. Larger: clutter and
    /// corners count as walls; smaller: rough walls count as clutter.
    pub line_spread_rad: f64 [0.01, 10.0],
    /// What a hit counts for a surface, in beams that pass through it. Larger: people who stood still stay longer.
    pub evidence_per_hit: i16 [1.0, 10000.0],
    /// The most evidence a surface has: so many beams must pass through before it goes. Larger: moved things
    /// stay longer; smaller: grazing beams carve walls away.
    pub evidence_max: i16 [1.0, 10000.0],
    /// Only every so-many-th beam is followed through the map. Larger: cheaper, moved things stay longer.
    pub carve_every_beams: usize [1.0, 1e5],
    /// So far before its end point a beam is not sure to be clear, metres. Smaller: beams that graze a wall deny it;
    /// larger: what stood just before a wall stays.
    pub carve_margin_m: f64,
    /// The map learns from a scan when the base has moved this far since the last one it learnt from, metres.
    /// Larger: cheaper, and the map knows less of what is ahead; smaller: the map repeats the same beams' errors.
    pub learn_every_m: f64,
    /// The same for turning, radians.
    pub learn_every_rad: f64,
}
}

impl Default for MapParams {
    fn default() -> Self {
        Self {
            cell_m: 0.05,
            reach_m: 0.25,
            tiles: 4096,
            surfaces: 200_000,
            memory_hits: 50.0,
            merge_across_m: 0.04,
            line_spread_rad: 0.6,
            evidence_per_hit: 3,
            evidence_max: 60,
            carve_every_beams: 3,
            carve_margin_m: 0.2,
            learn_every_m: 0.05,
            learn_every_rad: 0.05,
        }
    }
}

/// Surfaces and the grid that finds them.
#[derive(Clone, Debug)]
pub struct LocalMap {
    pub(crate) params: MapParams,
    pub(crate) grid: Grid,
    pub(crate) surfaces: Vec<Surface>,
    free: Vec<u32>,
    pub(crate) brush: Brush,
    reach: i32,
    cells_per_m: f32,
    /// The chapter that new surfaces belong to, and how many have come since it began.
    chapter: u8,
    born: u32,
    /// Squared length of the mean normal from which on a surface is a line.
    line_strength: f32,
}

impl LocalMap {
    /// An empty map with all the memory it will ever have.
    pub fn new(params: MapParams) -> Self {
        let capacity = params.surfaces.clamp(1, MAX_SURFACES);
        let reach = ((params.reach_m / params.cell_m).round() as i32).clamp(1, 15);
        Self {
            grid: Grid::new(params.tiles),
            surfaces: Vec::with_capacity(capacity),
            free: Vec::with_capacity(capacity),
            brush: Brush::new(reach),
            reach,
            cells_per_m: (1.0 / params.cell_m) as f32,
            chapter: 0,
            born: 0,
            // Directions with a normal spread s have a mean unit vector of length exp(-s^2 / 2).
            line_strength: (-params.line_spread_rad.powi(2)).exp() as f32,
            params,
        }
    }

    /// Forgets everything; the memory stays.
    pub fn clear(&mut self) {
        self.grid.clear();
        self.surfaces.clear();
        self.free.clear();
        (self.chapter, self.born) = (0, 0);
    }

    /// Surfaces that were new since the last chapter began.
    pub fn born(&self) -> u32 {
        self.born
    }

    /// From now on new surfaces belong to this chapter; `thinned` when every two earlier ones have become one.
    pub fn begin_chapter(&mut self, chapter: u8, thinned: bool) {
        if thinned {
            self.surfaces.iter_mut().for_each(|surface| surface.chapter /= 2);
        }
        (self.chapter, self.born) = (chapter, 0);
    }

    /// Surfaces in the map.
    pub fn surface_count(&self) -> usize {
        self.surfaces.len() - self.free.len()
    }

    /// What the map uses and what it may come to use.
    pub fn size(&self) -> MapSize {
        let (a_surface, pool) = (size_of::<Surface>() + size_of::<u32>(), self.surfaces.capacity());
        let [used, reserved] = self.grid.bytes();
        MapSize {
            tiles: self.grid.tiles(),
            surfaces: self.surface_count(),
            bytes_used: used + self.surfaces.len() * a_surface,
            bytes_reserved: reserved + pool * a_surface,
        }
    }

    /// The cell that holds a point.
    #[inline]
    pub fn cell_of(&self, point_m: [f32; 2]) -> [i32; 2] {
        point_m.map(|metres| floor(metres * self.cells_per_m))
    }

    /// The surface nearest to a point's cell, within reach.
    #[inline]
    pub fn nearest(&self, point_m: [f32; 2]) -> Option<&Surface> {
        let [x, y] = self.cell_of(point_m);
        self.surfaces.get(self.grid.cell(x, y).surface()? as usize)
    }

    /// The same surface's number among [`Self::surfaces`].
    #[inline]
    pub fn nearest_index(&self, point_m: [f32; 2]) -> Option<u32> {
        let [x, y] = self.cell_of(point_m);
        self.grid.cell(x, y).surface()
    }

    /// All places for surfaces that were ever used.
    pub fn surfaces(&self) -> &[Surface] {
        &self.surfaces
    }

    /// Whether the directions seen on a surface agree so well that it is a line.
    #[inline]
    pub fn is_line(&self, surface: &Surface) -> bool {
        dot(surface.normal, surface.normal) >= self.line_strength
    }

    /// Whether beams have passed through a point's surroundings.
    #[inline]
    pub fn seen_through(&self, point_m: [f32; 2]) -> bool {
        let [x, y] = self.cell_of(point_m);
        self.grid.look(x, y).1
    }

    /// Adds a scan taken at this pose: first what its beams passed through, then where they ended.
    /// A base too close to the edge of what the directory covers adds nothing: there the map ends.
    pub fn learn(&mut self, map_from_base: &Pose2, points: &EndPoints) {
        if !self.covers(map_from_base, points.reach_m()) {
            return;
        }
        self.grid.advance();
        self.look_through(map_from_base, points);
        self.hit_all(map_from_base, points.as_slice());
    }

    /// Adds where a scan's beams ended, taken at this pose; what stood in their way before stays. Too close to the edge of what the
    /// directory covers nothing is added.
    pub fn add(&mut self, map_from_base: &Pose2, points: &[EndPoint]) {
        let reach_m = points.iter().map(|point| dot(point.at_m, point.at_m).sqrt()).fold(0.0, f32::max);
        if !self.covers(map_from_base, reach_m) {
            return;
        }
        self.grid.advance();
        self.hit_all(map_from_base, points);
    }

    /// Whether the directory covers all around a pose, so far.
    fn covers(&self, map_from_base: &Pose2, reach_m: f32) -> bool {
        let limit_m = (Grid::HALF_SIDE - 2 * TILE) as f32 / self.cells_per_m - reach_m;
        map_from_base.x_m.abs().max(map_from_base.y_m.abs()) <= f64::from(limit_m)
    }

    fn hit_all(&mut self, map_from_base: &Pose2, points: &[EndPoint]) {
        let placement = Placement::new(map_from_base);
        for point in points {
            let (at_m, normal) = placement.place_point(point);
            self.hit(at_m, normal, point.kind);
        }
    }

    fn hit(&mut self, at_m: [f32; 2], normal: [f32; 2], kind: Kind) {
        let home = self.cell_of(at_m);
        let cell = self.grid.cell(home[0], home[1]);
        if let Some(index) = cell.surface()
            && let Some(surface) = self.surfaces.get_mut(index as usize)
            && (cell.squared() == 0 || surface.takes(minus(at_m, surface.at_m), normal, &self.params))
        {
            surface.add(at_m, normal, &self.params);
            let [x, y] = surface.home.map(i32::from);
            self.grid.claim(x, y); // keeps its tile young
            return;
        }
        if kind == Kind::Unsure || !self.claim(home[0], home[1]) {
            return;
        }
        let surface = Surface::new(at_m, normal, home, self.chapter, &self.params);
        let index = match self.free.pop() {
            Some(index) => {
                self.surfaces[index as usize] = surface;
                index
            }
            None if self.surfaces.len() < self.surfaces.capacity() => {
                self.surfaces.push(surface);
                self.surfaces.len() as u32 - 1
            }
            None => return,
        };
        self.paint(index);
        self.born += 1;
        self.grid.set_own(home[0], home[1], true);
    }

    /// A tile for this cell, forgetting the oldest one when there is none left.
    pub(crate) fn claim(&mut self, x: i32, y: i32) -> bool {
        match self.grid.claim(x, y) {
            Claim::Ready => true,
            Claim::Refused => false,
            Claim::Evict(tile) => {
                self.forget(tile);
                self.grid.claim(x, y) == Claim::Ready
            }
        }
    }

    /// A surface's place in the pool may be used again.
    pub(crate) fn free(&mut self, index: u32) {
        self.free.push(index);
    }

    /// Forgets a tile (tile coordinates) and the surfaces in it.
    fn forget(&mut self, tile: [i32; 2]) {
        let [left, low] = tile.map(|t| t * TILE);
        let reach = self.reach;
        let inside = |home: [i16; 2]| {
            [i32::from(home[0]).div_euclid(TILE), i32::from(home[1]).div_euclid(TILE)] == tile
        };
        for y in low - reach..low + TILE + reach {
            for x in left - reach..left + TILE + reach {
                let Some(cell) = self.grid.cell_mut(x, y) else { continue };
                let Some(index) = cell.surface() else { continue };
                if inside(self.surfaces[index as usize].home) {
                    if cell.squared() == 0 {
                        self.free.push(index);
                    }
                    *cell = Cell::default();
                }
            }
        }
        self.grid.release(tile);
    }
}

/// The largest integer not above; without the call into a maths library that `f32::floor` costs.
#[inline]
fn floor(value: f32) -> i32 {
    let towards_zero = value as i32;
    towards_zero.saturating_sub(i32::from(value < towards_zero as f32))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hits(params: MapParams, places: &[[f32; 2]]) -> LocalMap {
        let mut map = LocalMap::new(params);
        map.grid.advance();
        for &at_m in places {
            map.hit(at_m, [0.0; 2], Kind::Point);
        }
        map
    }

    /// Places that look random, in a square of 2 m about the origin.
    fn places() -> Vec<[f32; 2]> {
        (0..60).map(|i| [(i * 37 % 101) as f32 / 50.0 - 1.0, (i * 53 % 97) as f32 / 48.0 - 1.0]).collect()
    }

    /// Squared distance in cells to the nearest surface's cell, by looking at all of them.
    fn nearest_by_brute_force(map: &LocalMap, cell: [i32; 2], gone: &[u32]) -> Option<i32> {
        let all = map.surfaces.iter().enumerate().filter(|(index, _)| !gone.contains(&(*index as u32)));
        let squared = all.map(|(_, surface)| {
            let [x, y] = surface.home.map(i32::from);
            (x - cell[0]).pow(2) + (y - cell[1]).pow(2)
        });
        squared.min().filter(|squared| *squared <= map.reach * map.reach)
    }

    fn assert_as_brute_force(map: &LocalMap, gone: &[u32]) {
        for y in -40..40 {
            for x in -40..40 {
                let cell = map.grid.cell(x, y);
                let found = cell.surface().map(|_| i32::from(cell.squared()));
                assert_eq!(found, nearest_by_brute_force(map, [x, y], gone), "cell {x} {y}");
            }
        }
    }

    #[test]
    fn every_cell_names_the_nearest_surface_also_after_some_are_gone() {
        let mut map = hits(MapParams::default(), &places());
        assert!(map.surface_count() > 50);
        assert_as_brute_force(&map, &[]);
        for gone in [3, 17, 40] {
            map.remove(gone);
        }
        assert_eq!(map.surface_count(), map.surfaces.len() - 3);
        assert_as_brute_force(&map, &[3, 17, 40]);
    }

    #[test]
    fn end_points_of_one_wall_become_one_row_of_surfaces_even_across_a_border_of_cells() {
        let mut map = LocalMap::new(MapParams::default());
        map.grid.advance();
        for i in 0..400 {
            // Along x, on the border between two rows of cells, a centimetre to either side.
            let y = 1.0 + if i % 2 == 0 { 0.01 } else { -0.01 };
            map.hit([0.0025 * i as f32, y], [0.0, -1.0], Kind::Line);
        }
        assert!((15..=25).contains(&map.surface_count()), "{}", map.surface_count());
        let surface = map.nearest([0.5, 1.0]).unwrap();
        assert!((surface.at_m[1] - 1.0).abs() < 0.005, "{surface:?}");
    }

    #[test]
    fn a_full_pool_forgets_the_oldest_tile_with_its_surfaces() {
        let mut map = LocalMap::new(MapParams { tiles: 2, ..MapParams::default() });
        for (step, x) in [0.8, 2.4, 4.0].into_iter().enumerate() {
            map.grid.advance();
            map.hit([x, 0.8], [0.0; 2], Kind::Point);
            assert_eq!((map.size().tiles, map.surface_count()), ((step + 1).min(2), (step + 1).min(2)));
        }
        assert!(map.nearest([0.8, 0.8]).is_none() && map.nearest([2.4, 0.8]).is_some());
    }

    #[test]
    fn when_surfaces_are_used_up_new_ones_wait_until_some_go() {
        let mut map =
            hits(MapParams { surfaces: 2, ..MapParams::default() }, &[[0.1, 0.1], [0.5, 0.1], [0.9, 0.1]]);
        assert_eq!(map.surface_count(), 2);
        map.remove(0);
        map.hit([0.9, 0.1], [0.0; 2], Kind::Point);
        assert!(map.nearest([0.9, 0.1]).is_some() && map.nearest([0.1, 0.1]).is_none());
    }

    #[test]
    fn floor_rounds_down_on_both_sides_of_zero() {
        for (value, below) in
            [(1.5, 1), (-1.5, -2), (2.0, 2), (-2.0, -2), (0.0, 0), (-1e-9, -1), (1e30, i32::MAX)]
        {
            assert_eq!(floor(value), below, "{value}");
        }
    }
}
