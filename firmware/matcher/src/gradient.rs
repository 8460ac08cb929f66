//! The method `gradient`: the paper's scan matching (section 2.2).
//!
//! Gradient ascent of the summed log-likelihood of a scan's end points over (x, y, theta), from the odometry prior, in
//! the field of a few earlier scans. The heading is measured in metres at the end points' typical distance, so that one
//! step length serves all three. Frame: map.

use nalgebra::{Matrix3, Vector3};

use crate::align::{Alignment, Fit, Prior};
use crate::doubt::Doubt;
use crate::field::{Field, Reference};
use crate::journal::Journal;
use crate::map_matcher::Verdict;
use crate::params::TrackerParams;
use crate::points::EndPoints;
use crate::pose::{Pose2, wrap_angle};
use crate::surface::Placement;

crate::named::named_parameters! { "gradient";
/// The paper's method.
#[derive(Copy, Clone, PartialEq, Debug)]
pub struct GradientParams {
    /// Side of a cell, metres; the paper's is 0.1. Smaller: finer and slower to prepare, by the square.
    pub cell_m: f64 [0.005, 10.0],
    /// Half the side of the square around the latest reference scan that the field covers, metres. End points outside
    /// count nothing.
    pub half_window_m: f64 [0.1, 1000.0],
    /// From this distance on the likelihood falls no further, metres. Larger: a wider basin, more harm from people.
    pub cutoff_m: f64 [0.01, 100.0],
    /// So far behind an end point space is not yet occluded, metres. Smaller: end points slip behind the walls.
    pub occlusion_margin_m: f64,
    /// Beams farther apart than this leave the space between them unknown, radians.
    pub gap_rad: f64,
    /// Earlier scans that make the field. More: steadier, and slower to prepare.
    pub reference_scans: usize [1.0, 100.0],
    /// A scan becomes a reference when the base has moved this far since the last one, metres. Smaller: more drift, as
    /// every reference adds its error; larger: less overlap.
    pub reference_every_m: f64,
    /// The same for turning, radians.
    pub reference_every_rad: f64,
    /// Iterations at most; the paper's figure 2 needs 100 for 10 cm, 10 cm and 30 degrees.
    pub max_iterations: u32,
    /// The first and longest step, metres. Larger: fewer iterations from far away, more overshoot.
    pub first_step_m: f64 [0.0001, 10.0],
    /// The step grows by this factor while the gradient keeps its direction. Larger: fewer iterations, more overshoot.
    pub step_growth: f64 [1.0, 10.0],
    /// The step shrinks by this factor when the gradient turns back. Larger: more iterations to settle.
    pub step_shrink: f64 [0.01, 1.0],
    /// A smaller step ends the ascent, metres. Larger: fewer iterations, a rougher pose.
    pub rest_m: f64,
    /// Standard deviation of an end point in the field, metres: range noise and half a cell. For the covariance.
    pub noise_m: f64 [0.0001, 100.0],
    /// How far the field's slopes are off in direction, radians: that much structure is not believed, as with
    /// align.direction_noise_rad.
    pub direction_noise_rad: f64,
    /// End points this close to a reference's are explained, metres. Larger: poor matches pass for good ones.
    pub explained_m: f64,
}
}

impl Default for GradientParams {
    fn default() -> Self {
        Self {
            cell_m: 0.1,
            half_window_m: 20.0,
            cutoff_m: 1.0,
            occlusion_margin_m: 0.4,
            gap_rad: 0.05,
            reference_scans: 3,
            reference_every_m: 0.5,
            reference_every_rad: 0.3,
            max_iterations: 100,
            first_step_m: 0.1,
            step_growth: 1.5,
            step_shrink: 0.4,
            rest_m: 0.0005,
            noise_m: 0.05,
            direction_noise_rad: 0.2,
            explained_m: 0.15,
        }
    }
}

/// Reference scans, their field, and when the last one was taken.
#[derive(Clone, Debug)]
pub struct GradientMatcher {
    params: TrackerParams,
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
    pub fn new(params: &TrackerParams) -> Self {
        let count = params.gradient.reference_scans.max(1);
        Self {
            params: *params,
            field: Field::new(params.gradient),
            references: (0..count)
                .map(|_| Reference::with_capacity(params.points.max_beams.max(1)))
                .collect(),
            filled: 0,
            next: 0,
            taken_at: None,
            journal: Journal::default(),
        }
    }

    /// Forgets all references; the memory stays.
    pub fn forget(&mut self) {
        self.filled = 0;
        self.next = 0;
        self.taken_at = None;
    }

    /// Reference scans in use.
    pub fn references(&self) -> usize {
        self.filled
    }

