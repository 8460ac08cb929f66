//! From one scan to the next: the odometry's step, or without one the last step again, and what it is worth.
//!
//! Frames: steps are in the base's frame, covariances in the map's axes. Units: meters, radians; stamps in
//! nanoseconds.

pub(crate) mod cadence;
pub(crate) mod consistency;
pub(crate) mod innovation_gate;
pub(crate) mod leap_record;
pub(crate) mod leaps;
pub(crate) mod odometry;
pub(crate) mod odometry_scale;
pub(crate) mod params;
pub(crate) mod propagation;
pub(crate) mod steadiness;

use crate::motion::cadence::{Cadence, LONGEST_GAP_S};
use crate::motion::consistency::{Consistency, Reading};
use crate::motion::leap_record::LeapRecord;
use crate::motion::leaps::LeapWatch;
use crate::motion::odometry::{Odometry, StallWatch};
use crate::motion::odometry_scale::{OdometryScale, ScaleWatch};
use crate::motion::params::MotionParams;
use crate::motion::steadiness::Steadiness;
use biplane_geometry::Pose2;

/// Standard deviation of position that every step has, meters, or odometry that says nothing moved would rule
/// out every match. Larger: a base that stands is held less. Error 0.0246 m halved, 0.0292 m doubled.
const POSITION_FLOOR_M: f64 = 0.01;
/// Standard deviation of heading that every step has, radians. As the floor of the position. Error 0.0295 m
/// halved, 0.0250 m doubled.
const HEADING_FLOOR_RAD: f64 = 0.005;
/// A larger turn of the odometry in one step is a jump and not believed, radians: no base turns so far
/// between two scans. Error 0.0248 m also when halved or doubled.
const JUMP_RAD: f64 = 2.0;

/// Over longer ways the errors of wheels are independent of each other, meters.
const WALK_M: f64 = 0.25;
/// The same for turns, radians.
const WALK_RAD: f64 = 0.25;

/// What is expected of the next scan.
#[derive(Copy, Clone, PartialEq, Debug)]
pub(crate) struct Prediction {
    /// The step that is likeliest.
    pub step: Step,
    /// Another one that may be right instead.
    pub rival: Option<Step>,
    /// How far the motion may be from the last one.
    pub steadiness: Steadiness,
    /// Natural logarithm of the odds that the base has not made the odometry's step: where the rival is there
    /// only because the odometry leaps.
    pub odds_against_leap: Option<f64>,
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
    /// The scan was matched, but for the way along a bare corridor, which follows the odometry.
    ButForTheWay,
    /// The pose follows the odometry.
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
    last_step: Pose2,
    cadence: Cadence,
    stall: StallWatch,
    leaps: LeapWatch,
    /// How its leaps turned out.
    leap_record: LeapRecord,
    /// What scans have shown of the odometry.
    consistency: Consistency,
    /// What a meter and a radian of it truly are.
    scale: ScaleWatch,
    /// How long no scan has shown the way that the base has come, seconds.
    unshown_s: f64,
}

impl MotionModel {
    /// A model that has seen nothing.
    pub(crate) fn new(params: MotionParams) -> Self {
        Self {
            weighs_odometry: true,
            params,
            last_odom_from_base: None,
            last_step: Pose2::IDENTITY,
            cadence: Cadence::default(),
            stall: StallWatch::default(),
            leaps: LeapWatch::default(),
            leap_record: LeapRecord::default(),
            consistency: Consistency::default(),
            scale: ScaleWatch::default(),
            unshown_s: 0.0,
        }
    }

    /// The same, which takes each step of the odometry as it is: the paper's method knows nothing else.
    pub(crate) fn taking_odometry_as_it_is(params: MotionParams) -> Self {
        Self { weighs_odometry: false, ..Self::new(params) }
    }

