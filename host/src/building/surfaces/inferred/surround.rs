//! The wall around an opening, where something hid it or too few beams met it: openings become whole
//! rectangles.
//!
//! A surround ends where its face does, and where rays passed there is none. What hides a jamb may hide a
//! part of the opening: beyond it there is wall over the head and under the sill, and between them nothing is
//! known.

use std::cmp::Reverse;

use super::super::plane_rays::PlaneRays;
use super::super::rectangle::{self, Place, holds, ring};
use super::super::{BESIDE_M, is_face_at, place_of};
use super::{is_free_behind, of_wall};
use crate::building::elements::{Elements, Room, Wall, WallOpening};
use crate::building::elevation::{Span, extent};
use crate::building::spaces::evidence::Evidence;
use crate::building::spaces::raster::CELL_M;
use crate::model::inferred::{InferredKind, InferredSurface};
use crate::model::{PlanarPolygon, Plane};
use crate::reconstruct::polygons::flat_polygon::{flat, lifted_rings};
use crate::reconstruct::polygons::outline::union::{Ring, Shape, area_m2, difference, intersection};
use crate::reconstruct::polygons::plane_frame::{FlatPoint, Frame, STEP_M};
use crate::reconstruct::polygons::seams::clearance;

/// How wide a surround is, meters: frames of doors are no wider.
const WIDTH_M: f64 = 0.25;
/// The border of what was seen and the edge of an opening are never further apart than this, meters.
const REACH_M: f64 = 0.1;
/// Narrower pieces are between borders that are the same but for noise, meters.
const MIN_WIDTH_M: f64 = 0.03;
/// Smaller pieces are none, square meters: as in outlines.
const MIN_PIECE_M2: f64 = 0.01;
/// An edge of which less than this share was seen may be further away: the opening is open beyond it.
const SEEN: f64 = 0.25;
/// Where so many edges were seen, the face is the wall's, and its soffit may stand for that of the head.
const MIN_EDGES: usize = 2;
/// A soffit has so many points, so near to the head, meters.
const MIN_POINTS: usize = 8;
const SOFFIT_M: f64 = 0.03;
/// The lower laser tells of pieces that begin lower than this over the floor, meters.
const LOW_M: f64 = 0.75;

/// The surrounds of all openings, on both sides of their walls. `known` is what of walls is inferred already.
pub(super) fn surfaces(
    evidence: &Evidence<'_>,
    elements: &Elements,
    polygons: &[PlanarPolygon],
    known: &[InferredSurface],
) -> Vec<InferredSurface> {
    let mut found: Vec<InferredSurface> = Vec::new();
    for opening in &elements.openings {
        let Some(wall) = elements.wall(&opening.wall) else { continue };
        for side in [1.0, -1.0] {
            let Some(mut face) = Face::new(evidence, elements, polygons, (wall, opening), side) else {
                continue;
            };
            if count(face.is_seen) >= MIN_EDGES && !face.is_seen[1][1] {
                face.look_for_soffit();
            }
            let pieces = face.pieces(elements, known.iter().chain(&found));
            found.extend(pieces);
        }
    }
    found
}

/// What was seen of one side of a wall around an opening, in the coordinates of the plane that has the
/// larger part of it.
struct Face<'a> {
    evidence: &'a Evidence<'a>,
    plane: &'a Plane,
    /// All planes that lie there.
    planes: Vec<&'a Plane>,
    frame: Frame,
    /// The polygons of the plane itself.
    own: Vec<&'a PlanarPolygon>,
    shapes: Vec<Shape>,
    wall: &'a Wall,
    /// The opening.
    has_sill: bool,
    sides: [Span; 2],
    /// Which of its edges were seen: where none was, the opening may go on.
    is_seen: [[bool; 2]; 2],
    /// From corner to corner of the room that the face belongs to.
    span_m: Span,
}

