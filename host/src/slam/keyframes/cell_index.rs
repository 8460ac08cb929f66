//! Which points lie in a cell of the floor plan: a bit a cell in tiles, and the points in the order of cells.
//!
//! Most cells that are asked for are empty, and a bit tells. Where one is set, the cells before it are
//! counted.

use std::ops::Range;

/// A tile has 64 rows of 64 cells.
const TILE_BITS: u32 = 6;
const TILE: i32 = 1 << TILE_BITS;
/// What sets the numbers of tiles apart, which have a sign, in a key.
const TILE_OFFSET: i32 = 1 << (31 - TILE_BITS);

/// The cells of a tile that hold points, a bit a cell.
#[derive(Clone, Debug)]
struct Tile {
    at: [i32; 2],
    rows: [u64; TILE as usize],
    /// So many cells that hold points come before each row, those of other tiles among them.
    before: [u32; TILE as usize],
}

/// See the module's text.
#[derive(Clone, Debug)]
pub(crate) struct CellIndex {
    /// By their place, in its order.
    tiles: Vec<Tile>,
    /// The tile used last: a beam stays in one for many cells.
    last: usize,
    /// Where each cell's points begin in `numbers`; one more than there are cells.
    starts: Vec<u32>,
    /// The points, cell by cell.
    numbers: Vec<u32>,
}

impl CellIndex {
    /// Of points in these cells.
    pub(crate) fn new(cells: impl Iterator<Item = [i32; 2]>) -> Self {
        let mut keyed: Vec<(u64, u32)> = (0..).zip(cells).map(|(number, cell)| (key(cell), number)).collect();
        keyed.sort_unstable();
        let mut index = Self {
            tiles: Vec::new(),
            last: 0,
            starts: Vec::new(),
            numbers: keyed.iter().map(|(_, number)| *number).collect(),
        };
        let mut last = None;
        for (start, (key, _)) in (0..).zip(keyed) {
            if last.replace(key) != Some(key) {
                index.push(key);
                index.starts.push(start);
            }
        }
        index.starts.push(index.numbers.len() as u32);
        for tile in &mut index.tiles {
            let mut before = tile.before[0];
            for (row, sum) in tile.rows.iter().zip(&mut tile.before) {
                *sum = before;
                before += row.count_ones();
            }
        }
        index
    }

    /// The points, cell by cell, those of a cell in ascending order.
    pub(crate) fn numbers(&self) -> &[u32] {
        &self.numbers
    }

    /// Where the points of a cell are in [`CellIndex::numbers`].
    pub(crate) fn find(&self, cell: [i32; 2]) -> Range<usize> {
        let at = tile_of(cell);
        self.tiles.binary_search_by_key(&at, |tile| tile.at).map_or(0..0, |tile| self.within(tile, cell))
    }

    /// The same, quickest for cells that follow each other.
    pub(crate) fn find_along(&mut self, cell: [i32; 2]) -> Range<usize> {
        let at = tile_of(cell);
        if self.tiles.get(self.last).is_none_or(|tile| tile.at != at) {
            let Ok(tile) = self.tiles.binary_search_by_key(&at, |tile| tile.at) else { return 0..0 };
            self.last = tile;
        }
        self.within(self.last, cell)
    }

    /// The points of a cell in its tile.
    fn within(&self, tile: usize, cell: [i32; 2]) -> Range<usize> {
        let [column, row] = cell.map(|value| (value & (TILE - 1)) as usize);
        let (tile, bit) = (&self.tiles[tile], 1_u64 << column);
        if tile.rows[row] & bit == 0 {
            return 0..0;
        }
        let number = (tile.before[row] + (tile.rows[row] & (bit - 1)).count_ones()) as usize;
        self.starts[number] as usize..self.starts[number + 1] as usize
    }

    /// Marks the next cell that holds points.
    fn push(&mut self, key: u64) {
        let at = [key >> (32 + TILE_BITS), key >> (2 * TILE_BITS)]
            .map(|part| (part & ((1 << (32 - TILE_BITS)) - 1)) as i32 - TILE_OFFSET);
        if self.tiles.last().is_none_or(|tile| tile.at != at) {
            let before = [self.starts.len() as u32; TILE as usize];
            self.tiles.push(Tile { at, rows: [0; TILE as usize], before });
        }
        if let Some(tile) = self.tiles.last_mut() {
            let [row, column] = [key >> TILE_BITS, key].map(|part| part & (TILE as u64 - 1));
            tile.rows[row as usize] |= 1 << column;
        }
    }
}

fn tile_of(cell: [i32; 2]) -> [i32; 2] {
    cell.map(|value| value >> TILE_BITS)
}

/// Orders cells by tile, row and column.
fn key(cell: [i32; 2]) -> u64 {
    let [x, y] = tile_of(cell).map(|value| (value + TILE_OFFSET) as u64);
    let [column, row] = cell.map(|value| (value & (TILE - 1)) as u64);
    x << (32 + TILE_BITS) | y << (2 * TILE_BITS) | row << TILE_BITS | column
}

#[cfg(test)]
mod tests {
    use super::CellIndex;

    #[test]
    fn it_finds_the_points_of_each_cell_and_none_in_empty_ones() {
        let (min, max) = (i32::MIN, i32::MAX);
        let cells = [[0, 0], [-1, 63], [64, 0], [0, 0], [min, max], [max, min], [-1, 62], [63, 63], [0, 0]];
        let mut index = CellIndex::new(cells.into_iter());
        let around = cells.iter().flat_map(|[x, y]| {
            (-1..=1).flat_map(move |dx| (-1..=1).map(move |dy| [x.wrapping_add(dx), y.wrapping_add(dy)]))
        });
        for cell in around {
            let expected: Vec<u32> =
                (0..).zip(cells).filter(|(_, at)| *at == cell).map(|(at, _)| at).collect();
            assert_eq!(index.numbers()[index.find(cell)], expected, "{cell:?}");
            let range = index.find_along(cell);
            assert_eq!(index.numbers()[range], expected, "{cell:?}");
        }
    }
}
