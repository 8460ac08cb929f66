//! Voxels as single numbers, points in their order, and what is found in each.

use std::collections::hash_map::Entry;
use std::ops::Range;

use biplane_geometry::PortableMath;

use crate::model::voxels::Voxels;

/// A voxel's place; keys are in the order of x, then y, then z.
pub(crate) type Key = u64;

/// Bits of each part of a key. At 0.4 m they reach 400 km; what lies beyond shares the last voxel.
const BITS: u32 = 21;
const OFFSET: i32 = 1 << (BITS - 1);

/// The number of a cell along an axis.
pub(crate) fn cell(at_m: f64, side_m: f64) -> i32 {
    (at_m / side_m).floor_to_i32()
}

/// The voxel of a place.
pub(crate) fn key_of(at_m: [f64; 3], side_m: f64) -> Key {
    key(at_m.map(|v| cell(v, side_m)))
}

/// The voxel with these numbers.
pub(crate) fn key(cells: [i32; 3]) -> Key {
    // One is left on each side, so that all have neighbors.
    cells.iter().fold(0, |key, cell| key << BITS | (cell.clamp(&(2 - OFFSET), &(OFFSET - 2)) + OFFSET) as Key)
}

/// A voxel and those that touch it, in their order.
pub(crate) fn around(key: Key) -> impl Iterator<Item = Key> {
    const ONES: Key = 1 << (2 * BITS) | 1 << BITS | 1;
    (0..27).map(move |at| key - ONES + ((at / 9) << (2 * BITS) | (at / 3 % 3) << BITS | (at % 3)))
}

/// Numbers with their voxels, in the order of these.
pub(crate) fn ordered(mut keyed: Vec<(Key, u32)>) -> Vec<(Key, u32)> {
    keyed.sort_unstable();
    keyed
}

/// The runs of one voxel's numbers.
pub(crate) fn runs(order: &[(Key, u32)]) -> impl Iterator<Item = Range<usize>> {
    let mut start = 0;
    order.chunk_by(|one, other| one.0 == other.0).map(move |run| {
        start += run.len();
        start - run.len()..start
    })
}

/// Some numbers for each voxel.
#[derive(Clone, Debug, Default)]
pub(crate) struct VoxelMap {
    /// Each voxel's first and last entry.
    ends: Voxels<[u32; 2]>,
    /// The numbers, each with the place of the voxel's next one.
    entries: Vec<(u32, u32)>,
}

/// No entry has this place.
const NO_ENTRY: u32 = u32::MAX;

impl VoxelMap {
    /// Appends a number to those of a voxel, unless it is the last one already.
    pub(crate) fn push(&mut self, key: Key, number: u32) {
        let entry = self.entries.len() as u32;
        match self.ends.entry(key) {
            Entry::Vacant(voxel) => {
                voxel.insert([entry; 2]);
            }
            Entry::Occupied(mut voxel) => {
                let [_, last] = voxel.get_mut();
                let (known, next) = &mut self.entries[*last as usize];
                if *known == number {
                    return;
                }
                (*last, *next) = (entry, entry);
            }
        }
        self.entries.push((number, NO_ENTRY));
    }

    /// The numbers of a voxel, in the order in which they came.
    pub(crate) fn get(&self, key: Key) -> impl Iterator<Item = u32> {
        let entry = |at: u32| self.entries.get(at as usize).copied();
        let first = self.ends.get(&key).and_then(|[first, _]| entry(*first));
        std::iter::successors(first, move |(_, next)| entry(*next)).map(|(number, _)| number)
    }
}

#[cfg(test)]
mod tests {
    use super::{VoxelMap, around, key, key_of, ordered, runs};

    #[test]
    fn keys_are_in_the_order_of_places_and_next_to_each_other() {
        let places = [[-2, 5, 1], [-1, -7, 0], [-1, -7, 1], [-1, 0, -9], [0, 0, 0], [0, 1, -1], [3, 0, 0]];
        assert!(places.map(key).is_sorted());
        let [x, y, z] = [4, -3, 0];
        let expected = (-1..=1)
            .flat_map(|i| (-1..=1).flat_map(move |j| (-1..=1).map(move |k| key([x + i, y + j, z + k]))));
        assert!(around(key([x, y, z])).eq(expected));
        for far_m in [f64::NAN, f64::INFINITY, -1e300] {
            assert_eq!(around(key_of([far_m, 0.0, -far_m], 0.4)).count(), 27);
        }
    }

    #[test]
    fn runs_are_those_of_each_voxel() {
        let order = ordered(vec![(key([1, 0, 0]), 0), (key([0, 0, 0]), 2), (key([1, 0, 0]), 1)]);
        assert_eq!(order.iter().map(|(_, number)| *number).collect::<Vec<_>>(), [2, 0, 1]);
        assert_eq!(runs(&order).collect::<Vec<_>>(), [0..1, 1..3]);
    }

    #[test]
    fn numbers_come_in_their_order_and_none_twice_in_a_row() {
        let mut map = VoxelMap::default();
        assert_eq!(map.get(key([0; 3])).count(), 0);
        for number in [3, 3, 1, 2, 2] {
            (0..100).for_each(|x| map.push(key([x, 0, 0]), number));
        }
        for x in 0..100 {
            assert_eq!(map.get(key([x, 0, 0])).collect::<Vec<_>>(), [3, 1, 2]);
        }
        assert_eq!(map.get(key([0, 1, 0])).count(), 0);
    }
}
