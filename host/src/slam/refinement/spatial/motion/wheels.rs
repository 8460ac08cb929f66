//! What the base's own odometry and wheels that stand on a ground say of the way from knot to knot.
//!
//! Along the body: as far as counted; to the side and off the ground that the tilt tells: nothing. So height
//! and pitch are one unknown. The odometry's length, turn and drift are calibrated against the poses first.

use crate::recordings::deskew::Trajectory;
use crate::slam::refinement::spatial::knots::{Attitude, Knots, State};
use crate::slam::refinement::spatial::normal_equations::rows::{Part, Rows};
use crate::slam::refinement::spatial::normal_equations::{Layout, robust};
use crate::slam::refinement::spatial::params::MotionSigmas;
use biplane_geometry::PortableMath;
use biplane_geometry::vec3::{dot, minus};
use biplane_geometry::wrap_angle;
use nalgebra::{Matrix2, Vector2};

/// Longest time between reports of the base, nanoseconds.
const GAP_NS: i64 = 500_000_000;
/// A step shorter than this is none, meters and radians: the robot stands.
const STANDS_M: f64 = 2e-4;
const STANDS_RAD: f64 = 5e-4;
/// What remains of steps however short: the counts are rounded.
const ROUNDED_M: f64 = 5e-4;
const ROUNDED_ASIDE_M: f64 = 2e-4;
const ROUNDED_UP_M: f64 = 1e-4;
const ROUNDED_RAD: f64 = 6e-4;
/// Calibration compares over so many knots: long against the noise of a pose, short against a blunder.
const OVER_KNOTS: usize = 20;
/// A step ahead that is off by so many standard deviations is a slip; smaller ones hold, or a wrong wall
/// drags the robot along.
const SLIP_KERNEL: f64 = 15.0;
/// A pitch of so many standard deviations of a level floor is that of a ramp: the floor says little then.
const LEVEL_KERNEL: f64 = 2.0;
/// And a change of the pitch of so many is a bend of the ground.
const BEND_KERNEL: f64 = 4.0;
/// Rounds of the robust fit, and its scale in standard deviations (Tukey).
const ROUNDS: usize = 10;
const TUKEY: f64 = 4.0;

/// A step as the base counted it, in the body's frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Step {
    pub ahead_m: f64,
    pub aside_m: f64,
    pub turn_rad: f64,
}

impl Step {
    fn stands(self) -> bool {
        self.ahead_m.abs() + self.aside_m.abs() < STANDS_M && self.turn_rad.abs() < STANDS_RAD
    }
}

/// The steps between knots; `None` where the base said nothing.
#[derive(Clone, Debug)]
pub(crate) struct Wheels {
    pub steps: Vec<Option<Step>>,
}

impl Wheels {
    /// Reads the odometry at the knots' times and calibrates it against their poses; `None` when the base
    /// says nothing of most of the way.
    pub(crate) fn new(odometry: &Trajectory, knots: &Knots) -> Option<Self> {
        let counted: Vec<_> = (0..knots.states.len() as i64)
            .map(|number| odometry.at(knots.start_ns + number * knots.step_ns, GAP_NS))
            .collect();
        let step = |pair: &[Option<_>]| {
            let (a, b): (biplane_geometry::StampedPose, biplane_geometry::StampedPose) = (pair[0]?, pair[1]?);
            let turn_rad = wrap_angle(b.theta_rad - a.theta_rad);
            let (sin, cos) = (a.theta_rad + 0.5 * turn_rad).portable_sin_cos();
            let (x, y) = (b.x_m - a.x_m, b.y_m - a.y_m);
            Some(Step { ahead_m: cos * x + sin * y, aside_m: cos * y - sin * x, turn_rad })
        };
        let mut wheels = Self { steps: counted.windows(2).map(step).collect() };
        let known = wheels.steps.iter().flatten().count();
        if 10 * known < 9 * wheels.steps.len() {
            return None;
        }
        wheels.calibrate(knots);
        Some(wheels)
    }

