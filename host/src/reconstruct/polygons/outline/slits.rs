//! Slits and slivers: what is too narrow to be told from a row of points that is missing, or from one too
//! many.
//!
//! A border beside far points is a comb, a surface that was seen through something thin has slits, and pieces
//! of one wall lie a few centimeters apart. Surfaces grow over slits and shrink again, then shrink below
//! slivers and grow again; corners stay as sharp as they are. Plane coordinates in whole steps
//! ([`crate::reconstruct::polygons::plane_frame`]). Source: closing and opening (Serra 1982).

use super::union::{Shape, repair};
use crate::reconstruct::polygons::plane_frame::STEP_M;
use i_overlay::i_float::int::angle::Angle;
use i_overlay::mesh::int::outline::offset::IntOutlineOffset;
use i_overlay::mesh::int::style::{IntLineJoin, IntOutlineStyle};

/// What is narrower than this is no surface, meters: as far as a border may move. Larger: frames and strips
/// along a wall get lost. Smaller: teeth stay.
const SLIVER_M: f64 = 0.03;
/// Corners with at least this angle stay sharp, degrees; spikes are gone already.
const SHARP_DEG: f64 = 50.0;

/// Shapes without gaps narrower than `slit_m`, meters, and without slivers; those that were only apart by
/// such a gap are one.
pub(crate) fn without_slits(shapes: &[Shape], slit_m: f64) -> Vec<Shape> {
    repair(&offset(&offset(&closed(shapes, slit_m), -SLIVER_M / 2.0), SLIVER_M / 2.0))
}

/// Shapes without gaps narrower than `width_m`, meters.
pub(crate) fn closed(shapes: &[Shape], width_m: f64) -> Vec<Shape> {
    offset(&offset(shapes, width_m / 2.0), -width_m / 2.0)
}

/// Shapes whose borders are moved outwards by a distance, meters, or inwards.
fn offset(shapes: &[Shape], by_m: f64) -> Vec<Shape> {
    let sharp = Angle::from_bits((SHARP_DEG / 360.0 * f64::from(u32::MAX)) as u32);
    let style = IntOutlineStyle::new((by_m / STEP_M).round() as i32).line_join(IntLineJoin::Miter(sharp));
    let bounded = shapes.validate_outline(&style).is_ok();
    if bounded { shapes.outline(&style).unwrap_or_default() } else { shapes.to_vec() }
}

#[cfg(test)]
mod tests {
    use super::without_slits;
    use crate::reconstruct::polygons::outline::union::{Ring, Shape, area_m2};
    use crate::reconstruct::polygons::plane_frame::FlatPoint;

    fn ring(points: &[(i32, i32)]) -> Ring {
        points.iter().map(|(x, y)| FlatPoint::new(*x, *y)).collect()
    }

    fn rectangle([x, y]: [i32; 2], [width, height]: [i32; 2]) -> Shape {
        vec![ring(&[(x, y), (x + width, y), (x + width, y + height), (x, y + height)])]
    }

    fn sorted(shape: &Shape) -> Vec<(i32, i32)> {
        let mut corners: Vec<(i32, i32)> = shape.iter().flatten().map(|p| (p.x, p.y)).collect();
        corners.sort_unstable();
        corners
    }

    #[test]
    fn a_wall_with_a_window_keeps_its_corners() {
        let mut wall = rectangle([0, 0], [40_000, 25_000]);
        wall.push(ring(&[(10_000, 10_000), (10_000, 20_000), (20_000, 20_000), (20_000, 10_000)]));
        let same = without_slits(std::slice::from_ref(&wall), 0.08);
        assert_eq!(same.iter().map(sorted).collect::<Vec<_>>(), [sorted(&wall)]);
    }

    #[test]
    fn two_pieces_with_a_slit_between_them_are_one_and_with_a_gap_two() {
        let beside = |gap: i32| [rectangle([0, 0], [9000, 9000]), rectangle([9000 + gap, 0], [9000, 9000])];
        let one = without_slits(&beside(500), 0.08);
        assert_eq!(one.iter().map(Vec::len).collect::<Vec<_>>(), [1]);
        assert!((area_m2(&one[0][0]) - 0.9 * 1.85).abs() < 1e-6);
        assert_eq!(without_slits(&beside(1000), 0.08).len(), 2);
    }

    #[test]
    fn a_sliver_beside_a_wall_goes() {
        let mut wall = rectangle([0, 0], [20_000, 20_000]);
        wall[0].splice(2..2, ring(&[(20_000, 9000), (30_000, 9000), (30_000, 9200), (20_000, 9200)]));
        let clean = without_slits(&[wall], 0.08);
        assert_eq!(
            clean.iter().map(sorted).collect::<Vec<_>>(),
            [sorted(&rectangle([0, 0], [20_000, 20_000]))]
        );
        assert!(without_slits(&[rectangle([0, 0], [20_000, 200])], 0.08).is_empty());
    }
}
