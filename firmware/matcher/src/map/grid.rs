//! A plane of cells kept in tiles from a fixed pool: each cell names the nearest mapped surface within reach.
//!
//! Frame: map. Cell (0, 0) has its lower corner at the map's origin. Memory: a directory of all places where
//! a tile may lie and a pool of tiles; both are allocated once, and the system gives the pool's memory as
//! tiles come into use. When the pool is used up, the tile that was not needed for the longest time is
//! forgotten.

use biplane_geometry::PortableMath;

use crate::map::ages::Ages;

/// Cells along a tile's side.
pub(crate) const TILE: i32 = 32;
const TILE_BITS: i32 = 5;
const TILE_CELLS: usize = (TILE * TILE) as usize;
/// Places for tiles along the directory's side: 819 m each way at 5 cm.
pub(super) const DIRECTORY: i32 = 1024;
/// Cells along a block's side; a block knows whether a beam has passed through it.
pub(crate) const BLOCK: i32 = 4;
const BLOCK_BITS: i32 = 2;
pub(super) const BLOCKS_PER_SIDE: i32 = TILE / BLOCK;
const TILE_BLOCKS: usize = (BLOCKS_PER_SIDE * BLOCKS_PER_SIDE) as usize;

/// What a cell knows: the nearest surface and how far its cell is. Zero is "nothing near".
#[derive(Copy, Clone, PartialEq, Eq, Debug, Default)]
pub(crate) struct Cell(u32);

impl Cell {
    /// A cell whose nearest surface is `surface`, `squared` cells squared away.
    pub(crate) fn near(surfel: u32, squared: u8) -> Self {
        Self(((surfel + 1) << 8) | u32::from(squared))
    }

    /// The nearest surface.
    pub(crate) fn surfel(self) -> Option<u32> {
        (self.0 >> 8).checked_sub(1)
    }

    /// Squared distance of the nearest surface's cell, in cells.
    pub(crate) fn squared(self) -> u8 {
        self.0 as u8
    }

    /// The surface that lies in this very cell.
    pub(crate) fn own(self) -> Option<u32> {
        if self.squared() == 0 { self.surfel() } else { None }
    }
}

/// The most surfaces that cells can name.
pub(crate) const MAX_SURFELS: usize = (1 << 24) - 2;

/// What the blocks of a tile know; a bit a block, row by row.
#[derive(Copy, Clone, Debug)]
struct Blocks {
    /// A beam has passed through: not unknown.
    seen_through: u64,
    /// Some cell has a surface of its own.
    occupied: u64,
    /// Which cells of each block have one; a bit a cell, row by row.
    own: [u16; TILE_BLOCKS],
}

impl Blocks {
    const UNKNOWN: Self = Self { seen_through: 0, occupied: 0, own: [0; TILE_BLOCKS] };
}

/// Where in the pool a tile lies, until a tile is claimed or released.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
pub(crate) struct TileSlot {
    slot: usize,
}

/// A block's place among those of its tile, as in the bits of [`Grid::quiet`] (block coordinates).
#[inline(always)]
pub(crate) fn block_bit([x, y]: [i32; 2]) -> u32 {
    (((y & (BLOCKS_PER_SIDE - 1)) * BLOCKS_PER_SIDE) + (x & (BLOCKS_PER_SIDE - 1))) as u32
}

/// The cell that holds a point.
#[inline(always)]
pub(crate) fn cell_of(point_m: [f32; 2], cells_per_m: f32) -> [i32; 2] {
    point_m.map(|meters| (meters * cells_per_m).floor_to_i32())
}

/// A number this large has no fraction: adding it rounds.
const ROUND: f32 = 12_582_912.0;

/// The largest integer not above, for many values side by side. What lies farther than four million cells
/// becomes another cell that lies farther than any map reaches.
#[inline(always)]
pub(crate) fn floor_in_lanes(value: f32) -> f32 {
    let rounded = (value + ROUND) - ROUND;
    rounded - if rounded > value { 1.0 } else { 0.0 }
}

/// What [`floor_in_lanes`] found, as an integer.
#[inline(always)]
pub(crate) fn whole(floor: f32) -> i32 {
    (floor + ROUND).to_bits().wrapping_sub(ROUND.to_bits()) as i32
}

