//! Notches in the borders of surfaces: where no scan met the surface, or something thin hid it. They are
//! filled where no rays pass.

use super::plane_rays::PlaneRays;
use super::rectangle::holds;
use crate::building::elevation::Span;
use crate::reconstruct::polygons::outline::border::segment_distance;
use crate::reconstruct::polygons::outline::slits::closed;
use crate::reconstruct::polygons::outline::union::{Ring, Shape, area_m2, difference, union};
use crate::reconstruct::polygons::plane_frame::{FlatPoint, STEP_M};
use crate::reconstruct::polygons::seams::met_edges::PlaneSeams;
use biplane_geometry::PortableMath;

/// Notches are narrower than this, meters. Larger: surface is invented that nobody saw. Smaller: borders
/// between far scans stay ragged.
const WIDTH_M: f64 = 0.3;
/// What is shallower is left as it is, meters.
const MIN_DEPTH_M: f64 = 0.01;
/// What is narrower is between borders that are the same but for rounding, meters.
const HAIR_M: f64 = 0.002;
/// An edge lies along the border of a notch when its middle is this near to it, steps: rounding.
const ALONG_STEPS: f64 = 3.0;

/// The notches of each shape by itself: gaps between two surfaces are none, and neither are holes. Behind a
/// narrow mouth there may be a wide place, such as a window over a slit: that is a hole then. Where a surface
/// of another plane meets the border of a notch, it stands there.
pub(super) fn find(shapes: &[Shape], seams: &PlaneSeams) -> Vec<Shape> {
    let outer: Vec<&Ring> = shapes.iter().filter_map(|shape| shape.first()).collect();
    let filled: Vec<Ring> =
        outer.iter().flat_map(|ring| closed(&[vec![ring.to_vec()]], WIDTH_M)).flatten().collect();
    let pieces = difference(filled.iter().map(Vec::as_slice), outer.iter().map(|ring| ring.as_slice()));
    let met: Vec<FlatPoint> = outer.iter().flat_map(|ring| met_middles(ring, seams)).collect();
    pieces
        .into_iter()
        .filter(|piece| is_deep(piece, &outer) && !met.iter().any(|p| is_along(piece, *p)))
        .collect()
}

/// From where to where a shape goes along both axes.
pub(super) fn sides(shape: &Shape) -> [Span; 2] {
    [0, 1].map(|axis| shape.first().map_or([0.0; 2], |outer| super::holes::extent(outer, axis)))
}

/// Shapes with the notches filled that no rays pass.
pub(super) fn filled(shapes: Vec<Shape>, notches: &[Shape], rays: &[PlaneRays]) -> Vec<Shape> {
    let is_free = |notch: &Shape, rays: &PlaneRays| {
        !rays.blocked_m.iter().any(|place| holds(std::slice::from_ref(notch), *place))
    };
    let free = notches.iter().zip(rays).filter(|(notch, rays)| is_free(notch, rays));
    let fills: Vec<&Ring> = free.flat_map(|(notch, _)| notch).collect();
    if fills.is_empty() {
        return shapes;
    }
    union(shapes.iter().flatten().chain(fills).map(Vec::as_slice))
}

fn edges(ring: &Ring) -> impl Iterator<Item = (&FlatPoint, &FlatPoint)> {
    ring.iter().zip(ring.iter().cycle().skip(1))
}

/// The middles of the edges that surfaces of other planes meet.
fn met_middles(ring: &Ring, seams: &PlaneSeams) -> Vec<FlatPoint> {
    let met = edges(ring).filter(|(a, b)| seams.meet([a, b].map(|p| [f64::from(p.x), f64::from(p.y)])));
    met.map(|(a, b)| middle(a, b)).collect()
}

fn middle(a: &FlatPoint, b: &FlatPoint) -> FlatPoint {
    let middle = |a: i32, b: i32| ((i64::from(a) + i64::from(b)) / 2) as i32;
    FlatPoint::new(middle(a.x, b.x), middle(a.y, b.y))
}

/// Whether a point lies on the border of a piece.
fn is_along(piece: &Shape, p: FlatPoint) -> bool {
    piece.iter().flat_map(edges).any(|(a, b)| segment_distance(*a, *b, p) <= ALONG_STEPS)
}

/// Whether a piece reaches into its surface: its area by the length of its open side. A slit is as deep as
/// it is long.
fn is_deep(piece: &Shape, surfaces: &[&Ring]) -> bool {
    let Some(outer) = piece.first() else { return false };
    let is_open_side = |a: &FlatPoint, b: &FlatPoint| {
        let middle = middle(a, b);
        let mut border = surfaces.iter().flat_map(|ring| edges(ring));
        !border.any(|(from, to)| segment_distance(*from, *to, middle) <= ALONG_STEPS)
    };
    let (mut around_m, mut open_m) = (0.0, 0.0);
    for (a, b) in edges(outer) {
        let length_m = f64::from(b.x - a.x).portable_hypot(f64::from(b.y - a.y)) * STEP_M;
        around_m += length_m;
        open_m += if is_open_side(a, b) { length_m } else { 0.0 };
    }
    area_m2(outer) >= (MIN_DEPTH_M * open_m).max(HAIR_M * around_m / 2.0)
}

