//! The plain check that neighbors have no cracks between them: all corners against all edges, for tests.
//!
//! It knows nothing of seams: it sees polygons, and asks where two of them that do not lie in one direction
//! nearly touch. Frame `map`, meters.

use crate::model::{Model, PlanarPolygon};
use biplane_geometry::vec3::{dot, minus, norm};

/// What is nearer than this touches, meters.
pub(crate) const TOUCH_M: f64 = 0.001;
/// Edges that run along each other further apart than this have something between them, meters.
const GAP_M: f64 = 0.01;
/// Planes closer to parallel than this (sine of the angle; 15 degrees) do not meet in a line.
const MIN_SINE: f64 = 0.26;

/// What is wrong between neighbors.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct TJunctions {
    /// Corners of one polygon in the middle of an edge of another.
    pub corners_in_edges: usize,
    /// Corners of two polygons that nearly meet.
    pub corners_apart: usize,
    /// Length of edges that run along each other, apart by more than [`TOUCH_M`] and less than a centimeter,
    /// meters.
    pub gaps_m: f64,
    /// Length of edges that run along each other and touch, meters: how much there was to check.
    pub shared_m: f64,
}

type Point = [f64; 3];

/// Looks at all pairs of polygons.
pub(crate) fn find(model: &Model) -> TJunctions {
    let mut found = TJunctions::default();
    for (index, a) in model.polygons.iter().enumerate() {
        for b in &model.polygons[index + 1..] {
            let cosine = dot(model.planes[a.plane].normal, model.planes[b.plane].normal);
            if 1.0 - cosine * cosine >= MIN_SINE * MIN_SINE {
                between(a, b, &mut found);
                between(b, a, &mut found);
                along(a, b, &mut found);
            }
        }
    }
    found
}

fn edges(polygon: &PlanarPolygon) -> impl Iterator<Item = (Point, Point)> {
    std::iter::once(&polygon.outer_m)
        .chain(&polygon.holes_m)
        .flat_map(|ring| ring.iter().zip(ring.iter().cycle().skip(1)).map(|(a, b)| (*a, *b)))
}

/// Corners of `a` against corners and edges of `b`.
fn between(a: &PlanarPolygon, b: &PlanarPolygon, found: &mut TJunctions) {
    for (corner, _) in edges(a) {
        let nearest = edges(b).map(|(p, _)| norm(minus(corner, p))).fold(f64::INFINITY, f64::min);
        if nearest < TOUCH_M {
            found.corners_apart += usize::from(nearest > 0.0);
            continue;
        }
        let off = |(p, q): (Point, Point)| {
            let edge = minus(q, p);
            let t = (dot(minus(corner, p), edge) / dot(edge, edge)).clamp(0.0, 1.0);
            norm(minus(corner, std::array::from_fn(|k| p[k] + t * edge[k])))
        };
        found.corners_in_edges += usize::from(edges(b).map(off).any(|off| off < TOUCH_M));
    }
}

/// Edges of `a` along edges of `b`.
fn along(a: &PlanarPolygon, b: &PlanarPolygon, found: &mut TJunctions) {
    for ((p, q), (r, s)) in edges(a).flat_map(|e| edges(b).map(move |f| (e, f))) {
        let whole = norm(minus(q, p));
        let unit = minus(q, p).map(|v| v / whole);
        let (from, to) = (dot(minus(r, p), unit), dot(minus(s, p), unit));
        let (low, high) = (from.min(to).max(0.0), from.max(to).min(whole));
        // Within some 10 degrees of each other, over more than a centimeter.
        if high - low < 0.01 || (to - from).abs() < 0.985 * norm(minus(s, r)) {
            continue;
        }
        let middle = 0.5 * (low + high);
        let t = (middle - from) / (to - from);
        let on_a: Point = std::array::from_fn(|k| p[k] + middle * unit[k]);
        let on_b: Point = std::array::from_fn(|k| r[k] + t * (s[k] - r[k]));
        match norm(minus(on_a, on_b)) {
            gap if gap < TOUCH_M => found.shared_m += high - low,
            gap if gap < GAP_M => found.gaps_m += high - low,
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{TJunctions, find};
    use crate::model::{Model, PlanarPolygon, Plane};

    fn floor_and_wall(wall: Vec<[f64; 3]>) -> TJunctions {
        let plane = |normal| Plane { normal, offset_m: 0.0, points: 3, rms_m: 0.0 };
        let floor = vec![[0.0, 0.0, 0.0], [0.0, -2.0, 0.0], [2.0, -2.0, 0.0], [2.0, 0.0, 0.0]];
        let polygon = |plane, outer_m| PlanarPolygon { plane, outer_m, holes_m: Vec::new() };
        find(&Model {
            planes: vec![plane([0.0, 0.0, 1.0]), plane([0.0, -1.0, 0.0])],
            polygons: vec![polygon(0, floor), polygon(1, wall)],
            ..Model::default()
        })
    }

    #[test]
    fn every_kind_of_crack_is_seen() {
        let wall = |x: f64, lift: f64| vec![[0.0, 0.0, lift], [x, 0.0, lift], [x, 0.0, 2.0], [0.0, 0.0, 2.0]];
        assert_eq!(floor_and_wall(wall(2.0, 0.0)), TJunctions { shared_m: 2.0, ..TJunctions::default() });
        assert_eq!(floor_and_wall(wall(1.5, 0.0)).corners_in_edges, 1);
        assert_eq!(floor_and_wall(wall(2.0005, 0.0)).corners_apart, 2);
        let lifted = floor_and_wall(wall(2.0, 0.004));
        assert_eq!((lifted.gaps_m, lifted.shared_m), (2.0, 0.0));
        assert_eq!(floor_and_wall(wall(2.0, 0.5)), TJunctions::default());
    }
}
