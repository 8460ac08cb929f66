//! Upright faces as lines of the plan, with where along them there is wall.

use super::directions::{length_m, unit};
use super::evidence::Evidence;
use super::levels::Overhead;
use super::raster::CELL_M;
use crate::building::elevation::{Elevation, Span};
use crate::building::part::is_upright;
use crate::building::spaces::line::{Curve, Line};
use crate::model::PlanarPolygon;
use biplane_geometry::PortableMath;
use biplane_geometry::polygon_area::ring_area_m2;
use biplane_geometry::vec2::{distance, dot, minus};

/// What is over this height is rarely furniture, meters.
pub(crate) const UPPER_M: f64 = 1.75;
/// The upper edge of walls keeps this from the ceiling, meters: noise of the ceiling.
pub(super) const UNDER_CEILING_M: f64 = 0.07;
/// Points higher over the floor belong to other storeys, meters.
pub(super) const MAX_HEIGHT_M: f64 = 6.0;
/// Points lower over the floor are of things, meters.
pub(super) const MIN_HEIGHT_M: f64 = 0.3;
/// Gaps up to this in the wall over the doors are gaps between scans, meters.
pub(super) const MAX_GAP_M: f64 = 0.3;
/// Gaps up to this that the robot drove through are doorways, meters; wider ones are open plan.
const MAX_DOORWAY_M: f64 = 1.15;
/// Poses further apart are not of one drive, meters.
const MAX_STEP_M: f64 = 1.0;
/// Heights at which polygons are looked at, meters apart.
const ROW_STEP_M: f64 = 0.1;
/// Faces of one direction whose offsets differ by no more are one, meters: more, and thin walls vanish.
const SAME_FACE_M: f64 = 0.03;

/// A line of the plan on which wall was seen from one side.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Face {
    /// Towards the side from which it was seen.
    pub normal: [f64; 2],
    /// Distance from the origin along the normal, meters.
    pub offset_m: f64,
    /// Where along it there is wall over most furniture and doors, meters.
    pub upper_m: Vec<Span>,
    /// Where along it there is anything.
    pub any_m: Vec<Span>,
    /// Area that was seen, square meters.
    pub area_m2: f64,
    /// Root mean square distance of its points, meters.
    pub rms_m: f64,
    /// The circle that it is a chord of.
    pub curve: Option<OnCurve>,
}

/// The circle of a face of a curved wall. Both faces of one wall have the same curve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct OnCurve {
    /// The circle in the middle of the wall.
    pub curve: Curve,
    /// The radius of the face about its center, meters.
    pub radius_m: f64,
}

impl Face {
    /// The direction along it: the normal's left.
    pub(crate) fn along(&self) -> [f64; 2] {
        [-self.normal[1], self.normal[0]]
    }

    /// Distance to the side from which it was seen, meters.
    pub(crate) fn before_m(&self, point: [f64; 2]) -> f64 {
        dot(self.normal, point) - self.offset_m
    }

    /// A place on it.
    pub(crate) fn point(&self, at_m: f64) -> [f64; 2] {
        let along = self.along();
        [0, 1].map(|axis| self.offset_m * self.normal[axis] + at_m * along[axis])
    }

    /// The line that its wall is measured along, and the distance of the face across it, meters.
    pub(crate) fn line(&self) -> (Line, f64) {
        match self.curve {
            None => (Line::Straight { normal: self.normal }, self.offset_m),
            Some(on) => (Line::Curved(on.curve), on.radius_m),
        }
    }

    /// Length of the wall over furniture, meters.
    pub(crate) fn upper_length_m(&self) -> f64 {
        self.upper_m.iter().map(|[from, to]| to - from).sum()
    }
}

/// Length of the parts of spans within another, meters.
pub(crate) fn covered_m(spans: &[Span], [from, to]: Span) -> f64 {
    spans.iter().map(|span| (span[1].min(to) - span[0].max(from)).max(0.0)).sum()
}