    /// Makes length, turn and drift those that the poses tell.
    fn calibrate(&mut self, knots: &Knots) {
        let (mut ways, mut turns) = (Vec::new(), Vec::new());
        for first in (0..self.steps.len().saturating_sub(OVER_KNOTS)).step_by(OVER_KNOTS / 2) {
            let (mut way, mut turn, mut matched_m) = (0.0, 0.0, 0.0);
            for knot in first..first + OVER_KNOTS {
                let step = self.steps[knot].unwrap_or_default();
                way += step.ahead_m;
                turn += step.turn_rad;
                let (a, b) = (&knots.states[knot], &knots.states[knot + 1]);
                let (sin, cos) = (0.5 * (a[5] + b[5])).portable_sin_cos();
                matched_m += cos * (b[0] - a[0]) + sin * (b[1] - a[1]);
            }
            if way.abs() > 0.1 || turn.abs() > 0.1 {
                let matched_rad = knots.states[first + OVER_KNOTS][5] - knots.states[first][5];
                ways.push((Vector2::new(way, 0.0), matched_m));
                turns.push((Vector2::new(turn, way), matched_rad));
            }
        }
        let scale = fit(&ways, Vector2::new(1.0, 0.0), [0.05, 1e-6], 0.01)[0];
        let gains = fit(&turns, Vector2::new(1.0, 0.0), [0.05, 0.02], 0.01);
        for step in self.steps.iter_mut().flatten() {
            step.turn_rad = gains[0] * step.turn_rad + gains[1] * step.ahead_m;
            step.ahead_m *= scale;
            step.aside_m *= scale;
        }
    }

    /// Whether the robot stands from a knot to the next.
    pub(crate) fn stands(&self, knot: usize) -> bool {
        self.steps[knot].is_some_and(Step::stands)
    }

    /// Speed ahead at a knot.
    pub(crate) fn speed_m_s(&self, knot: usize, step_s: f64) -> f64 {
        let around = &self.steps[knot.saturating_sub(1)..(knot + 1).min(self.steps.len())];
        around.iter().flatten().map(|step| step.ahead_m).sum::<f64>() / (around.len() as f64 * step_s)
    }

    /// Acceleration to the left of the curve after a knot.
    pub(crate) fn curve_m_s2(&self, knot: usize, step_s: f64) -> f64 {
        self.steps[knot].map_or(0.0, |step| step.ahead_m * step.turn_rad / (step_s * step_s))
    }

    /// The way from the start to each knot, meters.
    pub(crate) fn way_m(&self) -> Vec<f64> {
        let mut way_m = vec![0.0];
        for step in &self.steps {
            let step_m = step.map_or(0.0, |step| step.ahead_m.portable_hypot(step.aside_m));
            way_m.push(way_m.last().copied().unwrap_or(0.0) + step_m);
        }
        way_m
    }

    /// The next state when the tilt stays.
    pub(crate) fn reckoned(&self, state: &State, knot: usize) -> State {
        let step = self.steps[knot].unwrap_or_default();
        let mut middle = *state;
        middle[5] += 0.5 * step.turn_rad;
        let moved = Attitude::of(&middle).rotate([step.ahead_m, step.aside_m, 0.0]);
        let [x, y, z, roll, pitch, yaw] = *state;
        [x + moved[0], y + moved[1], z + moved[2], roll, pitch, yaw + step.turn_rad]
    }

    /// All states by the wheels alone, on flat ground, from the first one on.
    pub(crate) fn dead_reckoned(&self, knots: &Knots) -> Knots {
        let mut states = vec![knots.states[0]];
        for knot in 0..self.steps.len() {
            states.push(self.reckoned(&states[knot], knot));
        }
        Knots { states, ..knots.clone() }
    }

