//! How much memory a map uses.

/// How much of the pools the map uses.
#[derive(Copy, Clone, PartialEq, Eq, Debug, Default)]
pub struct MapSize {
    /// Tiles in use, of [`MapParams::tiles`](crate::MapParams::tiles).
    pub tiles: usize,
    /// Surfaces in use, of [`MapParams::surfaces`](crate::MapParams::surfaces).
    pub surfaces: usize,
    /// Tiles that there is room for.
    pub tile_capacity: usize,
    /// Surfaces that there is room for.
    pub surface_capacity: usize,
    /// Tiles that were forgotten because all were in use.
    pub forgotten: u64,
    /// Memory that holds them and the directory that finds them, bytes.
    pub bytes_used: usize,
    /// Memory that the pools may come to use, bytes; the system gives it page by page when it is first used.
    pub bytes_reserved: usize,
}

impl MapSize {
    /// The share of the fuller of the two pools that is in use, 0 to 1.
    #[must_use]
    pub fn filling(&self) -> f64 {
        let share = |used: usize, capacity: usize| used as f64 / capacity.max(1) as f64;
        share(self.tiles, self.tile_capacity).max(share(self.surfaces, self.surface_capacity))
    }
}
