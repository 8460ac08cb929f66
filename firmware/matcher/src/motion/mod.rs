//! From one scan to the next: the odometry's step, or without one the last step again, and what it is worth.
//!
//! Frames: steps are in the base's frame, covariances in the map's axes. Units: meters, radians; stamps in
//! nanoseconds.

pub(crate) mod consistency;
pub(crate) mod innovation_gate;
pub(crate) mod odometry;
pub(crate) mod steadiness;

use nalgebra::{Matrix3, Vector3};

use crate::motion::consistency::{Consistency, Reading};
use crate::motion::odometry::{Odometry, StallWatch};
use crate::motion::steadiness::Steadiness;
use crate::parameter_group::parameter_group;
use crate::registration::covariance::rows;
use biplane_geometry::Pose2;
use biplane_geometry::covariance::compound;

parameter_group! { "motion";
/// How much the odometry's own motion is worth. Smaller: the match follows the odometry more; larger: it
/// follows the scans more, also where they say little (along a bare corridor).
#[derive(Copy, Clone, PartialEq, Debug)]
pub struct MotionParams {
    /// Standard deviation of position per meter driven, meters. Larger: less held by the odometry, as all of
    /// these.
    pub position_m_per_m: f64,
    /// Standard deviation of position per radian turned, meters.
    pub position_m_per_rad: f64,
    /// Standard deviation of heading per radian turned, radians.
    pub heading_rad_per_rad: f64,
    /// Standard deviation of heading per meter driven, radians.
    pub heading_rad_per_m: f64,
    /// A longer step of the odometry is a jump and not believed, meters. Smaller: dropped scans at speed look
    /// like jumps; larger: jumps cost a search.
    pub jump_m: f64,
    /// Standard deviation of position when a step is only guessed from the one before, meters. Larger: a
    /// wider search for every scan without odometry; smaller: a base that starts or stops suddenly is lost.
    pub unmeasured_m: f64 [1e-06, 100.0],
    /// Standard deviation of heading when a step is only guessed, radians. The same for turning.
    pub unmeasured_rad: f64 [1e-06, 10.0],
}
}

impl Default for MotionParams {
    fn default() -> Self {
        Self {
            position_m_per_m: 0.1,
            position_m_per_rad: 0.05,
            heading_rad_per_rad: 0.1,
            heading_rad_per_m: 0.05,
            jump_m: 3.0,
            unmeasured_m: 0.1,
            unmeasured_rad: 0.1,
        }
    }
}

/// Standard deviation of position that every step has, meters, or odometry that says nothing moved would rule
/// out every match. Larger: a base that stands is held less. Error 0.0246 m halved, 0.0292 m doubled.
const POSITION_FLOOR_M: f64 = 0.01;
/// Standard deviation of heading that every step has, radians. As the floor of the position. Error 0.0295 m
/// halved, 0.0250 m doubled.
const HEADING_FLOOR_RAD: f64 = 0.005;
/// A larger turn of the odometry in one step is a jump and not believed, radians: no base turns so far
/// between two scans. Error 0.0248 m also when halved or doubled.
const JUMP_RAD: f64 = 2.0;
/// A gap so many times the usual one means dropped scans.
const DROPPED: f64 = 1.5;
/// A guess is not stretched over more than this many scans.
const LONGEST_GUESS: f64 = 4.0;

/// Over longer ways the errors of wheels are independent of each other, meters.
const WALK_M: f64 = 0.25;
/// The same for turns, radians.
const WALK_RAD: f64 = 0.25;
/// Longer gaps between scans are a leap of the clock, seconds.
const LONGEST_GAP_S: f64 = 10.0;
/// Scans that come after less than this share of the mean gap come at once.
const AT_ONCE: f64 = 0.2;
/// What the newest scan counts for the share of those that come at once.
const DISORDER_RATE: f64 = 0.05;
/// Where more than this share of the scans come at once, their order is not sure: inertia foretells nothing.
const DISORDERED: f64 = 0.2;