    /// What the wheels say of the knots `first..first + layout.knots`.
    pub(crate) fn rows(
        &self,
        knots: &Knots,
        first: usize,
        layout: Layout,
        sigmas: &MotionSigmas,
        rows: &mut Rows,
    ) {
        for knot in 0..layout.knots - 1 {
            let (a, b) = (&knots.states[first + knot], &knots.states[first + knot + 1]);
            let step = self.steps[first + knot];
            motion(a, b, step, knot, layout, sigmas, rows);
            let dt_s = knots.step_s();
            let stands = step.is_some_and(Step::stands);
            let turn = step.unwrap_or_default().turn_rad;
            let noise = if stands { 0.0 } else { sigmas.turn_rad * dt_s.sqrt() };
            let sigma = (noise.powi(2) + (sigmas.turn_share * turn).powi(2) + ROUNDED_RAD.powi(2)).sqrt();
            if step.is_some() {
                let both = between([layout.flat(knot), layout.flat(knot + 1)], 2);
                rows.push(&both, b[5] - a[5] - turn, 1.0 / (sigma * sigma));
            }
            let walk = if stands { 0.02 * sigmas.tilt_rad } else { sigmas.tilt_rad } * dt_s.sqrt();
            let tilts = [layout.tilt(knot), layout.tilt(knot + 1)];
            rows.push(&between(tilts, 1), b[3] - a[3], 1.0 / (walk * walk));
            // Ground bends rarely and then at once.
            let bend_rad = b[4] - a[4];
            let bend = if stands { walk } else { sigmas.bend_rad };
            let weight = 1.0 / (bend * bend) * robust(bend_rad, BEND_KERNEL * bend);
            rows.push(&between(tilts, 2), bend_rad, weight);
            rows.push(&[(layout.tilt(knot), [0.0, 1.0, 0.0])], a[3], sigmas.roll_rad.powi(-2));
            let kernel = robust(a[4], LEVEL_KERNEL * sigmas.level_rad);
            let level = [(layout.tilt(knot), [0.0, 0.0, 1.0])];
            rows.push(&level, a[4], kernel / sigmas.level_rad.powi(2));
        }
    }
}

/// The body's step ahead, to the side and up.
fn motion(
    a: &State,
    b: &State,
    step: Option<Step>,
    knot: usize,
    layout: Layout,
    sigmas: &MotionSigmas,
    rows: &mut Rows,
) {
    let counted = step.unwrap_or_default();
    let middle: State = std::array::from_fn(|part| 0.5 * (a[part] + b[part]));
    let attitude = Attitude::of(&middle);
    let moved = minus([b[0], b[1], b[2]], [a[0], a[1], a[2]]);
    let way_m = counted.ahead_m.portable_hypot(counted.aside_m);
    let expected = [counted.ahead_m, counted.aside_m, 0.0];
    let sigma = [(sigmas.ahead_m, ROUNDED_M), (sigmas.aside_m, ROUNDED_ASIDE_M), (sigmas.up_m, ROUNDED_UP_M)];
    for (axis, (slip_m, rounded_m)) in sigma.into_iter().enumerate() {
        if axis < 2 && step.is_none() {
            continue;
        }
        let direction = std::array::from_fn(|row| attitude.matrix[row][axis]);
        let residual = dot(direction, moved) - expected[axis];
        let sigma_m = (slip_m * slip_m * way_m + rounded_m * rounded_m).sqrt();
        let kernel = if axis == 0 { robust(residual, SLIP_KERNEL * sigma_m) } else { 1.0 };
        let [roll, pitch, yaw] = attitude.derivatives(direction).map(|turned| 0.5 * dot(turned, moved));
        let [x, y, z] = direction;
        let parts = [
            (layout.flat(knot), [-x, -y, yaw]),
            (layout.tilt(knot), [-z, roll, pitch]),
            (layout.flat(knot + 1), [x, y, yaw]),
            (layout.tilt(knot + 1), [z, roll, pitch]),
        ];
        rows.push(&parts, residual, kernel / (sigma_m * sigma_m));
    }
}

/// The difference of one part of two variables.
fn between(variables: [usize; 2], axis: usize) -> [Part; 2] {
    let part = |sign: f64| std::array::from_fn(|at| if at == axis { sign } else { 0.0 });
    [(variables[0], part(-1.0)), (variables[1], part(1.0))]
}

/// Slopes of value = slopes . of, robustly, with what is known beforehand.
fn fit(rows: &[(Vector2<f64>, f64)], start: Vector2<f64>, prior: [f64; 2], sigma: f64) -> Vector2<f64> {
    let known = Matrix2::from_diagonal(&Vector2::from(prior.map(|sigma| sigma.powi(-2))));
    let mut slopes = start;
    for _ in 0..ROUNDS {
        let (mut matrix, mut right) = (known, known * start);
        for (of, value) in rows {
            let away = (value - of.dot(&slopes)) / (TUKEY * sigma);
            let weight = if away.abs() < 1.0 { (1.0 - away * away).powi(2) } else { 0.0 } / (sigma * sigma);
            matrix += of * of.transpose() * weight;
            right += of * (weight * value);
        }
        slopes = matrix.cholesky().map_or(start, |factor| factor.solve(&right));
    }
    slopes
}