/// Spans in order, those closer than a gap made one.
pub(crate) fn joined(mut spans: Vec<Span>, gap_m: f64) -> Vec<Span> {
    spans.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let mut out: Vec<Span> = Vec::new();
    for span in spans {
        match out.last_mut() {
            Some(last) if span[0] <= last[1] + gap_m => last[1] = last[1].max(span[1]),
            _ => out.push(span),
        }
    }
    out
}

/// All faces, those of curved walls with them, the largest first.
pub(crate) fn find(evidence: &Evidence<'_>, overhead: &Overhead, curved: Vec<Face>) -> Vec<Face> {
    let model = evidence.model;
    let mut polygons: Vec<Vec<&PlanarPolygon>> = vec![Vec::new(); model.planes.len()];
    for polygon in &model.polygons {
        if let Some(of_plane) = polygons.get_mut(polygon.plane) {
            of_plane.push(polygon);
        }
    }
    let middles = middles(evidence);
    let mut faces: Vec<Face> = Vec::new();
    for (index, plane) in model.planes.iter().enumerate().filter(|(_, plane)| is_upright(plane)) {
        let (Some(elevation), Some(middle)) = (Elevation::new(plane), middles[index]) else { continue };
        let angle_rad = plane.normal[1].portable_atan2(plane.normal[0]);
        let normal = unit(evidence.area.directions.snapped(angle_rad, length_m(&polygons[index])));
        let mut face = Face {
            normal,
            offset_m: dot(normal, middle),
            upper_m: Vec::new(),
            any_m: Vec::new(),
            area_m2: polygons[index].iter().map(|polygon| ring_area_m2(&polygon.outer_m)).sum(),
            rms_m: plane.rms_m,
            curve: None,
        };
        cover(&mut face, evidence, overhead, &elevation, &polygons[index]);
        if !face.any_m.is_empty() {
            faces.push(face);
        }
    }
    faces.extend(curved);
    faces.sort_by(|a, b| b.area_m2.total_cmp(&a.area_m2));
    let mut faces = merged(faces);
    faces.iter_mut().for_each(|face| close_doorways(face, evidence.path_m));
    faces
}

/// Joins the wall on both sides of where the robot drove through it: a doorway parts rooms whether its lintel
/// was seen or not, and also when it has none.
fn close_doorways(face: &mut Face, path_m: &[[f64; 2]]) {
    let along = face.along();
    let mut closed = Vec::new();
    for gap in face.upper_m.windows(2).map(|pair| [pair[0][1], pair[1][0]]) {
        if gap[1] - gap[0] > MAX_DOORWAY_M {
            continue;
        }
        let is_driven = path_m.windows(2).any(|pair| {
            let [a, b] = [face.before_m(pair[0]), face.before_m(pair[1])];
            let share = a / (a - b);
            let at = dot(along, pair[0]) + share * dot(along, minus(pair[1], pair[0]));
            (a > 0.0) != (b > 0.0) && distance(pair[0], pair[1]) < MAX_STEP_M && gap[0] < at && at < gap[1]
        });
        if is_driven {
            closed.push(gap);
        }
    }
    face.upper_m.extend(closed);
    face.upper_m = joined(std::mem::take(&mut face.upper_m), MAX_GAP_M);
}

/// The middle of the points of each plane.
fn middles(evidence: &Evidence<'_>) -> Vec<Option<[f64; 2]>> {
    let mut sums = vec![([0.0; 2], 0usize); evidence.model.planes.len()];
    for (point, label) in evidence.cloud.points_m.iter().zip(evidence.labels) {
        if let Some((sum, count)) = usize::try_from(*label).ok().and_then(|label| sums.get_mut(label)) {
            *sum = [sum[0] + f64::from(point[0]), sum[1] + f64::from(point[1])];
            *count += 1;
        }
    }
    sums.into_iter().map(|(sum, n)| (n > 0).then(|| sum.map(|value| value / n as f64))).collect()
}

