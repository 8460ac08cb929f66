//! The two pools that a map is made of, tiles of cells and surfaces, kept consistent with each other.
//!
//! Frame: map. Units: cells. Both pools are fixed: when the tiles are used up the place that was not needed
//! for the longest time is forgotten, when the surfaces are, new ones are not taken until some are freed.

use crate::map::grid::{Cell, Claim, Grid, MAX_SURFELS, TILE};
use crate::map::size::MapSize;
use crate::map::surfel::Surfel;

/// Surfaces and the grid that finds them.
#[derive(Clone, Debug)]
pub(crate) struct Pools {
    /// The cells, each with its nearest surface.
    pub grid: Grid,
    /// All places for surfaces that were ever used.
    pub surfels: Vec<Surfel>,
    free: Vec<u32>,
    /// Tiles that were forgotten because the pool was full.
    forgotten: u64,
    /// How many cells away a cell may be that names a surface.
    pub reach: i32,
}

impl Pools {
    /// Empty pools with all the memory they will ever have.
    pub(crate) fn new(tiles: usize, surfels: usize, reach: i32) -> Self {
        let capacity = surfels.clamp(1, MAX_SURFELS);
        Self {
            grid: Grid::new(tiles),
            surfels: Vec::with_capacity(capacity),
            free: Vec::with_capacity(capacity),
            forgotten: 0,
            reach,
        }
    }

    /// Forgets everything; the memory stays.
    pub(crate) fn clear(&mut self) {
        self.grid.clear();
        self.surfels.clear();
        self.free.clear();
        self.forgotten = 0;
    }

    /// Surfaces in use.
    pub(crate) fn surfel_count(&self) -> usize {
        self.surfels.len() - self.free.len()
    }

    /// What is in use and what may come to be.
    pub(crate) fn size(&self) -> MapSize {
        let (a_surfel, pool) = (size_of::<Surfel>() + size_of::<u32>(), self.surfels.capacity());
        let [used, reserved] = self.grid.bytes();
        MapSize {
            tiles: self.grid.tiles(),
            surfaces: self.surfel_count(),
            tile_capacity: self.grid.capacity(),
            surface_capacity: pool,
            forgotten: self.forgotten,
            bytes_used: used + self.surfels.len() * a_surfel,
            bytes_reserved: reserved + pool * a_surfel,
        }
    }

    /// A place for a surface; `None` when all are used.
    pub(crate) fn insert(&mut self, surfel: Surfel) -> Option<u32> {
        match self.free.pop() {
            Some(index) => {
                self.surfels[index as usize] = surfel;
                Some(index)
            }
            None if self.surfels.len() < self.surfels.capacity() => {
                self.surfels.push(surfel);
                Some(self.surfels.len() as u32 - 1)
            }
            None => None,
        }
    }

    /// A surface's place may be used again.
    pub(crate) fn free(&mut self, index: u32) {
        self.free.push(index);
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

    /// Forgets a tile (tile coordinates) and the surfaces in it.
    fn forget(&mut self, tile: [i32; 2]) {
        self.forgotten += 1;
        let [left, low] = tile.map(|t| t * TILE);
        let reach = self.reach;
        let inside = |home: [i16; 2]| {
            [i32::from(home[0]).div_euclid(TILE), i32::from(home[1]).div_euclid(TILE)] == tile
        };
        for y in low - reach..low + TILE + reach {
            for x in left - reach..left + TILE + reach {
                let Some(cell) = self.grid.cell_mut(x, y) else { continue };
                let Some(index) = cell.surfel() else { continue };
                if inside(self.surfels[index as usize].home) {
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
