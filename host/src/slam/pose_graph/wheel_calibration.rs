//! What a drive teaches of its odometry: length, turn, drift, and the point whose way it counts; and how well
//! it foretells steps then.
//!
//! Learned where scans tell each step in every direction, used where they do not: along a wall outdoors,
//! round the corner of a house, through a door. Learned by least squares over segments of some meters
//! (Tukey's weights: wheels slip), so that the errors of single poses do not count.
//!
//! Units: meters, radians; steps in the base's frame.

use biplane_geometry::PortableMath;
use biplane_geometry::quantile::upper_median;
use biplane_matcher::{Pose2, wrap_angle};
use nalgebra::{SMatrix, SVector};
use serde::Serialize;

/// Steps of a segment, and from one segment to the next.
const SEGMENT: usize = 7;
const EVERY: usize = 2;
/// Fewer segments teach nothing.
const MIN_SEGMENTS: usize = 12;
/// Rounds of the fit.
const ROUNDS: usize = 10;
/// Residuals of so many standard deviations do not count (Tukey).
const TUKEY: f64 = 4.0;
/// Standard deviations of a segment before the residuals tell them: meters, radians.
const AT_FIRST: [f64; 3] = [0.03, 0.05, 0.02];
/// What is taken for granted: length, turn, drift (radians a meter), the point (meters).
const GRANTED: SVector<f64, UNKNOWNS> = SVector::<f64, UNKNOWNS>::new(1.0, 1.0, 0.0, 0.0, 0.0);
const GRANTED_SIGMA: [f64; UNKNOWNS] = [0.05, 0.05, 0.02, 0.2, 0.05];
const UNKNOWNS: usize = 5;
/// Odometry that is off by more for each root of a meter teaches nothing: meters, radians.
const WORST: [f64; 2] = [0.06, 0.04];
/// And none is better than this.
const BEST: [f64; 2] = [0.005, 0.005];

/// Known wheels count beside a sure scan where a meter is off by more than this share, and in full at that
/// one.
const LEAN_FROM: f64 = 0.02;
const LEAN_TO: f64 = 0.05;

/// A step that scans tell in every direction: as the odometry counted it, and as it was.
pub(crate) type SureStep = (Pose2, Pose2);

/// What a drive teaches of its odometry.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct OdometryScale {
    /// True length over counted length, and its standard deviation.
    pub way_scale: [f64; 2],
    /// True turn over counted turn, and its standard deviation.
    pub turn_scale: [f64; 2],
    /// What the heading truly turned beside that for each meter counted, and its standard deviation, radians.
    pub drift_rad_per_m: [f64; 2],
}

/// A calibration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct WheelCalibration {
    learned: SVector<f64, UNKNOWNS>,
    learned_sigma: SVector<f64, UNKNOWNS>,
    /// Standard deviations for each root of a meter driven: meters, radians.
    sigma: [f64; 2],
}

impl WheelCalibration {
    /// Learns from the steps of a drive, in order, `None` where scans do not tell; `None` when they teach
    /// nothing.
    pub(crate) fn learn(steps: &[Option<SureStep>]) -> Option<Self> {
        let segments: Vec<Segment> = steps.windows(SEGMENT).step_by(EVERY).filter_map(Segment::new).collect();
        if segments.len() < MIN_SEGMENTS {
            return None;
        }
        let (mut learned, mut learned_sigma) = (GRANTED, SVector::from(GRANTED_SIGMA));
        let mut sigma = AT_FIRST;
        for _ in 0..ROUNDS {
            let headed: Vec<Headed> = segments.iter().map(|segment| segment.headed(&learned)).collect();
            (learned, learned_sigma) = solve(&headed, &learned, &sigma)?;
            for (axis, sigma) in sigma.iter_mut().enumerate() {
                let mut off: Vec<f64> =
                    headed.iter().map(|segment| segment.off(&learned)[axis].abs()).collect();
                off.sort_unstable_by(f64::total_cmp);
                *sigma = (1.4826 * upper_median(&off)?).clamp(0.1 * AT_FIRST[axis], 3.0 * AT_FIRST[axis]);
            }
        }
        let way_m = segments.iter().map(|segment| segment.way_m).sum::<f64>() / segments.len() as f64;
        let root_m = way_m.max(0.1).sqrt();
        let sigma = [sigma[0] / root_m, sigma[2] / root_m];
        if sigma[0] > WORST[0] || sigma[1] > WORST[1] {
            return None;
        }
        let sigma = [sigma[0].max(BEST[0]), sigma[1].max(BEST[1])];
        Some(Self { learned, learned_sigma, sigma })
    }

    /// The figures that a reader wants.
    pub(crate) fn scale(&self) -> OdometryScale {
        let [way_scale, turn_scale, drift_rad_per_m] =
            std::array::from_fn(|of| [self.learned[of], self.learned_sigma[of]]);
        OdometryScale { way_scale, turn_scale, drift_rad_per_m }
    }

