//! What sizes the map, and which end points it takes for one surface.

use crate::map::grid::MAX_SURFELS;
use crate::parameter_group::parameter_group;

parameter_group! { "map";
/// The map that the method `map` matches against.
#[derive(Copy, Clone, PartialEq, Debug)]
pub struct MapParams {
    /// Side of a cell, meters: at most one surface a cell. Smaller: finer, more memory, slower to fill;
    /// larger: the two faces of a thin wall run together.
    pub cell_m: f64 [0.005, 1.0],
    /// From how far an end point finds a surface, meters. Larger: a wider basin of convergence, slower to
    /// fill.
    pub reach_m: f64 [0.005, 10.0],
    /// Tiles of 32 x 32 cells in the pool (4 KB each): memory against the area remembered. When all are used,
    /// the place not needed for the longest time is forgotten.
    pub tiles: usize [1.0, 65534.0],
    /// Surfaces in the pool (32 bytes each): memory against the area remembered. When all are used, new ones
    /// wait until others go.
    pub surfaces: usize [1.0, MAX_SURFELS as f64],
    /// An end point this close to the line of a neighboring surface joins it, meters. A few times the range
    /// noise: more, and two walls run together; less, and one wall lies in two rows.
    pub merge_across_m: f64,
    not by name:
    /// A surface's mean moves by at least 1 / this many hits. Larger: steadier; smaller: it follows later
    /// scans. The map of the tracker has `MEMORY_HITS`; a map of optimized poses forgets nothing and takes
    /// more.
    pub memory_hits: f64,
}
}

/// Hits after which a surface of the tracker's map follows later scans, since earlier poses are no better
/// than later ones. Error 0.0247 m halved, 0.0254 m doubled.
const MEMORY_HITS: f64 = 50.0;

/// What a tile takes with all that is kept of it, bytes.
const BYTES_PER_TILE: usize = 4262;
/// What a surface takes, bytes.
const BYTES_PER_SURFACE: usize = 32;
/// Surfaces in a tile: 46 to 107 in the mean of four recordings in buildings.
const SURFACES_PER_TILE: usize = 64;
/// The directory of tiles, bytes.
const BYTES_OF_DIRECTORY: usize = 2 << 20;

impl MapParams {
    /// The map remembers as much as fits into so many bytes.
    #[must_use]
    pub fn within_bytes(self, bytes: usize) -> Self {
        let a_tile = BYTES_PER_TILE + SURFACES_PER_TILE * BYTES_PER_SURFACE;
        let tiles = (bytes.saturating_sub(BYTES_OF_DIRECTORY) / a_tile).clamp(1, 65_534);
        Self { tiles, surfaces: (tiles * SURFACES_PER_TILE).min(MAX_SURFELS), ..self }
    }
}

impl Default for MapParams {
    fn default() -> Self {
        Self {
            cell_m: 0.05,
            reach_m: 0.25,
            tiles: 18_000,
            surfaces: 1_152_000,
            merge_across_m: 0.04,
            memory_hits: MEMORY_HITS,
        }
    }
}
