//! Curved walls as faces: chords along their circle, so that rooms are cut with straight lines.
//!
//! A cylinder that the search for round things found has no planes any more. Chords lie half inside and half
//! outside of its circle; faces of one wall share their circle, so that its two sides are parallel.

use super::evidence::Evidence;
use super::faces::{
    Face, MAX_GAP_M, MAX_HEIGHT_M, MIN_HEIGHT_M, OnCurve, UNDER_CEILING_M, UPPER_M, joined, low_ceiling_m,
};
use super::levels::Overhead;
use crate::building::spaces::line::{Curve, Line, chords};
use crate::model::cylinder::{Cylinder, CylinderKind, SeenFrom};
use biplane_geometry::PortableMath;
use biplane_geometry::vec2::{distance, dot};

/// A chord is nowhere further from its circle, meters: less than a wall is thick.
const CHORD_M: f64 = 0.01;
/// Axes with a smaller vertical part lean: 5 degrees.
const MIN_UPRIGHT: f64 = 0.996;
/// Circles are of one wall when one of them, seen from the center of the other, bends by no more, meters.
const CONCENTRIC_M: f64 = 0.03;
/// Faces of one wall are no further apart, meters.
const MAX_THICKNESS_M: f64 = 0.65;
/// Points this far off the surface are of something else, standard deviations of the noise.
const NEAR_SIGMAS: f64 = 3.0;
/// Cells in which points are counted, along and up, meters.
const CELL_M: [f64; 2] = [0.05, 0.1];
/// Fewer points in a cell are noise of what stands near.
const MIN_POINTS: u16 = 2;

/// A cylinder that is a wall: its circle in the plan.
struct Arc {
    center_m: [f64; 2],
    radius_m: f64,
    /// From where to where, counter-clockwise, radians.
    from_rad: f64,
    to_rad: f64,
    is_from_inside: bool,
    /// From where to where up, meters.
    heights_m: [f64; 2],
    rms_m: f64,
    points: usize,
}

impl Arc {
    fn of(cylinder: &Cylinder) -> Option<Self> {
        let axis = cylinder.axis_direction;
        if cylinder.kind != CylinderKind::Wall || axis[2] < MIN_UPRIGHT {
            return None;
        }
        let [x, y, z] = cylinder.axis_point_m;
        let zero = cylinder.zero();
        let zero_rad = zero[1].portable_atan2(zero[0]);
        Some(Self {
            center_m: [x, y],
            radius_m: cylinder.radius_m,
            from_rad: zero_rad + cylinder.seen_arc_deg[0].to_radians(),
            to_rad: zero_rad + cylinder.seen_arc_deg[1].to_radians(),
            is_from_inside: cylinder.seen_from == SeenFrom::Inside,
            heights_m: cylinder.seen_m.map(|along| z + along),
            rms_m: cylinder.rms_m,
            points: cylinder.points,
        })
    }

    fn point(&self, angle_rad: f64) -> [f64; 2] {
        let (sin, cos) = angle_rad.portable_sin_cos();
        [self.center_m[0] + self.radius_m * cos, self.center_m[1] + self.radius_m * sin]
    }

    fn middle_rad(&self) -> f64 {
        (self.from_rad + self.to_rad) / 2.0
    }
}

/// Both faces of a curved wall, or the one that was seen, about one center.
struct CurvedWall {
    curve: Curve,
    /// Each with its radius about the common center.
    arcs: Vec<(Arc, f64)>,
}

impl CurvedWall {
    /// Of an arc alone.
    fn new(arc: Arc) -> Self {
        let curve = Curve { center_m: arc.center_m, radius_m: arc.radius_m, zero_rad: arc.middle_rad() };
        let radius_m = arc.radius_m;
        Self { curve, arcs: vec![(arc, radius_m)] }
    }

