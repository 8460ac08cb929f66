//! A build in pieces: planes are searched tile by tile, on one machine or on many, and put together.
//!
//! A tile is one or several blocks of the search (`reconstruct::planes::search::blocks`). A build without
//! tiles searches the same blocks, so both make the same bytes, whoever searched what and how often.

pub(crate) mod bytes;
pub(crate) mod found_file;
pub(crate) mod manifest;
pub(crate) mod points_file;

use crate::reconstruct::planes::PlaneParams;
use crate::reconstruct::planes::search::blocks::Block;
use manifest::Tile;
use std::collections::BTreeMap;

/// Blocks, by their numbers, in tiles of about `size_m`.
pub(crate) fn tiles_of(blocks: &[Block], params: &PlaneParams, size_m: f64) -> Vec<Tile> {
    let mut tiles: BTreeMap<[u64; 2], Tile> = BTreeMap::new();
    for (number, block) in blocks.iter().enumerate() {
        let empty = || Tile { box_m: block.box_m, halo_m: params.halo_m, ..Tile::default() };
        let tile = tiles.entry(row_and_column(block, params, size_m)).or_insert_with(empty);
        for k in 0..2 {
            tile.box_m[0][k] = tile.box_m[0][k].min(block.box_m[0][k]);
            tile.box_m[1][k] = tile.box_m[1][k].max(block.box_m[1][k]);
        }
        tile.blocks.push(number);
        tile.points += block.is_own.iter().filter(|is_own| **is_own).count();
    }
    tiles.into_values().collect()
}

/// The tile that the middle of a block lies in.
fn row_and_column(block: &Block, params: &PlaneParams, size_m: f64) -> [u64; 2] {
    let [column, row] = block.place.map(|v| ((f64::from(v) + 0.5) * params.block_m / size_m) as u64);
    [row, column]
}

/// Numbers as Slurm's `--array` takes them: `0,3-5`.
pub(crate) fn array_words(indices: &[usize]) -> String {
    let mut words: Vec<String> = Vec::new();
    for run in indices.chunk_by(|a, b| a + 1 == *b) {
        words.push(match run {
            [one] => one.to_string(),
            [first, .., last] => format!("{first}-{last}"),
            [] => continue,
        });
    }
    words.join(",")
}

#[cfg(test)]
mod tests {
    use super::{Tile, array_words, found_file, points_file, tiles_of};
    use crate::reconstruct::fixture::{corridor, drive};
    use crate::reconstruct::planes::search::blocks::{Block, divide};
    use crate::reconstruct::planes::search::stitch::combine;
    use crate::reconstruct::planes::{PlaneParams, extract, extract_searched, search_block, setting};

    #[test]
    fn blocks_searched_backwards_and_kept_in_files_make_what_a_whole_build_makes() {
        let cloud = drive(&corridor(), 60, 0.02, 5);
        let params = PlaneParams { block_m: 1.5, min_points_to_divide: 0, ..PlaneParams::default() };
        let blocks = divide(&params, &cloud);
        assert!(blocks.len() > 2, "{}", blocks.len());
        let setting = setting(&params, &cloud, &blocks);
        let kept = |block: &Block| {
            let points = points_file::decode(&points_file::encode(&cloud, &[block])).unwrap();
            let found = search_block(&params, &points[0], setting);
            found_file::decode(&found_file::encode(1, &[found]), 1).unwrap().remove(0)
        };
        let mut found: Vec<_> = blocks.iter().rev().map(kept).collect();
        found.reverse();
        let searched = combine(&cloud, &blocks, &found, setting);
        let tiled = extract_searched(&params, &cloud, searched, &mut |_| ());
        assert_eq!(tiled, extract(&params, &cloud));
        // Walls that several blocks share are one plane all the same.
        let whole = extract(&PlaneParams::default(), &cloud);
        assert_eq!(tiled.planes.len(), whole.planes.len());
        let same = tiled.labels.iter().zip(&whole.labels).filter(|(a, b)| a == b).count();
        assert!(same as f64 > 0.98 * cloud.len() as f64, "{same} of {}", cloud.len());
    }

    #[test]
    fn missing_tiles_are_named_in_runs() {
        assert_eq!(array_words(&[0, 3, 4, 5, 9, 10]), "0,3-5,9-10");
        assert_eq!(array_words(&[7]), "7");
        assert_eq!(array_words(&[]), "");
    }

    #[test]
    fn tiles_hold_whole_blocks_each_once() {
        let params = PlaneParams::default();
        let block = |place: [u32; 2]| Block {
            place,
            box_m: [place, place.map(|v| v + 1)].map(|corner| corner.map(|v| 20.0 * f64::from(v))),
            is_own: vec![true, false],
            ..Block::default()
        };
        let all: Vec<Block> = (0..4).flat_map(|row| (0..5).map(move |column| block([column, row]))).collect();
        for (size_m, count) in [(20.0, 20), (40.0, 6), (50.0, 4), (100.0, 1), (1000.0, 1)] {
            let tiles = tiles_of(&all, &params, size_m);
            assert_eq!(tiles.len(), count, "{size_m}");
            let mut blocks: Vec<usize> = tiles.iter().flat_map(|tile| tile.blocks.clone()).collect();
            blocks.sort_unstable();
            assert_eq!(blocks, (0..20).collect::<Vec<_>>());
            assert_eq!(tiles.iter().map(|tile| tile.points).sum::<usize>(), 20);
            let inside = |tile: &Tile| {
                tile.blocks.iter().all(|k| {
                    let [low, high] = all[*k].box_m;
                    (0..2).all(|axis| tile.box_m[0][axis] <= low[axis] && high[axis] <= tile.box_m[1][axis])
                })
            };
            assert!(tiles.iter().all(inside));
        }
    }
}