#[cfg(test)]
mod tests {
    use super::{PlaneRays, Shape, filled, find};
    use crate::building::elevation::Span;
    use crate::building::surfaces::rectangle::ring;
    use crate::model::{PlanarPolygon, Plane};
    use crate::reconstruct::polygons::outline::union::{area_m2, difference};
    use crate::reconstruct::polygons::plane_frame::Frame;
    use crate::reconstruct::polygons::seams::met_edges::MetEdges;

    /// A wall of 5 m by 3 m, less rectangles.
    fn wall(less: &[[Span; 2]]) -> Vec<Shape> {
        let whole = ring([[0.0, 5.0], [0.0, 3.0]]);
        let less: Vec<_> = less.iter().map(|sides| ring(*sides)).collect();
        difference(std::iter::once(whole.as_slice()), less.iter().map(Vec::as_slice))
    }

    /// The wall's plane, and one across it at 2 m along with a polygon that is its border there up to
    /// `high_m`.
    fn planes(high_m: f64) -> (Vec<Plane>, Vec<PlanarPolygon>, Frame) {
        let plane = |normal: [f64; 3], offset_m: f64| Plane { normal, offset_m, points: 3, rms_m: 0.0 };
        let planes = vec![plane([0.0, -1.0, 0.0], 0.0), plane([1.0, 0.0, 0.0], 2.0)];
        let outer_m = vec![[2.0, 0.0, 2.8], [2.0, 0.0, high_m], [2.0, -1.0, high_m], [2.0, -1.0, 2.8]];
        let across = PlanarPolygon { plane: 1, outer_m, holes_m: Vec::new() };
        let frame = Frame::new(&planes[0], [0.0; 3]);
        (planes, vec![across], frame)
    }

    fn area(shapes: &[Shape]) -> f64 {
        let holes = |shape: &Shape| shape.iter().skip(1).map(|ring| area_m2(ring)).sum::<f64>();
        shapes.iter().map(|shape| area_m2(&shape[0]) - holes(shape)).sum()
    }

    fn found(shapes: &[Shape], high_m: f64) -> Vec<Shape> {
        let (planes, polygons, frame) = planes(high_m);
        let neighbors = [vec![1], vec![0]];
        find(shapes, &MetEdges::new(&planes, &polygons, &neighbors).of_plane(0, &frame))
    }

    #[test]
    fn a_narrow_notch_is_filled_and_holes_and_wide_ones_are_not() {
        let notch = [[2.0, 2.2], [2.8, 3.0]];
        let wide = [[3.0, 3.5], [2.8, 3.0]];
        let hole = [[1.0, 1.2], [1.0, 1.2]];
        let before = wall(&[notch, wide, hole]);
        let notches = found(&before, 2.8);
        assert_eq!(notches.len(), 1, "{notches:?}");
        assert!((area(&notches) - 0.04).abs() < 1e-4, "{notches:?}");
        let after = filled(before.clone(), &notches, &[PlaneRays::default()]);
        assert!((area(&after) - area(&before) - 0.04).abs() < 1e-4, "{after:?}");
    }

    #[test]
    fn a_slit_is_filled_and_a_shallow_dip_stays() {
        let slit = [[2.0, 2.01], [2.8, 3.0]];
        let dip = [[3.0, 3.2], [2.995, 3.0]];
        let notches = found(&wall(&[slit, dip]), 2.8);
        assert_eq!(notches.len(), 1, "{notches:?}");
        assert!((area(&notches) - 0.002).abs() < 1e-5, "{notches:?}");
    }

    #[test]
    fn a_slit_below_a_window_is_filled_where_rays_pass_the_window_alone() {
        let (slit, window) = ([[2.0, 2.2], [0.0, 1.0]], [[1.5, 2.7], [1.0, 2.0]]);
        let before = wall(&[slit, window]);
        let notches = found(&before, 2.8);
        assert_eq!(notches.len(), 1, "{notches:?}");
        let rays = PlaneRays { blocked_m: vec![[2.1, 1.5]], ..PlaneRays::default() };
        let after = filled(before, &notches, &[rays]);
        assert_eq!(after[0].iter().map(Vec::len).collect::<Vec<_>>(), [4, 4], "{after:?}");
    }

    #[test]
    fn a_notch_that_rays_pass_stays() {
        let before = wall(&[[[2.0, 2.2], [2.8, 3.0]]]);
        let rays = PlaneRays { blocked_m: vec![[2.1, 2.9]], ..PlaneRays::default() };
        assert_eq!(filled(before.clone(), &found(&before, 2.8), &[rays]), before);
    }

    #[test]
    fn a_notch_in_which_something_stands_stays() {
        let before = wall(&[[[2.0, 2.2], [2.8, 3.0]]]);
        assert_eq!(found(&before, 3.0), Vec::<Shape>::new());
    }
}
