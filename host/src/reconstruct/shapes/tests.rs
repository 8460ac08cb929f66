//! Round things of clouds whose truth is known.

use super::extract;
use super::fit::axis::{Axis, Tube};
use super::fit::judge::judge;
use super::fit::surface::{Evidence, Rejected};
use super::params::ShapeParams;
use crate::model::Cloud;
use crate::model::cylinder::{Cylinder, CylinderKind, SeenFrom};
use crate::reconstruct::planes;
use crate::reconstruct::planes::paper::random::Random;
use crate::reconstruct::planes::params::PlaneParams;

const SIGMA_M: f64 = 0.012;

/// A cloud in the making: points seen from one place after another.
struct Seen {
    cloud: Cloud,
    random: Random,
}

impl Seen {
    fn new(seed: u64) -> Self {
        Self { cloud: Cloud { beams_per_scan: 9999, ..Cloud::default() }, random: Random::new(seed) }
    }

    /// `count` points of a surface, with noise along the beams from a place.
    fn from(&mut self, origin: [f64; 3], count: u16, surface: impl Fn(f64, f64) -> [f64; 3]) {
        let scan = self.cloud.origins_m.len() as u32;
        self.cloud.origins_m.push(origin.map(|v| v as f32));
        for beam in 0..count {
            let p = surface(self.random.unit(), self.random.unit());
            let beam_m = [0, 1, 2].map(|k| p[k] - origin[k]);
            let share =
                1.0 + SIGMA_M * self.random.normal() / beam_m.iter().map(|v| v * v).sum::<f64>().sqrt();
            self.cloud.points_m.push([0, 1, 2].map(|k| (origin[k] + share * beam_m[k]) as f32));
            self.cloud.scan.push(scan);
            self.cloud.beam.push(beam);
        }
    }

    /// A column seen from four sides, by its half that faces each.
    fn column(&mut self, [x, y]: [f64; 2], radius_m: f64) {
        for quarter in 0..4 {
            let middle = f64::from(quarter) * std::f64::consts::FRAC_PI_2;
            let origin = [x + 3.0 * middle.cos(), y + 3.0 * middle.sin(), 0.5];
            self.from(origin, 800, |a, b| {
                let angle = middle + 2.0 * (a - 0.5);
                [x + radius_m * angle.cos(), y + radius_m * angle.sin(), 3.0 * b]
            });
        }
    }

    /// Floor, ceiling and four walls of 8 m by 6 m by 3 m, the origin in their middle.
    fn room(&mut self) {
        let origin = [0.1, 0.2, 0.8];
        for side in [-1.0, 1.0] {
            self.from(origin, 6000, |a, b| [8.0 * a - 4.0, 6.0 * b - 3.0, 1.5 + 1.5 * side]);
            self.from(origin, 4000, |a, b| [8.0 * a - 4.0, 3.0 * side, 3.0 * b]);
            self.from(origin, 4000, |a, b| [4.0 * side, 6.0 * a - 3.0, 3.0 * b]);
        }
    }

    fn found(&self) -> (planes::Planes, planes::Planes, Vec<Cylinder>) {
        let before = planes::extract(&PlaneParams::default(), &self.cloud);
        let mut after = before.clone();
        let rounds = extract(&ShapeParams::default(), &self.cloud, &mut after);
        (before, after, rounds.cylinders)
    }
}

#[test]
fn columns_in_a_room_are_found_and_their_strips_are_gone() {
    let mut seen = Seen::new(1);
    seen.room();
    seen.column([1.5, 1.0], 0.2);
    seen.column([-1.5, -1.0], 0.4);
    let (_, after, mut cylinders) = seen.found();
    assert_eq!((after.planes.len(), cylinders.len()), (6, 2), "{cylinders:?}");
    cylinders.sort_by(|a, b| a.radius_m.total_cmp(&b.radius_m));
    for (one, (radius_m, at)) in cylinders.iter().zip([(0.2, [1.5, 1.0]), (0.4, [-1.5, -1.0])]) {
        assert!((one.radius_m - radius_m).abs() < 0.01, "{one:?}");
        let [x, y] = [0, 1].map(|k| one.axis_point_m[k] - at[k]);
        assert!(x.hypot(y) < 0.015, "{one:?}");
        // Between floor and ceiling, to which it is trimmed.
        let ends = [one.from_m, one.to_m].map(|along| one.axis_point_m[2] + along);
        assert!(ends[0].abs() < 0.02 && (ends[1] - 3.0).abs() < 0.02, "{ends:?}");
        assert_eq!((one.kind, one.seen_from), (CylinderKind::Column, SeenFrom::Outside));
    }
}

