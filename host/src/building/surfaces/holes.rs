//! Holes of upright surfaces that are rectangles but for how far apart points are: windows of a facade that
//! was seen from outside, where no room knows of them.

use super::border::{LINE_M, covered};
use crate::building::elevation::{self, Span};
use crate::reconstruct::polygons::outline::union::{Ring, Shape, area_m2};
use crate::reconstruct::polygons::plane_frame::STEP_M;
use biplane_geometry::quantile::upper_median;

/// A hole that fills less of the rectangle around it is of another shape.
const FILLS: f64 = 0.75;
/// Smaller holes are no windows, meters.
const MIN_SIDE_M: f64 = 0.3;

/// The rectangles that holes stand for, in the coordinates of their plane, meters.
pub(super) fn rectangles(shapes: &[Shape]) -> Vec<[Span; 2]> {
    shapes.iter().flat_map(|shape| shape.iter().skip(1)).filter_map(rectangle).collect()
}

/// The rectangle that one hole stands for.
pub(super) fn rectangle(hole: &Ring) -> Option<[Span; 2]> {
    let around = [0, 1].map(|axis| extent(hole, axis));
    let area: f64 = around.iter().map(|[from, to]| to - from).product();
    if area_m2(hole) < FILLS * area {
        return None;
    }
    let [u, v] = [0, 1].map(|axis| middle(hole, axis, around[1 - axis]));
    let sides = [u?, v?];
    sides.iter().all(|[from, to]| to - from >= MIN_SIDE_M).then_some(sides)
}

/// From where to where a ring goes along an axis.
pub(super) fn extent(ring: &Ring, axis: usize) -> Span {
    elevation::extent(ring.iter().map(|p| f64::from([p.x, p.y][axis]) * STEP_M))
}

/// From where to where it goes along an axis on half of the lines across `others`.
fn middle(hole: &Ring, axis: usize, others: Span) -> Option<Span> {
    let shape = [vec![hole.clone()]];
    let lines = ((others[1] - others[0]) / LINE_M).floor().max(0.0) as usize;
    let places = (0..lines).map(|line| others[0] + (line as f64 + 0.5) * LINE_M);
    let spans: Vec<Span> = places
        .filter_map(|place| {
            let spans = covered(&shape, axis, place);
            spans.into_iter().max_by(|a, b| (a[1] - a[0]).total_cmp(&(b[1] - b[0])))
        })
        .collect();
    let median = |end: usize| {
        let mut ends: Vec<f64> = spans.iter().map(|span| span[end]).collect();
        ends.sort_by(f64::total_cmp);
        upper_median(&ends)
    };
    Some([median(0)?, median(1)?])
}

#[cfg(test)]
mod tests {
    use super::rectangles;
    use crate::reconstruct::polygons::plane_frame::FlatPoint;

    fn ring(points: &[(i32, i32)]) -> Vec<FlatPoint> {
        points.iter().map(|(x, y)| FlatPoint::new(*x, *y)).collect()
    }

    #[test]
    fn a_hole_without_a_corner_is_its_rectangle_and_a_triangle_or_a_pinhole_is_none() {
        let outer = ring(&[(0, 0), (90_000, 0), (90_000, 30_000), (0, 30_000)]);
        let window =
            ring(&[(10_000, 10_000), (10_000, 24_000), (20_000, 24_000), (20_000, 12_000), (18_000, 10_000)]);
        let gable = ring(&[(30_000, 10_000), (40_000, 24_000), (50_000, 10_000)]);
        let pinhole = ring(&[(60_000, 10_000), (60_000, 12_000), (62_000, 12_000), (62_000, 10_000)]);
        let found = rectangles(&[vec![outer, window, gable, pinhole]]);
        assert_eq!(found, [[[1.0, 2.0], [1.0, 2.4]]]);
    }
}
