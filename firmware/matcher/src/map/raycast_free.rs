//! What the beams of a scan passed through: free space becomes known, surfaces that are no longer there lose
//! evidence.
//!
//! Frame: map. Units: meters. Each beam walks from block to block (Amanatides and Woo 1987); only blocks that
//! hold surfaces are looked into.

use crate::map::grid::{BLOCK, TileSlot, block_bit};
use crate::map::pools::Pools;
use crate::map::rasterize::Stamp;
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
    /// Side of a cell, meters.
    pub cell_m: f32,
}

impl Carving<'_> {
    /// Walks along the beams of a scan taken at this pose.
    pub(crate) fn look_through(&mut self, map_from_base: &Pose2, points: &EndPoints) {
        let placement = Placement::new(map_from_base);
        let from_m = placement.place(points.laser_in_base_m());
        for point in points.as_slice().iter().step_by(CARVE_EVERY_BEAMS) {
            let offset = minus(placement.place(point.at_m), from_m);
            let range_m = dot(offset, offset).sqrt();
            let clear_m = range_m - CARVE_MARGIN_M;
            if clear_m > 0.0 {
                let direction = offset.map(|meters| meters / range_m);
                self.walk(&Ray { from_m, direction, clear_m });
            }
        }
    }

    fn walk(&mut self, ray: &Ray) {
        let block_m = self.cell_m * BLOCK as f32;
        let mut block = ray.from_m.map(|meters| (meters / block_m).floor() as i32);
        let mut step = [0_i32; 2];
        let mut next_m = [f32::INFINITY; 2];
        let mut per_block_m = [f32::INFINITY; 2];
        for axis in 0..2 {
            let direction = ray.direction[axis];
            if direction != 0.0 {
                step[axis] = if direction > 0.0 { 1 } else { -1 };
                let border = (block[axis] + i32::from(direction > 0.0)) as f32 * block_m;
                next_m[axis] = (border - ray.from_m[axis]) / direction;
                per_block_m[axis] = block_m / direction.abs();
            }
        }
        let (mut tile, mut quiet) = (None, 0);
        loop {
            if !tile.is_some_and(|tile: TileSlot| tile.holds(block)) {
                tile = self.pools.grid.tile_slot(block);
                quiet = tile.map_or(0, |tile| self.pools.grid.quiet(tile));
            }
            if quiet >> block_bit(block) & 1 == 0 {
                tile = self.pass(block, ray, tile);
                quiet = tile.map_or(0, |tile| self.pools.grid.quiet(tile));
            }
            let across_x = next_m[0] <= next_m[1];
            if next_m[usize::from(!across_x)] >= ray.clear_m {
                return;
            }
            // Both axes, without a branch: which one is next cannot be foreseen.
            block[0] += if across_x { step[0] } else { 0 };
            block[1] += if across_x { 0 } else { step[1] };
            next_m[0] += if across_x { per_block_m[0] } else { 0.0 };
            next_m[1] += if across_x { 0.0 } else { per_block_m[1] };
        }
    }

    /// A beam passes through a block, of this tile when there is one. Returns the tile.
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
        let mut own = self.pools.grid.own_cells_in(tile?, block);
        while own != 0 {
            let cell = own.trailing_zeros() as i32;
            own &= own - 1;
            if let Some(index) = self.pools.grid.cell(left + cell % BLOCK, low + cell / BLOCK).own() {
                self.pass_surfel(index, ray);
            }
        }
        tile
    }

    /// A surface that a beam went straight through loses evidence, and goes when it has none left.
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