/// What is expected of the next scan.
#[derive(Copy, Clone, PartialEq, Debug)]
pub(crate) struct Prediction {
    /// The step that is likeliest.
    pub step: Step,
    /// Another one that may be right instead.
    pub rival: Option<Step>,
    /// How far the motion may be from the last one.
    pub steadiness: Steadiness,
}

/// A step from the last scan's base to this one's.
#[derive(Copy, Clone, PartialEq, Debug)]
pub(crate) struct Step {
    /// `last_from_base`.
    pub last_from_base: Pose2,
    /// Standard deviations of x, y (m) and theta (rad) in the last base's frame.
    pub sigma: [f64; 3],
    /// Whether the odometry said so, or why not.
    pub odometry: Odometry,
}

impl Step {
    /// Whether the odometry said so.
    pub(crate) fn measured(&self) -> bool {
        matches!(self.odometry, Odometry::Used | Odometry::Reversed)
    }
}

/// What became of a scan's pose, for the next prediction.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
pub(crate) enum Found {
    /// The scan was matched in every direction.
    Surely,
    /// The pose follows the odometry, wholly or along a bare corridor.
    ByOdometry,
    /// It is only a guess.
    Guessed,
}

/// Remembers the last scan's odometry and step.
#[derive(Clone, Debug)]
pub(crate) struct MotionModel {
    /// Whether the odometry is weighed against inertia and against what scans have shown of it.
    weighs_odometry: bool,
    params: MotionParams,
    last_odom_from_base: Option<Pose2>,
    last_stamp_ns: Option<i64>,
    last_step: Pose2,
    usual_gap_s: Option<f64>,
    /// The same with stamps that repeat or step back: scans that come in bursts.
    mean_gap_s: Option<f64>,
    /// The share of the last scans whose stamps came at once with others, or stepped back.
    disorder: f64,
    stall: StallWatch,
    /// What scans have shown of the odometry.
    consistency: Consistency,
}

impl MotionModel {
    /// A model that has seen nothing.
    pub(crate) fn new(params: MotionParams) -> Self {
        Self {
            weighs_odometry: true,
            params,
            last_odom_from_base: None,
            last_stamp_ns: None,
            last_step: Pose2::IDENTITY,
            usual_gap_s: None,
            mean_gap_s: None,
            disorder: 0.0,
            stall: StallWatch::default(),
            consistency: Consistency::default(),
        }
    }

    /// The same, which takes each step of the odometry as it is: the paper's method knows nothing else.
    pub(crate) fn taking_odometry_as_it_is(params: MotionParams) -> Self {
        Self { weighs_odometry: false, ..Self::new(params) }
    }

    /// What is expected of a scan with this stamp and odometry.
    pub(crate) fn predict(&self, stamp_ns: i64, odom_from_base: Option<Pose2>) -> Prediction {
        let (again, steadiness) = (self.same_again(stamp_ns), Steadiness::after(self.mean_gap_s));
        let step = match self.measured(stamp_ns, odom_from_base) {
            Ok(step) => step,
            Err(odometry) => return Prediction { step: Step { odometry, ..again }, rival: None, steadiness },
        };
        let reading = self.consistency.reading();
        let inertia = self.inertia(stamp_ns, &step);
        let apart = step.last_from_base.between(&inertia.last_from_base);
        let is_worth = self.weighs_odometry && steadiness.is_worth() && self.disorder < DISORDERED;
        let rival = is_worth && steadiness.squared(&apart) > 1.0;
        if reading == Reading::Contradicted && is_worth {
            return Prediction {
                step: Step { odometry: Odometry::Contradicted, ..again },
                rival: rival.then_some(step),
                steadiness,
            };
        }
        Prediction { step, rival: rival.then_some(inertia), steadiness }
    }

