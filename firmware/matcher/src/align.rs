//! Gauss-Newton alignment of a scan's end points with the map's surfaces, from a prior.
//!
//! Minimises over (x, y, theta) of `map_from_base`: the squared distances of end points to the lines of their nearest
//! surfaces (to the means, where a surface is no line), in units of the expected noise and under Cauchy weights, plus the
//! prior's squared Mahalanobis distance. The Cauchy scale starts wide and halves each iteration, so that the first
//! steps come from far away and the last ones see only what truly fits. Units: metres, radians; map's axes.

use nalgebra::{Matrix3, Vector3};

use crate::doubt::Doubt;
use crate::journal::Journal;
use crate::local_map::LocalMap;
use crate::normal::{BATCH, Batch, LineSums, Normal};
use crate::points::{EndPoint, EndPoints, Kind};
use crate::pose::{Pose2, wrap_angle};
use crate::surface::{Placement, dot, minus};

crate::named::named_parameters! { "align";
/// The alignment of the method `map`.
#[derive(Copy, Clone, PartialEq, Debug)]
pub struct AlignParams {
    /// Iterations at most; at the cap the last pose counts. Fewer: cheaper; poses from far away are not reached.
    pub max_iterations: u32 [1.0, 10000.0],
    /// Cauchy scale of the first iteration, metres. Larger: wider basin; smaller: fewer iterations.
    pub capture_m: f64 [0.0001, 100.0],
    /// Cauchy scale of the last iterations, metres: residuals beyond it are mostly people and changes. Smaller:
    /// less harm from these; larger: less harm from a map that is off itself.
    pub outlier_m: f64 [0.0001, 100.0],
    /// Standard deviation of an end point across its wall, metres. Smaller: the scan counts more against the odometry.
    pub range_noise_m: f64 [0.0001, 10.0],
    /// Standard deviation of an end point about a surface that is no line, metres. Smaller: clutter counts more against
    /// walls.
    pub point_noise_m: f64 [0.0001, 10.0],
    /// How far the directions of mapped walls are off, radians. Larger: a corridor needs more structure before the scan
    /// is believed along its axis; smaller: noise is taken for structure and the pose wanders along bare corridors.
    pub direction_noise_rad: f64,
    /// So many beams together know what one would know if their errors were independent. Larger: larger
    /// covariances.
    pub beams_per_independent_one: f64 [0.1, 1e5],
    /// A step shorter than this ends the iterations, metres. Larger: fewer iterations, a rougher pose.
    pub rest_m: f64,
    /// A turn smaller than this ends the iterations, radians. Larger: fewer iterations, a rougher heading.
    pub rest_rad: f64,
    /// End points this close to a surface are explained, metres. Larger: poor matches pass for good ones; smaller: good
    /// ones call for a search.
    pub explained_m: f64,
    /// When the scan alone leaves more than this in some direction the match is weak, metres (standard deviation). It
    /// changes what is reported, not the pose.
    pub weak_m: f64,
}
}

impl Default for AlignParams {
    fn default() -> Self {
        Self {
            max_iterations: 20,
            capture_m: 0.15,
            outlier_m: 0.06,
            range_noise_m: 0.015,
            point_noise_m: 0.04,
            direction_noise_rad: 0.05,
            beams_per_independent_one: 5.0,
            rest_m: 0.001,
            rest_rad: 0.0005,
            explained_m: 0.06,
            weak_m: 0.05,
        }
    }
}

impl AlignParams {
    /// Below this, 1 / m^2, a direction is left to the prior.
    pub fn least_information(&self, prior: &Prior) -> f64 {
        if prior.measured { self.beams_per_independent_one / (self.weak_m * self.weak_m) } else { 0.0 }
    }
}

/// Where the base is expected, and how surely.
#[derive(Copy, Clone, Debug)]
pub struct Prior {
    /// Expected `map_from_base`.
    pub mean: Pose2,
    /// Inverse covariance of x, y, theta in the map's axes.
    pub information: Matrix3<f64>,
    /// Whether odometry measured it. A weak direction is left to odometry; a mere guess gives way to what little a scan knows
    /// there, or it would drift on from guess to guess.
    pub measured: bool,
}

/// A prior off by so many standard deviations counts half: odometry slips, or the base is carried.
pub const SURPRISE: f64 = 4.0;

impl Prior {
    /// The way from the expected pose: x, y in the map's axes, theta wrapped.
    pub fn away(&self, pose: &Pose2) -> Vector3<f64> {
        let turn = wrap_angle(pose.theta_rad - self.mean.theta_rad);
        Vector3::new(pose.x_m - self.mean.x_m, pose.y_m - self.mean.y_m, turn)
    }

