//! Blocks in one number each, for beams that pass through many.
//!
//! Units: blocks.

use crate::map::grid::{BLOCKS_PER_SIDE, DIRECTORY};

/// A block and its tile in one number, for beams that pass through many.
#[derive(Copy, Clone, PartialEq, Eq, Debug, Default)]
pub(crate) struct BlockKey(pub u32);

impl BlockKey {
    /// Blocks from the origin to the directory's edge.
    const HALF_SIDE: i32 = DIRECTORY / 2 * BLOCKS_PER_SIDE;
    /// More blocks lie on no straight line through the directory.
    pub(crate) const MAX_ON_A_LINE: usize = 4 * Self::HALF_SIDE as usize;

    /// Of a block within the directory (block coordinates).
    #[inline(always)]
    pub(crate) fn new(block: [i32; 2]) -> Self {
        let [x, y] = block.map(|index| (index + Self::HALF_SIDE) as u32);
        let side = BLOCKS_PER_SIDE as u32;
        let (tile, within) = (((y / side) << 10) | (x / side), (y % side) * side + x % side);
        Self((tile << 6) | within)
    }

    /// Tells its tile from others.
    #[inline(always)]
    pub(crate) fn tile(self) -> u32 {
        self.0 >> 6
    }

    /// Its place among those of its tile, as in the bits of [`Grid::quiet`](crate::map::grid::Grid::quiet).
    #[inline(always)]
    pub(crate) fn bit(self) -> u32 {
        self.0 & 63
    }

    /// Its block coordinates.
    #[inline(always)]
    pub(crate) fn block(self) -> [i32; 2] {
        let (tile, within) = (self.tile() as i32, self.bit() as i32);
        let x = (tile & (DIRECTORY - 1)) * BLOCKS_PER_SIDE + within % BLOCKS_PER_SIDE;
        let y = (tile >> 10) * BLOCKS_PER_SIDE + within / BLOCKS_PER_SIDE;
        [x - Self::HALF_SIDE, y - Self::HALF_SIDE]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::map::grid::block_bit;

    #[test]
    fn a_blocks_key_tells_its_tile_its_place_there_and_the_block() {
        for x in [-4096, -4095, -9, -8, -1, 0, 1, 7, 8, 100, 4095] {
            for y in [-4096, -17, -1, 0, 5, 4095] {
                let key = BlockKey::new([x, y]);
                assert_eq!((key.block(), key.bit()), ([x, y], block_bit([x, y])));
                assert_eq!(key.tile(), BlockKey::new([x & !7, y | 7]).tile());
                assert_ne!(key.tile(), BlockKey::new([x ^ 8, y]).tile());
            }
        }
    }
}