    /// The radius of an arc about the center of this wall, if it is another face of it.
    fn radius_m(&self, arc: &Arc) -> Option<f64> {
        let angles = [arc.from_rad, arc.middle_rad(), arc.to_rad];
        let away = angles.map(|angle| distance(arc.point(angle), self.curve.center_m));
        let low = away.iter().copied().fold(f64::INFINITY, f64::min);
        let high = away.iter().copied().fold(0.0, f64::max);
        let radius_m = (low + high) / 2.0;
        let is_near = self.arcs.iter().all(|(_, other_m)| (other_m - radius_m).abs() <= MAX_THICKNESS_M);
        (high - low <= CONCENTRIC_M && is_near).then_some(radius_m)
    }

    /// The angles between which all of it lies, from the middle of its first arc.
    fn span_rad(&self) -> [f64; 2] {
        let ends = self.arcs.iter().map(|(arc, _)| {
            let middle = self.curve.at_m(arc.middle_rad()) / self.curve.radius_m;
            let half = (arc.to_rad - arc.from_rad) / 2.0;
            [middle - half, middle + half]
        });
        ends.fold([0.0, 0.0], |span, ends| [f64::min(span[0], ends[0]), f64::max(span[1], ends[1])])
    }

    /// The chords of all its arcs.
    fn faces(mut self, evidence: &Evidence<'_>, overhead: &Overhead) -> Vec<Face> {
        let radii = || self.arcs.iter().map(|(_, radius_m)| *radius_m);
        let (low, high) = (radii().fold(f64::INFINITY, f64::min), radii().fold(0.0, f64::max));
        self.curve.radius_m = (low + high) / 2.0;
        let chords = Chords::along(self.span_rad(), high);
        let mut faces = Vec::new();
        for (arc, radius_m) in &self.arcs {
            let seen = Seen::of(evidence, &self.curve, arc, *radius_m, &chords);
            let all = (0..chords.count).map(|chord| {
                let mut face = self.chord(arc, *radius_m, chords.middle_rad(chord), chords.half_rad);
                seen.cover(&mut face, evidence, overhead, chord);
                face
            });
            faces.extend(all.filter(|face| !face.any_m.is_empty()));
        }
        faces
    }

    /// The line of one chord, on which nothing was seen yet.
    fn chord(&self, arc: &Arc, radius_m: f64, middle_rad: f64, half_rad: f64) -> Face {
        let outward = self.curve.normal(middle_rad * self.curve.radius_m);
        // The polygon of such chords covers as much as the circle.
        let away_m = radius_m * (half_rad / half_rad.portable_tan()).sqrt();
        let sign = if arc.is_from_inside { -1.0 } else { 1.0 };
        let normal = outward.map(|value| sign * value);
        Face {
            normal,
            offset_m: dot(normal, self.curve.center_m) + sign * away_m,
            upper_m: Vec::new(),
            any_m: Vec::new(),
            area_m2: 0.0,
            rms_m: arc.rms_m,
            curve: Some(OnCurve { curve: self.curve, radius_m }),
        }
    }
}

/// Equal chords one after the other.
struct Chords {
    /// Where the first begins, radians from the middle of the wall.
    from_rad: f64,
    /// Half of the angle of each.
    half_rad: f64,
    count: usize,
    /// Cells of points along each.
    columns: usize,
}

impl Chords {
    fn along([from, to]: [f64; 2], radius_m: f64) -> Self {
        // A chord rises by twice the distance that it may have.
        let count = chords(radius_m, (to - from) * radius_m, 2.0 * CHORD_M);
        let half_rad = (to - from) / count as f64 / 2.0;
        let columns = (2.0 * half_rad * radius_m / CELL_M[0]).ceil().max(1.0) as usize;
        Self { from_rad: from, half_rad, count, columns }
    }

    fn middle_rad(&self, chord: usize) -> f64 {
        self.from_rad + (2 * chord + 1) as f64 * self.half_rad
    }
}

/// Where on a curved face there are points: cells along it and up.
struct Seen {
    columns: usize,
    half_rad: f64,
    counts: Vec<Vec<u16>>,
    lowest_m: f64,
}

