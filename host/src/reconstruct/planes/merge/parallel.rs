//! Planes that are parallel: a strip or a pane whose own points do not tell its direction well takes that of
//! a plane that does.
//!
//! The paper names the prior ("large, flat surfaces that are typically parallel") and does not use it. Here a
//! direction is taken only when a plane's points fit it about as well as their own. Meters.

use crate::reconstruct::planes::fit::noise::Noise;
use crate::reconstruct::planes::fit::scatter::{Fit, Scatter};
use biplane_geometry::vec3::dot;

/// What a turn may cost over all points of a plane, in squared deviations: three deviations in either
/// direction of the turn.
const TURN_BY_CHANCE: f64 = 18.0;
/// Share of the noise by which a turn may move the points of a plane, as a root mean square, when errors are
/// common to many points.
const TURN_SHARE: f64 = 0.15;
/// Directions further apart than this are not tried (cosine; 37 degrees, as far as the normal of a strip
/// errs).
const MIN_COSINE: f64 = 0.8;
/// A direction is lent when it is known to this, radians, one standard deviation.
const REFERENCE_DEVIATION_RAD: f64 = 0.004;

/// The directions that are known well, each once.
pub(crate) fn reference_directions(sums: &[Scatter], noise: Noise) -> Vec<[f64; 3]> {
    let fits: Vec<Option<Fit>> = sums.iter().map(Scatter::fit).collect();
    let held = hold(sums, &fits, noise);
    let known = held.iter().flatten().filter(|fit| !fit.held);
    known
        .filter(|fit| fit.normal_deviation_rad(noise.min_error_m()) < REFERENCE_DEVIATION_RAD)
        .map(|fit| fit.normal)
        .collect()
}

/// The best planes of the sums, each with the direction of a better known one when its points agree to that.
pub(crate) fn hold(sums: &[Scatter], before: &[Option<Fit>], noise: Noise) -> Vec<Option<Fit>> {
    let free: Vec<Option<Fit>> = sums.iter().zip(before).map(|(s, b)| b.as_ref().and(s.fit())).collect();
    let deviation = |index: &usize| {
        free[*index].map_or(f64::INFINITY, |fit: Fit| fit.normal_deviation_rad(noise.min_error_m()))
    };
    let mut order: Vec<usize> = (0..sums.len()).filter(|index| free[*index].is_some()).collect();
    order.sort_by(|a, b| deviation(a).total_cmp(&deviation(b)).then(a.cmp(b)));
    let mut reference_directions: Vec<[f64; 3]> = Vec::new();
    let mut held = free.clone();
    for index in order {
        let Some(own) = free[index] else { continue };
        let mut best: Option<(f64, Fit)> = None;
        for normal in &reference_directions {
            if dot(*normal, own.normal).abs() < MIN_COSINE {
                continue;
            }
            let Some(fit) = sums[index].fit_along(*normal) else { continue };
            let cost = (fit.variances_m2[0] - own.variances_m2[0]) * own.count / noise.variance_of(&own);
            let limit = TURN_BY_CHANCE + TURN_SHARE * TURN_SHARE * own.count;
            if cost <= limit && best.is_none_or(|b| cost < b.0) {
                best = Some((cost, fit));
            }
        }
        match best {
            Some((_, fit)) => held[index] = Some(fit),
            None if deviation(&index) < REFERENCE_DEVIATION_RAD => reference_directions.push(own.normal),
            None => {}
        }
    }
    held
}

#[cfg(test)]
mod tests {
    use super::{hold, reference_directions};
    use crate::reconstruct::planes::fit::noise::Noise;
    use crate::reconstruct::planes::fit::scatter::{Fit, Scatter};
    use crate::reconstruct::planes::paper::random::Random;

    /// A patch `width_m` wide along x and 2 m high, turned about the vertical by `turn_rad`, with 2 cm of
    /// noise.
    fn patch(width_m: f64, turn_rad: f64, points: usize, seed: u64) -> Scatter {
        let mut random = Random::new(seed);
        let (sin, cos) = turn_rad.sin_cos();
        let mut sum = Scatter::default();
        for _ in 0..points {
            let (u, off) = (width_m * (random.unit() - 0.5), 0.02 * random.normal());
            sum.add([u * cos - off * sin, u * sin + off * cos, 2.0 * random.unit()]);
        }
        sum
    }

    #[test]
    fn a_strip_takes_the_direction_of_a_wall_and_a_door_ajar_keeps_its_own() {
        let sums = [patch(5.0, 0.0, 5000, 1), patch(0.15, 0.0, 300, 2), patch(0.8, 0.2, 800, 3)];
        let fits: Vec<Option<Fit>> = sums.iter().map(Scatter::fit).collect();
        let held = hold(&sums, &fits, Noise::new(0.02));
        let [wall, strip, door] = [0, 1, 2].map(|k| held[k].unwrap());
        assert!(fits[1].unwrap().normal[0].abs() > 1e-4, "its own direction is not exact");
        assert_eq!((strip.normal, strip.held), (wall.normal, true));
        assert!(!wall.held && !door.held && door.normal[0].abs() > 0.15);
        assert_eq!(reference_directions(&sums[..2], Noise::new(0.02)), [wall.normal]);
    }

    #[test]
    fn planes_that_were_given_up_stay_so() {
        let sums = [patch(5.0, 0.0, 5000, 1)];
        assert_eq!(hold(&sums, &[None], Noise::new(0.02)), [None]);
    }
}
