//! The map that scans are matched against: small surfaces, found through a grid that names the nearest one.
//!
//! Frame: map. Units: meters. The map grows with the area seen, not with time. Both pools (tiles, surfaces)
//! are fixed: when the tiles are used up the place that was not needed for the longest time is forgotten,
//! when the surfaces are, new ones are not taken until some are freed.

mod ages;
mod block_key;
pub(crate) mod grid;
mod params;
pub(crate) mod point_map;
mod pools;
pub(crate) mod rasterize;
pub(crate) mod raycast_free;
mod size;
pub(crate) mod surfel;
mod trace;

pub use params::MapParams;
pub use size::MapSize;

use crate::lanes::{InLanes, widest};
use crate::map::grid::{Grid, TILE, TileRow, cell_of};
use crate::map::pools::Pools;
use crate::map::rasterize::{MAX_REACH, Stamp};
use crate::map::raycast_free::Carving;
use crate::map::surfel::Surfel;
use crate::map::trace::Trace;
use crate::placement::Placement;
use crate::scan::end_points::{EndPoint, EndPoints, Kind, Mobility};
use biplane_geometry::PortableMath;
use biplane_geometry::Pose2;
use biplane_geometry::vec2::{dot, minus};

/// Spread of the directions seen on a surface (standard deviation) up to which it is a line, radians. Larger:
/// clutter and corners count as walls; smaller: rough walls count as clutter. Error 0.0257 m halved, 0.0378 m
/// doubled.
const LINE_SPREAD_RAD: f64 = 0.6;

/// Surfaces and the grid that finds them.
#[derive(Clone, Debug)]
pub struct LocalMap {
    params: MapParams,
    pools: Pools,
    stamp: Stamp,
    trace: Trace,
    cells_per_m: f32,
    /// The submap that new surfaces belong to, and how many have come since it began.
    submap: u8,
    born: u32,
    /// Squared length of the mean normal from which on a surface is a line.
    line_strength: f32,
}

impl LocalMap {
    /// An empty map with all the memory it will ever have.
    pub fn new(params: MapParams) -> Self {
        let reach = ((params.reach_m / params.cell_m).round() as i32).clamp(1, MAX_REACH);
        Self {
            pools: Pools::new(params.tiles, params.surfaces, reach),
            stamp: Stamp::new(reach),
            trace: Trace::with_memory(),
            cells_per_m: (1.0 / params.cell_m) as f32,
            submap: 0,
            born: 0,
            // Directions with a normal spread s have a mean unit vector of length exp(-s^2 / 2).
            line_strength: (-LINE_SPREAD_RAD.powi(2)).portable_exp() as f32,
            params,
        }
    }

    /// Forgets everything; the memory stays.
    pub fn clear(&mut self) {
        self.pools.clear();
        (self.submap, self.born) = (0, 0);
    }

    /// Surfaces that were new since the last submap began.
    pub fn born(&self) -> u32 {
        self.born
    }

    /// From now on new surfaces belong to this submap; `thinned` when every two earlier ones have become one.
    pub fn begin_submap(&mut self, submap: u8, thinned: bool) {
        if thinned {
            self.pools.surfels.iter_mut().for_each(|surfel| surfel.submap /= 2);
        }
        (self.submap, self.born) = (submap, 0);
    }

    /// Surfaces in the map.
    pub fn surfel_count(&self) -> usize {
        self.pools.surfel_count()
    }

    /// What the map uses and what it may come to use.
    pub fn size(&self) -> MapSize {
        self.pools.size()
    }

    /// The cell that holds a point.
    #[inline]
    pub fn cell_of(&self, point_m: [f32; 2]) -> [i32; 2] {
        cell_of(point_m, self.cells_per_m)
    }

    /// Cells along a meter.
    pub(crate) fn cells_per_m(&self) -> f32 {
        self.cells_per_m
    }

    /// The surface nearest to a point's cell, within reach.
    #[inline]
    pub fn nearest(&self, point_m: [f32; 2]) -> Option<&Surfel> {
        let [x, y] = self.cell_of(point_m);
        self.pools.surfels.get(self.pools.grid.cell(x, y).surfel()? as usize)
    }

    /// The same surface's number among `Self::surfaces`.
    #[inline]
    pub fn nearest_index(&self, point_m: [f32; 2]) -> Option<u32> {
        self.index_in(self.cell_of(point_m))
    }

    /// The number of the surface nearest to a cell, within reach.
    #[inline]
    pub(crate) fn index_in(&self, [x, y]: [i32; 2]) -> Option<u32> {
        self.pools.grid.cell(x, y).surfel()
    }

