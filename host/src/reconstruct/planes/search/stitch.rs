//! Parts of a plane in neighboring blocks: they have points in common, in the margins, and are one when the
//! best plane of all parts suits each of them.
//!
//! A plane that grows over the whole cloud takes cells that lie off it by as much as poses err
//! (`COMMON_SHARE`); parts may lie off the common plane by as much. Meters.

use super::blocks::Block;
use super::searched::{Searched, Setting};
use crate::model::Cloud;
use crate::reconstruct::planes::fit::noise::{COMMON_SHARE, DEVIATIONS, Noise};
use crate::reconstruct::planes::fit::scatter::{Fit, Scatter};
use crate::reconstruct::planes::labels::refine::{refit, scatters};
use biplane_geometry::vec3::dot;
use std::collections::BTreeMap;

/// Points that two parts have in common at least: some cells full.
const MIN_SHARED: usize = 20;
/// Parts further apart in direction than this are not tried (cosine; 11 degrees, as far as the normal of a
/// small part errs).
const MIN_COSINE: f64 = 0.98;

/// What was found in all blocks of a cloud, as if it were of one search: each point has the label that its
/// own block gave it.
pub(crate) fn combine(cloud: &Cloud, blocks: &[Block], found: &[Searched], setting: Setting) -> Searched {
    let mut labels = vec![-1; cloud.len()];
    let mut fits: Vec<Option<Fit>> = Vec::new();
    for (block, found) in blocks.iter().zip(found) {
        let first = fits.len() as i32;
        let own = block.points.iter().zip(&found.labels).zip(&block.is_own).filter(|(_, is_own)| **is_own);
        for ((point, label), _) in own.filter(|((_, label), _)| **label >= 0) {
            labels[*point as usize] = first + label;
        }
        fits.extend(&found.fits);
    }
    // Points of the margins have helped to find a plane; its own ones make it.
    let sums = scatters(&cloud.points_m, &labels, fits.len());
    let fits = refit(&sums, &fits);
    let shared = shared_points(blocks, found, &labels);
    let into = stitch(&shared, &sums, &fits, Noise::new(setting.sigma_m));
    for label in labels.iter_mut().filter(|label| **label >= 0) {
        *label = into[*label as usize] as i32;
    }
    let fits = refit(&scatters(&cloud.points_m, &labels, fits.len()), &fits);
    Searched { setting, labels, fits, blocks: blocks.len() }
}

/// How many points each two parts have in common; `labels` are those that points have in their own blocks,
/// counted through all blocks.
fn shared_points(blocks: &[Block], found: &[Searched], labels: &[i32]) -> BTreeMap<[usize; 2], usize> {
    let mut shared = BTreeMap::new();
    let mut first = 0;
    for (block, found) in blocks.iter().zip(found) {
        let margin = block.points.iter().zip(&found.labels).zip(&block.is_own).filter(|(_, own)| !**own);
        for ((point, label), _) in margin {
            let (here, there) = (usize::try_from(*label), usize::try_from(labels[*point as usize]));
            let (Ok(here), Ok(there)) = (here, there) else { continue };
            let pair = [(first + here).min(there), (first + here).max(there)];
            *shared.entry(pair).or_default() += 1;
        }
        first += found.fits.len();
    }
    shared
}

/// For every part the first one of its plane. Those that share most come first.
fn stitch(
    shared: &BTreeMap<[usize; 2], usize>,
    sums: &[Scatter],
    fits: &[Option<Fit>],
    noise: Noise,
) -> Vec<usize> {
    let mut pairs: Vec<(usize, [usize; 2])> = shared
        .iter()
        .map(|(pair, count)| (*count, *pair))
        .filter(|(count, _)| *count >= MIN_SHARED)
        .collect();
    pairs.sort_by(|a, b| b.0.cmp(&a.0).then(a.1.cmp(&b.1)));
    let mut into: Vec<usize> = (0..sums.len()).collect();
    let mut parts: Vec<Vec<usize>> = (0..sums.len()).map(|part| vec![part]).collect();
    for (_, [a, b]) in pairs {
        let (a, b) = (into[a].min(into[b]), into[a].max(into[b]));
        if a == b || !are_one(&[&parts[a], &parts[b]], sums, fits, noise) {
            continue;
        }
        let moved = std::mem::take(&mut parts[b]);
        moved.iter().for_each(|part| into[*part] = a);
        parts[a].extend(moved);
    }
    into
}

/// Whether the best plane of all parts suits each.
fn are_one(parts: &[&Vec<usize>], sums: &[Scatter], fits: &[Option<Fit>], noise: Noise) -> bool {
    let mut all = Scatter::default();
    parts.iter().copied().flatten().for_each(|part| all.merge(&sums[*part]));
    let Some(common) = all.fit() else { return false };
    parts.iter().copied().flatten().all(|part| {
        let Some(own) = fits[*part] else { return true };
        let (_, squared_m2) = sums[*part].distance_to(common.normal, common.offset_m);
        let sigma2_m2 = own.variances_m2[0].max(noise.variance_of(&own));
        let off = squared_m2 - own.variances_m2[0];
        let by_chance = DEVIATIONS * DEVIATIONS / own.count;
        dot(own.normal, common.normal).abs() >= MIN_COSINE
            && off <= sigma2_m2 * (COMMON_SHARE * COMMON_SHARE + by_chance)
    })
}

#[cfg(test)]
mod tests {
    use super::stitch;
    use crate::reconstruct::planes::fit::noise::Noise;
    use crate::reconstruct::planes::fit::scatter::Scatter;
    use crate::reconstruct::planes::paper::random::Random;
    use std::collections::BTreeMap;

    /// 20 m of a wall from `from_m` on, so far off y = 0, with 2 cm of noise.
    fn part(from_m: f64, off_m: f64, random: &mut Random) -> Scatter {
        let mut sum = Scatter::default();
        for _ in 0..4000 {
            sum.add([from_m + 20.0 * random.unit(), off_m + 0.02 * random.normal(), 3.0 * random.unit()]);
        }
        sum
    }

    #[test]
    fn parts_that_share_points_and_a_plane_are_one_and_a_step_or_a_gap_is_none() {
        let mut random = Random::new(3);
        // A wall in three parts, poses a few millimeters off, one part beyond a step of 4 cm, and one that
        // nothing leads to.
        let walls = [(0.0, 0.0), (20.0, 0.005), (40.0, 0.0), (60.0, 0.04), (90.0, 0.0)];
        let sums: Vec<Scatter> =
            walls.iter().map(|(from_m, off_m)| part(*from_m, *off_m, &mut random)).collect();
        let fits: Vec<_> = sums.iter().map(Scatter::fit).collect();
        let shared = BTreeMap::from([([0, 1], 300), ([1, 2], 500), ([2, 3], 400), ([3, 4], 5)]);
        assert_eq!(stitch(&shared, &sums, &fits, Noise::new(0.02)), [0, 0, 0, 3, 4]);
    }
}
