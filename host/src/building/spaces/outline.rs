//! The outline of a room: the union of its cells, each edge on the line of a wall.

use super::arrangement::{Cell, LineOf, length_m};
use super::faces::Face;
use super::raster::Grid;
use crate::reconstruct::polygons::outline::union::{Shape, area_m2, union};
use crate::reconstruct::polygons::plane_frame::{FlatPoint, STEP_M};
use biplane_geometry::vec2::{cross, dot, minus};

/// Corners this close to a line lie on it, meters: corners are rounded to whole steps.
const ON_LINE_M: f64 = 5.0 * STEP_M;
/// A corner this close to an edge is on it, meters.
const TOUCH_M: f64 = 1e-5;
/// Jogs of a wall that are smaller are noise of its faces, meters.
const MIN_JOG_M: f64 = 0.08;
/// Smaller parts of a room are none, square meters.
const MIN_PART_M2: f64 = 1.0;
/// Smaller holes are closed, square meters.
const MIN_HOLE_M2: f64 = 0.02;

/// An edge of an outline.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Edge {
    /// Where it begins; it ends where the next one begins.
    pub from_m: [f64; 2],
    /// The face whose line it lies on.
    pub line: LineOf,
}

/// A ring of edges: the outer one counter-clockwise, holes clockwise, the room to the left.
pub(crate) type Ring = Vec<Edge>;

/// The ends of each edge of a ring, with its line.
pub(crate) fn ends(ring: &Ring) -> impl Iterator<Item = ([[f64; 2]; 2], LineOf)> + '_ {
    let pairs = ring.iter().zip(ring.iter().cycle().skip(1));
    pairs.map(|(edge, next)| ([edge.from_m, next.from_m], edge.line))
}

/// Signed area of a ring, square meters.
pub(crate) fn signed_area_m2(ring: &Ring) -> f64 {
    0.5 * ends(ring).map(|([a, b], _)| cross(a, b)).sum::<f64>()
}

/// The outline of the cells of a room: its outer ring, then its holes. Empty when nothing is left.
pub(crate) fn of<'a>(grid: &Grid, faces: &[Face], cells: impl Iterator<Item = &'a Cell>) -> Vec<Ring> {
    let [x, y] = grid.origin_m;
    let flat = |p: &[f64; 2]| {
        FlatPoint::new(((p[0] - x) / STEP_M).round() as i32, ((p[1] - y) / STEP_M).round() as i32)
    };
    let cells: Vec<&Cell> = cells.collect();
    let rings: Vec<Vec<FlatPoint>> =
        with_corners_of_all(&cells).iter().map(|corners| corners.iter().map(flat).collect()).collect();
    let largest = |a: &Shape, b: &Shape| area_m2(&a[0]).total_cmp(&area_m2(&b[0]));
    let shapes = union(rings.iter().map(Vec::as_slice));
    let Some(shape) = shapes.into_iter().filter(|shape| !shape.is_empty()).max_by(largest) else {
        return Vec::new();
    };
    if area_m2(&shape[0]) < MIN_PART_M2 {
        return Vec::new();
    }
    let back = |p: &FlatPoint| [x + f64::from(p.x) * STEP_M, y + f64::from(p.y) * STEP_M];
    let kept = shape.iter().enumerate().filter(|(at, ring)| *at == 0 || area_m2(ring) >= MIN_HOLE_M2);
    kept.map(|(_, ring)| on_lines(&ring.iter().map(back).collect::<Vec<_>>(), faces))
        .filter(|ring| ring.len() >= 3)
        .collect()
}

