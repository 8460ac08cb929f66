//! Polygons that end where a round thing begins: their borders follow the line in which both meet. Meters,
//! radians.

use crate::model::cylinder::{Cylinder, CylinderKind};
use crate::model::{PlanarPolygon, Plane};
use crate::reconstruct::polygons::validate;
use biplane_geometry::plane::distance_m;
use biplane_geometry::vec3::{distance, dot, minus, plus, scaled};
use rayon::prelude::*;

/// A corner of a polygon this near to the line belongs on it: the last beam before the line is a step away.
const REACH_M: f64 = 0.12;
/// A line lies in a plane when its ends are no further off.
const IN_PLANE_M: f64 = 0.005;

/// A line in which a cylinder meets planes.
enum Line<'a> {
    /// Along the axis, at an end of the arc.
    Straight([[f64; 3]; 2]),
    /// Round the axis, at an end of it.
    Bent(&'a Cylinder, usize),
}

/// Moves borders onto the lines in which their planes meet curved walls; a polygon that this would break
/// stays as it is.
pub(crate) fn meet(planes: &[Plane], polygons: &mut [PlanarPolygon], cylinders: &[Cylinder]) {
    let walls: Vec<&Cylinder> = cylinders.iter().filter(|one| one.kind == CylinderKind::Wall).collect();
    if walls.is_empty() {
        return;
    }
    polygons.par_iter_mut().for_each(|polygon| {
        let Some(plane) = planes.get(polygon.plane) else { return };
        let lines: Vec<Line<'_>> = walls.iter().flat_map(|wall| lines_in(plane, wall)).collect();
        if lines.is_empty() {
            return;
        }
        let mut moved = polygon.clone();
        let rings = std::iter::once(&mut moved.outer_m).chain(&mut moved.holes_m);
        rings.for_each(|ring| {
            lines.iter().for_each(|line| onto(ring, line));
            ring.iter_mut().for_each(|p| {
                let off_m = distance_m(plane.normal, plane.offset_m, *p);
                *p = minus(*p, scaled(plane.normal, off_m));
            });
        });
        if validate::check(&moved, plane).is_ok() {
            *polygon = moved;
        }
    });
}

/// The lines of a wall that lie in a plane.
fn lines_in<'a>(plane: &Plane, wall: &'a Cylinder) -> Vec<Line<'a>> {
    let is_in = |p: [f64; 3]| distance_m(plane.normal, plane.offset_m, p).abs() <= IN_PLANE_M;
    let arc = wall.arc_deg.map(f64::to_radians);
    let straight = arc.map(|angle| [wall.corner_m(angle, 0), wall.corner_m(angle, 1)]);
    let straight = straight.into_iter().filter(|ends| ends.iter().all(|p| is_in(*p))).map(Line::Straight);
    let bent = [0, 1].into_iter().filter(|end| {
        [arc[0], 0.5 * (arc[0] + arc[1]), arc[1]].iter().all(|angle| is_in(wall.corner_m(*angle, *end)))
    });
    straight.chain(bent.map(|end| Line::Bent(wall, end))).collect()
}

/// Moves the corners of a ring that are near a line onto it.
fn onto(ring: &mut Vec<[f64; 3]>, line: &Line<'_>) {
    match line {
        Line::Straight(ends) => ring.iter_mut().for_each(|p| *p = onto_straight(*p, *ends)),
        Line::Bent(wall, end) => *ring = onto_bent(ring, wall, *end),
    }
    ring.dedup_by(|a, b| distance(*a, *b) < 1e-6);
    while ring.len() > 1 && distance(ring[0], ring[ring.len() - 1]) < 1e-6 {
        ring.pop();
    }
}

fn onto_straight(p: [f64; 3], [from, to]: [[f64; 3]; 2]) -> [f64; 3] {
    let along = minus(to, from);
    let length2 = dot(along, along);
    if length2 <= 0.0 {
        return p;
    }
    let share = dot(minus(p, from), along) / length2;
    let margin = REACH_M / length2.sqrt();
    let foot = plus(from, scaled(along, share));
    if (-margin..=1.0 + margin).contains(&share) && distance(foot, p) <= REACH_M { foot } else { p }
}

/// Corners near the bent line move onto it, and edges along it get corners where the wall's mesh has them.
fn onto_bent(ring: &[[f64; 3]], wall: &Cylinder, end: usize) -> Vec<[f64; 3]> {
    let arc = wall.arc_deg.map(f64::to_radians);
    let margin = REACH_M / wall.radius_m;
    let angle_of = |p: [f64; 3]| -> Option<f64> {
        let (angle, distance_m, _) = wall.around(p);
        let angle = arc[0] - margin + (angle - arc[0] + margin).rem_euclid(std::f64::consts::TAU);
        let is_near = (distance_m - wall.radius_m).abs() <= REACH_M && angle <= arc[1] + margin;
        is_near.then(|| angle.clamp(arc[0], arc[1]))
    };
    let angles: Vec<Option<f64>> = ring.iter().map(|p| angle_of(*p)).collect();
    let corners = wall.angles_rad();
    let mut bent = Vec::with_capacity(ring.len());
    for (k, p) in ring.iter().enumerate() {
        let (here, next) = (angles[k], angles[(k + 1) % ring.len()]);
        bent.push(here.map_or(*p, |angle| wall.corner_m(angle, end)));
        let (Some(here), Some(next)) = (here, next) else { continue };
        let between = corners.iter().copied().filter(|angle| {
            let (low, high) = (here.min(next), here.max(next));
            *angle > low + 1e-6 && *angle < high - 1e-6
        });
        let mut between: Vec<f64> = between.collect();
        if next < here {
            between.reverse();
        }
        bent.extend(between.into_iter().map(|angle| wall.corner_m(angle, end)));
    }
    bent
}
