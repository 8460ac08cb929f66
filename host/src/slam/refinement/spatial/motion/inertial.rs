//! What an inertial unit says of tilt and heading: turns from knot to knot, and which way is up.
//!
//! What it shows while the robot stands at the start, where the ground is taken as level, is its bias; what
//! is left of that is a part of the solution. Accelerations are those of gravity once what the wheels tell of
//! speeding up and of curves is taken off.

use crate::slam::refinement::spatial::knots::{Knots, State};
use crate::slam::refinement::spatial::motion::inertial_samples::InertialSample;
use crate::slam::refinement::spatial::motion::wheels::Wheels;
use crate::slam::refinement::spatial::normal_equations::rows::Rows;
use crate::slam::refinement::spatial::normal_equations::{Layout, robust};
use biplane_geometry::PortableMath;

/// Samples between two knots, at least.
const SAMPLES: usize = 3;
/// Knots over which up is averaged: speeds that are counted in whole ticks say little of shorter times.
const SPAN: usize = 5;
/// The robot has stood long enough to tell the biases after so many knots.
const REST: usize = 3;
/// A unit that shows more tilt at rest is not mounted as the rig says, radians.
const MOUNT_RAD: f64 = 0.26;
const GRAVITY_M_S2: f64 = 9.806_65;

/// Turns: noise for the root of a second, share of a turn (scale), both radians; MEMS units are better.
const TURN_RAD: f64 = 3.5e-4;
const TURN_SHARE: f64 = 0.005;
/// Up over one span: what wheels do not tell of accelerations, radians; and a kernel, in standard deviations.
const UP_RAD: f64 = 1.7e-3;
const UP_KERNEL: f64 = 3.0;
/// Biases that were seen at rest wander by so much, and what they may be where the robot never stood: rad/s
/// and radians.
const TURN_BIAS: [f64; 2] = [1.7e-4, 9e-3];
const UP_BIAS_RAD: [f64; 2] = [7e-4, 0.026];
/// So many spans one after the other lean on average by so much, or by so many times what the bias may be: a
/// ramp.
const RAMP_SPANS: usize = 6;
const RAMP_RAD: f64 = 0.0175;
const RAMP_BIASES: f64 = 4.0;

/// Which way up is, over a span of knots.
#[derive(Clone, Copy, Debug)]
struct Up {
    first: usize,
    /// Roll and pitch on average.
    tilt_rad: [f64; 2],
    sigma_rad: [f64; 2],
}

/// See the module's text.
#[derive(Clone, Debug)]
pub(crate) struct Inertial {
    /// From each knot to the next, about the axes of the base, radians.
    turns: Vec<Option<[f64; 3]>>,
    ups: Vec<Up>,
    /// Standard deviations of what is left of the biases.
    turn_bias_rad_s: f64,
    up_bias_rad: f64,
}

/// Means over the samples between two knots.
#[derive(Clone, Copy, Debug)]
struct Mean {
    turn_rad_s: [f64; 3],
    force_m_s2: [f64; 3],
    /// Variance of the mean acceleration.
    variance: [f64; 3],
}

/// What is left of the biases: of turn rates (rad/s), and of roll and pitch (radians).
pub(crate) type Biases = [[f64; 3]; 2];

impl Inertial {
    /// Of samples in the order of their stamps; `None` where they cover less than nine tenths of the way, or
    /// the unit is not mounted as the rig says.
    pub(crate) fn of(samples: &[InertialSample], knots: &Knots, wheels: &Wheels) -> Option<Self> {
        let means = means(samples, knots);
        if 10 * means.iter().flatten().count() < 9 * means.len() {
            return None;
        }
        let rest = Rest::of(&means, wheels);
        let [roll, pitch] = tilt_of(rest.force_m_s2, [0.0; 2]);
        if roll.abs().max(pitch.abs()) > MOUNT_RAD {
            return None;
        }
        let step_s = knots.step_s();
        let turn = |mean: &Option<Mean>| {
            mean.map(|mean| {
                std::array::from_fn(|axis| step_s * (mean.turn_rad_s[axis] - rest.turn_rad_s[axis]))
            })
        };
        let up = |first: usize| up(&means[first..first + SPAN], first, wheels, step_s, [roll, pitch]);
        let last = (means.len() + 1).saturating_sub(SPAN);
        Some(Self {
            turns: means.iter().map(turn).collect(),
            ups: (0..last).step_by(SPAN).filter_map(up).collect(),
            turn_bias_rad_s: TURN_BIAS[usize::from(!rest.is_seen)],
            up_bias_rad: UP_BIAS_RAD[usize::from(!rest.is_seen)],
        })
    }