/// The corners of each cell with those of others that lie on its edges: rounded to steps they would lie
/// beside them, and cells that touch would not hang together.
fn with_corners_of_all(cells: &[&Cell]) -> Vec<Vec<[f64; 2]>> {
    let all: Vec<[f64; 2]> = cells.iter().flat_map(|cell| cell.corners_m.iter().copied()).collect();
    let on_edge = |[a, b]: [[f64; 2]; 2]| {
        let (way, length) = (minus(b, a), length_m([a, b]).max(1e-12));
        let mut on: Vec<(f64, [f64; 2])> = all
            .iter()
            .map(|p| (dot(minus(*p, a), way) / length, cross(way, minus(*p, a)) / length, *p))
            .filter(|(at, off, _)| off.abs() < TOUCH_M && *at > TOUCH_M && *at < length - TOUCH_M)
            .map(|(at, _, p)| (at, p))
            .collect();
        on.sort_by(|a, b| a.0.total_cmp(&b.0));
        std::iter::once(a).chain(on.into_iter().map(|(_, p)| p)).collect::<Vec<_>>()
    };
    cells.iter().map(|cell| cell.edges().flat_map(|(ends, _)| on_edge(ends)).collect()).collect()
}

/// Gives each edge its line, and corners that are where lines cross.
fn on_lines(corners: &[[f64; 2]], faces: &[Face]) -> Ring {
    let pairs = corners.iter().zip(corners.iter().cycle().skip(1));
    let mut ring: Ring = pairs.map(|(a, b)| Edge { from_m: *a, line: line_of(*a, *b, faces) }).collect();
    loop {
        join_same(&mut ring);
        if !drop_jog(&mut ring) {
            break;
        }
    }
    let crossed = |at: usize| {
        let before = ring[(at + ring.len() - 1) % ring.len()].line?;
        crossing(&faces[before], &faces[ring[at].line?])
    };
    let corners: Vec<Option<[f64; 2]>> = (0..ring.len()).map(crossed).collect();
    for (edge, corner) in ring.iter_mut().zip(corners) {
        edge.from_m = corner.unwrap_or(edge.from_m);
    }
    ring
}

fn line_of(a: [f64; 2], b: [f64; 2], faces: &[Face]) -> LineOf {
    let off = |face: &Face| face.before_m(a).abs().max(face.before_m(b).abs());
    let near = faces.iter().enumerate().map(|(index, face)| (index, off(face)));
    near.filter(|(_, off)| *off <= ON_LINE_M).min_by(|a, b| a.1.total_cmp(&b.1)).map(|(index, _)| index)
}

/// Makes edges one that follow each other on one line.
fn join_same(ring: &mut Ring) {
    let mut at = 0;
    while ring.len() > 3 && at < ring.len() {
        let before = ring[(at + ring.len() - 1) % ring.len()].line;
        if before.is_some() && before == ring[at].line {
            ring.remove(at);
        } else {
            at += 1;
        }
    }
}

/// Takes out one jog: a short edge between two that run on in one direction; the shorter of the two comes
/// onto the line of the other.
fn drop_jog(ring: &mut Ring) -> bool {
    let count = ring.len();
    if count <= 4 {
        return false;
    }
    let length = |at: usize| length_m([ring[at % count].from_m, ring[(at + 1) % count].from_m]);
    let way = |at: usize| minus(ring[(at + 1) % count].from_m, ring[at % count].from_m);
    let jog = (0..count).find(|at| {
        let (before, after) = ((at + count - 1) % count, (at + 1) % count);
        let cosine = dot(way(before), way(after)) / (length(before) * length(after)).max(1e-12);
        length(*at) < MIN_JOG_M && cosine > 0.99
    });
    let Some(at) = jog else { return false };
    let (before, after) = ((at + count - 1) % count, (at + 1) % count);
    let line = if length(before) >= length(after) { ring[before].line } else { ring[after].line };
    // The corner before stays on the line that is kept by the crossing with its own neighbor.
    ring[before].line = line;
    let mut gone = [at, after];
    gone.sort_unstable();
    ring.remove(gone[1]);
    ring.remove(gone[0]);
    true
}

/// Where the lines of two faces cross; `None` when they are nearly parallel.
pub(crate) fn crossing(a: &Face, b: &Face) -> Option<[f64; 2]> {
    let sine = cross(a.normal, b.normal);
    (sine.abs() > 0.05).then(|| {
        let [x, y] = [
            a.offset_m * b.normal[1] - b.offset_m * a.normal[1],
            b.offset_m * a.normal[0] - a.offset_m * b.normal[0],
        ];
        [x / sine, y / sine]
    })
}