impl<'a> Face<'a> {
    /// `None` where too little of it was seen.
    fn new(
        evidence: &'a Evidence<'a>,
        elements: &Elements,
        polygons: &'a [PlanarPolygon],
        (wall, opening): (&'a Wall, &WallOpening),
        side: f64,
    ) -> Option<Self> {
        let ([x, y], _) = wall.along();
        let place = place_of(wall, opening);
        let is_here = |index: &usize| {
            let plane = &evidence.model.planes[*index];
            side * (plane.normal[0] * y - plane.normal[1] * x) > 0.0
                && is_face_at(evidence, plane, wall, opening.center_m)
        };
        let planes: Vec<usize> = (0..evidence.model.planes.len()).filter(is_here).collect();
        let on = |index: usize| polygons.iter().filter(move |polygon| polygon.plane == index);
        let frame = |index: usize| {
            let near_m = on(index).next()?.outer_m.first()?;
            Some(Frame::new(&evidence.model.planes[index], *near_m))
        };
        let edges = |index: &usize| {
            let frame = frame(*index)?;
            let shapes: Vec<Shape> = on(*index).filter_map(|polygon| flat(&frame, polygon)).collect();
            let (_, is_seen) = settled(&place, &frame, &shapes);
            Some((count(is_seen), Reverse(*index)))
        };
        let (_, Reverse(index)) = planes.iter().filter_map(edges).max()?;
        let (plane, frame) = (&evidence.model.planes[index], frame(index)?);
        let all = planes.iter().flat_map(|index| on(*index));
        let shapes: Vec<Shape> = all.filter_map(|polygon| flat(&frame, polygon)).collect();
        let (sides, is_seen) = settled(&place, &frame, &shapes);
        let middle_m = (sides[0][0] + sides[0][1]) / 2.0;
        let rooms = elements.rooms.iter().filter(|room| wall.rooms.contains(&room.id));
        let span_m = rooms.filter_map(|room| span_of(room, plane, &frame, middle_m)).next()?;
        let has_sill = place.has_sill;
        Some(Self {
            evidence,
            plane,
            planes: planes.iter().map(|index| &evidence.model.planes[*index]).collect(),
            own: on(index).collect(),
            frame,
            shapes,
            wall,
            has_sill,
            sides,
            is_seen,
            span_m,
        })
    }

    /// The pieces to add beside what is inferred already.
    fn pieces<'b>(
        &self,
        elements: &Elements,
        known: impl Iterator<Item = &'b InferredSurface>,
    ) -> Vec<InferredSurface> {
        let is_here = |surface: &&InferredSurface| {
            let plane = surface.plane();
            self.planes.iter().any(|one| one.normal == plane.normal && one.offset_m == plane.offset_m)
        };
        let taken: Vec<Shape> =
            known.filter(is_here).filter_map(|surface| flat(&self.frame, &surface.polygon())).collect();
        let pieces = self.missing(elements, &taken);
        if pieces.is_empty() {
            return Vec::new();
        }
        let rays = PlaneRays::of(self.evidence, self.plane, &self.frame, &[self.sides]);
        let surface = |shape: Shape| {
            let rings = lifted_rings(&self.frame, shape, &self.own);
            of_wall(InferredKind::OpeningSurround, self.wall, self.plane, rings)
        };
        pieces.into_iter().filter(|piece| self.may_be_wall(piece, &rays[0])).filter_map(surface).collect()
    }

    /// Counts the head as seen where its soffit was. Points on a jamb's reveal may as well be furniture that
    /// stands in the opening.
    fn look_for_soffit(&mut self) {
        let depth_m = self.evidence.pass_m()..self.wall.drawn_thickness_m;
        let [[left, right], [_, head_m]] = self.sides;
        let is_soffit = |point: &&[f32; 3]| {
            let point = point.map(f64::from);
            let [u, v] = self.frame.steps(point).map(|step| step * STEP_M);
            let is_below = left < u && u < right && (v - head_m).abs() <= SOFFIT_M;
            is_below && depth_m.contains(&-self.plane.distance_m(point))
        };
        self.is_seen[1][1] = self.evidence.cloud.points_m.iter().filter(is_soffit).count() >= MIN_POINTS;
    }

    /// What nobody saw around an opening.
    fn missing(&self, elements: &Elements, taken: &[Shape]) -> Vec<Shape> {
        let up = |z: f64| {
            let [x, y] = self.wall.axis_m[0];
            self.frame.steps([x, y, z])[1] * STEP_M
        };
        let floor_m = self.evidence.floor_m;
        let [[left, right], [sill, head]] = self.sides;
        let [from, to] = self.span_m;
        // Beyond a head or sill that nobody saw nothing is added. Beyond a jamb that nobody saw the opening
        // may go on; over its head and under its sill the wall goes on in any case.
        let wide = self.is_seen[1].map(|is_seen| if is_seen { WIDTH_M } else { 0.0 });
        let low = if self.has_sill { (sill - wide[0]).max(up(floor_m)) } else { up(floor_m) };
        let high = (head + wide[1]).min(up(floor_m + self.wall.height_m));
        let around = [[(left - WIDTH_M).max(from), (right + WIDTH_M).min(to)], [low, high]];
        if around.iter().any(|[from, to]| to - from < MIN_WIDTH_M) {
            return Vec::new();
        }
        let further = self.is_seen[0].map(|is_seen| if is_seen { 0.0 } else { WIDTH_M });
        let opening = [[left - further[0], right + further[1]], [sill, head]];
        let around = [vec![ring(around)]];
        let seen = intersection(&self.shapes, &around);
        let known = intersection(taken, &around);
        let others = elements.openings.iter().filter(|opening| opening.wall == self.wall.id);
        let others = others.map(|opening| place_of(self.wall, opening).in_frame(&self.frame));
        let open: Vec<Ring> = others.chain([opening]).map(ring).collect();
        let less = seen.iter().chain(&known).flatten().chain(&open).map(Vec::as_slice);
        let mut pieces = clearance::clear(difference(around.iter().flatten().map(Vec::as_slice), less));
        pieces.retain(is_wide);
        pieces
    }