    /// The odometry's step as it is to be read, or why there is none.
    fn measured(&self, stamp_ns: i64, odom_from_base: Option<Pose2>) -> Result<Step, Odometry> {
        let now = odom_from_base.ok_or(Odometry::Missing)?;
        if now.is_finite() && self.last_odom_from_base.is_none() {
            return Err(Odometry::Missing);
        }
        let step = self.plausible(self.gap_s(stamp_ns), odom_from_base).ok_or(Odometry::Jumped)?;
        if self.stall.holds(&now) {
            return Err(Odometry::Stalled);
        }
        let reading = self.consistency.reading();
        let [position, heading] = self.consistency.inflation();
        let [x_m, y_m, theta_rad] = self.odometry_sigma(&step);
        let (max_m, max_rad) = (self.params.unmeasured_m, self.params.unmeasured_rad);
        let sigma = [
            (x_m * position).min(x_m.max(max_m)),
            (y_m * position).min(y_m.max(max_m)),
            (theta_rad * heading).min(theta_rad.max(max_rad)),
        ];
        let odometry = if reading == Reading::Reversed { Odometry::Reversed } else { Odometry::Used };
        Ok(Step { last_from_base: reading.of(&step), sigma, odometry })
    }

    /// The odometry's step when a base can have made it in this time, seconds.
    fn plausible(&self, gap_s: Option<f64>, odom_from_base: Option<Pose2>) -> Option<Pose2> {
        let step = self.last_odom_from_base?.between(&odom_from_base?);
        let seconds = gap_s.map_or(1.0, |gap_s| gap_s.clamp(1.0, LONGEST_GAP_S));
        let leaps =
            step.distance_m() > seconds * self.params.jump_m || step.theta_rad.abs() > seconds * JUMP_RAD;
        (step.is_finite() && !leaps).then_some(step)
    }

    /// The last step again, longer when scans seem to have been dropped. Stamps that repeat, step back or
    /// jitter change nothing.
    pub(crate) fn same_again(&self, stamp_ns: i64) -> Step {
        let scale = match (self.gap_s(stamp_ns), self.usual_gap_s) {
            (Some(gap_s), Some(usual_s)) if gap_s > DROPPED * usual_s => (gap_s / usual_s).min(LONGEST_GUESS),
            _ => 1.0,
        };
        self.stretched(scale)
    }

    /// What inertia makes of a step that the odometry has measured: the last step again, stretched over a gap
    /// in the stamps only when that comes closer to the odometry. Stamps may leap where no scan is missing.
    pub(crate) fn inertia(&self, stamp_ns: i64, measured: &Step) -> Step {
        let off_m = |step: &Step| step.last_from_base.between(&measured.last_from_base).distance_m();
        let (once, stretched) = (self.stretched(1.0), self.same_again(stamp_ns));
        if off_m(&stretched) < off_m(&once) { stretched } else { once }
    }

    fn stretched(&self, scale: f64) -> Step {
        let Pose2 { x_m, y_m, theta_rad } = self.last_step;
        let position_m = scale * self.params.unmeasured_m;
        Step {
            last_from_base: Pose2::new(x_m * scale, y_m * scale, theta_rad * scale),
            sigma: [position_m, position_m, scale * self.params.unmeasured_rad],
            odometry: Odometry::Missing,
        }
    }