    /// What is expected of a scan with this stamp and odometry.
    pub(crate) fn predict(&self, stamp_ns: i64, odom_from_base: Option<Pose2>) -> Prediction {
        let (again, steadiness) = (self.same_again(stamp_ns), Steadiness::after(self.cadence.mean_gap_s()));
        let alone = |step: Step| Prediction { step, rival: None, steadiness, odds_against_leap: None };
        let step = match self.measured(stamp_ns, odom_from_base) {
            Ok(step) => step,
            Err(odometry) => return alone(Step { odometry, ..again }),
        };
        let inertia = self.inertia(stamp_ns, &step.last_from_base);
        let squared = steadiness.squared(&step.last_from_base.between(&inertia.last_from_base));
        let is_disordered = self.cadence.is_disordered();
        let may_speak = !is_disordered
            || self.leaps.is_leaping(&step.last_from_base, &inertia.last_from_base, &steadiness);
        if !(self.weighs_odometry && steadiness.is_worth() && may_speak) || self.is_all_there_is() {
            return alone(step);
        }
        let odds_against_leap = is_disordered.then(|| self.leap_record.odds_against(squared));
        let (step, rival) = match self.consistency.reading() {
            Reading::Contradicted => (Step { odometry: Odometry::Contradicted, ..again }, step),
            Reading::AsIs | Reading::Reversed => (step, inertia),
        };
        Prediction { step, rival: (squared > 1.0).then_some(rival), steadiness, odds_against_leap }
    }

    /// Whether scans have contradicted this odometry, but have shown nothing for so long that inertia
    /// foretells less than it does.
    fn is_all_there_is(&self) -> bool {
        let since_s = self.cadence.mean_gap_s().map(|gap_s| gap_s + self.unshown_s);
        self.consistency.reading() == Reading::Contradicted && !Steadiness::after(since_s).is_worth()
    }

    /// The odometry's step as it is to be read, or why there is none.
    fn measured(&self, stamp_ns: i64, odom_from_base: Option<Pose2>) -> Result<Step, Odometry> {
        let now = odom_from_base.ok_or(Odometry::Missing)?;
        if now.is_finite() && self.last_odom_from_base.is_none() {
            return Err(Odometry::Missing);
        }
        let step = self.plausible(self.cadence.gap_s(stamp_ns), odom_from_base).ok_or(Odometry::Jumped)?;
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
        Ok(Step { last_from_base: self.read(&step), sigma, odometry })
    }

    /// The odometry's step in true meters and radians, with the right sign.
    fn read(&self, step: &Pose2) -> Pose2 {
        self.consistency.reading().of(&self.scale.scale().of(step))
    }

    /// Whether hardly any step of the odometry has been wrong lately.
    pub(crate) fn is_reliable(&self) -> bool {
        self.consistency.is_reliable()
    }

    /// So many scans usually come in the time since the last one, 1 to 4.
    pub(crate) fn scans_since_last(&self, stamp_ns: i64) -> f64 {
        self.cadence.scans_since_last(stamp_ns)
    }

    /// What scans have shown of the odometry's scales.
    pub(crate) fn odometry_scale(&self) -> OdometryScale {
        self.scale.scale()
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
        self.stretched(self.cadence.steps_to_guess(stamp_ns))
    }

