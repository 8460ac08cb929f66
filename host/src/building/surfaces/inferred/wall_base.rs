//! The base of a wall: from the lowest that was seen of its face down to the floor.

use super::super::border::covered;
use super::super::is_face_of;
use super::{is_free_behind, of_wall};
use crate::building::elements::{Elements, Use, Wall};
use crate::building::elevation::Span;
use crate::building::spaces::evidence::Evidence;
use crate::building::spaces::raster::CELL_M;
use crate::model::inferred::{InferredKind, InferredSurface};
use crate::model::{PlanarPolygon, Plane};
use crate::reconstruct::polygons::flat_polygon::{flat, lifted_rings};
use crate::reconstruct::polygons::outline::union::{Ring, Shape, area_m2, repair};
use crate::reconstruct::polygons::plane_frame::{FlatPoint, Frame, STEP_M};
use crate::reconstruct::polygons::seams::clearance;

/// The lowest that was seen of a wall is no higher over the laser than this, meters: 1 degree between beams
/// at 10 m, and half as much again. What begins higher is hidden by something, or hangs.
const OVER_LASER_M: f64 = 0.25;
/// A face is a wall's only where this much of it was seen, meters.
const MIN_SEEN_M: f64 = 0.3;
/// Lower bases are none, meters.
const MIN_HEIGHT_M: f64 = 0.01;
/// Narrower segments of wall get no base, meters.
const MIN_RUN_M: f64 = 0.1;
/// Behind its face a wall is looked at in its middle, but no nearer and no deeper than this, meters: the map
/// has cells of 5 cm, and what lies deep behind a face may be another room.
const BEHIND_M: [f64; 2] = [0.05, 0.1];

/// One face of a wall in the coordinates of its plane.
struct WallFace<'a> {
    evidence: &'a Evidence<'a>,
    plane: &'a Plane,
    frame: Frame,
    shapes: Vec<Shape>,
    /// Height of the floor along the plane.
    floor_v_m: f64,
    /// Where the wall is, and where doors are in it.
    span: Span,
    doors: Vec<Span>,
    behind_m: f64,
    /// The highest at which the lower border of a wall may be, over the floor.
    max_height_m: f64,
    /// Where the bases of other walls in this plane are.
    taken: &'a [Span],
}

/// A segment of a face between two corners: where it begins and ends, and its lower border there.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Segment {
    ends_m: Span,
    low_m: Span,
}

/// The bases of all walls.
pub(super) fn surfaces(
    evidence: &Evidence<'_>,
    elements: &Elements,
    polygons: &[PlanarPolygon],
) -> Vec<InferredSurface> {
    let mut found = Vec::new();
    let max_height_m = evidence.laser_m() + OVER_LASER_M - evidence.floor_m;
    for (index, plane) in evidence.model.planes.iter().enumerate() {
        let own: Vec<&PlanarPolygon> = polygons.iter().filter(|polygon| polygon.plane == index).collect();
        let mut taken = Vec::new();
        for wall in elements.walls.iter().filter(|wall| is_face_of(evidence, plane, wall)) {
            let Some(face) = WallFace::new(evidence, elements, wall, plane, &own) else { continue };
            let face = WallFace { max_height_m, taken: &taken, ..face };
            let (bases, own_taken) = face.bases();
            let rings = bases.into_iter().map(|shape| lifted_rings(&face.frame, shape, &own));
            found.extend(rings.filter_map(|rings| of_wall(InferredKind::WallBase, wall, plane, rings)));
            taken.extend(own_taken);
        }
    }
    found
}

impl<'a> WallFace<'a> {
    fn new(
        evidence: &'a Evidence<'a>,
        elements: &Elements,
        wall: &Wall,
        plane: &'a Plane,
        own: &[&PlanarPolygon],
    ) -> Option<Self> {
        let frame = Frame::new(plane, *own.first()?.outer_m.first()?);
        let shapes: Vec<Shape> = own.iter().map(|polygon| flat(&frame, polygon)).collect::<Option<_>>()?;
        let [x, y] = wall.axis_m[0];
        // Up along the plane, which may lean a little.
        let up = |z: f64| frame.steps([x, y, z])[1] * STEP_M;
        let at = |[x, y]: [f64; 2]| frame.steps([x, y, evidence.floor_m])[0] * STEP_M;
        let ordered = |[a, b]: Span| [a.min(b), a.max(b)];
        let ([along_x, along_y], _) = wall.along();
        let doors = elements.openings.iter().filter(|o| o.wall == wall.id && o.kind != Use::Window);
        let doors = doors.map(|door| {
            let [cx, cy, _] = door.center_m;
            let half = door.width_m / 2.0;
            ordered([-half, half].map(|t| at([cx + t * along_x, cy + t * along_y])))
        });
        let [min_m, max_m] = BEHIND_M;
        Some(Self {
            evidence,
            plane,
            floor_v_m: up(evidence.floor_m),
            span: ordered(wall.axis_m.map(at)),
            doors: doors.collect(),
            behind_m: (wall.drawn_thickness_m / 2.0).clamp(min_m, max_m),
            max_height_m: 0.0,
            taken: &[],
            frame,
            shapes,
        })
    }

