//! Gauss-Newton alignment of end points with a map's surfaces, from a prior: of a scan with all that the
//! tracker has mapped, and of a submap of a drive with another one when loops are closed.
//!
//! Minimizes over (x, y, theta) of `map_from_base`: the squared distances of end points to the lines of their
//! nearest surfaces (to the means, where a surface is no line), in units of the expected noise and under
//! Cauchy weights, plus the prior's squared Mahalanobis distance. The Cauchy scale starts wide and halves
//! each iteration, so that the first steps come from far away and the last ones see only what truly fits.
//! Units: meters, radians; map's axes.

pub(crate) mod correspondences;
pub(crate) mod fit;
pub(crate) mod on_map;
pub(crate) mod params;
pub(crate) mod point_alignment;
pub(crate) mod prior;

use biplane_geometry::PortableMath;
use nalgebra::Matrix3;

use crate::placement::Placement;
use crate::registration::degeneracy::Degeneracy;
use crate::registration::gauss_newton::fit::{Fit, fit};
use crate::registration::gauss_newton::params::{AlignParams, BEAMS_PER_INDEPENDENT_ONE, REACH_SCALES};
use crate::registration::gauss_newton::prior::Prior;
use crate::registration::journal::Journal;
use crate::registration::normal_equations::{BATCH, Batch, LineSums, Normal, step};
use crate::registration::surface_map::{Correspondence, SurfaceMap};
use crate::scan::end_points::{EndPoint, Kind};
use biplane_geometry::Pose2;

/// An explained end point is so much likelier than one that is not (natural logarithm).
const EXPLAINED_GAIN: f64 = 3.0;

/// The result of an alignment.
#[derive(Copy, Clone, Debug)]
pub(crate) struct Alignment {
    /// The best pose.
    pub pose: Pose2,
    /// What the scan alone knows of x, y, theta: inverse covariance, map's axes.
    pub information: Matrix3<f64>,
    /// How well the pose explains the scan.
    pub fit: Fit,
    /// Iterations used.
    pub iterations: u32,
    /// Whether the steps had become small when it ended: what stopped at the cap was still on its way.
    pub at_rest: bool,
}

impl Alignment {
    /// Log-likelihood of scan and prior together, up to a constant: what decides between two alignments.
    pub(crate) fn likelihood(&self, prior: &Prior) -> f64 {
        self.gain() - prior.neg_log_likelihood(&self.pose)
    }

    /// Log-likelihood of the scan alone, up to a constant.
    pub(crate) fn gain(&self) -> f64 {
        EXPLAINED_GAIN * self.fit.explained / BEAMS_PER_INDEPENDENT_ONE
    }
}

/// End points on a map, whatever is kept of what they meet there.
pub(crate) trait Laid {
    /// Sums over all end points at a pose under Cauchy weights of this scale: the residuals' normal
    /// equations, and J^T W J over the walls' tangents.
    fn sums(&mut self, pose: &Pose2, scale_m: f32, params: &AlignParams) -> (Normal, Matrix3<f64>);

    /// How well a pose explains the end points.
    fn fit(&mut self, pose: &Pose2, params: &AlignParams) -> Fit;

    /// What an alignment makes small, but for the prior, and how many end points have a say: what
    /// [`Laid::sums`] differentiates.
    fn cost(&self, pose: &Pose2, scale_m: f32, params: &AlignParams) -> (f64, u32);
}

/// Aligns end points with a map, starting at `start` and held by the prior; each iteration goes to the
/// journal.
pub(crate) fn align(
    laid: &mut impl Laid,
    start: Pose2,
    prior: &Prior,
    params: &AlignParams,
    journal: &mut Journal,
) -> Alignment {
    let mut pose = start;
    let mut scale_m = params.capture_m.max(params.outlier_m);
    let mut iterations = 0;
    let mut known = None;
    while iterations < params.max_iterations {
        iterations += 1;
        let (normal, tangent) = laid.sums(&pose, scale_m as f32, params);
        let degeneracy =
            Degeneracy::new(&normal.matrix(), &tangent, params.direction_noise_rad, prior.min_information());
        let (information, gradient) = (degeneracy.information(), degeneracy.gradient(&normal.vector()));
        let prior_information = prior.information_at(&pose);
        let Some(step) = step(&information, &gradient, &prior_information, &prior.residual(&pose)) else {
            break;
        };
        let from = pose;
        pose = pose.stepped(step.into());
        if journal.is_kept() {
            let (cost, used) = laid.cost(&from, scale_m as f32, params);
            journal.push(iterations - 1, [&from, &pose], (cost + prior.neg_log_likelihood(&from), used));
        }
        let at_rest = step[0].portable_hypot(step[1]) < params.rest_m && step[2].abs() < params.rest_rad;
        if at_rest && scale_m <= params.outlier_m {
            known = Some(information); // so short a step changes nothing
            break;
        }
        scale_m = (0.5 * scale_m).max(params.outlier_m);
    }
    let at_rest = known.is_some();
    let information = known.unwrap_or_else(|| {
        let (normal, tangent) = laid.sums(&pose, params.outlier_m as f32, params);
        Degeneracy::new(&normal.matrix(), &tangent, params.direction_noise_rad, prior.min_information())
            .information()
    });
    let information = information / BEAMS_PER_INDEPENDENT_ONE;
    Alignment { pose, information, fit: laid.fit(&pose, params), iterations, at_rest }
}

/// End points on a map that is asked for each of them at each pose.
pub(crate) struct Asking<'a, M> {
    /// The map.
    pub map: &'a M,
    /// The end points.
    pub points: &'a [EndPoint],
}