    /// How much known wheels count beside a scan that leaves no direction open: not at all where a meter is
    /// off by less than 2 %, in full from 5 % on.
    pub(crate) fn lean_share(&self) -> f64 {
        let off = (self.learned[0] - 1.0).abs();
        ((off - LEAN_FROM) / (LEAN_TO - LEAN_FROM)).clamp(0.0, 1.0).powi(2)
    }

    /// The step when the odometry counted this one, and its standard deviations.
    pub(crate) fn of(&self, counted: &Pose2) -> (Pose2, [f64; 3]) {
        let headed = headed(counted, &self.learned);
        let [x_m, y_m, _] = (effects(&headed) * self.learned).into();
        let root_m = (counted.distance_m() + counted.theta_rad.abs() + 0.01).sqrt();
        let [position, heading] = self.sigma.map(|sigma| sigma * root_m);
        (Pose2::new(x_m, y_m, headed.theta_rad), [position, position, heading])
    }
}

/// Some steps together.
#[derive(Clone, Copy, Debug)]
struct Segment {
    counted: [Pose2; SEGMENT],
    /// Where they led: x and y from the first pose, and all turns together.
    matched: SVector<f64, 3>,
    way_m: f64,
}

impl Segment {
    fn new(steps: &[Option<SureStep>]) -> Option<Self> {
        let (mut matched, mut matched_rad, mut way_m) = (Pose2::IDENTITY, 0.0, 0.0);
        let mut counted = [Pose2::IDENTITY; SEGMENT];
        for (step, counted) in steps.iter().zip(&mut counted) {
            let (odometry, scans) = (*step)?;
            *counted = odometry;
            matched = matched * scans;
            matched_rad += scans.theta_rad;
            way_m += odometry.distance_m();
        }
        Some(Self { counted, matched: SVector::<f64, 3>::new(matched.x_m, matched.y_m, matched_rad), way_m })
    }

    /// What each unknown makes of the segment when its headings are as learned so far. They bend the way: of
    /// headings as counted, a drift made the point lie a meter off.
    fn headed(&self, learned: &SVector<f64, UNKNOWNS>) -> Headed {
        let (mut way, mut counted_rad) = (Pose2::IDENTITY, 0.0);
        for counted in &self.counted {
            way = way * headed(counted, learned);
            counted_rad += wrap_angle(counted.theta_rad);
        }
        let mut effects = effects(&way);
        effects[(2, 1)] = counted_rad;
        effects[(2, 2)] = self.way_m;
        // Ahead is where the segment leads.
        let (sin, cos) = way.y_m.portable_atan2(way.x_m).portable_sin_cos();
        let turned = SMatrix::<f64, 3, 3>::new(cos, sin, 0.0, -sin, cos, 0.0, 0.0, 0.0, 1.0);
        Headed { effects: turned * effects, matched: (turned * self.matched).into() }
    }
}

/// A segment whose headings are as learned.
#[derive(Clone, Copy, Debug)]
struct Headed {
    effects: SMatrix<f64, 3, UNKNOWNS>,
    matched: [f64; 3],
}

impl Headed {
    fn off(&self, learned: &SVector<f64, UNKNOWNS>) -> [f64; 3] {
        let foretold = self.effects * learned;
        std::array::from_fn(|axis| self.matched[axis] - foretold[axis])
    }
}

/// A counted step with its turn as learned; its way is the chord of an arc, and turns by half of what the arc
/// turns more.
fn headed(counted: &Pose2, learned: &SVector<f64, UNKNOWNS>) -> Pose2 {
    let counted_rad = wrap_angle(counted.theta_rad);
    let theta_rad = learned[1] * counted_rad + learned[2] * counted.distance_m();
    let (sin, cos) = (0.5 * (theta_rad - counted_rad)).portable_sin_cos();
    let Pose2 { x_m, y_m, .. } = *counted;
    Pose2::new(cos * x_m - sin * y_m, sin * x_m + cos * y_m, theta_rad)
}

/// What each unknown makes of a way: x, y, turn. Turn and drift bend it, too: that is in the way.
fn effects(way: &Pose2) -> SMatrix<f64, 3, UNKNOWNS> {
    let (sin, cos) = way.theta_rad.portable_sin_cos();
    SMatrix::<f64, 3, UNKNOWNS>::from_rows(&[
        [way.x_m, 0.0, 0.0, 1.0 - cos, sin].into(),
        [way.y_m, 0.0, 0.0, -sin, 1.0 - cos].into(),
        [0.0; UNKNOWNS].into(),
    ])
}

