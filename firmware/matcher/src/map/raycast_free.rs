//! What the beams of a scan passed through: free space becomes known, surfaces that are no longer there lose
//! evidence.
//!
//! Frame: map. Units: meters. Each beam walks from block to block; only blocks that hold surfaces are looked
//! into.

use crate::map::block_key::BlockKey;
use crate::map::grid::{BLOCK, TileSlot};
use crate::map::pools::Pools;
use crate::map::rasterize::Stamp;
use crate::map::trace::{BEAMS, Beams, Trace};
use crate::placement::Placement;
use crate::scan::end_points::EndPoints;
use biplane_geometry::Pose2;
use biplane_geometry::vec2::{dot, minus};

/// Only every so-many-th beam is followed through the map. Larger: cheaper, moved things stay longer.
/// Error 0.0262 m halved, 0.0253 m doubled.
const CARVE_EVERY_BEAMS: usize = 3;
/// So far before its end point a beam is not sure to be clear, meters. Smaller: beams that graze a wall deny
/// it; larger: what stood just before a wall stays. Error 0.0244 m halved, 0.0295 m doubled.
const CARVE_MARGIN_M: f32 = 0.2;

/// A beam in the map.
struct Ray {
    from_m: [f32; 2],
    direction: [f32; 2],
    /// As far as it is sure that nothing stood in its way, meters.
    clear_m: f32,
}

/// A map that beams pass through.
pub(crate) struct Carving<'a> {
    /// The map's cells and surfaces.
    pub pools: &'a mut Pools,
    /// Who takes surfaces out of it.
    pub stamp: &'a mut Stamp,
    /// Who follows beams.
    pub trace: &'a mut Trace,
    /// Side of a cell, meters.
    pub cell_m: f32,
}

impl Carving<'_> {
    /// Walks along the beams of a scan taken at this pose.
    #[inline(always)]
    pub(crate) fn look_through(&mut self, map_from_base: &Pose2, points: &EndPoints) {
        let placement = Placement::new(map_from_base);
        let from_m = placement.place(points.laser_in_base_m());
        let mut beams = Beams::default();
        for point in points.as_slice().iter().step_by(CARVE_EVERY_BEAMS) {
            let offset = minus(placement.place(point.at_m), from_m);
            let range_m = dot(offset, offset).sqrt();
            let clear_m = range_m - CARVE_MARGIN_M;
            if clear_m > 0.0 {
                let direction = offset.map(|meters| meters / range_m);
                [beams.direction[0][beams.len], beams.direction[1][beams.len]] = direction;
                beams.clear_m[beams.len] = clear_m;
                beams.len += 1;
            }
            if beams.len == BEAMS {
                self.walk_all(&beams, from_m);
                beams.len = 0;
            }
        }
        self.walk_all(&beams, from_m);
    }

    /// Follows beams, one after the other.
    #[inline(always)]
    fn walk_all(&mut self, beams: &Beams, from_m: [f32; 2]) {
        if beams.len == 0 {
            return;
        }
        let mut trace = std::mem::take(self.trace);
        trace.follow(beams, from_m, self.cell_m);
        for beam in 0..beams.len {
            let direction = [beams.direction[0][beam], beams.direction[1][beam]];
            let ray = Ray { from_m, direction, clear_m: beams.clear_m[beam] };
            self.walk(&ray, trace.of(beam));
        }
        *self.trace = trace;
    }

    #[inline(always)]
    fn walk(&mut self, ray: &Ray, blocks: impl Iterator<Item = BlockKey>) {
        let (mut tile, mut of, mut quiet) = (None, None, 0);
        for key in blocks {
            if of != Some(key.tile()) {
                tile = self.pools.grid.tile_slot(key.block());
                quiet = tile.map_or(0, |tile| self.pools.grid.quiet(tile));
                of = tile.map(|_| key.tile());
            }
            if quiet >> key.bit() & 1 == 0 {
                tile = self.pass(key.block(), ray, tile);
                quiet = tile.map_or(0, |tile| self.pools.grid.quiet(tile));
                of = tile.map(|_| key.tile());
            }
        }
    }

    /// A beam passes through a block, of this tile when there is one. Returns the tile.
    #[inline(always)]
    fn pass(&mut self, block: [i32; 2], ray: &Ray, tile: Option<TileSlot>) -> Option<TileSlot> {
        let mut tile = tile;
        let [left, low] = block.map(|index| index * BLOCK);
        if !tile.is_some_and(|tile| self.pools.grid.seen_through(tile, block)) {
            if !self.pools.claim(left, low) {
                return None;
            }
            tile = self.pools.grid.tile_slot(block); // what was claimed may have taken another one's place
            self.pools.grid.see_through(tile?, block);
        }
        // A copy: a surface that goes changes cells, but whose own cells the others are stays.
        let tile = tile?;
        let mut own = self.pools.grid.own_cells_in(tile, block);
        while own != 0 {
            let cell = own.trailing_zeros() as i32;
            own &= own - 1;
            if let Some(index) = self.pools.grid.cell_in(tile, left + cell % BLOCK, low + cell / BLOCK).own()
            {
                self.pass_surfel(index, ray);
            }
        }
        Some(tile)
    }

    /// A surface that a beam went straight through loses evidence, and goes when it has none left.
    #[inline(always)]
    fn pass_surfel(&mut self, index: u32, ray: &Ray) {
        let Some(surfel) = self.pools.surfels.get_mut(index as usize) else { return };
        let offset = minus(surfel.at_m, ray.from_m);
        let along_m = dot(offset, ray.direction);
        let aside_m = (offset[0] * ray.direction[1] - offset[1] * ray.direction[0]).abs();
        if along_m < 0.0 || along_m > ray.clear_m || aside_m > 0.5 * self.cell_m {
            return;
        }
        // A beam that runs along a wall passes close to its surfaces without denying them.
        let strength = dot(surfel.normal, surfel.normal);
        let across = dot(surfel.normal, ray.direction);
        if strength > 0.5 && across * across < 0.1 * strength {
            return;
        }
        surfel.evidence -= 1;
        if surfel.evidence <= 0 {
            self.stamp.remove(self.pools, index);
        }
    }
}
