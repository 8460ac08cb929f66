//! Clouds that hold points several times, as files do that were joined with themselves: each place counts
//! once.
//!
//! A copy tells nothing of the noise, but the search would take it for an independent point: few places would
//! be a plane, and chance steps would seem certain. Looked for by a sample, so that clouds without copies
//! cost one glance at each point.

use crate::model::Cloud;
use crate::reconstruct::planes::labeled::Planes;
use rayon::prelude::*;
use std::collections::HashMap;

/// Points whose copies are counted.
const SAMPLE: usize = 1024;
/// Copies for each point of the sample from which on places are told apart: chance makes some where
/// coordinates have steps.
const MAX_COPIES: f64 = 0.05;
/// Bits of the sieve before the exact look: 64 for each point of the sample.
const SIEVE_BITS: usize = 64 * SAMPLE;

/// A cloud with each place once.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Distinct {
    /// The places, in the order of their first points.
    pub cloud: Cloud,
    /// For each point of the other cloud the one that stands for it.
    pub place_of: Vec<u32>,
}

impl Distinct {
    /// What was found among the places, for all points: planes have the points that are on them, largest
    /// first.
    pub(crate) fn spread(&self, found: Planes) -> Planes {
        let Planes { mut planes, labels, .. } = found;
        let mut labels: Vec<i32> = self.place_of.iter().map(|place| labels[*place as usize]).collect();
        planes.iter_mut().for_each(|plane| plane.points = 0);
        for label in labels.iter().filter_map(|label| usize::try_from(*label).ok()) {
            planes[label].points += 1;
        }
        let mut order: Vec<usize> = (0..planes.len()).collect();
        order.sort_by_key(|plane| std::cmp::Reverse(planes[*plane].points));
        let mut new_label = vec![-1; planes.len()];
        order.iter().zip(0..).for_each(|(old, new)| new_label[*old] = new);
        for label in &mut labels {
            *label = usize::try_from(*label).map_or(-1, |old| new_label[old]);
        }
        Planes { planes: order.into_iter().map(|old| planes[old]).collect(), labels, ..found }
    }
}

/// The places of an unorganized cloud that holds many points several times; `None` when it does not, or is
/// organized.
pub(crate) fn distinct(cloud: &Cloud) -> Option<Distinct> {
    if !cloud.scan.is_empty() || copies_per_point(&cloud.points_m) <= MAX_COPIES {
        return None;
    }
    let keys = |index: u32| key(&cloud.points_m[index as usize]);
    let mut order: Vec<u32> = (0..cloud.len() as u32).collect();
    order.par_sort_unstable_by_key(|index| (keys(*index), *index));
    let mut first_of = vec![0; cloud.len()];
    for same in order.chunk_by(|a, b| keys(*a) == keys(*b)) {
        same.iter().for_each(|index| first_of[*index as usize] = same[0]);
    }
    let mut out = Distinct { cloud: Cloud::default(), place_of: vec![0; cloud.len()] };
    for (index, first) in first_of.iter().enumerate() {
        out.place_of[index] = if *first as usize == index {
            out.cloud.points_m.push(cloud.points_m[index]);
            out.cloud.len() as u32 - 1
        } else {
            out.place_of[*first as usize]
        };
    }
    Some(out)
}

/// Copies that there are of a point on average, itself not counted, told by a sample.
fn copies_per_point(points_m: &[[f32; 3]]) -> f64 {
    let step = points_m.len().div_ceil(SAMPLE).max(1);
    let finite = |p: &&[f32; 3]| p.iter().all(|v| v.is_finite());
    let mut counts: HashMap<[u32; 3], (usize, usize)> = HashMap::new();
    for point in points_m.iter().step_by(step).filter(finite) {
        counts.entry(key(point)).or_default().0 += 1;
    }
    let mut sieve = vec![false; SIEVE_BITS];
    counts.keys().for_each(|key| sieve[slot(*key)] = true);
    for key in points_m.iter().map(key).filter(|key| sieve[slot(*key)]) {
        if let Some((_, all)) = counts.get_mut(&key) {
            *all += 1;
        }
    }
    let sampled: usize = counts.values().map(|(own, _)| own).sum();
    let others: usize = counts.values().map(|(own, all)| own * (all - 1)).sum();
    others as f64 / sampled.max(1) as f64
}

/// A point's place, to the bit; both zeros are one.
fn key(point: &[f32; 3]) -> [u32; 3] {
    point.map(|v| (v + 0.0).to_bits())
}

/// Where a place falls in the sieve.
fn slot([x, y, z]: [u32; 3]) -> usize {
    let mixed = (u64::from(x) ^ u64::from(y).rotate_left(21) ^ u64::from(z).rotate_left(42))
        .wrapping_mul(0x9E37_79B9_7F4A_7C15);
    (mixed >> 32) as usize % SIEVE_BITS
}

#[cfg(test)]
mod tests {
    use super::distinct;
    use crate::model::Cloud;
    use crate::reconstruct::planes::extract;
    use crate::reconstruct::planes::paper::random::Random;
    use crate::reconstruct::planes::params::PlaneParams;

    fn cloud(points_m: Vec<[f32; 3]>) -> Cloud {
        Cloud { points_m, ..Cloud::default() }
    }

    /// A floor and a wall with 1 cm of noise, without two points at one place.
    fn corner() -> Vec<[f32; 3]> {
        let mut random = Random::new(4);
        let point = |k: usize| {
            let (u, v) = (0.05 * (k / 2 % 40) as f64, 0.05 * (k / 80) as f64);
            let off = 0.01 * random.normal();
            (if k.is_multiple_of(2) { [u, v, off] } else { [u, off, v] }).map(|v| v as f32)
        };
        (0..3200).map(point).collect()
    }

    #[test]
    fn each_place_stands_once_in_the_order_of_its_first_point() {
        let (a, b, c) = ([1.0, 2.0, 3.0], [0.0, 0.0, 0.0], [4.0, 0.0, 0.0]);
        let found = distinct(&cloud(vec![a, b, a, c, [-0.0, 0.0, 0.0], a])).unwrap();
        assert_eq!(found.cloud.points_m, [a, b, c]);
        assert_eq!(found.place_of, [0, 1, 0, 2, 1, 0]);
    }

    #[test]
    fn a_cloud_without_copies_or_with_scans_or_with_points_nowhere_is_left_as_it_is() {
        let points = corner();
        assert_eq!(distinct(&cloud(points.clone())), None);
        assert_eq!(distinct(&cloud(vec![[f32::NAN; 3]; 100])), None);
        assert_eq!(distinct(&Cloud::default()), None);
        let twice = [points.clone(), points].concat();
        let scan = (0..twice.len() as u32).collect();
        assert_eq!(distinct(&Cloud { scan, ..cloud(twice) }), None);
    }

    #[test]
    fn copies_change_nothing_but_the_number_of_points() {
        let points = corner();
        let once = extract(&PlaneParams::default(), &cloud(points.clone()));
        // The wall's points stand there more often than the floor's.
        let copies =
            points.iter().enumerate().flat_map(|(k, p)| vec![*p; if k.is_multiple_of(2) { 3 } else { 20 }]);
        let found = extract(&PlaneParams::default(), &cloud(copies.collect()));
        assert_eq!((once.planes.len(), found.planes.len(), found.sigma_m), (2, 2, once.sigma_m));
        assert!(found.planes[0].points > found.planes[1].points && found.planes[0].normal[1].abs() > 0.99);
        for (label, plane) in found.planes.iter().enumerate() {
            assert_eq!(found.labels.iter().filter(|l| **l == label as i32).count(), plane.points);
        }
    }
}
