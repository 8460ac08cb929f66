//! The step that makes distances smallest, and how well it is known.
//!
//! Iterated reweighted least squares with Tukey's weight, a scale for each kind of agreement from the
//! distances themselves, and a wide prior that keeps what nothing tells about where it was. The covariance is
//! that of clustered errors (sandwich; Newey and West 1987): distances of one moment share the error of its
//! pose, and those of neighboring moments as well, so that a million beams are worth but some hundred.

use std::collections::BTreeMap;

use nalgebra::SymmetricEigen;

use super::agreement::{Agreement, Kind, Surface};
use super::placement::{PARAMETERS, Square, Step};
use crate::calibrate::robust_scale;

/// Standard deviations of the prior: meters, radians, seconds.
pub(super) const PRIOR: [f64; PARAMETERS] = [0.1, 0.1, 0.1, 0.09, 0.09, 0.09, 0.1];
const ROUNDS: usize = 4;
/// Blocks of a drive that are left out one at a time.
const BLOCKS: usize = 12;
/// A surface is off from what it is taken for by this share of what distances of its kind come to: what a
/// beam's spot, the angle that it comes in at and the surface's own shape do to all ranges to it.
const OF_SURFACES: f64 = 0.5;

/// A step and what is known of it.
#[derive(Clone, Debug)]
pub(super) struct Solution {
    /// From where the agreements were taken.
    pub step: Step,
    /// Covariance of the parameters by the measurements alone, as far as they tell; with the prior where they
    /// do not.
    pub covariance: Square,
    /// Root mean square of the distances that count, meters, and their number, for each kind.
    pub fits: Fits,
}

/// Root mean square and number of the distances of each kind.
type Fits = [(f64, usize); 4];

/// Solves for the step. `so_far` is what was stepped from the rig's values before.
pub(super) fn solve(agreements: &[Agreement], so_far: &Step) -> Solution {
    let mut step = Step::zeros();
    let mut weights = vec![0.0; agreements.len()];
    for _ in 0..ROUNDS {
        reweigh(agreements, &step, &mut weights);
        let (normal, gradient) = normal_equations(agreements, &weights, so_far);
        step = normal.cholesky().map_or(step, |cholesky| cholesky.solve(&-gradient));
    }
    reweigh(agreements, &step, &mut weights);
    let fits = fits(agreements, &weights, &step);
    Solution { step, covariance: covariance(agreements, &weights, &fits, so_far), fits }
}

fn left(agreement: &Agreement, step: &Step) -> f64 {
    agreement.off_m + agreement.slope.dot(step)
}

/// Weights, in 1 over square meters, with the scale of each kind.
fn reweigh(agreements: &[Agreement], step: &Step, weights: &mut [f64]) {
    for kind in Kind::ALL {
        let of_kind = |agreement: &Agreement| agreement.kind == kind;
        let ratios: Vec<f64> =
            agreements.iter().filter(|a| of_kind(a)).map(|a| (left(a, step) / a.sigma_m).abs()).collect();
        if ratios.is_empty() {
            continue;
        }
        let scale = robust_scale::scale(ratios).max(0.2);
        for (weight, agreement) in weights.iter_mut().zip(agreements).filter(|(_, a)| of_kind(a)) {
            let sigma_m = scale * agreement.sigma_m;
            *weight = robust_scale::weight(left(agreement, step) / sigma_m) / (sigma_m * sigma_m);
        }
    }
}

fn sums(agreements: &[Agreement], weights: &[f64]) -> (Square, Step) {
    let (mut normal, mut gradient) = (Square::zeros(), Step::zeros());
    for (agreement, &weight) in agreements.iter().zip(weights).filter(|(_, weight)| **weight > 0.0) {
        normal += agreement.slope * agreement.slope.transpose() * weight;
        gradient += agreement.slope * (weight * agreement.off_m);
    }
    (normal, gradient)
}

fn normal_equations(agreements: &[Agreement], weights: &[f64], so_far: &Step) -> (Square, Step) {
    let (mut normal, mut gradient) = sums(agreements, weights);
    for (i, sigma) in PRIOR.into_iter().enumerate() {
        normal[(i, i)] += 1.0 / (sigma * sigma);
        gradient[i] += so_far[i] / (sigma * sigma);
    }
    (normal, gradient)
}

/// The covariance by leaving out one block of the drive after the other (jackknife), what surfaces are off,
/// and the prior's part.
fn covariance(agreements: &[Agreement], weights: &[f64], fits: &Fits, so_far: &Step) -> Square {
    let all = normal_equations(agreements, weights, so_far);
    let inverse = all.0.try_inverse().unwrap_or_else(Square::zeros);
    let prior = Square::from_diagonal(&Step::from(PRIOR).map(|sigma| 1.0 / (sigma * sigma)));
    let mut covariance = inverse * (prior + of_surfaces(agreements, weights, fits)) * inverse;
    let solved = inverse * -all.1;
    let blocks = blocks(agreements);
    let count = blocks.len() as f64;
    for block in blocks {
        let (normal, gradient) = sums(&agreements[block.clone()], &weights[block]);
        let without = (all.0 - normal).try_inverse().map(|inverse| inverse * (gradient - all.1));
        let off = without.unwrap_or(solved) - solved;
        covariance += off * off.transpose() * ((count - 1.0) / count);
    }
    (covariance + covariance.transpose()) * 0.5
}

/// How the gradient varies when all that was seen of one surface is off together.
fn of_surfaces(agreements: &[Agreement], weights: &[f64], fits: &Fits) -> Square {
    let mut surfaces: BTreeMap<Surface, Step> = BTreeMap::new();
    for (agreement, &weight) in agreements.iter().zip(weights) {
        let off_m = OF_SURFACES * fits[agreement.kind as usize].0;
        *surfaces.entry(agreement.surface).or_insert_with(Step::zeros) += agreement.slope * (weight * off_m);
    }
    surfaces.values().map(|gradient| gradient * gradient.transpose()).sum()
}

/// Segments of the drive with about as many agreements each. Agreements come in the order of time.
fn blocks(agreements: &[Agreement]) -> Vec<std::ops::Range<usize>> {
    let size = agreements.len().div_ceil(BLOCKS).max(1);
    (0..agreements.len()).step_by(size).map(|start| start..(start + size).min(agreements.len())).collect()
}

fn fits(agreements: &[Agreement], weights: &[f64], step: &Step) -> Fits {
    Kind::ALL.map(|kind| {
        let counting = agreements.iter().zip(weights).filter(|(a, weight)| a.kind == kind && **weight > 0.0);
        let (sum, count) =
            counting.fold((0.0, 0), |(sum, count), (a, _)| (sum + left(a, step).powi(2), count + 1));
        (if count == 0 { 0.0 } else { (sum / count as f64).sqrt() }, count)
    })
}

/// Directions of a covariance, the worst known first, with their standard deviations; parameters in these
/// units.
pub(super) fn directions(covariance: &Square, units: &[f64; PARAMETERS]) -> Vec<(f64, Step)> {
    let scaled = Square::from_fn(|i, j| covariance[(i, j)] / (units[i] * units[j]));
    let eigen = SymmetricEigen::new(scaled);
    let mut all: Vec<(f64, Step)> = (0..PARAMETERS)
        .map(|i| (eigen.eigenvalues[i].max(0.0).sqrt(), eigen.eigenvectors.column(i).into_owned()))
        .collect();
    all.sort_by(|a, b| b.0.total_cmp(&a.0));
    all
}