#[test]
fn a_molding_on_a_wall_is_no_pipe_and_a_half_column_is_a_column() {
    let mut seen = Seen::new(8);
    for x in [-3.0, 0.0, 3.0] {
        seen.from([x, -3.0, 0.8], 6000, |a, b| [8.0 * a - 4.0, 0.0, 3.0 * b]);
    }
    // A rounded ledge at 2 m: 120 degrees of a circle whose axis is 10 cm behind the wall.
    let (radius_m, behind_m) = (0.2, 0.1);
    for x in [-3.0, 0.0, 3.0] {
        seen.from([x, -3.0, 0.8], 600, |a, b| {
            let angle = (120.0 * (b - 0.5)).to_radians();
            [8.0 * a - 4.0, behind_m - radius_m * angle.cos(), 2.0 + radius_m * angle.sin()]
        });
    }
    assert_eq!(seen.found().2, []);
    // A half column, its axis in the wall.
    for x in [-2.0, 0.0, 2.0] {
        seen.from([x, -3.0, 0.8], 600, |a, b| {
            let angle = (180.0 * (a - 0.5)).to_radians();
            [0.3 * angle.sin(), -0.3 * angle.cos(), 1.7 * b]
        });
    }
    let (_, _, cylinders) = seen.found();
    assert_eq!(cylinders.len(), 1, "{cylinders:?}");
    assert!(
        cylinders[0].axis_direction[2] > 0.99 && (cylinders[0].radius_m - 0.3).abs() < 0.01,
        "{cylinders:?}"
    );
}

#[test]
fn an_apse_is_one_curved_wall_seen_from_inside() {
    let mut seen = Seen::new(2);
    let origin = [0.5, 0.0, 0.8];
    seen.from(origin, 20_000, |a, b| {
        let angle = std::f64::consts::PI * (a - 0.5);
        [2.0 * angle.cos(), 2.0 * angle.sin(), 3.0 * b]
    });
    for side in [-1.0, 1.0] {
        seen.from([1.0, 0.0, 0.8], 4000, |a, b| [0.0, side * (2.0 + 2.0 * a), 3.0 * b]);
    }
    let (before, after, cylinders) = seen.found();
    // The four strips are gone; both straight walls are one plane.
    assert_eq!((before.planes.len(), after.planes.len()), (5, 1), "{:?}", after.planes);
    assert_eq!(cylinders.len(), 1);
    let apse = &cylinders[0];
    assert_eq!((apse.kind, apse.seen_from), (CylinderKind::Wall, SeenFrom::Inside));
    assert!((apse.radius_m - 2.0).abs() < 0.01, "{apse:?}");
    // Both ends are the lines in which it meets the straight walls.
    for (angle_deg, side) in apse.arc_deg.into_iter().zip([-1.0, 1.0]) {
        for end in [0, 1] {
            let [x, y, _] = apse.corner_m(angle_deg.to_radians(), end);
            assert!(x.abs() < 0.005 && (y - 2.0 * side).abs() < 0.015, "{apse:?}");
        }
    }
}

#[test]
fn a_room_and_a_square_pillar_keep_their_planes_as_they_were() {
    let mut seen = Seen::new(3);
    seen.room();
    for (side, normal) in [[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]].into_iter().enumerate() {
        let [x, y] = normal;
        seen.from([3.0 * x + 0.3, 2.5 * y + 0.3, 0.5], 1500, |a, b| {
            let along = 0.4 * (a - 0.5);
            [0.2 * x - along * y, 0.2 * y + along * x, 3.0 * b]
        });
        assert!(side < 4);
    }
    let (before, after, cylinders) = seen.found();
    assert_eq!(cylinders, []);
    assert_eq!(before, after);
}

#[test]
fn nothing_is_looked_for_when_that_is_asked() {
    let mut seen = Seen::new(4);
    seen.column([0.0, 0.0], 0.3);
    let mut found = planes::extract(&PlaneParams::default(), &seen.cloud);
    let params = ShapeParams { enabled: false, ..ShapeParams::default() };
    assert_eq!(extract(&params, &seen.cloud, &mut found), super::Rounds::default());
}

