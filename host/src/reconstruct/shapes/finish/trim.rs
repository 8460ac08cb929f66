//! What a cylinder is, and where it ends: at the planes that it touches. Meters, radians.

use super::claim::Claimed;
use crate::model::cylinder::{Cylinder, CylinderKind, SeenFrom};
use crate::model::{Cloud, Plane};
use crate::reconstruct::planes::labeled::Planes;
use crate::reconstruct::shapes::Rounds;
use crate::reconstruct::shapes::fit::axis::{Axis, Tube};
use crate::reconstruct::shapes::fit::judge::Accepted;
use crate::reconstruct::shapes::fit::surface::WALL_RADIUS_M;
use crate::reconstruct::shapes::params::ShapeParams;
use biplane_geometry::PortableMath;
use biplane_geometry::vec3::{dot, minus, norm, plus, scaled};

/// A surface ends at a plane that is no further on than this: at a ceiling the last beam is a step before it.
const MAX_TO_PLANE_M: f64 = 0.35;
/// What stands reaches down to a floor that the vertical laser is too high to see.
const MAX_TO_FLOOR_M: f64 = 1.0;
/// A plane is there when points of it are within this distance of the end.
const MAX_TO_POINTS_M: f64 = 0.5;
/// Points of each plane that are asked.
const MAX_ASKED: usize = 4000;
/// Cosine between an axis and the normal of a plane that cuts it.
const MIN_CUT_COSINE: f64 = 0.5;
/// Sine between an axis and a plane that runs along it.
const MAX_ALONG_SINE: f64 = 0.15;
/// An upright axis.
const UPRIGHT_COSINE: f64 = 0.9;
/// What was seen from outside over so much of its arc goes all the way round.
const WHOLE_FROM_DEG: f64 = 90.0;

/// Makes cylinders of the model.
pub(crate) fn cylinders(params: &ShapeParams, cloud: &Cloud, found: &Planes, claimed: Claimed) -> Rounds {
    let near = PlanePoints::new(cloud, found);
    let mut squares = vec![(0usize, 0.0); claimed.accepted.len()];
    for (point, label) in claimed.labels.iter().enumerate() {
        let Ok(index) = usize::try_from(*label) else { continue };
        let off_m = claimed.accepted[index].tube.off_m(cloud.points_m[point].map(f64::from));
        squares[index].0 += 1;
        squares[index].1 += off_m * off_m;
    }
    let shaped = claimed.accepted.iter().zip(&squares).map(|(one, (points, squares))| {
        let rms_m = (squares / (*points).max(1) as f64).sqrt();
        cylinder(params, one, &near, (*points, rms_m))
    });
    Rounds { cylinders: shaped.collect(), labels: claimed.labels }
}

/// One cylinder with its ends.
fn cylinder(
    params: &ShapeParams,
    one: &Accepted,
    near: &PlanePoints<'_>,
    (points, rms_m): (usize, f64),
) -> Cylinder {
    // Lengths count from the low end of what was seen.
    let [low, high] = one.along_m;
    let start = plus(one.tube.axis.point_m, scaled(one.tube.axis.direction(), low));
    let axis = Axis { point_m: start, ..one.tube.axis };
    let tube = Tube { axis, radius_m: one.tube.radius_m };
    let seen_m = [0.0, high - low];
    let is_upright = axis.direction()[2].abs() > UPRIGHT_COSINE;
    let ends = [0, 1].map(|end| near.end(&tube, seen_m[end], end));
    let floor = params.floor_m.filter(|_| is_upright && ends[0].is_none()).map(|floor_m| floor_m - start[2]);
    let floor = floor.filter(|floor| (-MAX_TO_FLOOR_M..=MAX_TO_PLANE_M).contains(floor));
    let from_m = ends[0].map(|cut| cut.0).or(floor).unwrap_or(0.0);
    let to_m = ends[1].map_or(seen_m[1], |cut| cut.0);
    let kind = kind(one, is_upright, ends[1].is_some());
    let arc = arc(one, &tube, kind, near);
    Cylinder {
        kind,
        axis_point_m: start,
        axis_direction: axis.direction(),
        radius_m: tube.radius_m,
        from_m,
        to_m,
        arc_deg: arc.map(f64::to_degrees),
        seen_arc_deg: centered(one.arc_rad).map(f64::to_degrees),
        seen_from: if one.inside { SeenFrom::Inside } else { SeenFrom::Outside },
        points,
        rms_m,
        seen_m,
        cuts: ends.map(|cut| cut.map_or([0.0; 2], |cut| cut.1)),
    }
}

fn kind(one: &Accepted, is_upright: bool, has_top: bool) -> CylinderKind {
    if one.inside || one.tube.radius_m > WALL_RADIUS_M {
        CylinderKind::Wall
    } else if !is_upright {
        CylinderKind::Pipe
    } else if has_top {
        CylinderKind::Column
    } else {
        CylinderKind::Pole
    }
}

