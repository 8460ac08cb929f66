//! How much memory a map uses.

/// How much of the pools the map uses.
#[derive(Copy, Clone, PartialEq, Eq, Debug, Default)]
pub struct MapSize {
    /// Tiles in use, of [`MapParams::tiles`](crate::MapParams::tiles).
    pub tiles: usize,
    /// Surfaces in use, of [`MapParams::surfaces`](crate::MapParams::surfaces).
    pub surfaces: usize,
    /// Memory that holds them and the directory that finds them, bytes.
    pub bytes_used: usize,
    /// Memory that the pools may come to use, bytes; the system gives it page by page when it is first used.
    pub bytes_reserved: usize,
}