    /// All places for surfaces that were ever used.
    pub fn surfels(&self) -> &[Surfel] {
        &self.pools.surfels
    }

    /// Whether the directions seen on a surface agree so well that it is a line.
    #[inline]
    pub fn is_line(&self, surfel: &Surfel) -> bool {
        dot(surfel.normal, surfel.normal) >= self.line_strength
    }

    /// Whether beams have passed through a point's surroundings.
    #[inline]
    pub fn seen_through(&self, point_m: [f32; 2]) -> bool {
        let [x, y] = self.cell_of(point_m);
        self.tile_row([x, y]).is_some_and(|row| row.look(x).1)
    }

    /// The row of cells of the tile that this cell lies in; `None` where nothing was ever mapped.
    #[inline(always)]
    pub(crate) fn tile_row(&self, [x, y]: [i32; 2]) -> Option<TileRow<'_>> {
        self.pools.grid.tile_row(x, y)
    }

    /// Adds a scan taken at this pose: first what its beams passed through, then where they ended.
    /// A base too close to the edge of what the directory covers adds nothing: there the map ends.
    pub fn learn(&mut self, map_from_base: &Pose2, points: &EndPoints) {
        if !self.covers(map_from_base, points.reach_m()) {
            return;
        }
        self.pools.grid.advance();
        widest(Learn { map: self, map_from_base, points });
    }

    /// Adds what was left out of a scan taken at this pose because it might have moved.
    pub(crate) fn learn_left_out(&mut self, map_from_base: &Pose2, points: &EndPoints) {
        if self.covers(map_from_base, points.reach_m()) {
            self.hit_all(map_from_base, points.as_slice(), Mobility::Unknown);
        }
    }

    /// Adds where a scan's beams ended, taken at this pose; what stood in their way before stays. Too close
    /// to the edge of what the directory covers nothing is added.
    pub fn add(&mut self, map_from_base: &Pose2, points: &[EndPoint]) {
        let reach_m = points.iter().map(|point| dot(point.at_m, point.at_m).sqrt()).fold(0.0, f32::max);
        if !self.covers(map_from_base, reach_m) {
            return;
        }
        self.pools.grid.advance();
        self.hit_all(map_from_base, points, Mobility::Static);
    }

    /// Whether the directory covers all around a pose, so far.
    fn covers(&self, map_from_base: &Pose2, reach_m: f32) -> bool {
        let limit_m = (Grid::HALF_SIDE - 2 * TILE) as f32 / self.cells_per_m - reach_m;
        map_from_base.x_m.abs().max(map_from_base.y_m.abs()) <= f64::from(limit_m)
    }

    #[inline(always)]
    fn hit_all(&mut self, map_from_base: &Pose2, points: &[EndPoint], mobility: Mobility) {
        let placement = Placement::new(map_from_base);
        for point in points.iter().filter(|point| point.mobility == mobility) {
            let EndPoint { at_m, normal, kind, .. } = point.placed(&placement);
            self.hit(at_m, normal, kind);
        }
    }

    #[inline(always)]
    fn hit(&mut self, at_m: [f32; 2], normal: [f32; 2], kind: Kind) {
        let home = self.cell_of(at_m);
        let cell = self.pools.grid.cell(home[0], home[1]);
        if let Some(index) = cell.surfel()
            && let Some(surfel) = self.pools.surfels.get_mut(index as usize)
            && (cell.squared() == 0 || surfel.takes(minus(at_m, surfel.at_m), normal, &self.params))
        {
            surfel.add(at_m, normal, &self.params);
            let [x, y] = surfel.home.map(i32::from);
            self.pools.grid.claim(x, y); // keeps its tile young
            return;
        }
        if kind == Kind::Unsure || !self.pools.claim(home[0], home[1]) {
            return;
        }
        let Some(index) = self.pools.insert(Surfel::new(at_m, normal, home, self.submap)) else { return };
        self.stamp.rasterize(&mut self.pools, index);
        self.born += 1;
        self.pools.grid.set_own(home[0], home[1], true);
    }
}

/// A map that learns from a scan at a pose.
struct Learn<'a> {
    map: &'a mut LocalMap,
    map_from_base: &'a Pose2,
    points: &'a EndPoints,
}