#[test]
fn what_is_no_cylinder_is_rejected_for_the_right_reason() {
    let mut random = Random::new(5);
    let tube = Tube { axis: Axis::new([0.0; 3], [0.0, 0.0, 1.0]), radius_m: 0.235 };
    let mut judged = |shape: &dyn Fn(f64) -> f64, spread_m: f64, arc: f64, height_m: f64| {
        let mut point = || {
            let angle = arc * random.unit();
            let r = shape(angle) + spread_m * random.normal();
            [r * angle.cos(), r * angle.sin(), height_m * random.unit()]
        };
        let points_m: Vec<[f64; 3]> = (0..3000).map(|_| point()).collect();
        let seen = Evidence { points_m: &points_m, origins_m: &[], sigma_m: SIGMA_M };
        judge(&ShapeParams::default(), &tube, &seen).err()
    };
    let square = |a: f64| 0.2 / a.cos().abs().max(a.sin().abs());
    let eighth = std::f64::consts::FRAC_PI_4;
    let octagon = |a: f64| 0.228 / (a.rem_euclid(eighth) - 0.5 * eighth).cos();
    let round = |_: f64| 0.235;
    assert_eq!(judged(&round, SIGMA_M, 3.0, 3.0), None);
    // A square lies too far off any circle; eight faces do not, and are told by the circle's own misfit.
    assert_eq!(judged(&square, SIGMA_M, 3.0, 3.0), Some(Rejected::Spread));
    assert_eq!(judged(&octagon, SIGMA_M, 3.0, 3.0), Some(Rejected::Flat));
    assert_eq!(judged(&round, SIGMA_M, 0.9, 3.0), Some(Rejected::Arc));
    assert_eq!(judged(&round, SIGMA_M, 3.0, 0.2), Some(Rejected::Length));
    // Leaves all about.
    assert_eq!(judged(&round, 0.2, 3.0, 3.0), Some(Rejected::Spread));
    let halved = |a: f64| 0.235 + if (500.0 * a) as i64 % 2 == 0 { 0.0 } else { 5.0 * SIGMA_M };
    assert_eq!(judged(&halved, SIGMA_M, 3.0, 3.0), Some(Rejected::Beside));
}

#[test]
fn a_thin_pipe_is_seen_from_one_side_though_its_edges_smear() {
    let mut random = Random::new(7);
    let tube = Tube { axis: Axis::new([0.0; 3], [1.0, 0.0, 0.0]), radius_m: 0.085 };
    let mut judged = |is_from_both: bool| {
        let (mut points_m, mut origins_m) = (Vec::new(), Vec::new());
        for number in 0..4000 {
            let side = if is_from_both && number % 2 == 0 { 1.0 } else { -1.0 };
            let x = 8.0 * random.unit();
            // Every sixth beam is split by an edge: its range is between pipe and ceiling.
            let is_mixed = number % 6 == 0;
            let share = 2.0 * random.unit() - 1.0;
            let miss_m = tube.radius_m * if is_mixed { 1.0 + 0.15 * share } else { share };
            let deep_m = (tube.radius_m * tube.radius_m - miss_m * miss_m).max(0.0).sqrt();
            let hit_m = if is_from_both { side * deep_m } else { -deep_m };
            let noise_m = 1.2 * SIGMA_M * random.normal();
            let along = if is_mixed { tube.radius_m * random.unit() } else { hit_m + noise_m };
            // From below and from beside.
            let towards = if random.unit() < 0.4 { [0.0, 1.0] } else { [1.0, 0.0] };
            let at = |a: f64| [x, a * towards[0] - miss_m * towards[1], a * towards[1] + miss_m * towards[0]];
            points_m.push(at(along));
            origins_m.push(at(-2.5));
        }
        let seen = Evidence { points_m: &points_m, origins_m: &origins_m, sigma_m: 1.2 * SIGMA_M };
        judge(&ShapeParams::default(), &tube, &seen).map(|one| one.inside)
    };
    assert_eq!(judged(false), Ok(false));
    assert_eq!(judged(true), Err(Rejected::Sides));
}
