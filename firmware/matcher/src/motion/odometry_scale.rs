//! What a meter and a radian of the odometry truly are, and how it turns by itself, learned while the base
//! drives.
//!
//! Where each scan is matched in every direction, the way that was matched is compared with the way counted,
//! a meter or a radian at a time. Wheels slip, so what is far off counts little (Student's t), and how far
//! off segments are tells how well wheels count. Scales may change with the floor and the load, so what was
//! learned long ago counts less. Units: meters, radians.

use biplane_geometry::Pose2;
use nalgebra::{Matrix2, Vector2};

/// A segment ends after this way, meters.
const SEGMENT_M: f64 = 1.0;
/// Or after this turn, radians.
const SEGMENT_RAD: f64 = 1.0;
/// Standard deviation of a matched way from its two ends, meters.
const ENDS_M: f64 = 0.02;
/// The same of a matched turn, radians.
const ENDS_RAD: f64 = 0.01;
/// What wheels slip by, of the root of a meter, meters.
const SLIP_M: f64 = 0.02;
/// The same of a turn: for the root of a radian, and of a meter, radians.
const SLIP_RAD: f64 = 0.03;
/// Odometry that has shown nothing yet: standard deviation of its scales.
const UNKNOWN: f64 = 0.1;
/// The same of the turn that comes with the way, radians a meter.
const UNKNOWN_RAD_PER_M: f64 = 0.02;
/// What a scale changes by from segment to segment, standard deviation.
const CHANGES: f64 = 5e-4;
/// The same of the turn that comes with the way, radians a meter.
const CHANGES_RAD_PER_M: f64 = 1e-4;
/// Degrees of freedom of Student's t distribution.
const FREEDOM: f64 = 4.0;
/// What the newest segment counts for how well wheels count.
const RATE: f64 = 0.05;
/// The most that one segment says of it, variances: a slip is no noise.
const MAX_SQUARED: f64 = 25.0;
/// A scale is known from this standard deviation on.
const KNOWN_BELOW: f64 = 0.02;
/// The same of the turn that comes with the way, radians a meter.
const KNOWN_BELOW_RAD_PER_M: f64 = 0.005;
/// A scale that is off by more is reported, and steps are read by it.
const WRONG_FROM: f64 = 0.05;

/// A number that was learned.
#[derive(Copy, Clone, PartialEq, Debug)]
pub struct Estimate {
    /// The likeliest value.
    pub value: f64,
    /// Its standard deviation.
    pub sigma: f64,
}

impl Estimate {
    /// Whether this is a known scale that is off by more than 5 % and three standard deviations.
    #[must_use]
    pub fn is_wrong_scale(&self) -> bool {
        let off = (self.value - 1.0).abs();
        off > WRONG_FROM && off > 3.0 * self.sigma
    }

    /// The estimate when it is known this well.
    fn known(self, below: f64) -> Option<Self> {
        (self.sigma < below).then_some(self)
    }
}

/// What scans have shown of the odometry, `None` as far as it is not known yet.
#[derive(Copy, Clone, PartialEq, Debug, Default)]
pub struct OdometryScale {
    /// True way over counted way, known to 2 %.
    pub way: Option<Estimate>,
    /// True turn over counted turn, known to 2 %.
    pub turn: Option<Estimate>,
    /// What the base truly turned beside that for each meter counted ahead, known to 5 mrad a meter.
    pub drift_rad_per_m: Option<Estimate>,
}

impl OdometryScale {
    /// The odometry's step as it truly is, where its scales are clearly wrong. Smaller errors change nothing
    /// that scans tell, and each change of a step sends a long drive another way.
    pub(crate) fn of(&self, step: &Pose2) -> Pose2 {
        let wrong = |scale: Option<Estimate>| scale.filter(Estimate::is_wrong_scale).map(|scale| scale.value);
        let way = wrong(self.way).unwrap_or(1.0);
        let turn = wrong(self.turn).unwrap_or(1.0);
        Pose2::new(way * step.x_m, way * step.y_m, turn * step.theta_rad)
    }
}

/// Learns the scales from step to step.
#[derive(Clone, Debug)]
pub(crate) struct ScaleWatch {
    way: Learner,
    /// Of what turns: the scale, and the turn that comes with the way.
    turn: Learner,
    segment: Segment,
}

