//! Points sorted by the cube of space that they lie in.
//!
//! Cube and index of a point fit into one number of 64 bits as long as the cloud is not absurdly wide for its
//! cubes: such numbers sort several times as fast as pairs. They are dealt out to buckets by their highest
//! bits, and each bucket is sorted by itself. Meters.

use rayon::prelude::*;

/// Bits of a cube's coordinate along one axis.
pub(crate) const BITS: u32 = 21;
const HALF: i64 = 1 << (BITS - 1);
/// Buckets, as a power of two: each should fit into the cache of a processor, for clouds of a million points.
const BUCKET_BITS: u32 = 10;
/// Fewer points than this are sorted at once.
const MIN_TO_DEAL: usize = 4096;
/// Points that one task turns into numbers.
const POINTS_PER_TASK: usize = 1 << 14;
/// One cube in so many is looked at to tell how full they are.
const CUBES_PER_SAMPLE: u64 = 8;
/// In clouds of fewer points all cubes are.
const MIN_TO_SAMPLE: usize = 1 << 15;
/// A number for points that are nowhere: behind all others.
const NOWHERE: u64 = u64::MAX;

/// Points in the order of their cubes.
#[derive(Clone, Debug, Default)]
pub(crate) struct Sorted {
    /// Indices of the points, cube by cube and within one ascending; points that are nowhere are left out.
    pub order: Vec<u32>,
    /// Where each cube that holds a point starts in `order`.
    pub firsts: Vec<u32>,
    /// The cubes' coordinates, ascending, as numbers that differ by 1 from cube to cube along z, by `1 <<
    /// BITS` along y and by `1 << (2 * BITS)` along x.
    pub keys: Vec<u64>,
}

impl Sorted {
    /// Sorts points into cubes with edges of `cell_m`.
    pub(crate) fn new(points_m: &[[f32; 3]], cell_m: f64) -> Self {
        let cubes = Cubes { per_m: cell_m.recip() };
        let Some(frame) = Frame::of(&cubes, points_m) else { return Self::default() };
        let index_bits = u32::BITS - (points_m.len() as u32).leading_zeros();
        if frame.bits() + index_bits < u64::BITS {
            let numbers = frame.sorted(&cubes, points_m, index_bits);
            let of = |number: u64| (number >> index_bits, (number & ((1 << index_bits) - 1)) as u32);
            return Self::split(&numbers, of, |packed| frame.key(packed));
        }
        let keyed = points_m.par_iter().enumerate().with_min_len(POINTS_PER_TASK);
        let mut keyed: Vec<(u64, u32)> =
            keyed.filter_map(|(index, p)| Some((key_of(cubes.of(p)?), index as u32))).collect();
        // No two entries are equal, so the order is the same on any number of threads.
        keyed.par_sort_unstable();
        Self::split(&keyed, |entry| entry, |key| key)
    }

    /// Entries that are sorted become cubes; `of` is the cube and the point of an entry, `key` the cube's
    /// key.
    fn split<T: Copy + Sync>(
        entries: &[T],
        of: impl Fn(T) -> (u64, u32) + Sync,
        key: impl Fn(u64) -> u64 + Sync,
    ) -> Self {
        let order = entries.par_iter().with_min_len(POINTS_PER_TASK).map(|entry| of(*entry).1).collect();
        let opens = |place: &usize| *place == 0 || of(entries[*place]).0 != of(entries[*place - 1]).0;
        let places = (0..entries.len()).into_par_iter().with_min_len(POINTS_PER_TASK);
        let firsts: Vec<u32> = places.filter(opens).map(|place| place as u32).collect();
        let cubes = firsts.par_iter().with_min_len(POINTS_PER_TASK);
        let keys = cubes.map(|first| key(of(entries[*first as usize]).0)).collect();
        Self { order, firsts, keys }
    }
}

/// How many points the cubes have on average that hold any; in a large cloud from one in eight of the cubes.
pub(crate) fn density(points_m: &[[f32; 3]], cell_m: f64) -> f64 {
    let cubes = Cubes { per_m: cell_m.recip() };
    let limit = if points_m.len() < MIN_TO_SAMPLE { u64::MAX } else { u64::MAX / CUBES_PER_SAMPLE };
    // Multiplied by 2^64 over the golden ratio, keys that differ at all differ in their highest bits.
    let scattered = |p: &[f32; 3]| cubes.of(p).map(|cube| key_of(cube).wrapping_mul(0x9e37_79b9_7f4a_7c15));
    let points = points_m.par_iter().with_min_len(POINTS_PER_TASK);
    let mut picked: Vec<u64> = points.filter_map(scattered).filter(|key| *key <= limit).collect();
    let count = picked.len();
    picked.par_sort_unstable();
    picked.dedup();
    count as f64 / picked.len().max(1) as f64
}

/// The cube's coordinates in one number, so that sorting goes by x, then y, then z; a spare cube on each side
/// keeps offsets from wrapping.
fn key_of(cube: [i64; 3]) -> u64 {
    cube.iter().fold(0, |key, index| (key << BITS) | (index + HALF) as u64)
}

/// Cubes of one size.
struct Cubes {
    per_m: f64,
}

impl Cubes {
    /// The cube of a point; `None` when the point is not finite or further than a million cubes out.
    fn of(&self, point_m: &[f32; 3]) -> Option<[i64; 3]> {
        let scaled = point_m.map(|value| f64::from(value) * self.per_m);
        let limit = (HALF - 2) as f64;
        scaled.iter().all(|value| value.abs() < limit).then(|| scaled.map(floor))
    }
}

