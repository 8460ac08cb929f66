//! Cells of space by their keys, in an order in which neighbors are found by going along it once. Meters.

/// Bits of a cell's coordinate along one axis.
const BITS: u32 = 21;
const HALF: i64 = 1 << (BITS - 1);
/// Cells further out have no key: neighbors of all others have one.
const MAX_COORDINATE: f64 = 1e6;

/// The key of the cell that a point is in; `None` for one that is nowhere. Keys are in the order of x, then
/// y, then z.
pub(crate) fn key_at(p: [f32; 3], cell_m: f64) -> Option<u64> {
    let mut key = 0;
    for value in p {
        let scaled = f64::from(value) / cell_m;
        if scaled.is_nan() || scaled.abs() >= MAX_COORDINATE {
            return None;
        }
        // Toward zero, then down: quicker than `floor` where the processor has no instruction for it.
        let whole = scaled as i64;
        let low = whole - i64::from(whole as f64 > scaled);
        key = (key << BITS) | (low + HALF) as u64;
    }
    Some(key)
}

/// Calls for every pair of entries in the same cell or in neighboring ones, once for each.
pub(crate) fn pairs(entries: &mut [(u64, u32)], mut call: impl FnMut(u32, u32)) {
    entries.sort_unstable();
    let (y, x) = (1u64 << BITS, 1u64 << (2 * BITS));
    // Of the neighbors that come after a cell, these are the middles of rows along z.
    let rows = [y, x - y, x, x + y];
    let mut begins = [0; 4];
    for (index, (key, entry)) in entries.iter().enumerate() {
        let above = entries[index + 1..].iter().take_while(|other| other.0 <= key + 1);
        above.for_each(|other| call(*entry, other.1));
        for (begin, row) in begins.iter_mut().zip(rows) {
            let middle = key + row;
            while entries.get(*begin).is_some_and(|other| other.0 < middle - 1) {
                *begin += 1;
            }
            let along = entries[*begin..].iter().take_while(|other| other.0 <= middle + 1);
            along.for_each(|other| call(*entry, other.1));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{key_at, pairs};
    use crate::reconstruct::planes::paper::random::Random;

    #[test]
    fn pairs_are_those_whose_cells_touch() {
        let mut random = Random::new(7);
        let points: Vec<[f32; 3]> =
            (0..300).map(|_| [0; 3].map(|_| (2.0 * random.unit() - 1.0) as f32)).collect();
        let mut entries: Vec<(u64, u32)> =
            points.iter().zip(0..).map(|(p, index)| (key_at(*p, 0.2).unwrap(), index)).collect();
        let mut found = Vec::new();
        pairs(&mut entries, |a, b| found.push((a.min(b), a.max(b))));
        found.sort_unstable();
        let cell = |index: u32| points[index as usize].map(|v| (f64::from(v) / 0.2).floor() as i32);
        let touch = |a: u32, b: u32| cell(a).iter().zip(cell(b)).all(|(a, b)| (a - b).abs() <= 1);
        let all = (0..300).flat_map(|b| (0..b).map(move |a| (a, b)));
        let mut expected: Vec<(u32, u32)> = all.filter(|(a, b)| touch(*a, *b)).collect();
        expected.sort_unstable();
        assert_eq!(found, expected);
    }

    #[test]
    fn a_point_that_is_nowhere_has_no_key() {
        for value in [f32::NAN, f32::INFINITY, -1e9] {
            assert_eq!(key_at([0.0, value, 0.0], 0.2), None);
        }
    }
}