    /// Squared Mahalanobis distance of a pose.
    pub fn squared(&self, pose: &Pose2) -> f64 {
        let away = self.away(pose);
        away.dot(&(self.information * away))
    }

    /// The information that is left to the prior when this pose is the truth (Cauchy weight).
    pub fn information_at(&self, pose: &Pose2) -> Matrix3<f64> {
        self.information / (1.0 + self.squared(pose) / (SURPRISE * SURPRISE))
    }

    /// What speaks against a pose: minus its log-likelihood, up to a constant (Cauchy).
    fn against(&self, pose: &Pose2) -> f64 {
        0.5 * SURPRISE * SURPRISE * (self.squared(pose) / (SURPRISE * SURPRISE)).ln_1p()
    }
}

/// How well a pose explains a scan.
#[derive(Copy, Clone, PartialEq, Debug, Default)]
pub struct Fit {
    /// Weight of the end points on mapped surfaces.
    pub explained: f64,
    /// Weight of the end points that say anything: near a surface, or where the map knows free space.
    pub informative: f64,
    /// Weight of all end points.
    pub total: f64,
}

impl Fit {
    /// Share of the informative end points that are explained, 0 to 1.
    pub fn score(&self) -> f64 {
        if self.informative > 0.0 { self.explained / self.informative } else { 0.0 }
    }
}

/// An explained end point is so much likelier than one that is not (natural logarithm).
const EXPLAINED_GAIN: f64 = 3.0;

/// The result of an alignment.
#[derive(Copy, Clone, Debug)]
pub struct Alignment {
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
    pub fn likelihood(&self, prior: &Prior, params: &AlignParams) -> f64 {
        EXPLAINED_GAIN * self.fit.explained / params.beams_per_independent_one - prior.against(&self.pose)
    }
}

/// Aligns a scan with the map, starting at `start` and held by the prior; each iteration goes to the journal.
pub fn align(
    map: &LocalMap,
    points: &EndPoints,
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
        let (normal, tangent) = accumulate(map, points, &pose, scale_m as f32, params);
        let doubt = Doubt::new(
            &normal.matrix(),
            &tangent,
            params.direction_noise_rad,
            params.least_information(prior),
        );
        let information = doubt.information();
        let held = prior.information_at(&pose);
        let gradient = doubt.gradient(&normal.vector()) + held * prior.away(&pose);
        let Some(factors) = (information + held).cholesky() else { break };
        let step = -factors.solve(&gradient);
        if !step.iter().all(|value| value.is_finite()) {
            break;
        }
        let from = pose;
        pose = Pose2::new(pose.x_m + step[0], pose.y_m + step[1], wrap_angle(pose.theta_rad + step[2]));
        if journal.is_kept() {
            let (cost, used) = cost(map, points, &from, scale_m as f32, params);
            journal.push(iterations - 1, [&from, &pose], (cost + prior.against(&from), used));
        }
        let at_rest = step[0].hypot(step[1]) < params.rest_m && step[2].abs() < params.rest_rad;
        if at_rest && scale_m <= params.outlier_m {
            known = Some(information); // so short a step changes nothing
            break;
        }
        scale_m = (0.5 * scale_m).max(params.outlier_m);
    }
    let at_rest = known.is_some();
    let information = known.unwrap_or_else(|| {
        let (normal, tangent) = accumulate(map, points, &pose, params.outlier_m as f32, params);
        Doubt::new(&normal.matrix(), &tangent, params.direction_noise_rad, params.least_information(prior))
            .information()
    });
    let information = information / params.beams_per_independent_one;
    Alignment { pose, information, fit: fit(map, points, &pose, params), iterations, at_rest }
}

/// Sums over all end points: the residuals' normal equations, and J^T W J over the walls' tangents.
fn accumulate(
    map: &LocalMap,
    points: &EndPoints,
    pose: &Pose2,
    scale_m: f32,
    params: &AlignParams,
) -> (Normal, Matrix3<f64>) {
    let placement = Placement::new(pose);
    let (mut batch, mut lines, mut spots) = (Batch::default(), LineSums::default(), Normal::default());
    for some in points.as_slice().chunks(BATCH) {
        for point in some {
            gather(map, point, &placement, scale_m, params, (&mut batch, &mut spots));
        }
        lines.take(&mut batch, scale_m);
    }
    let (normal, tangent) = lines.finish(1.0 / square(params.range_noise_m));
    (normal.plus(&spots), tangent)
}