/// The unknowns by least squares, and their standard deviations.
fn solve(
    segments: &[Headed],
    before: &SVector<f64, UNKNOWNS>,
    sigma: &[f64; 3],
) -> Option<(SVector<f64, UNKNOWNS>, SVector<f64, UNKNOWNS>)> {
    let mut information =
        SMatrix::from_diagonal(&SVector::from(GRANTED_SIGMA.map(|sigma| 1.0 / (sigma * sigma))));
    let mut pulls = information * GRANTED;
    for segment in segments {
        let off = segment.off(before);
        for axis in 0..3 {
            let share = (off[axis] / (TUKEY * sigma[axis])).powi(2).min(1.0);
            let weight = (1.0 - share) * (1.0 - share) / (sigma[axis] * sigma[axis]);
            let effect = segment.effects.row(axis).transpose();
            information += effect * effect.transpose() * weight;
            pulls += effect * (weight * segment.matched[axis]);
        }
    }
    let factors = information.cholesky()?;
    // Segments overlap: each step is in several of them.
    let overlap = (SEGMENT as f64 / EVERY as f64).sqrt();
    Some((factors.solve(&pulls), factors.inverse().diagonal().map(|variance| overlap * variance.sqrt())))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// How wheels count.
    #[derive(Clone, Copy)]
    struct Wheels {
        longer: f64,
        drift_rad_per_m: f64,
    }
    const WHEELS: Wheels = Wheels { longer: 1.03, drift_rad_per_m: 0.01 };

    /// Steps of a base that drives arcs to and fro, as wheels count that are 3 % too long, turn 2 % too far,
    /// drift by 0.01 rad a meter and sit 8 cm behind; every fortieth step is a slip where `slips`.
    fn steps(count: usize, slips: bool) -> Vec<Option<SureStep>> {
        counted_by(WHEELS, count, slips)
    }

    fn counted_by(wheels: Wheels, count: usize, slips: bool) -> Vec<Option<SureStep>> {
        let point = Pose2::new(POINT_M, 0.0, 0.0);
        let step = |at: usize| {
            let turn = if (at / 5).is_multiple_of(2) { 0.15 } else { -0.1 };
            let of_point = Pose2::new(0.3, 0.0, turn);
            let true_step = point * of_point * point.inverse();
            let way_m = of_point.x_m * wheels.longer;
            let counted = Pose2::new(way_m, 0.0, (turn + wheels.drift_rad_per_m * way_m) * 1.02);
            let slip = if slips && at % 40 == 3 { Pose2::new(0.2, 0.0, 0.1) } else { Pose2::IDENTITY };
            Some((counted * slip, true_step))
        };
        (0..count).map(step).collect()
    }
    const POINT_M: f64 = -0.08;

    #[test]
    fn length_turn_drift_and_point_are_learned_and_foretell_steps() {
        for slips in [false, true] {
            let steps = steps(200, slips);
            let learned = WheelCalibration::learn(&steps).unwrap();
            let worst_m = if slips { 0.02 } else { 0.002 };
            for (counted, truth) in steps.iter().flatten().take(3) {
                let (foretold, _) = learned.of(counted);
                let off = truth.between(&foretold);
                assert!(off.distance_m() < worst_m && off.theta_rad.abs() < worst_m, "{slips}: {off:?}");
            }
            let [way, sigma] = learned.scale().way_scale;
            assert!((way - 1.0 / 1.03).abs() < if slips { 0.02 } else { 0.002 }, "{slips}: {way}");
            assert!(sigma > 0.0 && sigma < 0.02, "{sigma}");
        }
    }

    #[test]
    fn a_drift_that_bends_the_way_does_not_move_the_point() {
        for drift_rad_per_m in [0.0, 0.035, -0.07] {
            let wheels = Wheels { drift_rad_per_m, ..WHEELS };
            let learned = WheelCalibration::learn(&counted_by(wheels, 200, false)).unwrap().learned;
            let [way, _, _, point_m, across_m] = learned.into();
            assert!((way - 1.0 / 1.03).abs() < 0.002, "{drift_rad_per_m}: {way}");
            assert!(
                (point_m - POINT_M).abs() < 0.02 && across_m.abs() < 0.02,
                "{drift_rad_per_m}: {learned}"
            );
        }
    }

    #[test]
    fn steps_lean_to_known_wheels_only_where_their_length_is_clearly_off() {
        let share = |longer| {
            let wheels = Wheels { longer, ..WHEELS };
            WheelCalibration::learn(&counted_by(wheels, 200, false)).unwrap().lean_share()
        };
        assert_eq!([share(1.0), share(0.985), share(1.015)], [0.0; 3]);
        assert!((0.05..0.2).contains(&share(1.03)) && share(1.06) == 1.0 && share(0.94) == 1.0);
    }

    #[test]
    fn too_few_segments_and_odometry_that_says_anything_teach_nothing() {
        assert_eq!(WheelCalibration::learn(&steps(20, false)), None);
        let mut gaps = steps(200, false);
        gaps.iter_mut().step_by(5).for_each(|step| *step = None);
        assert_eq!(WheelCalibration::learn(&gaps), None);
        let anything = |at: usize| {
            let counted = Pose2::new(0.1 * ((at * 7919) % 7) as f64, 0.0, 0.3 * ((at * 104_729) % 5) as f64);
            Some((counted, Pose2::new(0.3, 0.0, 0.0)))
        };
        let anything: Vec<_> = (0..200).map(anything).collect();
        assert_eq!(WheelCalibration::learn(&anything), None);
    }
}