    /// Finds the scan's pose by gradient ascent from the prior's mean.
    pub fn locate(&mut self, points: &EndPoints, prior: &Prior) -> (Alignment, Verdict) {
        let (pose, iterations) = self.ascend(points, prior.mean);
        let (information, fit) = self.judge(points, &pose);
        let pose = weigh(prior, &pose, &(information * self.params.align.beams_per_independent_one));
        let alignment = Alignment {
            pose,
            information,
            fit,
            iterations,
            at_rest: iterations < self.params.gradient.max_iterations,
        };
        let verdict = if fit.informative < self.params.search.min_informative * fit.total {
            Verdict::NewGround
        } else if fit.score() < self.params.search.lost_below_score {
            Verdict::Lost
        } else {
            Verdict::Found
        };
        (alignment, verdict)
    }

    /// How much of a scan a pose explains, 0 to 1.
    pub fn score_at(&self, points: &EndPoints, pose: &Pose2) -> f64 {
        self.judge(points, pose).1.score()
    }

    /// Steps of a length that grows while the gradient keeps its direction and shrinks when it turns back: unlike a
    /// test for more likelihood this is not led astray by end points that slip into occlusion.
    fn ascend(&mut self, points: &EndPoints, start: Pose2) -> (Pose2, u32) {
        let params = self.params.gradient;
        let arm_m = typical_distance_m(points).max(0.1);
        let mut pose = start;
        let mut before = Vector3::zeros();
        let mut step_m = params.first_step_m;
        for iteration in 0..params.max_iterations {
            let gradient = self.ascent(points, &pose);
            // Steepest direction when theta is measured in metres at the arm's end.
            let uphill = Vector3::new(gradient[0], gradient[1], gradient[2] / arm_m);
            let steepness = uphill.norm();
            if steepness <= 1e-9 || step_m < params.rest_m {
                return (pose, iteration);
            }
            let direction = uphill / steepness;
            step_m *= if direction.dot(&before) < 0.0 { params.step_shrink } else { params.step_growth };
            step_m = step_m.min(params.first_step_m);
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
        (pose, params.max_iterations)
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

    /// Minus the summed log-likelihood, metres, and how many end points have a say.
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
        let params = &self.params.gradient;
        let weight = 1.0 / (params.noise_m * params.noise_m * self.params.align.beams_per_independent_one);
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
            if f64::from(-likelihood.value) < params.explained_m {
                fit.explained += 1.0;
                let row = Vector3::new(gx, gy, arm[0] * gy - arm[1] * gx).map(f64::from);
                across += row * row.transpose() * weight;
                let row = Vector3::new(-gy, gx, arm[0] * gx + arm[1] * gy).map(f64::from);
                along += row * row.transpose() * weight;
            }
        }
        (Doubt::new(&across, &along, params.direction_noise_rad, 0.0).information(), fit)
    }

    /// Takes the scan as a reference when the base has moved enough, and prepares the field. Answers with the reference's
    /// number, which an older one had before.
    pub fn learn(&mut self, map_from_base: &Pose2, points: &EndPoints) -> Option<u8> {
        let params = &self.params.gradient;
        let moved_enough = self.taken_at.is_none_or(|last| {
            let step = last.between(map_from_base);
            step.distance_m() >= params.reference_every_m
                || step.theta_rad.abs() >= params.reference_every_rad
        });
        if !moved_enough {
            return None;
        }
        let taken = u8::try_from(self.next).ok();
        self.taken_at = Some(*map_from_base);
        self.references[self.next].fill(map_from_base, points, params.gap_rad);
        self.next = (self.next + 1) % self.references.len();
        self.filled = (self.filled + 1).min(self.references.len());
        let centre_m = [map_from_base.x_m as f32, map_from_base.y_m as f32];
        self.field.build(centre_m, &self.references[..self.filled]);
        taken
    }
}

/// Between the prior and the ascent's end, by what each knows: along a bare corridor the ascent knows nothing.
fn weigh(prior: &Prior, found: &Pose2, information: &Matrix3<f64>) -> Pose2 {
    let held = prior.information_at(found);
    let Some(factors) = (held + information).cholesky() else { return *found };
    let back = factors.solve(&(held * prior.away(found)));
    Pose2::new(found.x_m - back[0], found.y_m - back[1], wrap_angle(found.theta_rad - back[2]))
}

fn typical_distance_m(points: &EndPoints) -> f64 {
    let squares: f64 =
        points.as_slice().iter().map(|p| f64::from(p.at_m[0].powi(2) + p.at_m[1].powi(2))).sum();
    (squares / points.as_slice().len().max(1) as f64).sqrt()
}
