//! Planes that are one: a wall behind a cabinet, a ceiling on both sides of a beam.
//!
//! Two planes become one when the best plane of both together fits each about as well as its own does.
//! Meters.

use crate::reconstruct::planes::fit::noise::{COMMON_SHARE, DEVIATIONS, Noise};
use crate::reconstruct::planes::fit::scatter::{Fit, Scatter};
use crate::reconstruct::planes::merge::seen_by::SeenBy;
use biplane_geometry::vec3::dot;

/// Share of the noise by which a plane may lie off a common one, as a root mean square over its points.
/// Larger: a notice board and a door frame on one wall, a centimeter apart, become one. Smaller: pose errors
/// split a wall that was seen twice.
const OFF_SHARE: f64 = 0.15;
/// The same of planes that no scan saw at the same time: two deviations of the pose error that a scan's beams
/// share ([`COMMON_SHARE`]). Larger: a panel as high as its wall, a centimeter off, becomes the wall.
/// Smaller: a facade falls into sections that lie beside each other because poses drifted.
const APART_SHARE: f64 = 2.0 * COMMON_SHARE;
/// Only planes nearer to parallel than this are taken for sections of one (cosine; 0.25 degrees, as far as
/// headings drift): chords of a curved wall were seen one after the other as well.
const PARALLEL_COSINE: f64 = 0.99999;
/// Planes further apart in direction than this are not tried (cosine; 11 degrees, as far as the normal of a
/// small plane errs).
const MIN_COSINE: f64 = 0.98;

/// For every plane the one that it becomes part of; planes that stay alone become themselves. `seen` are the
/// scans that saw each plane; where nobody knows them, all planes count as seen at the same time.
pub(crate) fn unite(
    sums: &[Scatter],
    fits: &[Option<Fit>],
    noise: Noise,
    seen: Option<Vec<SeenBy>>,
) -> Vec<usize> {
    let mut seen = seen.unwrap_or_default();
    let mut order: Vec<usize> = (0..sums.len()).filter(|index| sums[*index].count() > 0.0).collect();
    order.sort_by(|a, b| sums[*b].count().total_cmp(&sums[*a].count()).then(a.cmp(b)));
    let mut into: Vec<usize> = (0..sums.len()).collect();
    let mut kept: Vec<(usize, Scatter, Fit)> = Vec::new();
    for index in order {
        let own = sums[index];
        let Some(fit) = fits[index] else { continue };
        let mut best: Option<(f64, usize)> = None;
        for (place, (first, whole, whole_fit)) in kept.iter().enumerate() {
            let is_section = || {
                dot(fit.normal, whole_fit.normal).abs() >= PARALLEL_COSINE
                    && seen.get(index).zip(seen.get(*first)).is_some_and(|(own, all)| own.is_apart_from(all))
            };
            let off_share = || if is_section() { APART_SHARE } else { OFF_SHARE };
            let off = off_together((whole, whole_fit), (&own, &fit), noise, off_share);
            if let Some(off) = off.filter(|off| best.is_none_or(|b| *off < b.0)) {
                best = Some((off, place));
            }
        }
        match best {
            Some((_, place)) => {
                let (first, whole, fit) = &mut kept[place];
                into[index] = *first;
                if let Some(own) = seen.get_mut(index).map(std::mem::take) {
                    seen[*first].join(&own);
                }
                whole.merge(&own);
                *fit = whole.fit_again(Some(fit)).unwrap_or(*fit);
            }
            None => kept.push((index, own, fit)),
        }
    }
    into
}

/// Whether a plane, carried on from its own points to the others', meets their center as well as its
/// direction is known. Without this any two small patches far from each other would do: a slight turn brings
/// both onto one plane.
fn foretells(fit: &Fit, other: &Scatter, own: &Scatter, noise: Noise) -> bool {
    let (here, there) = (own.mean(), other.mean());
    let between: [f64; 3] = std::array::from_fn(|k| there[k] - here[k]);
    let carried_m = fit.normal_deviation_rad(noise.min_error_m()) * dot(between, between).sqrt();
    let common_m = COMMON_SHARE * noise.sigma_m;
    fit.distance_m(there).powi(2) <= DEVIATIONS * DEVIATIONS * (carried_m * carried_m + common_m * common_m)
}