/// A row of cells that lie in one tile.
pub(crate) struct TileRow<'a> {
    cells: &'a [Cell; TILE as usize],
    /// Which of the blocks along the row a beam has passed through; a bit a block.
    seen_through: u32,
}

impl TileRow<'_> {
    /// The cell in this column of the tile, and whether a beam has passed through its block.
    #[inline(always)]
    pub(crate) fn look(&self, column: i32) -> (Cell, bool) {
        let column = column & (TILE - 1);
        (self.cells[column as usize], self.seen_through >> (column >> BLOCK_BITS) & 1 != 0)
    }
}

/// The tiled plane.
#[derive(Clone, Debug)]
pub(crate) struct Grid {
    directory: Vec<u16>, // slot + 1
    cells: Vec<Cell>,
    blocks: Vec<Blocks>,           // one a tile
    places: Vec<Option<[i32; 2]>>, // where each tile of the pool lies
    last_used: Vec<u32>,
    /// Tiles that were released.
    free: Vec<u16>,
    /// Tiles in the order of their last use.
    ages: Ages,
    capacity: usize,
    now: u32,
}

/// What became of a wish for a tile.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
pub(crate) enum Claim {
    /// The tile is there.
    Ready,
    /// The pool is full: the tile at this place (tile coordinates) must be emptied first.
    Evict([i32; 2]),
    /// Outside the directory, or every tile is in use just now.
    Refused,
}

impl Grid {
    /// Cells from the origin to the directory's edge.
    pub(crate) const HALF_SIDE: i32 = DIRECTORY / 2 * TILE;

    /// A plane with memory for this many tiles (at least 1, at most 65,534).
    pub(crate) fn new(tiles: usize) -> Self {
        let tiles = tiles.clamp(1, usize::from(u16::MAX) - 1);
        Self {
            directory: vec![0; (DIRECTORY * DIRECTORY) as usize],
            cells: Vec::with_capacity(tiles * TILE_CELLS),
            blocks: Vec::with_capacity(tiles),
            places: Vec::with_capacity(tiles),
            last_used: Vec::with_capacity(tiles),
            free: Vec::with_capacity(tiles),
            ages: Ages::with_capacity(tiles),
            capacity: tiles,
            now: 0,
        }
    }

    /// A new round of use: tiles touched from here on are the youngest.
    pub(crate) fn advance(&mut self) {
        self.now += 1;
    }

    /// Tiles in use.
    pub(crate) fn tiles(&self) -> usize {
        self.places.len() - self.free.len()
    }

    /// Tiles that there is memory for.
    pub(crate) fn capacity(&self) -> usize {
        self.capacity
    }

    /// Memory that is in use and memory that may come into use, bytes. The directory counts as used: it fills
    /// anywhere.
    pub(crate) fn bytes(&self) -> [usize; 2] {
        let a_tile = TILE_CELLS * size_of::<Cell>() + size_of::<Blocks>();
        let a_place =
            size_of::<Option<[i32; 2]>>() + size_of::<u32>() + size_of::<u16>() + Ages::BYTES_PER_TILE;
        let directory = size_of_val(&self.directory[..]);
        [self.places.len(), self.capacity].map(|tiles| directory + tiles * (a_tile + a_place))
    }

    /// The cell at these coordinates; the empty cell where nothing is known.
    #[inline(always)]
    pub(crate) fn cell(&self, x: i32, y: i32) -> Cell {
        self.slot(x >> TILE_BITS, y >> TILE_BITS)
            .map_or(Cell::default(), |slot| self.cells[slot * TILE_CELLS + within_tile(x, y)])
    }