impl Seen {
    fn of(evidence: &Evidence<'_>, curve: &Curve, arc: &Arc, radius_m: f64, chords: &Chords) -> Self {
        let lowest_m = evidence.floor_m + MIN_HEIGHT_M;
        let rows = ((MAX_HEIGHT_M - MIN_HEIGHT_M) / CELL_M[1]).ceil() as usize;
        let width = chords.count * chords.columns;
        let mut counts = vec![vec![0u16; width]; rows];
        let line = Line::Curved(*curve);
        let near_m = NEAR_SIGMAS * evidence.sigma_m.max(arc.rms_m);
        let [low, high] = arc.heights_m;
        for point in &evidence.cloud.points_m {
            let [x, y, z] = point.map(f64::from);
            let row = (z - lowest_m) / CELL_M[1];
            if z < low || z > high || row < 0.0 || row >= rows as f64 {
                continue;
            }
            let [across, at] = line.place([x, y]);
            let turned = (at / curve.radius_m - chords.from_rad) / (2.0 * chords.half_rad);
            let column = turned * chords.columns as f64;
            if (across - radius_m).abs() <= near_m && column >= 0.0 && column < width as f64 {
                let count = &mut counts[row as usize][column as usize];
                *count = count.saturating_add(1);
            }
        }
        Self { columns: chords.columns, half_rad: chords.half_rad, counts, lowest_m }
    }

    /// Where along a chord there is wall.
    fn cover(&self, face: &mut Face, evidence: &Evidence<'_>, overhead: &Overhead, chord: usize) {
        let Some(OnCurve { curve, radius_m }) = face.curve else { return };
        let middle = dot(face.along(), curve.center_m);
        let half_m = radius_m * self.half_rad.portable_tan();
        let step_m = 2.0 * half_m / self.columns as f64;
        // What is seen from inside runs along the other way round.
        let is_turned = dot(face.normal, face.point(middle)) < dot(face.normal, curve.center_m);
        for (row, counts) in self.counts.iter().enumerate() {
            let z_m = self.lowest_m + (row as f64 + 0.5) * CELL_M[1];
            for column in 0..self.columns {
                if counts[chord * self.columns + column] < MIN_POINTS {
                    continue;
                }
                let place = if is_turned { self.columns - 1 - column } else { column };
                let from = middle - half_m + step_m * place as f64;
                let span = [from, from + step_m];
                face.any_m.push(span);
                face.area_m2 += step_m * CELL_M[1];
                let ceiling_m = low_ceiling_m(evidence, overhead, face.point(from + step_m / 2.0));
                let is_under = ceiling_m.is_none_or(|ceiling_m| z_m <= ceiling_m - UNDER_CEILING_M);
                if z_m > evidence.floor_m + UPPER_M && is_under {
                    face.upper_m.push(span);
                }
            }
        }
        face.upper_m = joined(std::mem::take(&mut face.upper_m), MAX_GAP_M);
        face.any_m = joined(std::mem::take(&mut face.any_m), MAX_GAP_M);
    }
}

/// The chords of all cylinders that are walls.
pub(super) fn find(evidence: &Evidence<'_>, overhead: &Overhead) -> Vec<Face> {
    let mut arcs: Vec<Arc> = evidence.model.cylinders.iter().filter_map(Arc::of).collect();
    arcs.sort_by_key(|arc| std::cmp::Reverse(arc.points));
    let mut walls: Vec<CurvedWall> = Vec::new();
    for arc in arcs {
        let known = walls.iter_mut().find_map(|wall| wall.radius_m(&arc).map(|radius_m| (wall, radius_m)));
        match known {
            Some((wall, radius_m)) => wall.arcs.push((arc, radius_m)),
            None => walls.push(CurvedWall::new(arc)),
        }
    }
    walls.into_iter().flat_map(|wall| wall.faces(evidence, overhead)).collect()
}
