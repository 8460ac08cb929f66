//! One opening of a wall's face made a rectangle, as far as rays allow.

use super::border::{Border, Edge, LINE_M, covered};
use super::plane_rays::{AROUND_M, PlaneRays};
use crate::building::elevation::Span;
use crate::reconstruct::polygons::outline::union::{Ring, Shape, area_m2, difference, intersection};
use crate::reconstruct::polygons::plane_frame::{FlatPoint, Frame, STEP_M};

/// An edge and the border of what was seen are never further apart than this, meters.
const MAX_REACH_M: f64 = 0.2;
/// And may always be so far apart, meters.
const MIN_REACH_M: f64 = 0.05;
/// Between these the reach is so many times the distance between neighboring points.
const REACH_SPACINGS: f64 = 3.0;
/// And so many standard deviations of the noise.
const REACH_SIGMAS: f64 = 3.0;
/// Corners say nothing of where an edge is, meters.
const CORNER_M: f64 = 0.08;
/// Shorter stretches of an edge stay as they were seen, meters.
const MIN_RUN_M: f64 = 0.05;
/// Points in an opening on a surface that reaches into it: more are something that stands there.
const MAX_POINTS: usize = 3;

/// An opening where its wall has it.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Place {
    /// Its jambs in the middle of the wall.
    pub ends_m: [[f64; 2]; 2],
    /// Its lower and upper edge.
    pub heights_m: [f64; 2],
    /// Whether there is wall under it.
    pub has_sill: bool,
}

impl Place {
    /// From where to where it goes along both axes of a plane, meters.
    pub(super) fn in_frame(&self, frame: &Frame) -> [Span; 2] {
        let corners = [0, 1].map(|end| {
            let [x, y] = self.ends_m[end];
            frame.steps([x, y, self.heights_m[end]]).map(|step| step * STEP_M)
        });
        [0, 1].map(|axis| {
            let [a, b] = corners.map(|corner| corner[axis]);
            [a.min(b), a.max(b)]
        })
    }
}

/// Shapes with a rectangle for an opening.
pub(super) fn cut(
    shapes: Vec<Shape>,
    expected: [Span; 2],
    has_sill: bool,
    rays: &PlaneRays,
    sigma_m: f64,
) -> Vec<Shape> {
    let reach_m = reach_m(&shapes, expected, rays, sigma_m);
    let edges = edges(expected, has_sill, reach_m);
    let borders: Vec<Border> = edges.iter().map(|edge| edge.border(&shapes)).collect();
    if borders.iter().all(|border| border.iter().all(Option::is_none)) {
        return shapes;
    }
    let mut rectangle = expected;
    for (edge, border) in edges.iter().zip(&borders) {
        let inner = Edge { lines_m: [edge.lines_m[0] + CORNER_M, edge.lines_m[1] - CORNER_M], ..*edge };
        let into = inner.best(&inner.border(&shapes), &rays.hits_m, &rays.passes_m);
        let end = usize::from(edge.sign > 0.0);
        if border.iter().any(Option::is_some) {
            rectangle[edge.axis][end] = edge.at_m + edge.sign * into;
        }
    }
    if (0..2).any(|axis| rectangle[axis][0] >= rectangle[axis][1]) {
        return shapes;
    }
    let taken = reaching_in(&shapes, rectangle, has_sill, reach_m, rays);
    let mut fills: Vec<(usize, Ring)> = Vec::new();
    for edge in settled(&edges, rectangle, reach_m) {
        fills.extend(strips(&edge, &edge.border(&shapes), &shapes, &rays.blocked_m));
    }
    let freed = rays.blocked_m.iter().filter(|place| holds(&taken, **place)).count();
    let fills = within(fills, freed);
    if fills.is_empty() && taken.is_empty() {
        return shapes;
    }
    let rings = shapes.iter().flatten().chain(&fills).map(Vec::as_slice);
    difference(rings, taken.iter().flatten().map(Vec::as_slice))
}

/// Strips that block no more rays than are freed by what is taken away; those that block none always.
fn within(mut strips: Vec<(usize, Ring)>, freed: usize) -> Vec<Ring> {
    strips.sort_by_key(|(blocked, _)| *blocked);
    let mut left = freed;
    let mut is_free = |blocked: usize| {
        let fits = blocked <= left;
        left -= if fits { blocked } else { 0 };
        fits
    };
    strips.into_iter().filter(|(blocked, _)| is_free(*blocked)).map(|(_, ring)| ring).collect()
}

/// How far an edge and the border of what was seen may be apart: by noise and the distance between points.
fn reach_m(shapes: &[Shape], expected: [Span; 2], rays: &PlaneRays, sigma_m: f64) -> f64 {
    let [width, height] = expected.map(|[from, to]| to - from + 2.0 * AROUND_M);
    let inside: f64 = expected.iter().map(|[from, to]| to - from).product();
    let around_m2 = (width * height - inside).max(0.0).min(shapes.iter().flatten().map(|r| area_m2(r)).sum());
    let spacing_m = (around_m2 / rays.hits_m.len().max(1) as f64).sqrt();
    (REACH_SPACINGS * spacing_m + REACH_SIGMAS * sigma_m).clamp(MIN_REACH_M, MAX_REACH_M)
}