/// From where to where a cylinder goes round: to the lines in which it meets walls, or all round where it is
/// seen from outside.
fn arc(one: &Accepted, tube: &Tube, kind: CylinderKind, near: &PlanePoints<'_>) -> [f64; 2] {
    let [from, to] = one.arc_rad;
    if kind != CylinderKind::Wall && (to - from).to_degrees() >= WHOLE_FROM_DEG {
        return [0.0, std::f64::consts::TAU];
    }
    if to - from >= std::f64::consts::TAU {
        return [from, to];
    }
    let middle_m = 0.5 * (one.along_m[1] - one.along_m[0]);
    let angles = near.lines(tube, middle_m);
    let limit = (MAX_TO_PLANE_M / tube.radius_m).min(0.35);
    let snapped = |end: f64| {
        let off = |angle: &f64| wrapped(*angle - end).abs();
        let nearest = angles.iter().copied().min_by(|a, b| off(a).total_cmp(&off(b)));
        nearest.filter(|angle| off(angle) <= limit).map_or(end, |angle| end + wrapped(angle - end))
    };
    centered([snapped(from), snapped(to)])
}

/// The same arc, counted so that its middle is within half a turn of zero; a whole turn counts from zero.
fn centered([from, to]: [f64; 2]) -> [f64; 2] {
    if to - from >= std::f64::consts::TAU {
        return [0.0, std::f64::consts::TAU];
    }
    let turns = ((0.5 * (from + to)) / std::f64::consts::TAU).round() * std::f64::consts::TAU;
    [from - turns, to - turns]
}

/// An angle within half a turn of zero.
fn wrapped(angle: f64) -> f64 {
    let turn = angle.rem_euclid(std::f64::consts::TAU);
    if turn > std::f64::consts::PI { turn - std::f64::consts::TAU } else { turn }
}

/// Planes with some of their points.
struct PlanePoints<'a> {
    planes: &'a [Plane],
    points_m: Vec<Vec<[f64; 3]>>,
}

impl<'a> PlanePoints<'a> {
    fn new(cloud: &Cloud, found: &'a Planes) -> Self {
        let mut points_m = vec![Vec::new(); found.planes.len()];
        let mut seen = vec![0usize; found.planes.len()];
        for (point, label) in cloud.points_m.iter().zip(&found.labels) {
            let Ok(index) = usize::try_from(*label) else { continue };
            let step = found.planes[index].points.div_ceil(MAX_ASKED).max(1);
            if seen[index].is_multiple_of(step) {
                points_m[index].push(point.map(f64::from));
            }
            seen[index] += 1;
        }
        Self { planes: &found.planes, points_m }
    }

    /// Where the surface meets a plane beyond one of its ends, if it meets any: along the axis, and how the
    /// cut is slanted.
    fn end(&self, tube: &Tube, seen_m: f64, end: usize) -> Option<(f64, [f64; 2])> {
        let [zero, quarter, along] = tube.axis.frame;
        let meets = |(index, plane): (usize, &Plane)| {
            let cosine = dot(plane.normal, along);
            if cosine.abs() < MIN_CUT_COSINE {
                return None;
            }
            let at_m = (plane.offset_m - dot(plane.normal, tube.axis.point_m)) / cosine;
            let beyond_m = if end == 0 { seen_m - at_m } else { at_m - seen_m };
            let middle = plus(tube.axis.point_m, scaled(along, at_m));
            let reach_m = tube.radius_m + MAX_TO_POINTS_M;
            let is_there = (-0.5 * MAX_TO_PLANE_M..=MAX_TO_PLANE_M).contains(&beyond_m)
                && self.points_m[index].iter().any(|p| norm(minus(*p, middle)) <= reach_m);
            let cut = [-dot(plane.normal, zero) / cosine, -dot(plane.normal, quarter) / cosine];
            is_there.then_some((beyond_m.abs(), at_m, cut))
        };
        let nearest = self.planes.iter().enumerate().filter_map(meets).min_by(|a, b| a.0.total_cmp(&b.0));
        nearest.map(|(_, at_m, cut)| (at_m, cut))
    }

    /// The angles at which planes along the axis meet the surface, where they have points near by.
    fn lines(&self, tube: &Tube, middle_m: f64) -> Vec<f64> {
        let [zero, quarter, along] = tube.axis.frame;
        let mut angles = Vec::new();
        for (plane, points_m) in self.planes.iter().zip(&self.points_m) {
            if dot(plane.normal, along).abs() > MAX_ALONG_SINE {
                continue;
            }
            let off_m = plane.offset_m - dot(plane.normal, tube.axis.point_m);
            if off_m.abs() >= tube.radius_m {
                continue;
            }
            let towards = dot(plane.normal, quarter).portable_atan2(dot(plane.normal, zero));
            let half = (off_m / tube.radius_m).portable_acos();
            for angle in [towards - half, towards + half] {
                let (x, y) = (tube.radius_m * angle.portable_cos(), tube.radius_m * angle.portable_sin());
                let is_near = |p: &[f64; 3]| {
                    let [px, py, pz] = tube.axis.local(*p);
                    (px - x).portable_hypot(py - y) <= MAX_TO_POINTS_M
                        && (pz - middle_m).abs() <= middle_m + 0.5
                };
                if points_m.iter().any(is_near) {
                    angles.push(angle);
                }
            }
        }
        angles
    }
}