/// The integer below; `f64::floor` is a call on processors that are not known to have the instruction.
fn floor(value: f64) -> i64 {
    let towards_zero = value as i64;
    towards_zero - i64::from(towards_zero as f64 > value)
}

/// The cubes that points lie in: the first along each axis, and the bits that those from it to the last need.
struct Frame {
    first: [i64; 3],
    bits: [u32; 3],
}

impl Frame {
    fn of(cubes: &Cubes, points_m: &[[f32; 3]]) -> Option<Self> {
        let nothing = ([i64::MAX; 3], [i64::MIN; 3]);
        let bounds = |points_m: &[[f32; 3]]| {
            points_m.iter().filter_map(|p| cubes.of(p)).fold(nothing, |(low, high), cube| {
                (std::array::from_fn(|k| low[k].min(cube[k])), std::array::from_fn(|k| high[k].max(cube[k])))
            })
        };
        let join = |a: ([i64; 3], [i64; 3]), b: ([i64; 3], [i64; 3])| {
            (std::array::from_fn(|k| a.0[k].min(b.0[k])), std::array::from_fn(|k| a.1[k].max(b.1[k])))
        };
        let (first, last) = points_m.par_chunks(POINTS_PER_TASK).map(bounds).reduce(|| nothing, join);
        let bits = |k: usize| u64::BITS - ((last[k] - first[k]) as u64).leading_zeros();
        (first[0] <= last[0]).then(|| Self { first, bits: std::array::from_fn(bits) })
    }

    fn bits(&self) -> u32 {
        self.bits.iter().sum()
    }

    /// Cube and index of each point as one number, ascending.
    fn sorted(&self, cubes: &Cubes, points_m: &[[f32; 3]], index_bits: u32) -> Vec<u64> {
        let number = |(index, p): (usize, &[f32; 3])| {
            let Some(cube) = cubes.of(p) else { return NOWHERE };
            let packed =
                (0..3).fold(0, |packed, k| (packed << self.bits[k]) | (cube[k] - self.first[k]) as u64);
            (packed << index_bits) | index as u64
        };
        let points = points_m.par_iter().enumerate().with_min_len(POINTS_PER_TASK);
        let mut numbers: Vec<u64> = points.map(number).collect();
        if numbers.len() < MIN_TO_DEAL {
            numbers.sort_unstable();
        } else {
            let shift = (self.bits() + index_bits).saturating_sub(BUCKET_BITS);
            numbers = dealt(numbers, shift);
        }
        while numbers.last() == Some(&NOWHERE) {
            numbers.pop();
        }
        numbers
    }

    /// The key of a cube, as [`key_of`] makes it, from its place in the frame.
    fn key(&self, packed: u64) -> u64 {
        let z = packed & ((1 << self.bits[2]) - 1);
        let y = (packed >> self.bits[2]) & ((1 << self.bits[1]) - 1);
        let x = packed >> (self.bits[2] + self.bits[1]);
        key_of([x as i64 + self.first[0], y as i64 + self.first[1], z as i64 + self.first[2]])
    }
}

/// Sorts numbers: first into buckets by what is left of them after a shift, then each bucket.
fn dealt(numbers: Vec<u64>, shift: u32) -> Vec<u64> {
    let bucket = |number: u64| ((number >> shift) as usize).min(1 << BUCKET_BITS);
    let mut ends = vec![0usize; (1 << BUCKET_BITS) + 1];
    numbers.iter().for_each(|number| ends[bucket(*number)] += 1);
    let mut total = 0;
    for end in &mut ends {
        total += std::mem::replace(end, total);
    }
    let mut out = vec![0; numbers.len()];
    for number in numbers {
        let place = &mut ends[bucket(number)];
        out[*place] = number;
        *place += 1;
    }
    let mut buckets = Vec::with_capacity(ends.len());
    let (mut rest, mut start) = (out.as_mut_slice(), 0);
    for end in ends {
        let (own, others) = std::mem::take(&mut rest).split_at_mut(end - start);
        buckets.push(own);
        (rest, start) = (others, end);
    }
    buckets.into_par_iter().for_each(|bucket| bucket.sort_unstable());
    out
}

#[cfg(test)]
mod tests {
    use super::Sorted;
    use crate::reconstruct::planes::paper::random::Random;

    /// The same by sorting cubes and indices as they are.
    fn plainly(points_m: &[[f32; 3]], cell_m: f64) -> Vec<u32> {
        let cube = |p: &[f32; 3]| p.map(|v| (f64::from(v) / cell_m).floor() as i64);
        let finite = (0..points_m.len()).filter(|k| points_m[*k].iter().all(|v| v.is_finite()));
        let mut keyed: Vec<([i64; 3], u32)> = finite.map(|k| (cube(&points_m[k]), k as u32)).collect();
        keyed.sort_unstable();
        keyed.into_iter().map(|entry| entry.1).collect()
    }

    #[test]
    fn points_come_cube_by_cube_however_many_and_however_far_apart() {
        for (count, width_m) in [(10, 1.0), (20_000, 8.0), (20_000, 400_000.0)] {
            let mut random = Random::new(5);
            let mut points: Vec<[f32; 3]> = (0..count)
                .map(|_| std::array::from_fn(|_| (width_m * (random.unit() - 0.5)) as f32))
                .collect();
            points[3] = [f32::NAN, 0.0, 0.0];
            assert_eq!(
                Sorted::new(&points, 0.5).order,
                plainly(&points, 0.5),
                "{count} points over {width_m} m"
            );
        }
        assert!(
            Sorted::new(&[[f32::INFINITY; 3]], 0.5).keys.is_empty() && Sorted::new(&[], 0.5).order.is_empty()
        );
    }
}
