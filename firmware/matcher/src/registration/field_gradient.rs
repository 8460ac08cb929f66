//! The method `gradient`: the paper's scan matching (section 2.2).
//!
//! Gradient ascent of the summed log-likelihood of a scan's end points over (x, y, theta), from the odometry
//! prior, in the field of a few earlier scans. The heading is measured in meters at the end points' typical
//! distance, so that one step length serves all three. Frame: map.

use nalgebra::{Matrix3, Vector3};

use crate::placement::Placement;
use crate::registration::degeneracy::Degeneracy;
use crate::registration::gauss_newton::Alignment;
use crate::registration::gauss_newton::fit::Fit;
use crate::registration::gauss_newton::params::BEAMS_PER_INDEPENDENT_ONE;
use crate::registration::gauss_newton::prior::Prior;
use crate::registration::journal::Journal;
use crate::registration::likelihood_field::{Field, GradientParams, Reference};
use crate::registration::normal_equations::step;
use crate::registration::verdict::Verdict;
use crate::scan::end_points::EndPoints;
use biplane_geometry::{Pose2, wrap_angle};

/// Earlier scans that make the field. More: steadier, and slower to prepare. Error 0.6898 m halved, 0.3545 m
/// doubled.
const REFERENCE_SCANS: usize = 3;
/// A scan becomes a reference when the base has moved this far since the last one, meters. Smaller: more
/// drift, as every reference adds its error; larger: less overlap. Error 0.2344 m halved, 0.1734 m doubled.
const REFERENCE_EVERY_M: f64 = 0.5;
/// The same for turning, radians. Error 0.2640 m halved, 0.2174 m doubled.
const REFERENCE_EVERY_RAD: f64 = 0.3;
/// Iterations at most: the paper's figure 2 needs 100 for 10 cm, 10 cm and 30 degrees. Starts found 66.0 %
/// halved, 69.1 % doubled (as it is 69.1 %, 20 pairs).
const MAX_ITERATIONS: u32 = 100;
/// The first and longest step, meters: a cell. Larger: fewer iterations from far away, more overshoot.
/// Starts found 66.3 % halved, 70.3 % doubled (as it is 69.1 %, 20 pairs).
const FIRST_STEP_M: f64 = 0.1;
/// The step grows by this factor while the gradient keeps its direction. Larger: fewer iterations, more
/// overshoot. Starts found 61.4 % halved, 7.0 % doubled (as it is 69.1 %, 20 pairs).
const STEP_GROWTH: f64 = 1.5;
/// The step shrinks by this factor when the gradient turns back. Larger: more iterations to settle.
/// Starts found 67.1 % halved, 71.6 % doubled (as it is 69.1 %, 20 pairs).
const STEP_SHRINK: f64 = 0.4;
/// A smaller step ends the ascent, meters. Larger: fewer iterations, a rougher pose.
/// Starts found 70.0 % halved, 68.1 % doubled (as it is 69.1 %, 20 pairs).
const REST_M: f64 = 0.0005;
/// Standard deviation of an end point in the field, meters: range noise and half a cell. For the covariance.
/// Starts found 69.2 % halved, 56.7 % doubled (as it is 69.1 %, 20 pairs).
const NOISE_M: f64 = 0.05;
/// How far the field's slopes are off in direction, radians: that much structure is not believed, as with the
/// alignment's `direction_noise_rad`. Starts found 69.1 % halved, 63.3 % doubled (as it is 69.1 %, 20 pairs).
const DIRECTION_NOISE_RAD: f64 = 0.2;
/// End points this close to a reference's are explained, meters. Larger: poor matches pass for good ones.
/// Starts found 68.8 % halved, 69.0 % doubled (as it is 69.1 %, 20 pairs).
const EXPLAINED_M: f64 = 0.15;

/// Reference scans, their field, and when the last one was taken.
#[derive(Clone, Debug)]
pub(crate) struct GradientMatcher {
    field: Field,
    references: Vec<Reference>,
    filled: usize,
    next: usize,
    taken_at: Option<Pose2>,
    /// The iterations of the last scan.
    pub journal: Journal,
}

impl GradientMatcher {
    /// A matcher without references and with all the memory it will ever have.
    pub(crate) fn new(params: GradientParams, max_beams: usize) -> Self {
        Self {
            field: Field::new(params),
            references: (0..REFERENCE_SCANS).map(|_| Reference::with_capacity(max_beams.max(1))).collect(),
            filled: 0,
            next: 0,
            taken_at: None,
            journal: Journal::default(),
        }
    }

    /// Forgets all references; the memory stays.
    pub(crate) fn forget(&mut self) {
        self.filled = 0;
        self.next = 0;
        self.taken_at = None;
    }

    /// Reference scans in use.
    pub(crate) fn references(&self) -> usize {
        self.filled
    }

    /// Finds the scan's pose by gradient ascent from the prior's mean.
    pub(crate) fn locate(&mut self, points: &EndPoints, prior: &Prior) -> (Alignment, Verdict) {
        let (pose, iterations) = self.ascend(points, prior.mean);
        let (information, fit) = self.judge(points, &pose);
        let pose = weigh(prior, &pose, &(information * BEAMS_PER_INDEPENDENT_ONE));
        let at_rest = iterations < MAX_ITERATIONS;
        (Alignment { pose, information, fit, iterations, at_rest }, Verdict::of(&fit))
    }

    /// How much of a scan a pose explains, 0 to 1.
    pub(crate) fn score_at(&self, points: &EndPoints, pose: &Pose2) -> f64 {
        self.judge(points, pose).1.score()
    }

