//! What scans show of their own noise: how far their end points lie from the walls of the map.
//!
//! A laser whose noise is stated too high counts little against the odometry, and the map bends as the
//! odometry does. One whose noise is stated too low is believed where the map is off. The residuals on walls
//! tell better, so what is stated counts within their bounds only.

/// Of the sums so much is kept from scan to scan: two hundred scans count.
const KEPT: f64 = 0.995;
/// Fewer end points on walls say nothing yet.
const MIN_POINTS: f64 = 5000.0;
/// The noise that counts is at most so many times that of the residuals: neighbors on a wall share their
/// errors, so that a scan knows less than its residuals tell. Smaller: worst of 16 runs of Intel 0.0266 m
/// instead of 0.0251 m at 2.5. With the noise doubled the median is 0.025 m at 2.5 and 0.032 m at 3.
const MAX_SIGMAS: f64 = 3.0;
/// And at least so many times. Smaller: with the noise of Intel halved, one run of 8 has 0.153 m at 0 and
/// 0.027 m at 1.3.
const MIN_SIGMAS: f64 = 1.6;
/// But residuals are no reason to take a laser for noisier than this, meters: odometry that is off makes them
/// large, too, and must not be believed more for that. Without it the error of Intel is 0.053 m instead of
/// 0.025 m where odometry counts 1.1 of the way.
const MAX_LOWER_BOUND_M: f64 = 0.015;

/// Sums over the residuals of scans that were matched.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub(crate) struct RangeNoise {
    squares_m2: f64,
    points: f64,
}

impl RangeNoise {
    /// Takes over a match: the sum of the squared residuals on walls, and how many end points they are of.
    pub(crate) fn note(&mut self, squares_m2: f64, points: f64) {
        self.squares_m2 = KEPT * self.squares_m2 + squares_m2;
        self.points = KEPT * self.points + points;
    }

    /// Standard deviation of end points across walls, meters; `None` as long as too few were seen.
    pub(crate) fn sigma_m(&self) -> Option<f64> {
        (self.points >= MIN_POINTS).then(|| (self.squares_m2 / self.points).sqrt())
    }

    /// The noise that counts where so much was stated.
    pub(crate) fn bounded(&self, stated_m: f64) -> f64 {
        let within = |sigma_m: f64| {
            let min_m = (MIN_SIGMAS * sigma_m).min(MAX_LOWER_BOUND_M);
            stated_m.max(min_m).min(MAX_SIGMAS * sigma_m)
        };
        self.sigma_m().map_or(stated_m, within)
    }
}

#[cfg(test)]
mod tests {
    use super::RangeNoise;

    /// A hundred scans of 180 points that lie 1 cm from their walls.
    fn seen() -> RangeNoise {
        let mut noise = RangeNoise::default();
        (0..100).for_each(|_| noise.note(180.0 * 1e-4, 180.0));
        noise
    }

    #[test]
    fn what_is_stated_counts_within_the_bounds_that_residuals_set() {
        assert!((seen().sigma_m().unwrap() - 0.01).abs() < 1e-9);
        assert!((seen().bounded(0.1) - 0.03).abs() < 1e-9);
        assert!((seen().bounded(0.001) - 0.015).abs() < 1e-9);
        assert_eq!(seen().bounded(0.015), 0.015);
        assert_eq!(seen().bounded(0.02), 0.02);
    }

    #[test]
    fn what_is_stated_counts_as_long_as_few_residuals_are_known() {
        assert_eq!(RangeNoise::default().bounded(0.1), 0.1);
        let mut few = RangeNoise::default();
        few.note(180.0 * 1e-4, 180.0);
        assert_eq!((few.sigma_m(), few.bounded(0.1)), (None, 0.1));
    }

    #[test]
    fn a_change_of_the_noise_is_followed() {
        let mut noise = seen();
        (0..2000).for_each(|_| noise.note(180.0 * 4e-4, 180.0));
        assert!((noise.sigma_m().unwrap() - 0.02).abs() < 1e-5, "{:?}", noise.sigma_m());
    }
}