    /// Whether it tells of a slope.
    pub(crate) fn reports_slope(&self) -> bool {
        let limit_rad = RAMP_RAD.max(RAMP_BIASES * self.up_bias_rad);
        let leans = |ups: &[Up]| {
            [0, 1].into_iter().any(|part| {
                let mean = ups.iter().map(|up| up.tilt_rad[part]).sum::<f64>() / ups.len() as f64;
                let sigma = (ups.iter().map(|up| up.sigma_rad[part].powi(2)).sum::<f64>()).sqrt();
                mean.abs() > limit_rad.max(RAMP_BIASES * sigma / ups.len() as f64)
            })
        };
        self.ups.windows(RAMP_SPANS).any(leans)
    }

    /// How roll and pitch go on from a knot to the next.
    pub(crate) fn tilted(&self, state: &State, knot: usize) -> [f64; 2] {
        match self.turns[knot] {
            Some(turn) => {
                let [roll, pitch, _] = angle_steps(state, turn);
                [state[3] + roll, state[4] + pitch]
            }
            None => [state[3], state[4]],
        }
    }

    /// What it says of the knots `first..first + layout.knots`.
    pub(crate) fn rows(&self, knots: &Knots, first: usize, layout: Layout, biases: &Biases, rows: &mut Rows) {
        let step_s = knots.step_s();
        for knot in 0..layout.knots - 1 {
            let Some(turn) = self.turns[first + knot] else { continue };
            let (a, b) = (&knots.states[first + knot], &knots.states[first + knot + 1]);
            let middle: State = std::array::from_fn(|part| 0.5 * (a[part] + b[part]));
            let turned = std::array::from_fn(|axis| turn[axis] - step_s * biases[0][axis]);
            let steps = angle_steps(&middle, turned);
            let one = [layout.tilt(knot), layout.tilt(knot), layout.flat(knot)];
            for (axis, (part, at)) in [(3, 1), (4, 2), (5, 2)].into_iter().enumerate() {
                let sigma = (TURN_RAD * step_s.sqrt()).portable_hypot(TURN_SHARE * turn[axis]);
                let [mut back, mut ahead, mut bias] = [[0.0; 3]; 3];
                (back[at], ahead[at], bias[axis]) = (-1.0, 1.0, step_s);
                let parts = [(one[axis], back), (one[axis] + 2, ahead), (layout.extra(0), bias)];
                rows.push(&parts, b[part] - a[part] - steps[axis], sigma.powi(-2));
            }
        }
        let end = first + layout.knots;
        for up in self.ups.iter().filter(|up| up.first >= first && up.first + SPAN < end) {
            self.up_rows(up, knots, first, layout, biases, rows);
        }
        for (extra, sigma) in [self.turn_bias_rad_s, self.up_bias_rad].into_iter().enumerate() {
            for axis in 0..3 {
                let mut direction = [0.0; 3];
                direction[axis] = 1.0;
                rows.push(&[(layout.extra(extra), direction)], biases[extra][axis], sigma.powi(-2));
            }
        }
    }

    fn up_rows(
        &self,
        up: &Up,
        knots: &Knots,
        first: usize,
        layout: Layout,
        biases: &Biases,
        rows: &mut Rows,
    ) {
        for part in 0..2 {
            let mut bias = [0.0; 3];
            bias[part] = 1.0;
            let (mut parts, mut mean_rad) = ([(layout.extra(1), bias); SPAN + 2], 0.0);
            for (knot, of_knot) in parts[..=SPAN].iter_mut().enumerate() {
                let share = if knot == 0 || knot == SPAN { 0.5 } else { 1.0 } / SPAN as f64;
                let mut direction = [0.0; 3];
                direction[1 + part] = share;
                mean_rad += share * knots.states[up.first + knot][3 + part];
                *of_knot = (layout.tilt(up.first + knot - first), direction);
            }
            let residual = mean_rad + biases[1][part] - up.tilt_rad[part];
            let sigma = up.sigma_rad[part];
            rows.push(&parts, residual, robust(residual, UP_KERNEL * sigma) / (sigma * sigma));
        }
    }
}