    /// Steps of a length that grows while the gradient keeps its direction and shrinks when it turns back:
    /// unlike a test for more likelihood this is not led astray by end points that slip into occlusion.
    fn ascend(&mut self, points: &EndPoints, start: Pose2) -> (Pose2, u32) {
        let arm_m = typical_distance_m(points).max(0.1);
        let mut pose = start;
        let mut before = Vector3::zeros();
        let mut step_m = FIRST_STEP_M;
        for iteration in 0..MAX_ITERATIONS {
            let gradient = self.ascent(points, &pose);
            // Steepest direction when theta is measured in meters at the arm's end.
            let uphill = Vector3::new(gradient[0], gradient[1], gradient[2] / arm_m);
            let steepness = uphill.norm();
            if steepness <= 1e-9 || step_m < REST_M {
                return (pose, iteration);
            }
            let direction = uphill / steepness;
            step_m *= if direction.dot(&before) < 0.0 { STEP_SHRINK } else { STEP_GROWTH };
            step_m = step_m.min(FIRST_STEP_M);
            let from = pose;
            pose.x_m += step_m * direction[0];
            pose.y_m += step_m * direction[1];
            pose.theta_rad = wrap_angle(pose.theta_rad + step_m * direction[2] / arm_m);
            if self.journal.is_kept() {
                let cost = self.cost(points, &from);
                self.journal.push(iteration, [&from, &pose], cost);
            }
            before = direction;
        }
        (pose, MAX_ITERATIONS)
    }

    /// The summed log-likelihood's derivative by x, y (m) and theta (rad).
    fn ascent(&self, points: &EndPoints, pose: &Pose2) -> Vector3<f64> {
        let placement = Placement::new(pose);
        let mut sums = [0.0_f32; 3];
        for point in points.as_slice() {
            let arm = placement.turn(point.at_m);
            let [gx, gy] = self.field.at([arm[0] + placement.at_m[0], arm[1] + placement.at_m[1]]).gradient;
            sums[0] += gx;
            sums[1] += gy;
            sums[2] += arm[0] * gy - arm[1] * gx;
        }
        Vector3::from(sums.map(f64::from))
    }

    /// Minus the summed log-likelihood, meters, and how many end points have a say.
    fn cost(&self, points: &EndPoints, pose: &Pose2) -> (f64, u32) {
        let placement = Placement::new(pose);
        let values = points.as_slice().iter().map(|point| self.field.at(placement.place(point.at_m)).value);
        values
            .filter(|value| *value != 0.0)
            .fold((0.0, 0), |(cost, used), value| (cost - f64::from(value), used + 1))
    }

    /// What the scan knows at its final pose: each end point its distance along the field's gradient.
    fn judge(&self, points: &EndPoints, pose: &Pose2) -> (Matrix3<f64>, Fit) {
        let placement = Placement::new(pose);
        let weight = 1.0 / (NOISE_M * NOISE_M * BEAMS_PER_INDEPENDENT_ONE);
        let (mut across, mut along) = (Matrix3::zeros(), Matrix3::zeros());
        let mut fit = Fit::default();
        for point in points.as_slice() {
            let arm = placement.turn(point.at_m);
            let likelihood = self.field.at([arm[0] + placement.at_m[0], arm[1] + placement.at_m[1]]);
            let [gx, gy] = likelihood.gradient;
            fit.total += 1.0;
            if likelihood.value == 0.0 {
                continue; // occluded: it says nothing
            }
            fit.informative += 1.0;
            if f64::from(-likelihood.value) < EXPLAINED_M {
                fit.explained += 1.0;
                let row = Vector3::new(gx, gy, arm[0] * gy - arm[1] * gx).map(f64::from);
                across += row * row.transpose() * weight;
                let row = Vector3::new(-gy, gx, arm[0] * gx + arm[1] * gy).map(f64::from);
                along += row * row.transpose() * weight;
            }
        }
        (Degeneracy::new(&across, &along, DIRECTION_NOISE_RAD, 0.0).information(), fit)
    }

    /// Takes the scan as a reference when the base has moved enough, and prepares the field. Answers with the
    /// reference's number, which an older one had before.
    pub(crate) fn learn(&mut self, map_from_base: &Pose2, points: &EndPoints) -> Option<u8> {
        let moved_enough = self.taken_at.is_none_or(|last| {
            let step = last.between(map_from_base);
            step.distance_m() >= REFERENCE_EVERY_M || step.theta_rad.abs() >= REFERENCE_EVERY_RAD
        });
        if !moved_enough {
            return None;
        }
        let taken = u8::try_from(self.next).ok();
        self.taken_at = Some(*map_from_base);
        self.references[self.next].fill(map_from_base, points);
        self.next = (self.next + 1) % self.references.len();
        self.filled = (self.filled + 1).min(self.references.len());
        let center_m = [map_from_base.x_m as f32, map_from_base.y_m as f32];
        self.field.build(center_m, &self.references[..self.filled]);
        taken
    }
}

/// Between the prior and the ascent's end, by what each knows: along a bare corridor the ascent knows
/// nothing.
fn weigh(prior: &Prior, found: &Pose2, information: &Matrix3<f64>) -> Pose2 {
    let (prior_information, residual) = (prior.information_at(found), prior.residual(found));
    let back = step(information, &Vector3::zeros(), &prior_information, &residual);
    back.map_or(*found, |back| found.stepped(back.into()))
}

fn typical_distance_m(points: &EndPoints) -> f64 {
    let squares: f64 =
        points.as_slice().iter().map(|p| f64::from(p.at_m[0].powi(2) + p.at_m[1].powi(2))).sum();
    (squares / points.as_slice().len().max(1) as f64).sqrt()
}