impl Default for ScaleWatch {
    fn default() -> Self {
        Self {
            way: Learner::new([1.0, 0.0], [UNKNOWN, 0.0], [CHANGES, 0.0]),
            turn: Learner::new([1.0, 0.0], [UNKNOWN, UNKNOWN_RAD_PER_M], [CHANGES, CHANGES_RAD_PER_M]),
            segment: Segment::default(),
        }
    }
}

/// What was counted and matched since the last comparison.
#[derive(Copy, Clone, Debug, Default)]
struct Segment {
    counted: Pose2,
    matched: Pose2,
    way_m: f64,
    turn_rad: f64,
}

impl ScaleWatch {
    /// What is known by now.
    pub(crate) fn scale(&self) -> OdometryScale {
        OdometryScale {
            way: self.way.estimate(0).known(KNOWN_BELOW),
            turn: self.turn.estimate(0).known(KNOWN_BELOW),
            drift_rad_per_m: self.turn.estimate(1).known(KNOWN_BELOW_RAD_PER_M),
        }
    }

    /// Takes note of a step as the odometry counted it and as scans showed it in every direction.
    pub(crate) fn compare(&mut self, counted: &Pose2, matched: &Pose2) {
        let segment = &mut self.segment;
        segment.counted = added(&segment.counted, counted);
        segment.matched = added(&segment.matched, matched);
        segment.way_m += counted.distance_m();
        segment.turn_rad += counted.theta_rad.abs();
        if segment.way_m < SEGMENT_M && segment.turn_rad < SEGMENT_RAD {
            return;
        }
        let Segment { counted, matched, way_m, turn_rad } = std::mem::take(segment);
        let variance = 2.0 * ENDS_M * ENDS_M + SLIP_M * SLIP_M * way_m;
        self.way.learn([counted.x_m, 0.0], matched.x_m, variance);
        let variance = 2.0 * ENDS_RAD * ENDS_RAD + SLIP_RAD * SLIP_RAD * (turn_rad + way_m);
        self.turn.learn([counted.theta_rad, counted.x_m], matched.theta_rad, variance);
    }

    /// Takes note of a step of which either is not known: the segment begins anew.
    pub(crate) fn interrupt(&mut self) {
        self.segment = Segment::default();
    }
}

/// A Kalman filter of two numbers that change slowly.
#[derive(Clone, Debug)]
struct Learner {
    value: Vector2<f64>,
    covariance: Matrix2<f64>,
    /// What is added to the covariance from segment to segment.
    changes: Matrix2<f64>,
    /// By how much variances have proved too small.
    inflation: f64,
}

impl Learner {
    fn new(value: [f64; 2], sigma: [f64; 2], changes: [f64; 2]) -> Self {
        let squared = |sigma: [f64; 2]| Matrix2::from_diagonal(&Vector2::from(sigma.map(|each| each * each)));
        Self {
            value: Vector2::from(value),
            covariance: squared(sigma),
            changes: squared(changes),
            inflation: 1.0,
        }
    }

    fn estimate(&self, number: usize) -> Estimate {
        Estimate { value: self.value[number], sigma: self.covariance[(number, number)].sqrt() }
    }

    /// The numbers, each times its count, came to this sum, give or take.
    fn learn(&mut self, counts: [f64; 2], sum: f64, variance: f64) {
        let counts = Vector2::from(counts);
        self.covariance += self.changes;
        let carried = self.covariance * counts;
        let off = sum - counts.dot(&self.value);
        let variance = variance * self.inflation.max(1.0);
        let squared = off * off / (counts.dot(&carried) + variance);
        let weight = ((FREEDOM + 1.0) / (FREEDOM + squared)).min(1.0);
        let gain = carried / (counts.dot(&carried) + variance / weight);
        self.value += gain * off;
        self.covariance -= gain * carried.transpose();
        self.covariance = 0.5 * (self.covariance + self.covariance.transpose());
        self.inflation += RATE * (squared.min(MAX_SQUARED) * self.inflation.max(1.0) - self.inflation);
    }
}