    /// The shapes to add, and from where to where each run of them goes.
    fn bases(&self) -> (Vec<Shape>, Vec<Span>) {
        let (mut shapes, mut spans) = (Vec::new(), Vec::new());
        for run in self.runs() {
            let (Some(first), Some(last)) = (run.first(), run.last()) else { continue };
            if last.ends_m[1] - first.ends_m[0] >= MIN_RUN_M {
                shapes.push(vec![self.ring(&run)]);
                spans.push([first.ends_m[0], last.ends_m[1]]);
            }
        }
        let mut shapes = clearance::clear(repair(&shapes));
        shapes.retain(|shape| shape.first().is_some_and(|outer| area_m2(outer) >= MIN_RUN_M * MIN_HEIGHT_M));
        (shapes, spans)
    }

    /// Segments with a base that follow each other.
    fn runs(&self) -> Vec<Vec<Segment>> {
        let mut runs: Vec<Vec<Segment>> = Vec::new();
        let mut is_open = false;
        for pair in self.breaks().windows(2) {
            let segment = self.segment([pair[0], pair[1]]);
            match (segment, runs.last_mut()) {
                (Some(segment), Some(run)) if is_open => run.push(segment),
                (Some(segment), _) => runs.push(vec![segment]),
                (None, _) => {}
            }
            is_open = segment.is_some();
        }
        runs
    }

    /// Places between which the lower border is one straight edge, and no cell of the map is passed.
    fn breaks(&self) -> Vec<f64> {
        let [from, to] = self.span;
        let corners = self.shapes.iter().flatten().flatten().map(|p| f64::from(p.x) * STEP_M);
        let cells = (0..=((to - from) / CELL_M).ceil() as usize).map(|step| from + step as f64 * CELL_M);
        let mut all: Vec<f64> = corners.chain(cells).chain(self.doors.iter().flatten().copied()).collect();
        all.retain(|at| (from..=to).contains(at));
        all.push(to);
        all.iter_mut().for_each(|at| *at = (*at / STEP_M).round() * STEP_M);
        all.sort_by(f64::total_cmp);
        all.dedup();
        all
    }

    /// The segment between two places, where it gets a base.
    fn segment(&self, ends_m: Span) -> Option<Segment> {
        let middle = (ends_m[0] + ends_m[1]) / 2.0;
        let is_in = |spans: &[Span]| spans.iter().any(|[from, to]| *from < middle && middle < *to);
        if is_in(&self.doors) || is_in(self.taken) || self.is_free_behind(middle) {
            return None;
        }
        let inside = STEP_M / 2.0;
        // Just inside: at the ends themselves borders may turn.
        let low_m = [ends_m[0] + inside, ends_m[1] - inside].map(|at| self.lowest(at));
        let [a, b] = [low_m[0]?, low_m[1]?];
        let limits = MIN_HEIGHT_M..=self.max_height_m;
        [a, b].iter().all(|low| limits.contains(&(low - self.floor_v_m))).then_some(())?;
        Some(Segment { ends_m, low_m: [a, b] })
    }

    /// Where the face begins over a place, if enough of it was seen there.
    fn lowest(&self, at_m: f64) -> Option<f64> {
        let spans = covered(&self.shapes, 1, at_m);
        let seen_m: f64 = spans.iter().map(|[from, to]| to - from).sum();
        (seen_m >= MIN_SEEN_M).then(|| spans[0][0])
    }

    /// Whether the lower laser looked through the wall here.
    fn is_free_behind(&self, at_m: f64) -> bool {
        let flat = FlatPoint::new((at_m / STEP_M).round() as i32, (self.floor_v_m / STEP_M).round() as i32);
        is_free_behind(self.evidence, self.plane, self.frame.lift(flat), self.behind_m)
    }

    /// A run as a ring: along the floor, and back along the lower border of what was seen.
    fn ring(&self, run: &[Segment]) -> Ring {
        let step = |value: f64| (value / STEP_M).round() as i32;
        let point = |at: f64, up: f64| FlatPoint::new(step(at), step(up));
        let (first, last) = (run[0].ends_m[0], run[run.len() - 1].ends_m[1]);
        let mut ring = vec![point(first, self.floor_v_m), point(last, self.floor_v_m)];
        let corners: Vec<i32> = self.shapes.iter().flatten().flatten().map(|p| p.x).collect();
        for (place, segment) in run.iter().enumerate().rev() {
            let [from, to] = segment.ends_m;
            // Between corners the border is straight: what only a cell of the map parts stays one edge.
            if place + 1 == run.len() || corners.contains(&step(to)) {
                ring.push(point(to, segment.low_m[1]));
            }
            if place == 0 || corners.contains(&step(from)) {
                ring.push(point(from, segment.low_m[0]));
            }
        }
        ring.dedup();
        ring
    }
}