    /// Takes note of where the scan was found in the end. What is only a guess is worth less and less as a
    /// guess for the next one.
    pub(crate) fn update(
        &mut self,
        stamp_ns: i64,
        odom_from_base: Option<Pose2>,
        (map_from_last, map_from_base): (&Pose2, &Pose2),
        found: Found,
    ) {
        let gap_s = self.gap_s(stamp_ns);
        if let Some(gap_s) = gap_s {
            let usual_s = self.usual_gap_s.unwrap_or(gap_s);
            self.usual_gap_s = Some(usual_s + 0.1 * (gap_s.min(2.0 * usual_s) - usual_s));
        }
        if let Some(last_ns) = self.last_stamp_ns {
            let gap_s = (stamp_ns.saturating_sub(last_ns) as f64 * 1e-9).clamp(0.0, LONGEST_GAP_S);
            let mean_s = self.mean_gap_s.unwrap_or(gap_s);
            self.mean_gap_s = Some(mean_s + 0.1 * (gap_s - mean_s));
            let is_odd = gap_s < AT_ONCE * mean_s;
            self.disorder += DISORDER_RATE * (f64::from(u8::from(is_odd)) - self.disorder);
        }
        self.last_stamp_ns = Some(stamp_ns);
        if let (Some(step), Found::Surely, true) =
            (self.plausible(gap_s, odom_from_base), found, self.weighs_odometry)
        {
            let sigma = self.odometry_sigma(&step);
            let matched = map_from_last.between(map_from_base);
            self.consistency.compare(&step, sigma, &matched);
        } else {
            self.consistency.fade();
        }
        self.last_odom_from_base = odom_from_base.filter(Pose2::is_finite);
        match self.last_odom_from_base {
            Some(odom) if found == Found::Surely => {
                self.stall.matched(&odom, map_from_base);
            }
            _ => self.stall.unmatched(),
        }
        let worth = if found == Found::Guessed { 0.5 } else { 1.0 };
        let step = map_from_last.between(map_from_base);
        let Pose2 { x_m, y_m, theta_rad } = step;
        self.last_step = Pose2::new(worth * x_m, worth * y_m, worth * theta_rad);
    }

    /// Seconds since the last scan; `None` when the stamp repeats, steps back or is missing.
    fn gap_s(&self, stamp_ns: i64) -> Option<f64> {
        let gap_ns = stamp_ns.checked_sub(self.last_stamp_ns?)?;
        (gap_ns > 0).then_some(gap_ns as f64 * 1e-9)
    }

    fn odometry_sigma(&self, step: &Pose2) -> [f64; 3] {
        let p = &self.params;
        let (driven_m, turned_rad) =
            (walked(step.distance_m(), WALK_M), walked(step.theta_rad.abs(), WALK_RAD));
        let position_m = POSITION_FLOOR_M + p.position_m_per_m * driven_m + p.position_m_per_rad * turned_rad;
        let heading_rad =
            HEADING_FLOOR_RAD + p.heading_rad_per_rad * turned_rad + p.heading_rad_per_m * driven_m;
        [position_m, position_m, heading_rad]
    }
}

/// What a way counts: errors of wheels add up like a random walk over ways longer than `from`.
fn walked(way: f64, from: f64) -> f64 {
    if way > from { (way * from).sqrt() } else { way }
}