/// Way ahead, way to the side and turn, each summed up by itself: a turn of the odometry that is off does not
/// bend the way.
fn added(sum: &Pose2, step: &Pose2) -> Pose2 {
    let theta_rad = sum.theta_rad + step.theta_rad;
    Pose2 { x_m: sum.x_m + step.x_m, y_m: sum.y_m + step.y_m, theta_rad }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// After so many steps of 10 cm and 0.1 rad to alternate sides, of which the odometry counts these
    /// shares.
    fn after(steps: usize, way_share: f64, turn_share: f64) -> ScaleWatch {
        let mut watch = ScaleWatch::default();
        go_on(&mut watch, steps, way_share, turn_share);
        watch
    }

    fn go_on(watch: &mut ScaleWatch, steps: usize, way_share: f64, turn_share: f64) {
        for i in 0..steps {
            let turn_rad = if i % 60 < 30 { 0.1 } else { -0.1 };
            let counted = Pose2::new(0.1 * way_share, 0.0, turn_rad * turn_share);
            watch.compare(&counted, &Pose2::new(0.1, 0.0, turn_rad));
        }
    }

    #[test]
    fn a_scale_is_learned_within_meters_and_the_deviation_says_how_well() {
        for (way_share, turn_share) in [(1.0, 1.0), (0.8, 1.2), (1.2, 0.8)] {
            let watch = after(300, way_share, turn_share);
            let [way, turn] = [watch.scale().way, watch.scale().turn].map(Option::unwrap);
            for (found, share) in [(way, way_share), (turn, turn_share)] {
                assert!((found.value * share - 1.0).abs() < 0.01, "{found:?}");
                assert_eq!(found.is_wrong_scale(), share != 1.0, "{found:?}");
            }
            assert!(way.sigma < after(100, way_share, turn_share).scale().way.unwrap().sigma);
        }
    }

    #[test]
    fn a_turn_that_comes_with_the_way_is_told_from_turns_that_are_counted_wrong() {
        let mut watch = ScaleWatch::default();
        for i in 0..1800 {
            let counted_rad = if i % 30 < 15 { 0.1 } else { -0.1 };
            let matched = Pose2::new(0.1, 0.0, 0.9 * counted_rad + 0.03 * 0.1);
            watch.compare(&Pose2::new(0.1, 0.0, counted_rad), &matched);
        }
        let [turn, drift] = [watch.scale().turn, watch.scale().drift_rad_per_m].map(Option::unwrap);
        assert!((turn.value - 0.9).abs() < 0.02 && (drift.value - 0.03).abs() < 0.005, "{turn:?} {drift:?}");
    }

    #[test]
    fn segments_that_scatter_make_the_deviation_larger() {
        let sigma = |scatter_m: f64| {
            let mut watch = ScaleWatch::default();
            for i in 0..500 {
                let matched_m = 0.1 + if i % 20 < 10 { scatter_m } else { -scatter_m };
                watch.compare(&Pose2::new(0.1, 0.0, 0.0), &Pose2::new(matched_m, 0.0, 0.0));
            }
            watch.way.estimate(0).sigma
        };
        assert!(sigma(0.02) > 1.5 * sigma(0.0), "{} {}", sigma(0.02), sigma(0.0));
    }

    #[test]
    fn a_step_is_left_as_it_is_until_the_scale_is_known() {
        let step = Pose2::new(0.1, 0.02, 0.05);
        assert_eq!(after(10, 0.8, 0.8).scale().of(&step), step);
        let read = after(200, 0.8, 1.25).scale().of(&step);
        assert!((read.x_m - 0.125).abs() < 0.003 && (read.theta_rad - 0.04).abs() < 0.002, "{read:?}");
    }

    #[test]
    fn a_slip_changes_little_and_a_floor_on_which_wheels_slip_is_learned_in_time() {
        let mut watch = after(300, 1.0, 1.0);
        go_on(&mut watch, 10, 2.0, 1.0);
        let off = |watch: &ScaleWatch, way: f64| (watch.scale().way.unwrap().value - way).abs();
        assert!(off(&watch, 1.0) < 0.01, "{:?}", watch.scale());
        go_on(&mut watch, 2000, 1.1, 1.0);
        assert!(off(&watch, 1.0 / 1.1) < 0.01, "{:?}", watch.scale());
    }

    #[test]
    fn a_segment_that_is_interrupted_says_nothing() {
        let mut watch = ScaleWatch::default();
        for _ in 0..100 {
            go_on(&mut watch, 5, 0.5, 0.5);
            watch.interrupt();
        }
        assert_eq!(watch.scale(), OdometryScale::default());
    }
}
