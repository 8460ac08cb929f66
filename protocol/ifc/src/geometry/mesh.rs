//! Flat faces with holes as triangles.

use i_overlay::core::overlay::IntOverlayOptions;
use i_overlay::core::solver::Solver;
use i_overlay::i_float::int::point::IntPoint;
use i_triangle::int::triangulator::IntTriangulator;
use i_triangle::int::validation::Validation;

use crate::geometry::vector::{Placement, Vec3, add, cross, dot, sub, unit};

/// Three corners, counter-clockwise seen from outside.
pub(crate) type Triangle = [Vec3; 3];

/// Steps in which a face's longest side is counted: exact in all operations on it.
const STEPS: f64 = (1 << 24) as f64;

/// Normal of a ring by all its corners (Newell), not of length 1.
pub(crate) fn ring_normal(ring: &[Vec3]) -> Vec3 {
    let edges = ring.iter().zip(ring.iter().cycle().skip(1));
    let origin = ring.first().copied().unwrap_or_default();
    edges.fold([0.0; 3], |sum, (a, b)| add(sum, cross(sub(*a, origin), sub(*b, origin))))
}

/// Triangles of a face: its outline and the holes in it. They look where the outline's normal points to.
pub(crate) fn face(rings: &[Vec<Vec3>]) -> Vec<Triangle> {
    let Some(outer) = rings.first() else { return Vec::new() };
    let Some(normal) = unit(ring_normal(outer)) else { return Vec::new() };
    match (&outer[..], rings.len()) {
        ([a, b, c], 1) => vec![[*a, *b, *c]],
        ([a, b, c, d], 1) if is_convex([*a, *b, *c, *d], normal) => vec![[*a, *b, *c], [*a, *c, *d]],
        _ => cut(rings, normal),
    }
}

fn is_convex(corners: [Vec3; 4], normal: Vec3) -> bool {
    (0..4).all(|k| {
        let [a, b, c] = [0, 1, 2].map(|step| corners[(k + step) % 4]);
        dot(cross(sub(b, a), sub(c, b)), normal) > 0.0
    })
}

fn cut(rings: &[Vec<Vec3>], normal: Vec3) -> Vec<Triangle> {
    let frame = Placement::new(rings[0][0], normal, [1.0, 0.0, 0.0]);
    let flat = |point: &Vec3| {
        let off = sub(*point, frame.origin);
        frame.axes.map(|axis| dot(off, axis))
    };
    let all = || rings.iter().flatten().map(flat);
    let extent = all().fold(0.0_f64, |far, [x, y, _]| far.max(x.abs()).max(y.abs()));
    if extent <= 0.0 || !extent.is_finite() {
        return Vec::new();
    }
    let step = extent / STEPS;
    let shape: Vec<Vec<IntPoint<i32>>> = rings
        .iter()
        .enumerate()
        .map(|(index, ring)| {
            let point = |[x, y, _]: Vec3| IntPoint::new((x / step).round() as i32, (y / step).round() as i32);
            let points = ring.iter().map(|corner| point(flat(corner)));
            // Holes go round the other way than their outline.
            let is_left = dot(ring_normal(ring), normal) > 0.0;
            if is_left == (index == 0) { points.collect() } else { points.rev().collect() }
        })
        .collect();
    let options =
        IntOverlayOptions { preserve_input_collinear: true, ..IntOverlayOptions::keep_output_points() };
    let validation = Validation { options, ..Validation::default() };
    let found = IntTriangulator::<i32, u32>::new(64, validation, Solver::default()).triangulate_shape(&shape);
    let lift = |index: u32| {
        let point = found.points.get(index as usize)?;
        Some(frame.point([f64::from(point.x) * step, f64::from(point.y) * step, 0.0]))
    };
    let triangle = |t: &[u32]| Some([lift(t[0])?, lift(t[1])?, lift(t[2])?]);
    found.indices.chunks_exact(3).filter_map(triangle).collect()
}

#[cfg(test)]
mod tests {
    use super::{Vec3, cross, dot, face, sub};

    fn area(triangles: &[[Vec3; 3]], normal: Vec3) -> f64 {
        triangles.iter().map(|[a, b, c]| dot(cross(sub(*b, *a), sub(*c, *a)), normal) / 2.0).sum()
    }

    #[test]
    fn a_face_with_a_hole_has_its_area_and_looks_where_its_outline_does() {
        let square = |side: f64| {
            let s = side / 2.0;
            vec![[5.0, -s, -s], [5.0, s, -s], [5.0, s, s], [5.0, -s, s]]
        };
        let found = face(&[square(4.0), square(1.0)]);
        assert!((area(&found, [1.0, 0.0, 0.0]) - 15.0).abs() < 1e-5, "{found:?}");
        let mut back = square(4.0);
        back.reverse();
        assert!((area(&face(&[back, square(2.0)]), [1.0, 0.0, 0.0]) + 12.0).abs() < 1e-5);
        let arrow = vec![[0.0, 0.0, 1.0], [4.0, 0.0, 1.0], [1.0, 1.0, 1.0], [0.0, 4.0, 1.0]];
        assert!((area(&face(&[arrow]), [0.0, 0.0, 1.0]) - 4.0).abs() < 1e-5);
    }
}