/// Covariance (x, y, theta; map's axes) after a step from a pose with this covariance.
pub(crate) fn propagate(covariance: &Matrix3<f64>, map_from_last: &Pose2, step: &Step) -> Matrix3<f64> {
    let noise = Matrix3::from_diagonal(&Vector3::from(step.sigma.map(|sigma| sigma * sigma)));
    let sum = compound(map_from_last, &rows(covariance), &step.last_from_base, &rows(&noise));
    Matrix3::from_fn(|row, column| sum[row][column])
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::FRAC_PI_2;

    const STEP: Pose2 = Pose2::new(0.1, 0.0, 0.05);
    const S: i64 = 1_000_000_000;

    fn after_steps(stamps_ns: &[i64]) -> MotionModel {
        let mut model = MotionModel::new(MotionParams::default());
        for stamp_ns in stamps_ns {
            model.update(*stamp_ns, None, (&Pose2::IDENTITY, &STEP), Found::Surely);
        }
        model
    }

    #[test]
    fn odometry_gives_its_own_step_and_more_noise_the_longer_it_is() {
        let mut model = MotionModel::new(MotionParams::default());
        let still = (&Pose2::IDENTITY, &Pose2::IDENTITY);
        model.update(0, Some(Pose2::new(5.0, 5.0, FRAC_PI_2)), still, Found::Surely);
        let short = model.predict(S, Some(Pose2::new(5.0, 5.1, FRAC_PI_2))).step;
        assert!(short.measured() && (short.last_from_base.x_m - 0.1).abs() < 1e-12);
        let long = model.predict(S, Some(Pose2::new(5.0, 6.0, FRAC_PI_2))).step;
        assert!((0..3).all(|i| long.sigma[i] > short.sigma[i]));
    }

    #[test]
    fn a_jump_or_no_number_counts_as_no_odometry() {
        let mut model = after_steps(&[0, S]);
        model.update(2 * S, Some(Pose2::IDENTITY), (&Pose2::IDENTITY, &STEP), Found::Surely);
        for (odom, state) in [
            (None, Odometry::Missing),
            (Some(Pose2::new(50.0, 0.0, 0.0)), Odometry::Jumped),
            (Some(Pose2::new(0.0, 0.0, 3.0)), Odometry::Jumped),
            (Some(Pose2::new(f64::NAN, 0.0, 0.0)), Odometry::Jumped),
        ] {
            let step = model.predict(3 * S, odom).step;
            assert_eq!((step.last_from_base, step.odometry), (STEP, state));
        }
    }

    #[test]
    fn a_gap_of_two_scans_doubles_the_guess_and_odd_stamps_leave_it() {
        let model = after_steps(&[0, S, 2 * S, 3 * S]);
        assert!((model.same_again(5 * S).last_from_base.x_m - 0.2).abs() < 1e-9);
        for stamp_ns in [4 * S, 3 * S, 0, i64::MIN] {
            assert_eq!(model.same_again(stamp_ns).last_from_base, STEP, "{stamp_ns}");
        }
        let far = model.same_again(i64::MAX).last_from_base;
        assert!((far.x_m - 0.4).abs() < 1e-9, "never more than four steps: {far:?}");
    }

    #[test]
    fn inertia_bridges_dropped_scans_but_not_a_leap_of_the_stamps_alone() {
        let model = after_steps(&[0, S, 2 * S]);
        for (driven_m, expected_m) in [(0.19, 0.2), (0.11, 0.1)] {
            let last_from_base = Pose2::new(driven_m, 0.0, 0.0);
            let measured = Step { last_from_base, sigma: [0.01; 3], odometry: Odometry::Used };
            assert!((model.inertia(4 * S, &measured).last_from_base.x_m - expected_m).abs() < 1e-9);
        }
    }

    #[test]
    fn a_guess_that_was_not_confirmed_fades() {
        let mut model = after_steps(&[0]);
        model.update(S, None, (&Pose2::IDENTITY, &STEP), Found::Guessed);
        assert_eq!(model.same_again(2 * S).last_from_base.x_m, 0.05);
    }

    #[test]
    fn heading_noise_becomes_noise_across_the_way_driven() {
        let step =
            Step { last_from_base: Pose2::new(2.0, 0.0, 0.0), sigma: [0.0; 3], odometry: Odometry::Used };
        let before = Matrix3::from_diagonal(&Vector3::new(0.0, 0.0, 0.01));
        // Looking along y and driving 2 m: sigma 0.1 rad is 0.2 m along x.
        let after = propagate(&before, &Pose2::new(0.0, 0.0, FRAC_PI_2), &step);
        assert!((after[(0, 0)] - 0.04).abs() < 1e-12 && after[(1, 1)].abs() < 1e-12, "{after}");
        assert!((after[(0, 2)] + 0.02).abs() < 1e-12 && (after[(2, 2)] - 0.01).abs() < 1e-12, "{after}");
    }

    #[test]
    fn noise_ahead_turns_with_the_base() {
        let step = Step { last_from_base: Pose2::IDENTITY, sigma: [0.3, 0.1, 0.0], odometry: Odometry::Used };
        let after = propagate(&Matrix3::zeros(), &Pose2::new(0.0, 0.0, FRAC_PI_2), &step);
        assert!((after[(0, 0)] - 0.01).abs() < 1e-12 && (after[(1, 1)] - 0.09).abs() < 1e-12, "{after}");
    }
}
