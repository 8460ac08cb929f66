//! Cells of space by their coordinates, found in constant time; cells that nothing is in take no memory.
//! Meters.

use std::collections::{HashMap, HashSet};
use std::hash::{BuildHasherDefault, Hasher};

/// Bits of a cell's coordinate along one axis.
const BITS: u32 = 21;
const HALF: f64 = (1 << (BITS - 1)) as f64;

/// Something for each cell. Nothing may depend on the order of its entries.
pub(crate) type Voxels<T> = HashMap<u64, T, BuildHasherDefault<KeyHasher>>;

/// Keys, found as quickly. Nothing may depend on their order.
pub(crate) type Keys = HashSet<u64, BuildHasherDefault<KeyHasher>>;

/// The cell of a point as one number; `None` when the point is not finite or further than a million cells
/// out.
pub(crate) fn key(point_m: [f64; 3], per_m: f64) -> Option<u64> {
    let mut key = 0;
    for value in point_m {
        let scaled = value * per_m;
        if scaled.is_nan() || scaled.abs() >= HALF - 2.0 {
            return None;
        }
        key = (key << BITS) | (scaled.floor() + HALF) as u64;
    }
    Some(key)
}

/// Keys are numbers already: multiplied by 2^64 over the golden ratio they are spread over all bits.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct KeyHasher(u64);

impl Hasher for KeyHasher {
    fn finish(&self) -> u64 {
        self.0 ^ (self.0 >> 32)
    }

    fn write(&mut self, bytes: &[u8]) {
        bytes.iter().for_each(|byte| self.write_u64(u64::from(*byte)));
    }

    fn write_u64(&mut self, value: u64) {
        self.0 = (self.0 ^ value).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    }
}

#[cfg(test)]
mod tests {
    use super::key;

    #[test]
    fn points_of_one_cell_have_one_key_and_others_another() {
        let of = |x, y, z| key([x, y, z], 10.0).unwrap();
        assert_eq!(of(0.01, 0.29, -0.01), of(0.09, 0.21, -0.09));
        let cells =
            [of(0.05, 0.05, 0.05), of(-0.05, 0.05, 0.05), of(0.05, -0.05, 0.05), of(0.05, 0.05, -0.05)];
        assert!((0..4).all(|a| (0..a).all(|b| cells[a] != cells[b])));
    }

    #[test]
    fn a_point_that_is_nowhere_has_no_cell() {
        for value in [f64::NAN, f64::INFINITY, -1e9] {
            assert_eq!(key([0.0, value, 0.0], 10.0), None);
        }
    }
}