    /// The row of a tile that a cell lies in; `None` where no tile is.
    #[inline(always)]
    pub(crate) fn tile_row(&self, x: i32, y: i32) -> Option<TileRow<'_>> {
        let slot = self.slot(x >> TILE_BITS, y >> TILE_BITS)?;
        let start = slot * TILE_CELLS + within_tile(0, y);
        let cells = self.cells.get(start..start + TILE as usize)?.try_into().ok()?;
        let row = block_bit(block_of(0, y));
        Some(TileRow { cells, seen_through: (self.blocks[slot].seen_through >> row) as u32 })
    }

    /// The cell for writing; `None` where no tile is.
    #[inline(always)]
    pub(crate) fn cell_mut(&mut self, x: i32, y: i32) -> Option<&mut Cell> {
        let slot = self.slot(x >> TILE_BITS, y >> TILE_BITS)?;
        self.cells.get_mut(slot * TILE_CELLS + within_tile(x, y))
    }

    /// The cells `first` to `last` of a row for writing, which lie in one tile; none where no tile is.
    #[inline(always)]
    pub(crate) fn row_mut(&mut self, first: i32, last: i32, y: i32) -> &mut [Cell] {
        let Some(slot) = self.slot(first >> TILE_BITS, y >> TILE_BITS) else { return &mut [] };
        let start = slot * TILE_CELLS + within_tile(first, y);
        &mut self.cells[start..=start + (last - first) as usize]
    }

    /// Which cells of a block have a surface of their own; a bit a cell, row by row.
    #[inline(always)]
    pub(crate) fn own_cells(&self, block: [i32; 2]) -> u16 {
        self.tile_slot(block).map_or(0, |tile| self.own_cells_in(tile, block))
    }

    /// The same of a block of this tile.
    #[inline(always)]
    pub(crate) fn own_cells_in(&self, tile: TileSlot, block: [i32; 2]) -> u16 {
        self.blocks[tile.slot].own[block_bit(block) as usize]
    }

    /// A cell has got, or lost, a surface of its own.
    pub(crate) fn set_own(&mut self, x: i32, y: i32, there: bool) {
        let block = block_of(x, y);
        let Some(tile) = self.tile_slot(block) else { return };
        let (blocks, bit) = (&mut self.blocks[tile.slot], block_bit(block));
        let own = &mut blocks.own[bit as usize];
        let cell = 1 << ((y & (BLOCK - 1)) * BLOCK + (x & (BLOCK - 1)));
        *own = if there { *own | cell } else { *own & !cell };
        blocks.occupied = (blocks.occupied & !(1 << bit)) | u64::from(*own != 0) << bit;
    }

    /// The tile that holds this block (block coordinates), for looking at many of its blocks; `None` where
    /// there is none.
    #[inline(always)]
    pub(crate) fn tile_slot(&self, [x, y]: [i32; 2]) -> Option<TileSlot> {
        let tile = [x >> (TILE_BITS - BLOCK_BITS), y >> (TILE_BITS - BLOCK_BITS)];
        self.slot(tile[0], tile[1]).map(|slot| TileSlot { slot })
    }

    /// The cell at these coordinates, which lies in this tile.
    #[inline(always)]
    pub(crate) fn cell_in(&self, tile: TileSlot, x: i32, y: i32) -> Cell {
        self.cells[tile.slot * TILE_CELLS + within_tile(x, y)]
    }

    /// The blocks of a tile in which a beam finds nothing to do: seen through before, and without surfaces; a
    /// bit a block.
    #[inline(always)]
    pub(crate) fn quiet(&self, tile: TileSlot) -> u64 {
        let blocks = &self.blocks[tile.slot];
        blocks.seen_through & !blocks.occupied
    }

    /// A beam has passed through a block of this tile.
    #[inline(always)]
    pub(crate) fn see_through(&mut self, tile: TileSlot, block: [i32; 2]) {
        self.blocks[tile.slot].seen_through |= 1 << block_bit(block);
    }

    /// Whether a beam has passed through a block of this tile.
    #[inline(always)]
    pub(crate) fn seen_through(&self, tile: TileSlot, block: [i32; 2]) -> bool {
        self.blocks[tile.slot].seen_through >> block_bit(block) & 1 != 0
    }

    /// Makes sure that the cell at these coordinates has a tile, and marks that tile as used now.
    pub(crate) fn claim(&mut self, x: i32, y: i32) -> Claim {
        let tile = [x >> TILE_BITS, y >> TILE_BITS];
        if let Some(slot) = self.slot(tile[0], tile[1]) {
            if self.last_used[slot] != self.now {
                self.last_used[slot] = self.now;
                self.ages.remove(slot as u16);
                self.ages.push(slot as u16);
            }
            return Claim::Ready;
        }
        let Some(entry) = directory_index(tile[0], tile[1]) else { return Claim::Refused };
        let Some(slot) = self.unused_slot() else { return self.oldest() };
        self.directory[entry] = slot + 1;
        self.places[usize::from(slot)] = Some(tile);
        self.last_used[usize::from(slot)] = self.now;
        self.ages.push(slot);
        Claim::Ready
    }

    /// A tile of the pool that is not in use. One that was never used is within the capacity: nothing is
    /// allocated.
    fn unused_slot(&mut self) -> Option<u16> {
        if let Some(slot) = self.free.pop() {
            return Some(slot);
        }
        if self.places.len() == self.capacity {
            return None;
        }
        self.cells.resize(self.cells.len() + TILE_CELLS, Cell::default());
        self.blocks.push(Blocks::UNKNOWN);
        self.places.push(None);
        self.last_used.push(self.now);
        self.ages.grow();
        Some((self.places.len() - 1) as u16)
    }

    fn oldest(&self) -> Claim {
        let oldest = self.ages.oldest().map(usize::from);
        match oldest.filter(|&slot| self.last_used[slot] != self.now).and_then(|slot| self.places[slot]) {
            Some(tile) => Claim::Evict(tile),
            None => Claim::Refused,
        }
    }

    /// Forgets the tile at this place (tile coordinates).
    pub(crate) fn release(&mut self, tile: [i32; 2]) {
        let Some(slot) = self.slot(tile[0], tile[1]) else { return };
        self.cells[slot * TILE_CELLS..(slot + 1) * TILE_CELLS].fill(Cell::default());
        self.blocks[slot] = Blocks::UNKNOWN;
        self.places[slot] = None;
        self.ages.remove(slot as u16);
        self.free.push(slot as u16);
        if let Some(entry) = directory_index(tile[0], tile[1]) {
            self.directory[entry] = 0;
        }
    }

    /// Forgets all tiles.
    pub(crate) fn clear(&mut self) {
        for slot in 0..self.places.len() {
            if let Some(tile) = self.places[slot] {
                self.release(tile);
            }
        }
    }

    #[inline(always)]
    fn slot(&self, tile_x: i32, tile_y: i32) -> Option<usize> {
        let entry = directory_index(tile_x, tile_y)?;
        usize::from(self.directory[entry]).checked_sub(1)
    }
}

