//! The plain check that neighbours have no cracks between them: all corners against all edges, for tests.
//!
//! It knows nothing of seams: it sees polygons, and asks where two of them that do not lie in one direction nearly touch. Frame `map`, metres.

use crate::model::{Model, PlanarPolygon};
use crate::planes::scatter::dot;

/// What is nearer than this touches, metres.
pub const TOUCH_M: f64 = 0.001;
/// Edges that run along each other further apart than this have something between them, metres.
const GAP_M: f64 = 0.01;
/// Planes closer to parallel than this (sine of the angle; 15 degrees) do not meet in a line.
const MIN_SINE: f64 = 0.26;

/// What is wrong between neighbours.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cracks {
    /// Corners of one polygon in the middle of an edge of another.
    pub corners_in_edges: usize,
    /// Corners of two polygons that nearly meet.
    pub corners_apart: usize,
    /// Length of edges that run along each other, apart by more than [`TOUCH_M`] and less than a centimetre, metres.
    pub gaps_m: f64,
    /// Length of edges that run along each other and touch, metres: how much there was to check.
    pub shared_m: f64,
}

type Point = [f64; 3];

/// Looks at all pairs of polygons.
pub fn find(model: &Model) -> Cracks {
    let mut found = Cracks::default();
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

fn sub(a: Point, b: Point) -> Point {
    std::array::from_fn(|k| a[k] - b[k])
}

fn length(v: Point) -> f64 {
    dot(v, v).sqrt()
}

/// Corners of `a` against corners and edges of `b`.
fn between(a: &PlanarPolygon, b: &PlanarPolygon, found: &mut Cracks) {
    for (corner, _) in edges(a) {
        let nearest = edges(b).map(|(p, _)| length(sub(corner, p))).fold(f64::INFINITY, f64::min);
        if nearest < TOUCH_M {
            found.corners_apart += usize::from(nearest > 0.0);
            continue;
        }
        let off = |(p, q): (Point, Point)| {
            let edge = sub(q, p);
            let t = (dot(sub(corner, p), edge) / dot(edge, edge)).clamp(0.0, 1.0);
            length(sub(corner, std::array::from_fn(|k| p[k] + t * edge[k])))
        };
        found.corners_in_edges += usize::from(edges(b).map(off).any(|off| off < TOUCH_M));
    }
}

/// Edges of `a` along edges of `b`.
fn along(a: &PlanarPolygon, b: &PlanarPolygon, found: &mut Cracks) {
    for ((p, q), (r, s)) in edges(a).flat_map(|e| edges(b).map(move |f| (e, f))) {
        let whole = length(sub(q, p));
        let unit = sub(q, p).map(|v| v / whole);
        let (from, to) = (dot(sub(r, p), unit), dot(sub(s, p), unit));
        let (low, high) = (from.min(to).max(0.0), from.max(to).min(whole));
        // Within some 10 degrees of each other, over more than a centimetre.
        if high - low < 0.01 || (to - from).abs() < 0.985 * length(sub(s, r)) {
            continue;
        }
        let middle = 0.5 * (low + high);
        let t = (middle - from) / (to - from);
        let on_a: Point = std::array::from_fn(|k| p[k] + middle * unit[k]);
        let on_b: Point = std::array::from_fn(|k| r[k] + t * (s[k] - r[k]));
        match length(sub(on_a, on_b)) {
            gap if gap < TOUCH_M => found.shared_m += high - low,
            gap if gap < GAP_M => found.gaps_m += high - low,
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{Cracks, find};
    use crate::model::{Model, PlanarPolygon, Plane};

    fn floor_and_wall(wall: Vec<[f64; 3]>) -> Cracks {
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
        assert_eq!(floor_and_wall(wall(2.0, 0.0)), Cracks { shared_m: 2.0, ..Cracks::default() });
        assert_eq!(floor_and_wall(wall(1.5, 0.0)).corners_in_edges, 1);
        assert_eq!(floor_and_wall(wall(2.0005, 0.0)).corners_apart, 2);
        let lifted = floor_and_wall(wall(2.0, 0.004));
        assert_eq!((lifted.gaps_m, lifted.shared_m), (2.0, 0.0));
        assert_eq!(floor_and_wall(wall(2.0, 0.5)), Cracks::default());
    }
}