    /// What inertia makes of a step that the odometry has measured: the last step again, stretched over a
    /// gap in the stamps only when that comes closer to the odometry, or when that has leapt far from both.
    /// Stamps may leap where no scan is missing, and where they come in bursts they always do.
    pub(crate) fn inertia(&self, stamp_ns: i64, measured: &Pose2) -> Step {
        let (once, stretched) = (self.stretched(1.0), self.same_again(stamp_ns));
        let off = [&once, &stretched].map(|step| step.last_from_base.between(measured));
        let steadiness = Steadiness::after(self.cadence.mean_gap_s());
        let has_leapt = off.iter().all(|off| steadiness.is_sudden(off));
        let is_late = has_leapt || off[1].distance_m() < off[0].distance_m();
        if is_late { stretched } else { once }
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

    /// Takes note of where the scan was found in the end. What has been done while scans were dropped is
    /// shared out among them, or the next gap would stretch it once more. What is only a guess is worth less
    /// and less as a guess for the next one.
    pub(crate) fn update(
        &mut self,
        stamp_ns: i64,
        odom_from_base: Option<Pose2>,
        (map_from_last, map_from_base): (&Pose2, &Pose2),
        found: Found,
    ) {
        let gap_s = self.cadence.gap_s(stamp_ns);
        let odometry_step = self.plausible(gap_s, odom_from_base);
        self.watch_for_leaps(stamp_ns, odometry_step.as_ref());
        let is_matched = matches!(found, Found::Surely | Found::ButForTheWay);
        let passed_s = gap_s.unwrap_or(0.0).min(LONGEST_GAP_S);
        self.unshown_s = if found == Found::Surely { 0.0 } else { self.unshown_s + passed_s };
        let worth = match found {
            Found::Guessed => 0.5 / self.cadence.steps_to_guess(stamp_ns),
            _ => 1.0 / self.cadence.steps_since_last(stamp_ns),
        };
        self.cadence.note(stamp_ns);
        if let (Some(step), Found::Surely, true) = (odometry_step, found, self.weighs_odometry) {
            let sigma = self.odometry_sigma(&step);
            let matched = map_from_last.between(map_from_base);
            self.consistency.compare(&self.scale.scale().of(&step), sigma, &matched);
            self.learn_scale(&step, &matched, odom_from_base);
        } else {
            self.consistency.fade();
            self.scale.interrupt();
        }
        self.last_odom_from_base = odom_from_base.filter(Pose2::is_finite);
        match self.last_odom_from_base {
            Some(odom) if is_matched => {
                self.stall.matched(&odom, map_from_base, found == Found::Surely);
            }
            _ => self.stall.unmatched(),
        }
        let step = map_from_last.between(map_from_base);
        let Pose2 { x_m, y_m, theta_rad } = step;
        self.last_step = Pose2::new(worth * x_m, worth * y_m, worth * theta_rad);
    }

    /// Compares a step of the odometry with the matched one, unless it is known to be wrong.
    fn learn_scale(&mut self, step: &Pose2, matched: &Pose2, odom_from_base: Option<Pose2>) {
        let is_stalled = odom_from_base.is_some_and(|odom| self.stall.holds(&odom));
        let reading = self.consistency.reading();
        if is_stalled || reading == Reading::Contradicted {
            self.scale.interrupt();
        } else {
            self.scale.compare(&reading.of(step), matched);
        }
    }

    /// Takes note of a leap of the odometry, of its size, squared, and of whether a scan has shown that the
    /// base made it.
    pub(crate) fn note_leap(&mut self, squared: f64, was_made: bool) {
        self.leap_record.note(squared, was_made);
    }

    fn watch_for_leaps(&mut self, stamp_ns: i64, odometry_step: Option<&Pose2>) {
        let Some(step) = odometry_step.map(|step| self.read(step)) else {
            self.leaps.missed();
            return;
        };
        let inertia = self.inertia(stamp_ns, &step).last_from_base;
        self.leaps.update(&step, &inertia, &Steadiness::after(self.cadence.mean_gap_s()));
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
    fn contradicted_odometry_is_read_again_once_no_scan_has_shown_the_way_for_long() {
        for found in [Found::Guessed, Found::ButForTheWay] {
            let mut model = MotionModel::new(MotionParams::default());
            let odom = |i: i64| Some(Pose2::new(0.0, 0.2 * i as f64, 0.0));
            let at = |i: i64| Pose2::new(0.1 * i as f64, 0.0, 0.0);
            (0..10).for_each(|i| model.update(i * S / 5, odom(i), (&at(i - 1), &at(i)), Found::Surely));
            let mut read = |i: i64| {
                let step = model.predict(i * S / 5, odom(i)).step;
                model.update(i * S / 5, odom(i), (&at(i - 1), &at(i)), found);
                step.odometry
            };
            let seconds: Vec<Odometry> = (10..20).map(&mut read).collect();
            assert_eq!(seconds[..5], [Odometry::Contradicted; 5], "{found:?}");
            assert_eq!(seconds[7..], [Odometry::Used; 3], "{found:?}");
        }
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
    fn a_gap_of_two_scans_doubles_the_guess() {
        let model = after_steps(&[0, S, 2 * S, 3 * S]);
        assert!((model.same_again(5 * S).last_from_base.x_m - 0.2).abs() < 1e-9);
        assert!((model.same_again(i64::MAX).last_from_base.x_m - 0.4).abs() < 1e-9, "and no more than four");
        assert_eq!(model.same_again(4 * S).last_from_base, STEP);
    }

    #[test]
    fn what_was_done_in_a_gap_is_no_step_from_scan_to_scan() {
        let mut model = after_steps(&[0, S, 2 * S, 3 * S]);
        let gone = Pose2::new(0.3, 0.0, 0.15);
        model.update(6 * S, None, (&Pose2::IDENTITY, &gone), Found::Surely);
        let again = model.same_again(7 * S).last_from_base;
        assert!((again.x_m - 0.1).abs() < 1e-9 && (again.theta_rad - 0.05).abs() < 1e-9, "{again:?}");
        let (bursts, _) = in_bursts();
        assert_eq!(bursts.same_again(14 * S).last_from_base, STEP, "their gaps say nothing");
    }

    #[test]
    fn inertia_bridges_dropped_scans_but_not_a_leap_of_the_stamps_alone() {
        let model = after_steps(&[0, S, 2 * S]);
        // Odometry that has leapt says nothing of the gap, and the stamps count.
        for (driven_m, expected_m) in [(0.19, 0.2), (0.11, 0.1), (4.0, 0.2), (-4.0, 0.2)] {
            let inertia = model.inertia(4 * S, &Pose2::new(driven_m, 0.0, 0.0));
            assert!((inertia.last_from_base.x_m - expected_m).abs() < 1e-9);
        }
    }

    /// Scans that come in pairs, half a second apart, of a base that goes ahead by `STEP` with each; and the
    /// last pose of its odometry.
    fn in_bursts() -> (MotionModel, Pose2) {
        let mut model = MotionModel::new(MotionParams::default());
        let mut odom_from_base = Pose2::IDENTITY;
        for number in 0..40 {
            odom_from_base = odom_from_base * STEP;
            let stamp_ns = number / 2 * S / 2;
            model.update(stamp_ns, Some(odom_from_base), (&Pose2::IDENTITY, &STEP), Found::Surely);
        }
        (model, odom_from_base)
    }

    #[test]
    fn in_bursts_inertia_speaks_against_odometry_that_leaps_and_not_against_a_match_that_did() {
        let (mut model, last) = in_bursts();
        let next = last * STEP;
        let leaping = model.predict(12 * S, Some(last * Pose2::new(1.1, 0.0, 0.05)));
        let rival = leaping.rival.map(|rival| rival.last_from_base);
        assert_eq!(rival, Some(STEP), "the stamps of bursts stretch nothing");
        let at_first = leaping.odds_against_leap;
        assert!(at_first.is_some_and(|odds| odds < 0.0), "the odometry is believed at first: {at_first:?}");
        assert_eq!(model.predict(12 * S, Some(next)).rival, None);
        // A match that follows something that moves: the odometry goes on as before.
        let astray = Pose2::new(0.5, 0.0, 0.05);
        model.update(10 * S, Some(next), (&Pose2::IDENTITY, &astray), Found::Surely);
        assert_eq!(model.predict(10 * S, Some(next * STEP)).rival, None);
    }

    #[test]
    fn what_scans_have_shown_of_leaps_counts_for_the_next_one_of_that_size() {
        let (mut model, last) = in_bursts();
        let leap = Pose2::new(1.1, 0.0, 0.05);
        let squared = Steadiness::after(model.cadence.mean_gap_s()).squared(&leap.between(&STEP));
        let smaller = Pose2::new(0.4, 0.0, 0.05);
        let odds_of =
            |model: &MotionModel, step: Pose2| model.predict(12 * S, Some(last * step)).odds_against_leap;
        let before = odds_of(&model, smaller);
        (0..5).for_each(|_| model.note_leap(squared, false));
        assert!(odds_of(&model, leap).is_some_and(|odds| odds > 1.0), "{model:?}");
        assert_eq!(odds_of(&model, smaller), before);
    }

    #[test]
    fn a_guess_that_was_not_confirmed_fades() {
        let mut model = after_steps(&[0]);
        model.update(S, None, (&Pose2::IDENTITY, &STEP), Found::Guessed);
        assert_eq!(model.same_again(2 * S).last_from_base.x_m, 0.05);
    }
}
