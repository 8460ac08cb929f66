//! What the sensor's noise allows: how far a point, or the mean of several, may lie from its plane; and how
//! large the noise is.
//!
//! The paper's epsilon and gamma are fixed lengths that fit one sensor; here both follow from the deviation
//! of a range. Meters.

use super::scatter::{Fit, Scatter};
use biplane_geometry::quantile::weighted;
use rayon::prelude::*;

/// Limits for points and groups of points, for one deviation of the noise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Noise {
    /// Deviation of a single distance to a true plane, meters.
    pub sigma_m: f64,
}

/// Share of the deviation that does not average out over neighbors: the pose error, common to all beams of a
/// scan.
pub(crate) const COMMON_SHARE: f64 = 0.35;
/// Bounds of the noise of a single plane, as shares of that of all.
const MIN_SHARE: f64 = 0.5;
const MAX_SHARE: f64 = 2.0;
/// Deviations within which a value counts as noise.
pub(crate) const DEVIATIONS: f64 = 3.0;
/// A set of points is a plane when it spreads further than this many deviations in two directions. Points of
/// one beam that follows an edge spread by the noise alone, along the beam: they look like a plane that no
/// surface is.
const WIDTH_DEVIATIONS: f64 = 2.0;
/// Smallest noise that is assumed, meters: the resolution that 32-bit coordinates keep in a large building.
const MIN_SIGMA_M: f64 = 1e-4;
/// Smallest noise that is estimated, meters: ranges in steps of 1 cm repeat the same error over whole
/// stretches of a wall, and local planes bend with it.
const MIN_ESTIMATE_M: f64 = 5e-3;

impl Noise {
    /// Noise of a deviation.
    pub(crate) fn new(sigma_m: f64) -> Self {
        Self { sigma_m: sigma_m.max(MIN_SIGMA_M) }
    }

    /// Farthest that a single point may lie from its plane, meters (the paper's gamma).
    pub(crate) fn point_limit_m(&self) -> f64 {
        DEVIATIONS * self.sigma_m
    }

    /// Variance of the points of a plane, square meters: what they show, within bounds. The ground that is
    /// grazed is sharper than a facade seen from a turning robot.
    pub(crate) fn variance_of(&self, fit: &Fit) -> f64 {
        let all = self.sigma_m * self.sigma_m;
        fit.variances_m2[0].clamp(MIN_SHARE * MIN_SHARE * all, MAX_SHARE * MAX_SHARE * all)
    }

    /// Smallest error that a fit to few points is believed to have, meters.
    pub(crate) fn min_error_m(&self) -> f64 {
        0.5 * self.sigma_m
    }

    /// Smallest variance across a set of points that can be told from a line, square meters.
    pub(crate) fn min_width_m2(&self) -> f64 {
        WIDTH_DEVIATIONS * WIDTH_DEVIATIONS * self.sigma_m * self.sigma_m
    }

    /// Whether a group of points agrees with a plane: its mean with the plane, its spread with the noise (the
    /// paper's epsilon).
    pub(crate) fn agrees(&self, group: &Scatter, normal: [f64; 3], offset_m: f64) -> bool {
        let count = group.count();
        let (mean_m, squared_m2) = group.distance_to(normal, offset_m);
        let mean_variance = self.sigma_m * self.sigma_m * (count.recip() + COMMON_SHARE * COMMON_SHARE);
        mean_m * mean_m <= DEVIATIONS * DEVIATIONS * mean_variance
            && squared_m2 <= self.spread_limit_m2(count)
    }

    /// Largest mean squared distance of `count` points to their plane, square meters.
    pub(crate) fn spread_limit_m2(&self, count: f64) -> f64 {
        self.sigma_m * self.sigma_m * (1.0 + DEVIATIONS * (2.0 / count).sqrt())
    }
}

/// Estimates the deviation: the median error of the best planes of cells with their neighbors.
///
/// Most cells of a building lie in a surface; those at edges raise the upper half only. At least 5 mm. `None`
/// when no neighborhood has 20 points.
pub(crate) fn estimate_sigma_m(cells: &[Scatter], around: &[Option<Fit>]) -> Option<f64> {
    let errors: Vec<LocalError> = cells
        .iter()
        .zip(around)
        .filter_map(|(own, fit)| LocalError::of(fit.as_ref()?, own.count()))
        .collect();
    let weight_of = |errors: &[LocalError]| errors.iter().map(|error| error.weight).sum::<f64>();
    let flat: Vec<LocalError> = errors.iter().copied().filter(|error| error.flat).collect();
    let variance_m2 = if weight_of(&flat) >= MIN_FLAT_SHARE * weight_of(&errors) {
        quantile(errors, 0.45)?
    } else {
        // Stray points all around, also next to surfaces: cells by themselves, and of these the cleaner ones.
        let alone = cells.iter().filter_map(|own| LocalError::of(&own.fit()?, own.count()));
        quantile(alone.filter(|error| error.flat).collect(), 0.25)?
    };
    Some(variance_m2.sqrt().max(MIN_ESTIMATE_M))
}

/// A local plane counts as flat when its mean squared error is at most this share of its narrower width
/// squared: points that fill a volume have more.
const FLAT_RATIO: f64 = 0.3;
/// When fewer points than this share have flat surroundings, most points are strays.
const MIN_FLAT_SHARE: f64 = 0.3;

/// The best plane of some points, as far as the noise goes.
#[derive(Clone, Copy)]
struct LocalError {
    variance_m2: f64,
    weight: f64,
    flat: bool,
}

impl LocalError {
    /// Of the best plane of at least 20 points.
    fn of(fit: &Fit, weight: f64) -> Option<Self> {
        let count = fit.count;
        if count < 20.0 {
            return None;
        }
        let [error_m2, width_m2, _] = fit.variances_m2;
        let variance_m2 = error_m2 * count / (count - 3.0);
        Some(Self { variance_m2, weight, flat: error_m2 <= FLAT_RATIO * width_m2 })
    }
}

/// The variance below which a share of the weight lies, square meters.
fn quantile(mut errors: Vec<LocalError>, share: f64) -> Option<f64> {
    errors.par_sort_unstable_by(|a, b| {
        a.variance_m2.total_cmp(&b.variance_m2).then(a.weight.total_cmp(&b.weight))
    });
    weighted(&errors, share, |error| error.weight).map(|error| error.variance_m2)
}