impl InLanes for Learn<'_> {
    type Output = ();

    #[inline(always)]
    fn work(self) {
        let Self { map, map_from_base, points } = self;
        let cell_m = map.params.cell_m as f32;
        let LocalMap { pools, stamp, trace, .. } = map;
        Carving { pools, stamp, trace, cell_m }.look_through(map_from_base, points);
        map.hit_all(map_from_base, points.as_slice(), Mobility::Static);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn remove(map: &mut LocalMap, index: u32) {
        map.stamp.remove(&mut map.pools, index);
    }

    fn hits(params: MapParams, places: &[[f32; 2]]) -> LocalMap {
        let mut map = LocalMap::new(params);
        map.pools.grid.advance();
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
        let all = map.pools.surfels.iter().enumerate().filter(|(index, _)| !gone.contains(&(*index as u32)));
        let squared = all.map(|(_, surfel)| {
            let [x, y] = surfel.home.map(i32::from);
            (x - cell[0]).pow(2) + (y - cell[1]).pow(2)
        });
        squared.min().filter(|squared| *squared <= map.pools.reach * map.pools.reach)
    }

    fn assert_as_brute_force(map: &LocalMap, gone: &[u32]) {
        for y in -40..40 {
            for x in -40..40 {
                let cell = map.pools.grid.cell(x, y);
                let found = cell.surfel().map(|_| i32::from(cell.squared()));
                assert_eq!(found, nearest_by_brute_force(map, [x, y], gone), "cell {x} {y}");
            }
        }
    }

    #[test]
    fn every_cell_names_the_nearest_surface_also_after_some_are_gone() {
        let mut map = hits(MapParams::default(), &places());
        assert!(map.surfel_count() > 50);
        assert_as_brute_force(&map, &[]);
        for gone in [3, 17, 40] {
            remove(&mut map, gone);
        }
        assert_eq!(map.surfel_count(), map.pools.surfels.len() - 3);
        assert_as_brute_force(&map, &[3, 17, 40]);
    }

    #[test]
    fn end_points_of_one_wall_become_one_row_of_surfaces_even_across_a_border_of_cells() {
        let mut map = LocalMap::new(MapParams::default());
        map.pools.grid.advance();
        for i in 0..400 {
            // Along x, on the border between two rows of cells, a centimeter to either side.
            let y = 1.0 + if i % 2 == 0 { 0.01 } else { -0.01 };
            map.hit([0.0025 * i as f32, y], [0.0, -1.0], Kind::Line);
        }
        assert!((15..=25).contains(&map.surfel_count()), "{}", map.surfel_count());
        let surfel = map.nearest([0.5, 1.0]).unwrap();
        assert!((surfel.at_m[1] - 1.0).abs() < 0.005, "{surfel:?}");
    }

    #[test]
    fn a_full_pool_forgets_the_oldest_tile_with_its_surfaces() {
        let mut map = LocalMap::new(MapParams { tiles: 2, ..MapParams::default() });
        for (step, x) in [0.8, 2.4, 4.0].into_iter().enumerate() {
            map.pools.grid.advance();
            map.hit([x, 0.8], [0.0; 2], Kind::Point);
            let (size, kept) = (map.size(), (step + 1).min(2));
            assert_eq!((size.tiles, map.surfel_count(), size.forgotten), (kept, kept, step as u64 / 2));
        }
        assert!(map.nearest([0.8, 0.8]).is_none() && map.nearest([2.4, 0.8]).is_some());
    }

    #[test]
    fn a_map_reserves_the_memory_that_it_is_given_and_says_how_full_it_is() {
        for bytes in [4_000_000, 20_000_000, 300_000_000] {
            let size = LocalMap::new(MapParams::default().within_bytes(bytes)).size();
            assert!((bytes * 98 / 100..=bytes).contains(&size.bytes_reserved), "{bytes}: {size:?}");
        }
        let full =
            hits(MapParams { surfaces: 4, ..MapParams::default() }, &[[0.1, 0.1], [0.5, 0.1], [0.9, 0.1]]);
        assert_eq!((full.size().filling(), full.size().forgotten), (0.75, 0));
    }

    #[test]
    fn when_surfaces_are_used_up_new_ones_wait_until_some_go() {
        let mut map =
            hits(MapParams { surfaces: 2, ..MapParams::default() }, &[[0.1, 0.1], [0.5, 0.1], [0.9, 0.1]]);
        assert_eq!(map.surfel_count(), 2);
        remove(&mut map, 0);
        map.hit([0.9, 0.1], [0.0; 2], Kind::Point);
        assert!(map.nearest([0.9, 0.1]).is_some() && map.nearest([0.1, 0.1]).is_none());
    }
}
