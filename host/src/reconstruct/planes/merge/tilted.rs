//! Planes that lean on a larger one: strips across a step of a few centimeters, and what is left of a wall
//! beyond its noise.
//!
//! A region that starts on a door frame and on the wall behind it takes points of both and lies aslant. Its
//! points go back to the wall; whether there is a step is asked of parallel planes only
//! ([`crate::reconstruct::planes::labels::step_detection`]). Meters.

use crate::reconstruct::planes::fit::noise::Noise;
use crate::reconstruct::planes::fit::scatter::{Fit, Scatter};
use biplane_geometry::vec3::dot;

/// A plane leans on another that has at least this many times its points.
const LARGER: f64 = 4.0;
/// Directions further apart than this are a corner (cosine; 37 degrees).
const MIN_COSINE: f64 = 0.8;
/// Directions nearer than this are parallel (cosine; 1.5 degrees).
const PARALLEL_COSINE: f64 = 0.9997;
/// The points lie no further from the larger plane than this many deviations, as a root mean square.
const NEAR_DEVIATIONS: f64 = 2.0;
/// Points that were picked for their own error, such as those of a wall on one side of a border between
/// cells, spread by less than this share of the wall's variance: half of a normal distribution has 0.36.
const PICKED_SHARE: f64 = 0.5;
/// And their mean squared distance to the wall is that of its own points, up to this factor.
const PICKED_LIMIT: f64 = 1.3;

/// For every plane the one that it leans on, or itself.
pub(crate) fn lean(sums: &[Scatter], fits: &[Option<Fit>], noise: Noise) -> Vec<usize> {
    let on = |index: usize| {
        let own = fits[index]?;
        let mut best: Option<(f64, usize)> = None;
        for (other, fit) in fits.iter().enumerate() {
            let Some(fit) = fit.filter(|fit| other != index && fit.count >= LARGER * own.count) else {
                continue;
            };
            let cosine = dot(fit.normal, own.normal).abs();
            let variance_m2 = noise.variance_of(&fit);
            let limit_m2 = if own.variances_m2[0] <= PICKED_SHARE * variance_m2 && cosine >= MIN_COSINE {
                PICKED_LIMIT * variance_m2
            } else if (MIN_COSINE..PARALLEL_COSINE).contains(&cosine) && !own.held {
                (NEAR_DEVIATIONS * noise.sigma_m).powi(2)
            } else {
                continue;
            };
            let (_, squared_m2) = sums[index].distance_to(fit.normal, fit.offset_m);
            if squared_m2 <= limit_m2 && best.is_none_or(|b| squared_m2 < b.0) {
                best = Some((squared_m2, other));
            }
        }
        best.map(|b| b.1)
    };
    let first: Vec<usize> = (0..fits.len()).map(|index| on(index).unwrap_or(index)).collect();
    // Each leans on a larger one, so chains end.
    (0..fits.len())
        .map(|mut index| {
            while first[index] != index {
                index = first[index];
            }
            index
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::lean;
    use crate::reconstruct::planes::fit::noise::Noise;
    use crate::reconstruct::planes::fit::scatter::{Fit, Scatter};
    use crate::reconstruct::planes::paper::random::Random;

    /// Points of z = a + b x over an x range, 1 m deep, with 2 cm of noise.
    fn patch((from_m, to_m): (f64, f64), (a, b): (f64, f64), points: usize, seed: u64) -> Scatter {
        let mut random = Random::new(seed);
        let mut sum = Scatter::default();
        for _ in 0..points {
            let x = from_m + (to_m - from_m) * random.unit();
            sum.add([x, random.unit(), a + b * x + 0.02 * random.normal()]);
        }
        sum
    }

    #[test]
    fn a_strip_aslant_within_the_noise_of_a_wall_leans_on_it_and_a_ramp_does_not() {
        let wall = patch((0.0, 5.0), (0.0, 0.0), 4000, 1);
        let aslant = patch((1.0, 1.2), (-0.22, 0.2), 200, 2);
        let ramp = patch((5.0, 6.0), (-1.0, 0.2), 500, 3);
        let sums = [wall, aslant, ramp];
        let fits: Vec<Option<Fit>> = sums.iter().map(Scatter::fit).collect();
        assert_eq!(lean(&sums, &fits, Noise::new(0.02)), [0, 0, 2]);
    }

    #[test]
    fn half_of_a_wall_s_noise_leans_on_the_wall_and_a_board_two_centimeters_off_does_not() {
        let wall = patch((0.0, 5.0), (0.0, 0.0), 4000, 4);
        let board = patch((1.0, 1.5), (0.024, 0.0), 400, 5);
        let mut random = Random::new(6);
        let mut upper = Scatter::default();
        for _ in 0..400 {
            upper.add([2.0 + random.unit(), random.unit(), 0.02 * random.normal().abs()]);
        }
        let sums = [wall, board, upper];
        let fits: Vec<Option<Fit>> = sums.iter().map(Scatter::fit).collect();
        assert_eq!(lean(&sums, &fits, Noise::new(0.02)), [0, 1, 0]);
    }
}