#[inline(always)]
fn directory_index(tile_x: i32, tile_y: i32) -> Option<usize> {
    let (x, y) = ((tile_x + DIRECTORY / 2) as u32, (tile_y + DIRECTORY / 2) as u32);
    (x < DIRECTORY as u32 && y < DIRECTORY as u32).then(|| (y * DIRECTORY as u32 + x) as usize)
}

#[inline(always)]
fn within_tile(x: i32, y: i32) -> usize {
    ((y & (TILE - 1)) * TILE + (x & (TILE - 1))) as usize
}

#[inline(always)]
fn block_of(x: i32, y: i32) -> [i32; 2] {
    [x >> BLOCK_BITS, y >> BLOCK_BITS]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_of_many_points_are_those_of_each() {
        for i in -2000..2000 {
            let value = i as f32 * 0.37;
            assert_eq!(whole(floor_in_lanes(value)), value.floor_to_i32(), "{value}");
        }
        for value in [0.0, -0.0, 1e-30, -1e-30, 16_383.99, -16_384.0, -16_384.01, 4e6, -4e6] {
            assert_eq!(whole(floor_in_lanes(value)), value.floor_to_i32(), "{value}");
        }
        for value in [1e7, -1e7, -1.2582912e7, 1e12, -1e12, 3e38, f32::INFINITY, f32::NEG_INFINITY, f32::NAN]
        {
            let cell = whole(floor_in_lanes(value));
            assert!(!(-Grid::HALF_SIDE..Grid::HALF_SIDE).contains(&cell), "{value}: {cell}");
        }
    }

    #[test]
    fn floor_rounds_down_on_both_sides_of_zero() {
        for (value, below) in
            [(1.5_f32, 1), (-1.5, -2), (2.0, 2), (-2.0, -2), (0.0, 0), (-1e-9, -1), (1e30, i32::MAX)]
        {
            assert_eq!(value.floor_to_i32(), below, "{value}");
        }
    }
}