/// What the unit shows while the robot stands at the start.
struct Rest {
    turn_rad_s: [f64; 3],
    force_m_s2: [f64; 3],
    /// Whether it stood long enough.
    is_seen: bool,
}

impl Rest {
    fn of(means: &[Option<Mean>], wheels: &Wheels) -> Self {
        let standing: Vec<Mean> =
            (0..means.len()).take_while(|&knot| wheels.stands(knot)).filter_map(|knot| means[knot]).collect();
        if standing.len() < REST {
            return Self { turn_rad_s: [0.0; 3], force_m_s2: [0.0, 0.0, GRAVITY_M_S2], is_seen: false };
        }
        let mean =
            |value: &dyn Fn(&Mean) -> f64| standing.iter().map(value).sum::<f64>() / standing.len() as f64;
        Self {
            turn_rad_s: std::array::from_fn(|axis| mean(&|mean| mean.turn_rad_s[axis])),
            force_m_s2: std::array::from_fn(|axis| mean(&|mean| mean.force_m_s2[axis])),
            is_seen: true,
        }
    }
}

/// Means over the samples between knots.
fn means(samples: &[InertialSample], knots: &Knots) -> Vec<Option<Mean>> {
    let at = |knot: usize| {
        let stamp_ns = knots.start_ns + knot as i64 * knots.step_ns;
        samples.partition_point(|sample| sample.stamp_ns < stamp_ns)
    };
    let between = |knot: usize| {
        let own = &samples[at(knot)..at(knot + 1)];
        (own.len() >= SAMPLES).then(|| {
            let count = own.len() as f64;
            let mean = |value: &dyn Fn(&InertialSample) -> f64| own.iter().map(value).sum::<f64>() / count;
            let force_m_s2: [f64; 3] = std::array::from_fn(|axis| mean(&|sample| sample.force_m_s2[axis]));
            let square = |axis: usize| {
                mean(&|sample| (sample.force_m_s2[axis] - force_m_s2[axis]).powi(2)) / (count - 1.0)
            };
            Mean {
                turn_rad_s: std::array::from_fn(|axis| mean(&|sample| sample.turn_rad_s[axis])),
                force_m_s2,
                variance: std::array::from_fn(square),
            }
        })
    };
    (0..knots.states.len() - 1).map(between).collect()
}

/// Up over a span that begins at a knot; `None` where samples are missing.
fn up(means: &[Option<Mean>], first: usize, wheels: &Wheels, step_s: f64, rest_rad: [f64; 2]) -> Option<Up> {
    let means: Vec<Mean> = means.iter().copied().collect::<Option<_>>()?;
    let mean = |value: &dyn Fn(&Mean) -> f64| means.iter().map(value).sum::<f64>() / SPAN as f64;
    let force_m_s2 = std::array::from_fn(|axis| mean(&|mean| mean.force_m_s2[axis]));
    let speed_m_s = |knot: usize| wheels.speed_m_s(knot, step_s);
    let ahead = (speed_m_s(first + SPAN) - speed_m_s(first)) / (SPAN as f64 * step_s);
    let left = (first..first + SPAN).map(|knot| wheels.curve_m_s2(knot, step_s)).sum::<f64>() / SPAN as f64;
    let [roll, pitch] = tilt_of(force_m_s2, [ahead, left]);
    let sigma = |axis: usize| {
        let noise = mean(&|mean| mean.variance[axis]) / SPAN as f64;
        (noise.sqrt() / GRAVITY_M_S2).portable_hypot(UP_RAD)
    };
    let tilt_rad = [roll - rest_rad[0], pitch - rest_rad[1]];
    Some(Up { first, tilt_rad, sigma_rad: [sigma(1), sigma(0)] })
}

