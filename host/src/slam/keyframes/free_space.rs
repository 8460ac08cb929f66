//! Where the beams of a submap went through and no point lies near: cells in tiles of bits, so that its
//! memory follows the area seen.
//!
//! Frame of the submap, meters.

use biplane_geometry::PortableMath;
use biplane_matcher::{EndPoint, Pose2};

use crate::slam::keyframes::Node;

/// Side of a cell, meters.
const CELL_M: f32 = 0.2;
/// Beams end this far before what they see, meters.
const MARGIN_M: f32 = 0.3;
/// Of so many cells along a ray one is looked at, so that none is jumped over.
const STEP_CELLS: f32 = 0.7;
/// Beams and scans that are followed: every so many.
const EVERY_NODE: usize = 3;
/// See [`EVERY_NODE`].
const EVERY_BEAM: usize = 2;
/// A tile has 64 rows of 64 cells.
const TILE_BITS: u32 = 6;
const TILE: i32 = 1 << TILE_BITS;

/// The rows of a tile, a bit a cell.
type Rows = [u64; TILE as usize];

/// See the module's text.
#[derive(Clone, Debug, Default)]
pub(crate) struct FreeSpace {
    /// The tiles by their place, in its order.
    tiles: Vec<([i32; 2], Rows)>,
    /// The tile used last: a beam stays in one for many cells.
    last: usize,
}

impl FreeSpace {
    /// What the nodes at these poses saw through. `points` are theirs.
    pub(crate) fn new(nodes: &[Node], poses: &[Pose2], points: &[EndPoint]) -> Self {
        let mut free = Self::default();
        for (node, pose) in nodes.iter().zip(poses).step_by(EVERY_NODE) {
            node.keyframe_scan.beams(pose, EVERY_BEAM).for_each(|[from, to]| free.pass(from, to));
        }
        for point in points {
            let [column, row] = cell_of(point.at_m);
            for (x, y) in (-1..=1).flat_map(|y| (-1..=1).map(move |x| (x, y))) {
                free.clear([column.saturating_add(x), row.saturating_add(y)]);
            }
        }
        free.tiles.shrink_to_fit();
        free
    }

    /// Whether beams went through here.
    pub(crate) fn is_free(&self, at_m: [f32; 2]) -> bool {
        let (tile, row, bit) = tile_of(cell_of(at_m));
        self.find(tile).is_ok_and(|index| self.tiles[index].1[row] & bit != 0)
    }

    fn pass(&mut self, from: [f32; 2], to: [f32; 2]) {
        let along = [to[0] - from[0], to[1] - from[1]];
        let length = along[0].portable_hypot(along[1]);
        let steps = ((length - MARGIN_M) / (STEP_CELLS * CELL_M)).max(0.0) as usize;
        for step in 0..steps {
            let share = step as f32 * STEP_CELLS * CELL_M / length;
            self.set(cell_of([from[0] + share * along[0], from[1] + share * along[1]]));
        }
    }

    fn set(&mut self, cell: [i32; 2]) {
        let (tile, row, bit) = tile_of(cell);
        if self.tiles.get(self.last).is_none_or(|(at, _)| *at != tile) {
            self.last = self.find(tile).unwrap_or_else(|index| {
                self.tiles.insert(index, (tile, [0; TILE as usize]));
                index
            });
        }
        self.tiles[self.last].1[row] |= bit;
    }

    fn clear(&mut self, cell: [i32; 2]) {
        let (tile, row, bit) = tile_of(cell);
        if let Ok(index) = self.find(tile) {
            self.tiles[index].1[row] &= !bit;
        }
    }

    fn find(&self, tile: [i32; 2]) -> Result<usize, usize> {
        self.tiles.binary_search_by_key(&tile, |(at, _)| *at)
    }
}

fn cell_of(at_m: [f32; 2]) -> [i32; 2] {
    at_m.map(|value| (value / CELL_M).floor_to_i32())
}

fn tile_of(cell: [i32; 2]) -> ([i32; 2], usize, u64) {
    let [column, row] = cell.map(|value| value & (TILE - 1));
    (cell.map(|value| value >> TILE_BITS), row as usize, 1 << column)
}

#[cfg(test)]
mod tests {
    use biplane_matcher::{EndPoint, Pose2};

    use super::{FreeSpace, TILE};
    use crate::slam::keyframes::Node;
    use crate::slam::keyframes::keyframe_scan::KeyframeScan;

    fn seen_from_the_origin(points: &[[f32; 2]]) -> FreeSpace {
        let points: Vec<EndPoint> =
            points.iter().map(|&at_m| EndPoint { at_m, ..EndPoint::default() }).collect();
        let keyframe_scan = KeyframeScan { points: points.clone(), laser_m: [0.0; 2] };
        let node = Node::at(Pose2::IDENTITY, keyframe_scan);
        FreeSpace::new(&[node], &[Pose2::IDENTITY], &points)
    }

    #[test]
    fn it_is_free_up_to_what_a_beam_saw_and_nowhere_else() {
        let free = seen_from_the_origin(&[[29.1, 0.1], [-5.1, -5.1]]);
        for at_m in [[0.1, 0.1], [12.9, 0.1], [28.5, 0.1]] {
            assert!(free.is_free(at_m), "{at_m:?}");
        }
        for at_m in [[28.9, 0.1], [29.5, 0.1], [5.0, 0.5], [-5.1, -5.1], [1e9, f32::NAN]] {
            assert!(!free.is_free(at_m), "{at_m:?}");
        }
    }

    #[test]
    fn memory_follows_what_was_seen_and_not_what_spans_it() {
        let near = seen_from_the_origin(&[[29.0, 29.0]]);
        let far = seen_from_the_origin(&[[2900.0, 2900.0]]);
        let along = 2900.0 / (0.2 * TILE as f32);
        assert!(near.tiles.len() <= 9, "{}", near.tiles.len());
        assert!((far.tiles.len() as f32) < 4.0 * along, "{}", far.tiles.len());
    }
}