/// Height of the lowest ceiling around a place, meters.
pub(crate) fn low_ceiling_m(evidence: &Evidence<'_>, overhead: &Overhead, place: [f64; 2]) -> Option<f64> {
    let away = 3.0 * CELL_M;
    let steps = [[0.0, 0.0], [away, 0.0], [-away, 0.0], [0.0, away], [0.0, -away]];
    let heights = steps.iter().filter_map(|step| {
        let cell = evidence.area.grid.cell([place[0] + step[0], place[1] + step[1]])?;
        overhead.ceiling_m[cell].map(f64::from)
    });
    heights.reduce(f64::min).or(overhead.usual_m)
}

/// Finds where along a face its polygons are.
fn cover(
    face: &mut Face,
    evidence: &Evidence<'_>,
    overhead: &Overhead,
    elevation: &Elevation,
    polygons: &[&PlanarPolygon],
) {
    let floor_m = evidence.floor_m;
    let along = face.along();
    let rows = (1..).map(|row| MIN_HEIGHT_M + ROW_STEP_M * f64::from(row));
    for height_m in rows.take_while(|height_m| *height_m < MAX_HEIGHT_M) {
        let z_m = floor_m + height_m;
        for span in elevation.rows(polygons, z_m) {
            let ends = span.map(|u| dot(along, elevation.point(u, z_m)));
            let span = [ends[0].min(ends[1]), ends[0].max(ends[1])];
            face.any_m.push(span);
            if height_m > UPPER_M {
                face.upper_m.extend(under_ceiling(face, evidence, overhead, span, z_m));
            }
        }
    }
    face.upper_m = joined(std::mem::take(&mut face.upper_m), MAX_GAP_M);
    face.any_m = joined(std::mem::take(&mut face.any_m), MAX_GAP_M);
}

/// The parts of a span over which there is still ceiling.
fn under_ceiling(
    face: &Face,
    evidence: &Evidence<'_>,
    overhead: &Overhead,
    [from, to]: Span,
    z_m: f64,
) -> Vec<Span> {
    let steps = ((to - from) / CELL_M).ceil().max(1.0) as usize;
    let step_m = (to - from) / steps as f64;
    let parts = (0..steps).map(|step| [0.0, 1.0].map(|end| from + (step as f64 + end) * step_m));
    let is_under = |span: &Span| {
        let place = face.point((span[0] + span[1]) / 2.0);
        low_ceiling_m(evidence, overhead, place).is_none_or(|ceiling| z_m <= ceiling - UNDER_CEILING_M)
    };
    joined(parts.filter(is_under).collect(), 1e-6)
}

/// Joins faces that are one: planes of one wall that doors part, or that a step of noise made two.
fn merged(faces: Vec<Face>) -> Vec<Face> {
    let mut out: Vec<Face> = Vec::new();
    for face in faces {
        let is_same = |other: &&mut Face| {
            other.curve.map(|on| on.curve) == face.curve.map(|on| on.curve)
                && dot(other.normal, face.normal) > 1.0 - 1e-9
                && (other.offset_m - face.offset_m).abs() <= SAME_FACE_M
        };
        let Some(known) = out.iter_mut().find(is_same) else {
            out.push(face);
            continue;
        };
        let weights = [known.area_m2, face.area_m2];
        let mean = |a: f64, b: f64| (a * weights[0] + b * weights[1]) / (weights[0] + weights[1]).max(1e-9);
        known.offset_m = mean(known.offset_m, face.offset_m);
        known.rms_m = mean(known.rms_m, face.rms_m);
        known.area_m2 += face.area_m2;
        known.upper_m = joined([&known.upper_m[..], &face.upper_m].concat(), MAX_GAP_M);
        known.any_m = joined([&known.any_m[..], &face.any_m].concat(), MAX_GAP_M);
    }
    out
}