/// What an end point meets: a line of the map goes to the batch, a surface that is no line to the `spots`.
#[inline]
fn gather(
    map: &LocalMap,
    point: &EndPoint,
    placement: &Placement,
    scale_m: f32,
    params: &AlignParams,
    (batch, spots): (&mut Batch, &mut Normal),
) {
    let arm = placement.turn(point.at_m);
    let at_m = [arm[0] + placement.at_m[0], arm[1] + placement.at_m[1]];
    let Some(surface) = map.nearest(at_m) else { return };
    let offset = minus(at_m, surface.at_m);
    let strength = dot(surface.normal, surface.normal);
    let sureness = point.weight * surface.hits / (1.0 + surface.hits);
    if !map.is_line(surface) {
        if point.kind == Kind::Point {
            let weight = sureness * cauchy(dot(offset, offset), scale_m) / square(params.point_noise_m);
            spots.add([1.0, 0.0], -arm[1], offset[0], weight);
            spots.add([0.0, 1.0], arm[0], offset[1], weight);
        }
        return;
    }
    // Another face, or a wall that turns away, counts nothing.
    let agree = dot(placement.turn(point.normal), surface.normal);
    let turns_away = agree < 0.5 * strength && dot(point.normal, point.normal) > 0.5;
    let entry = batch.len;
    for axis in 0..2 {
        batch.arm[axis][entry] = arm[axis];
        batch.offset[axis][entry] = offset[axis];
        batch.normal[axis][entry] = surface.normal[axis];
    }
    batch.weight[entry] = if turns_away { 0.0 } else { sureness };
    batch.len += 1;
}

/// What an alignment makes small, but for the prior, and how many end points have a say: what [`accumulate`] differentiates.
fn cost(map: &LocalMap, points: &EndPoints, pose: &Pose2, scale_m: f32, params: &AlignParams) -> (f64, u32) {
    let placement = Placement::new(pose);
    let (mut cost, mut used) = (0.0, 0);
    for point in points.as_slice() {
        let (at_m, own) = placement.place_point(point);
        let Some(surface) = map.nearest(at_m) else { continue };
        let offset = minus(at_m, surface.at_m);
        let strength = dot(surface.normal, surface.normal);
        let (squared, noise_m) = if !map.is_line(surface) {
            if point.kind != Kind::Point {
                continue;
            }
            (dot(offset, offset), params.point_noise_m)
        } else {
            if dot(own, surface.normal) < 0.5 * strength && dot(point.normal, point.normal) > 0.5 {
                continue;
            }
            (square32(dot(offset, surface.normal)) / strength, params.range_noise_m)
        };
        let sureness = f64::from(point.weight * surface.hits / (1.0 + surface.hits));
        let scale_squared = f64::from(square32(scale_m));
        let robust = scale_squared * (f64::from(squared) / scale_squared).ln_1p();
        cost += 0.5 * sureness * robust / (noise_m * noise_m);
        used += 1;
    }
    (cost, used)
}

/// How well a pose explains a scan.
pub fn fit(map: &LocalMap, points: &EndPoints, pose: &Pose2, params: &AlignParams) -> Fit {
    let placement = Placement::new(pose);
    let mut fit = Fit::default();
    let near_m = params.explained_m as f32;
    for point in points.as_slice() {
        let (at_m, own) = placement.place_point(point);
        let weight = f64::from(point.weight);
        fit.total += weight;
        let Some(surface) = map.nearest(at_m) else {
            if map.seen_through(at_m) {
                fit.informative += weight;
            }
            continue;
        };
        fit.informative += weight;
        let offset = minus(at_m, surface.at_m);
        let strength = dot(surface.normal, surface.normal);
        let line = map.is_line(surface);
        let other_face =
            line && dot(point.normal, point.normal) > 0.5 && dot(own, surface.normal) < 0.5 * strength;
        let squared =
            if line { square32(dot(offset, surface.normal)) / strength } else { dot(offset, offset) };
        if !other_face && squared < near_m * near_m {
            fit.explained += weight;
        }
    }
    fit
}

#[inline]
pub fn cauchy(squared: f32, scale: f32) -> f32 {
    1.0 / (1.0 + squared / (scale * scale))
}

#[inline]
fn square(value: f64) -> f32 {
    (value * value) as f32
}

#[inline]
fn square32(value: f32) -> f32 {
    value * value
}
