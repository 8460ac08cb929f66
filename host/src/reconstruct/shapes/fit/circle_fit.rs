//! The cylinder that lies nearest to points, with the direction of its axis given: a circle in the plane that
//! the axis crosses, by Gauss-Newton over place and radius. Most guesses are fitted so, and end there. Points
//! far off are left out; where beams are known, each point counts by how squarely it was seen. Meters.

use super::axis::{Axis, Tube};
use super::sample::Sample;
use super::steps::{STEPS, WIDE_STEPS, solve};
use super::surface::WALL_RADIUS_M;
use biplane_geometry::vec3::{dot, minus, norm};

/// A step of so little, meters, is the last.
const SETTLED_M: f64 = 1e-4;
/// How far a step may go, in deviations of a range: from this on half as far with each step, but so far
/// always. What goes further has no circle near it: the fits of flat and of scattered points never settle.
const FIRST_DEVIATIONS: f64 = 20.0;
const LAST_DEVIATIONS: f64 = 1.0;

/// A point as the axis sees it.
struct Across {
    /// Its place.
    at_m: [f64; 2],
    /// The part of the beam's direction across the axis; `None` where nobody knows it.
    beam: Option<[f64; 2]>,
}

/// The sums of the normal equations for the two places and the radius: products of what the points weigh and
/// of where they lie, and the same with how far off they are.
#[derive(Clone, Copy, Default)]
struct Sums {
    count: usize,
    facing: f64,
    xx: f64,
    xy: f64,
    yy: f64,
    x: f64,
    y: f64,
    one: f64,
    right: [f64; 3],
}

/// Fits a cylinder to points, those within `limit_m` of it; `None` when they do not fix one.
pub(crate) fn fit(start: Tube, points: Sample<'_>, limits: (f64, f64)) -> Option<Tube> {
    fit_within(start, points, limits, f64::INFINITY)
}

/// The same for a guess at a column, a pipe or a pole; `None` when it does not settle too. Strips of a wall
/// hardly tell its radius: guesses at walls may go far.
pub(crate) fn fit_settling(start: Tube, points: Sample<'_>, limits: (f64, f64)) -> Option<Tube> {
    fit_within(start, points, limits, FIRST_DEVIATIONS)
}

/// The same, with how far the first step may go, in deviations.
fn fit_within(
    start: Tube,
    points: Sample<'_>,
    (sigma_m, limit_m): (f64, f64),
    mut may_move: f64,
) -> Option<Tube> {
    let across = across(&start.axis, points);
    let (mut center_m, mut radius_m) = ([0.0; 2], start.radius_m);
    // The side from which most was seen in the step before; at first that from which all is.
    let mut side = Sums::of(&across, center_m, radius_m, 1.5 * limit_m, 1.0).facing.signum();
    for step in 0..STEPS {
        // Farther off at first: a start through three points is no better than their noise.
        let reach_m = if step < WIDE_STEPS { 1.5 * limit_m } else { limit_m };
        let sums = Sums::of(&across, center_m, radius_m, reach_m, side);
        let moved = sums.solved()?;
        side = sums.facing.signum();
        center_m = [center_m[0] + moved[0], center_m[1] + moved[1]];
        radius_m += moved[2];
        let moved_m = moved.iter().fold(0.0, |max: f64, v| max.max(v.abs()));
        // The first step may go anywhere: a guess is no more than that.
        let is_sane = moved.iter().all(|v| v.is_finite()) && radius_m > 0.2 * sigma_m && radius_m < 100.0;
        // What has grown to a wall may go on: an apse is found from a corner of it.
        let is_bound = step > 0 && radius_m < WALL_RADIUS_M;
        if !is_sane || (is_bound && moved_m > may_move.max(LAST_DEVIATIONS) * sigma_m) {
            return None;
        }
        if step >= WIDE_STEPS && moved_m < SETTLED_M {
            break;
        }
        may_move *= 0.5;
    }
    Some(Tube { axis: start.axis.through(center_m), radius_m })
}

/// Points as an axis sees them.
fn across(axis: &Axis, points: Sample<'_>) -> Vec<Across> {
    let [zero, quarter, _] = axis.frame;
    let mut all = Vec::with_capacity(points.points_m.len());
    all.extend(points.points_m.iter().enumerate().map(|(index, p)| {
        let [x, y, _] = axis.local(*p);
        let beam = points.origins_m.get(index).map(|origin| {
            let beam = minus(*p, *origin);
            let length_m = norm(beam).max(1e-9);
            [dot(zero, beam) / length_m, dot(quarter, beam) / length_m]
        });
        Across { at_m: [x, y], beam }
    }));
    all
}