/// The edges of a rectangle: jambs, head, and sill where there is one.
pub(super) fn edges(rectangle: [Span; 2], has_sill: bool, reach_m: f64) -> Vec<Edge> {
    let sides = [(0, 0), (0, 1), (1, 1), (1, 0)];
    let of = |(axis, end): (usize, usize)| Edge {
        axis,
        at_m: rectangle[axis][end],
        sign: [-1.0, 1.0][end],
        lines_m: rectangle[1 - axis],
        reach_m,
    };
    sides.into_iter().map(of).take(if has_sill { 4 } else { 3 }).collect()
}

/// The same edges where they belong. Lines go on beyond the corners, so that no gap is left there.
fn settled(edges: &[Edge], rectangle: [Span; 2], reach_m: f64) -> Vec<Edge> {
    let of = |edge: &Edge| {
        let [from, to] = rectangle[1 - edge.axis];
        Edge {
            at_m: rectangle[edge.axis][usize::from(edge.sign > 0.0)],
            lines_m: [from - reach_m, to + reach_m],
            ..*edge
        }
    };
    edges.iter().map(of).collect()
}

/// The strips to add along an edge, from the edge to the border where that is within reach, and how many rays
/// each would block.
fn strips(edge: &Edge, border: &Border, shapes: &[Shape], blocked_m: &[[f64; 2]]) -> Vec<(usize, Ring)> {
    let mut found = Vec::new();
    let mut first = 0;
    for line in 0..=border.len() {
        if border.get(line).is_some_and(Option::is_some) {
            continue;
        }
        let depth_m = border[first..line].iter().filter_map(|into| *into).fold(0.0, f64::max);
        let ends = [first, line].map(|line| edge.lines_m[0] + line as f64 * LINE_M);
        if depth_m > STEP_M && ends[1] - ends[0] >= MIN_RUN_M {
            let depth = [edge.at_m, edge.at_m + edge.sign * depth_m];
            let mut sides = [[0.0; 2]; 2];
            sides[edge.axis] = [depth[0].min(depth[1]), depth[0].max(depth[1])];
            sides[1 - edge.axis] = ends;
            found.push((blocked_by(sides, shapes, blocked_m), ring(sides)));
        }
        first = line + 1;
    }
    found
}

/// How many rays are blocked where a rectangle would add surface.
fn blocked_by(sides: [Span; 2], shapes: &[Shape], blocked_m: &[[f64; 2]]) -> usize {
    let inside = blocked_m
        .iter()
        .filter(|place| (0..2).all(|axis| place[axis] > sides[axis][0] && place[axis] < sides[axis][1]));
    inside.filter(|place| !holds(shapes, **place)).count()
}

/// Whether a place is on one of these shapes.
pub(super) fn holds(shapes: &[Shape], place: [f64; 2]) -> bool {
    covered(shapes, 0, place[1]).iter().any(|[from, to]| (*from..*to).contains(&place[0]))
}

/// The ring around a rectangle, counter-clockwise.
pub(super) fn ring([[u0, u1], [v0, v1]]: [Span; 2]) -> Ring {
    let step = |value: f64| (value / STEP_M).round() as i32;
    [[u0, v0], [u1, v0], [u1, v1], [u0, v1]].map(|[u, v]| FlatPoint::new(step(u), step(v))).to_vec()
}

/// The pieces of shapes that reach into a rectangle, but for what stands there.
fn reaching_in(
    shapes: &[Shape],
    rectangle: [Span; 2],
    has_sill: bool,
    reach_m: f64,
    rays: &PlaneRays,
) -> Vec<Shape> {
    let mut sides = rectangle;
    if !has_sill {
        // A door is open down to whatever of its wall is lowest.
        let lowest = shapes.iter().flatten().flatten().map(|p| f64::from(p.y) * STEP_M);
        sides[1][0] = lowest.fold(sides[1][0], f64::min) - 1.0;
    }
    let deep = [0, 1].map(|axis| [sides[axis][0] + reach_m, sides[axis][1] - reach_m]);
    let inside = intersection(shapes, &[vec![ring(sides)]]);
    inside.into_iter().filter(|shape| !stands(shape, deep, rays)).collect()
}

/// Whether a piece of surface in an opening is something that stands there: it reaches deep into it, and more
/// rays end on it than pass.
fn stands(piece: &Shape, deep: [Span; 2], rays: &PlaneRays) -> bool {
    let piece = std::slice::from_ref(piece);
    let is_deep = piece.iter().flatten().flatten().any(|p| {
        let place = [f64::from(p.x) * STEP_M, f64::from(p.y) * STEP_M];
        (0..2).all(|axis| place[axis] > deep[axis][0] && place[axis] < deep[axis][1])
    });
    let count = |places: &[[f64; 2]]| places.iter().filter(|place| holds(piece, **place)).count();
    let (hits, passes) = (count(&rays.hits_m), count(&rays.passes_m));
    is_deep && hits > MAX_POINTS.max(passes)
}