impl<M: SurfaceMap> Laid for Asking<'_, M> {
    fn sums(&mut self, pose: &Pose2, scale_m: f32, params: &AlignParams) -> (Normal, Matrix3<f64>) {
        accumulate(self.map, self.points, pose, scale_m, params)
    }

    fn fit(&mut self, pose: &Pose2, params: &AlignParams) -> Fit {
        fit(self.map, self.points, pose, params)
    }

    fn cost(&self, pose: &Pose2, scale_m: f32, params: &AlignParams) -> (f64, u32) {
        cost(self.map, self.points, pose, scale_m, params)
    }
}

/// Sums over all end points: the residuals' normal equations, and J^T W J over the walls' tangents.
fn accumulate<M: SurfaceMap>(
    map: &M,
    points: &[EndPoint],
    pose: &Pose2,
    scale_m: f32,
    params: &AlignParams,
) -> (Normal, Matrix3<f64>) {
    let placement = Placement::new(pose);
    let (mut batch, mut lines, mut spots) = (Batch::default(), LineSums::default(), Normal::default());
    let mut met = [(0, M::Met::default()); BATCH];
    for some in points.chunks(BATCH) {
        let count = look_up(map, some, &placement, REACH_SCALES * scale_m, &mut met);
        for (index, met) in &met[..count] {
            let (Some(surfel), point) = (map.surfel(*met), &some[*index]) else { continue };
            let met = Correspondence::with(map, point, &placement, surfel);
            gather::<M>(&met, point, scale_m, params, (&mut batch, &mut spots));
        }
        lines.take(&mut batch, scale_m);
    }
    let (normal, tangent) = lines.finish(1.0 / square(params.range_noise_m));
    (normal.plus(&spots), tangent)
}

/// Looks up what end points meet, and keeps those that meet anything, with their places among all. There is
/// no branch that depends on it: so many end points wait for their cells together.
#[inline]
fn look_up<M: SurfaceMap>(
    map: &M,
    points: &[EndPoint],
    placement: &Placement,
    reach_m: f32,
    all_met: &mut [(usize, M::Met); BATCH],
) -> usize {
    let mut count = 0;
    for (index, point) in points.iter().enumerate() {
        let met = map.met_at(placement.place(point.at_m), placement.turn(point.normal), reach_m);
        all_met[count] = (index, met.unwrap_or_default());
        count += usize::from(met.is_some());
    }
    count
}

/// Takes what an end point meets: a line of the map goes to the batch, a surface that is no line to the
/// `spots`.
#[inline]
fn gather<M: SurfaceMap>(
    met: &Correspondence,
    point: &EndPoint,
    scale_m: f32,
    params: &AlignParams,
    (batch, spots): (&mut Batch, &mut Normal),
) {
    let Correspondence { arm, offset, surfel, .. } = *met;
    if !met.is_line {
        if lies_on_spot::<M>(point) {
            add_spot(met, point, scale_m, params, spots);
        }
        return;
    }
    // The mean of n end points is off by 1 / n of an end point's variance: the residual has 1 + 1 / n of it.
    let sureness = point.weight * surfel.hits / (1.0 + surfel.hits);
    let entry = batch.len;
    for axis in 0..2 {
        batch.arm[axis][entry] = arm[axis];
        batch.offset[axis][entry] = offset[axis];
        batch.normal[axis][entry] = surfel.normal[axis];
    }
    batch.weight[entry] = if met.is_other_face { 0.0 } else { sureness };
    batch.len += 1;
}

/// Adds an end point that is laid on a surface which is no line.
fn add_spot(met: &Correspondence, point: &EndPoint, scale_m: f32, params: &AlignParams, spots: &mut Normal) {
    let Correspondence { arm, offset, surfel, .. } = *met;
    let sureness = point.weight * surfel.hits / (1.0 + surfel.hits);
    let weight = sureness * cauchy(met.squared_m2(), scale_m) / square(params.point_noise_m);
    spots.add([1.0, 0.0], -arm[1], offset[0], weight);
    spots.add([0.0, 1.0], arm[0], offset[1], weight);
}

/// Whether an end point is laid on a surface that is no line.
#[inline]
fn lies_on_spot<M: SurfaceMap>(point: &EndPoint) -> bool {
    point.kind == Kind::Point || (M::UNSURE_ON_SPOTS && point.kind == Kind::Unsure)
}

/// What an alignment makes small, but for the prior, and how many end points have a say: what [`accumulate`]
/// differentiates.
fn cost<M: SurfaceMap>(
    map: &M,
    points: &[EndPoint],
    pose: &Pose2,
    scale_m: f32,
    params: &AlignParams,
) -> (f64, u32) {
    let placement = Placement::new(pose);
    let scale_squared = f64::from(square32(scale_m));
    let (mut cost, mut used) = (0.0, 0);
    for point in points {
        let Ok(met) = Correspondence::find(map, point, &placement, REACH_SCALES * scale_m) else { continue };
        if met.is_other_face || !(met.is_line || lies_on_spot::<M>(point)) {
            continue;
        }
        let noise_m = if met.is_line { params.range_noise_m } else { params.point_noise_m };
        let sureness = f64::from(point.weight * met.surfel.hits / (1.0 + met.surfel.hits));
        let robust = scale_squared * (f64::from(met.squared_m2()) / scale_squared).portable_ln_1p();
        cost += 0.5 * sureness * robust / (noise_m * noise_m);
        used += 1;
    }
    (cost, used)
}

#[inline]
pub(crate) fn cauchy(squared: f32, scale: f32) -> f32 {
    1.0 / (1.0 + squared / (scale * scale))
}

#[inline]
pub(crate) fn square(value: f64) -> f32 {
    (value * value) as f32
}

#[inline]
fn square32(value: f32) -> f32 {
    value * value
}