impl Sums {
    /// Of the points within reach of a circle.
    fn of(points: &[Across], center_m: [f64; 2], radius_m: f64, reach_m: f64, side: f64) -> Self {
        let mut sums = Self::default();
        let per_reach = 1.0 / reach_m;
        for Across { at_m, beam } in points {
            let [x, y] = [at_m[0] - center_m[0], at_m[1] - center_m[1]];
            let distance_m = (x * x + y * y).sqrt().max(1e-9);
            let residual_m = distance_m - radius_m;
            let share = residual_m * per_reach;
            if share.abs() > 1.0 {
                continue;
            }
            let per_distance = 1.0 / distance_m;
            let [x, y] = [x * per_distance, y * per_distance];
            let cosine = beam.map_or(1.0, |beam| -(x * beam[0] + y * beam[1]));
            sums.count += 1;
            sums.facing += cosine;
            // What seems to be seen from the other side is a smear beyond an edge.
            let rest = (1.0 - share * share) * (side * cosine).max(0.0);
            let weight = rest * rest;
            let (weighted_x, weighted_y) = (weight * x, weight * y);
            sums.xx += weighted_x * x;
            sums.xy += weighted_x * y;
            sums.yy += weighted_y * y;
            sums.x += weighted_x;
            sums.y += weighted_y;
            sums.one += weight;
            sums.right[0] += weighted_x * residual_m;
            sums.right[1] += weighted_y * residual_m;
            sums.right[2] += weight * residual_m;
        }
        sums
    }

    /// How far to move, and to grow; `None` when too few points are near or do not tell.
    fn solved(&self) -> Option<[f64; 3]> {
        let normal = [[self.xx, self.xy, self.x], [self.xy, self.yy, self.y], [self.x, self.y, self.one]];
        if self.count < 6 { None } else { solve(normal, self.right) }
    }
}

#[cfg(test)]
mod tests {
    use super::{fit, fit_settling};
    use crate::reconstruct::planes::paper::random::Random;
    use crate::reconstruct::shapes::fit::axis::{Axis, Tube};
    use crate::reconstruct::shapes::fit::sample::Sample;

    #[test]
    fn smears_beyond_the_edges_of_a_pipe_leave_its_radius_alone() {
        let mut random = Random::new(4);
        let (mut points_m, mut origins_m) = (Vec::new(), Vec::new());
        for number in 0..3000 {
            let share = 2.0 * random.unit() - 1.0;
            let (edge_m, deep_m) = (0.085 * share.signum(), -0.085 * (1.0 - share * share).sqrt());
            // A third of the beams are split by an edge, and end between pipe and ceiling.
            let (y, z) = if number % 3 == 0 {
                (edge_m * (1.0 + 0.1 * random.unit()), 0.12 * random.unit())
            } else {
                (0.085 * share, deep_m + 0.014 * random.normal())
            };
            let x = 8.0 * random.unit();
            points_m.push([x, y, z]);
            origins_m.push([x, y, -3.0]);
        }
        let start = Tube { axis: Axis::new([4.0, -0.03, 0.055], [1.0, 0.0, 0.0]), radius_m: 0.137 };
        let tube = fit(start, Sample { points_m: &points_m, origins_m: &origins_m }, (0.014, 0.042));
        let radius_m = tube.map_or(0.0, |tube| tube.radius_m);
        // A centimeter is what a radius may be off.
        assert!((radius_m - 0.085).abs() < 0.01, "{radius_m}");
        let blind = fit(start, Sample::blind(&points_m), (0.014, 0.042));
        assert!(blind.is_none_or(|tube| (tube.radius_m - 0.085).abs() > 0.01), "{blind:?}");
    }

    #[test]
    fn what_is_flat_never_settles_and_half_a_column_does() {
        let mut random = Random::new(5);
        let axis = Axis::new([0.0; 3], [0.0, 0.0, 1.0]);
        let start = Tube { axis: axis.through([0.03, -0.02]), radius_m: 0.25 };
        let limits = (0.015, 0.045);
        let mut fitted = |at: &dyn Fn(f64) -> [f64; 2]| {
            let point = |_| {
                let [x, y] = at(random.unit());
                [x + 0.015 * random.normal(), y + 0.015 * random.normal(), 2.0 * random.unit()]
            };
            let points_m: Vec<[f64; 3]> = (0..500).map(point).collect();
            fit_settling(start, Sample::blind(&points_m), limits)
        };
        let column = fitted(&|share| {
            let angle = std::f64::consts::PI * share;
            [0.2 * angle.cos(), 0.2 * angle.sin()]
        });
        assert!((column.unwrap().radius_m - 0.2).abs() < 0.003, "{column:?}");
        assert_eq!(fitted(&|share| [2.0 * share - 1.0, 0.25]), None);
    }
}