    /// Whether no ray passed a piece, but for noise.
    fn may_be_wall(&self, piece: &Shape, rays: &PlaneRays) -> bool {
        rays.allow(|place| holds(std::slice::from_ref(piece), *place)) && !self.is_free_behind(piece)
    }

    /// Whether the lower laser looked through the wall where a piece begins low.
    fn is_free_behind(&self, piece: &Shape) -> bool {
        let lift = |x: f64, y: i32| self.frame.lift(FlatPoint::new(x as i32, y));
        let low = piece.iter().flatten().map(|p| p.y).min().unwrap_or(0);
        if lift(0.0, low)[2] > self.evidence.floor_m + LOW_M {
            return false;
        }
        let [from, to] = extent(piece.iter().flatten().map(|p| f64::from(p.x)));
        let steps = ((to - from) * STEP_M / CELL_M).ceil().max(1.0) as usize;
        (0..steps).any(|step| {
            let place = lift(from + (to - from) * (step as f64 + 0.5) / steps as f64, low);
            is_free_behind(self.evidence, self.plane, place, CELL_M)
        })
    }
}

/// The rectangle of an opening with its edges where the border of what was seen is straight, and which edges
/// were seen.
fn settled(place: &Place, frame: &Frame, shapes: &[Shape]) -> ([Span; 2], [[bool; 2]; 2]) {
    let mut sides = place.in_frame(frame);
    // A door has no sill to be seen.
    let mut is_seen = [[false; 2], [!place.has_sill, false]];
    for edge in rectangle::edges(sides, place.has_sill, REACH_M) {
        let border = edge.border(shapes);
        let lines = border.iter().filter(|into| into.is_some()).count();
        if let Some(into) = edge.straight(&border).filter(|_| lines as f64 >= SEEN * border.len() as f64) {
            let end = usize::from(edge.sign > 0.0);
            sides[edge.axis][end] = edge.at_m + edge.sign * into;
            is_seen[edge.axis][end] = true;
        }
    }
    (sides, is_seen)
}

fn count(is_seen: [[bool; 2]; 2]) -> usize {
    is_seen.as_flattened().iter().filter(|is_seen| **is_seen).count()
}

/// From where to where a room has its border in a plane, at a place along it.
fn span_of(room: &Room, plane: &Plane, frame: &Frame, at_m: f64) -> Option<Span> {
    let of_ring = |ring: &Vec<[f64; 2]>| {
        let ends = ring.iter().zip(ring.iter().cycle().skip(1)).map(|(a, b)| [*a, *b]);
        let spans = ends.filter_map(|ends| {
            let ends = ends.map(|[x, y]| [x, y, frame.lift(FlatPoint::new(0, 0))[2]]);
            let is_near = ends.iter().all(|end| plane.distance_m(*end).abs() <= BESIDE_M);
            let [a, b] = ends.map(|end| frame.steps(end)[0] * STEP_M);
            (is_near && a.min(b) < at_m && at_m < a.max(b)).then_some([a.min(b), a.max(b)])
        });
        spans.collect::<Vec<Span>>()
    };
    std::iter::once(&room.outline_m).chain(&room.holes_m).flat_map(of_ring).next()
}

/// Whether a piece is more than a slit between two borders.
fn is_wide(piece: &Shape) -> bool {
    let Some(outer) = piece.first() else { return false };
    let area_m2 = area_m2(outer);
    let ends = outer.iter().zip(outer.iter().cycle().skip(1));
    let around_m: f64 = ends
        .map(|(a, b)| {
            let [x, y] = [f64::from(b.x) - f64::from(a.x), f64::from(b.y) - f64::from(a.y)];
            (x * x + y * y).sqrt() * STEP_M
        })
        .sum();
    area_m2 >= MIN_PIECE_M2 && 2.0 * area_m2 >= MIN_WIDTH_M * around_m
}