/// Roll and pitch of a base that feels this acceleration while it speeds up ahead and to the left.
fn tilt_of([x, y, z]: [f64; 3], [ahead, left]: [f64; 2]) -> [f64; 2] {
    let (x, y) = (x - ahead, y - left);
    [y.portable_atan2(z), (-x).portable_atan2(y.portable_hypot(z))]
}

/// Steps of roll, pitch and heading for a small turn about the axes of the base.
fn angle_steps(state: &State, [x, y, z]: [f64; 3]) -> [f64; 3] {
    let ((sin, cos), pitch) = (state[3].portable_sin_cos(), state[4]);
    let about = y * sin + z * cos;
    [x + about * pitch.portable_tan(), y * cos - z * sin, about / pitch.portable_cos()]
}

#[cfg(test)]
mod tests {
    use super::{GRAVITY_M_S2, Inertial, angle_steps};
    use crate::recordings::deskew::Trajectory;
    use crate::slam::refinement::spatial::knots::Knots;
    use crate::slam::refinement::spatial::motion::inertial_samples::InertialSample;
    use crate::slam::refinement::spatial::motion::wheels::Wheels;
    use biplane_geometry::StampedPose;

    const SECONDS: i64 = 30;

    /// A drive straight ahead after two seconds of standing, whose ground rises after ten seconds.
    fn felt(rise_rad: f64, lean_rad: f64, bias_rad_s: f64) -> Option<Inertial> {
        let pose = |tenth: i64| StampedPose {
            stamp_ns: tenth * 100_000_000,
            x_m: 0.03 * (tenth - 20).max(0) as f64,
            ..StampedPose::default()
        };
        let drive = Trajectory::new((0..=10 * SECONDS).map(pose).collect());
        let knots = Knots::of(&drive, 100_000_000, 1_000_000_000)?;
        let wheels = Wheels::new(&drive, &knots)?;
        let sample = |number: i64| {
            let pitch_rad = lean_rad - if number >= 1000 { rise_rad } else { 0.0 };
            let turn_rad_s = if number == 1000 { -rise_rad / 0.01 } else { 0.0 } + bias_rad_s;
            InertialSample {
                stamp_ns: number * 10_000_000 + 5_000_000,
                turn_rad_s: [0.0, turn_rad_s, 0.0],
                force_m_s2: [-pitch_rad.sin() * GRAVITY_M_S2, 0.0, pitch_rad.cos() * GRAVITY_M_S2],
            }
        };
        let samples: Vec<InertialSample> = (0..100 * SECONDS).map(sample).collect();
        Inertial::of(&samples, &knots, &wheels)
    }

    #[test]
    fn a_slope_is_reported_and_a_unit_that_leans_or_drifts_on_the_level_tells_none() {
        assert!(felt(0.1, 0.0, 0.0).is_some_and(|felt| felt.reports_slope()));
        assert!(felt(-0.1, 0.02, 0.01).is_some_and(|felt| felt.reports_slope()));
        for (lean_rad, bias_rad_s) in [(0.0, 0.0), (0.1, 0.01)] {
            assert!(felt(0.0, lean_rad, bias_rad_s).is_some_and(|felt| !felt.reports_slope()));
        }
        assert!(felt(0.1, 0.5, 0.0).is_none(), "it is not mounted as the rig says");
    }

    #[test]
    fn turns_without_the_bias_at_rest_tilt_the_next_knot() {
        let felt = felt(0.1, 0.0, 0.01).expect("there is enough");
        let [level, rises] = [50, 100].map(|knot| felt.tilted(&[0.0; 6], knot));
        assert!(level[1].abs() < 1e-9 && (rises[1] + 0.1).abs() < 1e-9, "{level:?} {rises:?}");
        // A turn about the vertical of the base, on a ramp, is one about the vertical but for its cosine.
        let steps = angle_steps(&[0.0, 0.0, 0.0, 0.0, 0.2, 0.0], [0.0, 0.0, 0.01]);
        assert!(
            (steps[0] - 0.01 * 0.2_f64.tan()).abs() < 1e-12
                && (steps[2] - 0.01 / 0.2_f64.cos()).abs() < 1e-12
        );
    }
}
