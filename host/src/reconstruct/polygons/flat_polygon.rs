//! Polygons in the coordinates of their plane, and back again.

use crate::model::PlanarPolygon;
use crate::reconstruct::polygons::outline::union::Shape;
use crate::reconstruct::polygons::plane_frame::{FlatPoint, Frame};
use std::collections::BTreeMap;

/// The rings of a polygon in the coordinates of a frame; `None` when they are out of its range.
pub(crate) fn flat(frame: &Frame, polygon: &PlanarPolygon) -> Option<Shape> {
    rings(polygon).map(|ring| ring.iter().map(|p| frame.flat(*p)).collect()).collect()
}

/// Shapes as polygons of plane `index`; see [`lifted_rings`].
pub(crate) fn lifted(
    index: usize,
    frame: &Frame,
    shapes: Vec<Shape>,
    before: &[&PlanarPolygon],
) -> Vec<PlanarPolygon> {
    let polygon = |shape: Shape| {
        let mut rings = lifted_rings(frame, shape, before);
        Some(PlanarPolygon { plane: index, outer_m: rings.next()?, holes_m: rings.collect() })
    };
    shapes.into_iter().filter_map(polygon).collect()
}

/// The rings of a shape. Corners that were there `before` are the same points, bit for bit: neighbors share
/// them.
pub(crate) fn lifted_rings<'a>(
    frame: &'a Frame,
    shape: Shape,
    before: &[&PlanarPolygon],
) -> impl Iterator<Item = Vec<[f64; 3]>> + use<'a> {
    let corners = before.iter().flat_map(|polygon| rings(polygon)).flatten();
    let known: BTreeMap<(i32, i32), [f64; 3]> =
        corners.filter_map(|p| frame.flat(*p).map(|at| ((at.x, at.y), *p))).collect();
    let lift = move |p: &FlatPoint| known.get(&(p.x, p.y)).copied().unwrap_or_else(|| frame.lift(*p));
    shape.into_iter().map(move |ring| ring.iter().map(&lift).collect())
}

/// The outer ring, then the holes.
pub(crate) fn rings(polygon: &PlanarPolygon) -> impl Iterator<Item = &Vec<[f64; 3]>> {
    std::iter::once(&polygon.outer_m).chain(&polygon.holes_m)
}

#[cfg(test)]
mod tests {
    use super::{flat, lifted};
    use crate::model::{PlanarPolygon, Plane};
    use crate::reconstruct::polygons::plane_frame::Frame;

    #[test]
    fn a_corner_that_was_there_before_comes_back_bit_for_bit() {
        let plane = Plane { normal: [0.6, 0.0, 0.8], offset_m: 1.0, points: 3, rms_m: 0.0 };
        let base = Frame::new(&plane, [0.0; 3]);
        let odd = |x: i32, y: i32| {
            let [a, b, c] = base.lift(super::FlatPoint::new(x, y));
            [a + 1.3e-5, b + 1.7e-5, c - 0.9e-5]
        };
        let outer_m = vec![odd(0, 0), odd(20_000, 0), odd(20_000, 20_000), odd(0, 20_000)];
        let holes_m = vec![vec![odd(5_000, 5_000), odd(5_000, 9_000), odd(9_000, 9_000)]];
        let polygon = PlanarPolygon { plane: 4, outer_m, holes_m };
        let shape = flat(&base, &polygon).unwrap();
        let again = lifted(4, &base, vec![shape.clone()], &[&polygon]);
        assert_eq!(again.as_slice(), std::slice::from_ref(&polygon));
        // Without it corners are where the frame has them.
        assert_ne!(lifted(4, &base, vec![shape], &[]).as_slice(), std::slice::from_ref(&polygon));
    }
}