/// How far, squared and in units of what `off_share` (of the noise) allows, two sets lie off their common
/// plane; `None` when it is too far.
fn off_together(
    (a, fit_a): (&Scatter, &Fit),
    (b, fit_b): (&Scatter, &Fit),
    noise: Noise,
    off_share: impl Fn() -> f64,
) -> Option<f64> {
    let cosine = dot(fit_a.normal, fit_b.normal).abs();
    if cosine < MIN_COSINE {
        return None;
    }
    if !(foretells(fit_a, b, a, noise) && foretells(fit_b, a, b, noise)) {
        return None;
    }
    let off_share = off_share();
    let mut both = *a;
    both.merge(b);
    let common = if fit_a.held || fit_b.held { both.fit_along(fit_a.normal)? } else { both.fit()? };
    let off = |part: &Scatter, fit: &Fit| {
        let (_, squared) = part.distance_to(common.normal, common.offset_m);
        let sigma2 = fit.variances_m2[0].max(noise.variance_of(fit));
        (squared - fit.variances_m2[0]) / (sigma2 * (off_share * off_share + 9.0 / part.count()))
    };
    let worst = off(a, fit_a).max(off(b, fit_b));
    (worst <= 1.0).then_some(worst)
}

#[cfg(test)]
mod tests {
    use super::{SeenBy, unite};
    use crate::reconstruct::planes::fit::noise::Noise;
    use crate::reconstruct::planes::fit::scatter::{Fit, Scatter};
    use crate::reconstruct::planes::paper::random::Random;

    /// A patch of a wall: from `x_m` on `width_m` wide and 1 m high, at the distance `y_m`, with 2 cm of
    /// noise.
    fn patch(x_m: f64, width_m: f64, y_m: f64, seed: u64) -> Scatter {
        let mut random = Random::new(seed);
        let mut sum = Scatter::default();
        for _ in 0..2000 {
            sum.add([x_m + width_m * random.unit(), y_m + 0.02 * random.normal(), random.unit()]);
        }
        sum
    }

    fn fits(pieces: &[Scatter]) -> Vec<Option<Fit>> {
        pieces.iter().map(Scatter::fit).collect()
    }

    #[test]
    fn a_wall_in_three_pieces_becomes_one_and_what_stands_off_it_stays() {
        let pieces = [
            patch(0.0, 3.0, 1.0, 1),
            patch(4.0, 3.0, 1.0, 2),
            patch(10.0, 1.0, 1.0, 3),
            patch(1.0, 1.0, 0.96, 4),
            Scatter::default(),
        ];
        let into = unite(&pieces, &fits(&pieces), Noise::new(0.02), None);
        assert_eq!((into[1], into[2]), (into[0], into[0]));
        assert_eq!((into[3], into[4]), (3, 4));
    }

    #[test]
    fn small_patches_far_apart_and_at_other_distances_stay_apart() {
        // A turn of 0.6 degrees would bring both onto one plane.
        let pieces = [patch(0.0, 0.9, 0.60, 5), patch(5.0, 0.9, 0.55, 6)];
        let into = unite(&pieces, &fits(&pieces), Noise::new(0.02), None);
        assert_eq!(into, [0, 1]);
    }

    #[test]
    fn fifteen_millimeters_are_a_step_and_one_is_none() {
        for (y_m, into) in [(0.985, [0, 1]), (0.999, [0, 0])] {
            let pieces = [patch(0.0, 2.0, 1.0, 7), patch(3.0, 2.0, y_m, 8)];
            let mut fits = fits(&pieces);
            let normal = fits[0].unwrap().normal;
            fits[1] = pieces[1].fit_along(normal);
            assert_eq!(unite(&pieces, &fits, Noise::new(0.02), None), into);
        }
    }

    #[test]
    fn what_was_seen_at_another_time_may_lie_off_by_what_poses_err() {
        let scans = |scans: std::ops::Range<u32>| scans.flat_map(|scan| [(0, scan); 20]);
        for (y_m, second, into) in [
            (0.990, 100..200, [0, 0]),
            (0.990, 0..100, [0, 1]),
            (0.990, 85..185, [0, 1]),
            (0.975, 100..200, [0, 1]),
        ] {
            let pieces = [patch(0.0, 2.0, 1.0, 7), patch(2.1, 2.0, y_m, 8)];
            let mut fits = fits(&pieces);
            fits[1] = pieces[1].fit_along(fits[0].unwrap().normal);
            let points = scans(0..100).chain(scans(second.clone()).map(|(_, scan)| (1, scan)));
            let (labels, of): (Vec<i32>, Vec<u32>) = points.unzip();
            let seen = SeenBy::of_labels(&labels, &of, 2);
            assert_eq!(unite(&pieces, &fits, Noise::new(0.02), seen), into, "{y_m}, {second:?}");
        }
    }
}
