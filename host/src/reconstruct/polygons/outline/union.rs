//! The union of flat pieces as polygons with holes, and the repair of polygons whose borders were moved.
//!
//! Plane coordinates in whole steps ([`crate::reconstruct::polygons::plane_frame`]): every operation is
//! exact, its result valid and repeatable.

use crate::reconstruct::polygons::plane_frame::{FlatPoint, STEP_M};
use biplane_geometry::polygon_area::doubled_ring_area;
use i_overlay::core::fill_rule::FillRule;
use i_overlay::core::overlay::{IntOverlayOptions, Overlay, ShapeType};
use i_overlay::core::overlay_rule::OverlayRule;
use i_overlay::core::solver::Solver;

/// A closed ring, first point not repeated.
pub(crate) type Ring = Vec<FlatPoint>;
/// A polygon: its outer ring counter-clockwise, then its holes clockwise.
pub(crate) type Shape = Vec<Ring>;

/// The union of rings: everything that they go around more often counter-clockwise than clockwise.
pub(crate) fn union<'a>(rings: impl Iterator<Item = &'a [FlatPoint]>) -> Vec<Shape> {
    let options = IntOverlayOptions { ogc: true, preserve_output_collinear: true, ..Default::default() };
    let mut overlay = Overlay::<i32>::new_custom(1024, options, Solver::default());
    for ring in rings {
        overlay.add_contour(ring, ShapeType::Subject);
    }
    let mut shapes = overlay.overlay(OverlayRule::Subject, FillRule::Positive);
    house_holes(&mut shapes);
    shapes.iter_mut().for_each(drop_straight_points);
    shapes
}

/// What some rings go around and others do not: what a ring goes around once and a reversed one too is
/// neither's.
pub(crate) fn difference<'a>(
    rings: impl Iterator<Item = &'a [FlatPoint]>,
    less: impl Iterator<Item = &'a [FlatPoint]>,
) -> Vec<Shape> {
    let reversed: Vec<Ring> = less.map(|ring| ring.iter().rev().copied().collect()).collect();
    let mut all: Vec<&[FlatPoint]> = rings.collect();
    all.extend(reversed.iter().map(Vec::as_slice));
    union(all.into_iter())
}

/// What two sets of shapes have in common.
pub(crate) fn intersection(shapes: &[Shape], others: &[Shape]) -> Vec<Shape> {
    let options = IntOverlayOptions { ogc: true, preserve_output_collinear: true, ..Default::default() };
    let mut overlay = Overlay::<i32>::new_custom(256, options, Solver::default());
    shapes.iter().flatten().for_each(|ring| overlay.add_contour(ring, ShapeType::Subject));
    others.iter().flatten().for_each(|ring| overlay.add_contour(ring, ShapeType::Clip));
    let mut common = overlay.overlay(OverlayRule::Intersect, FillRule::Positive);
    house_holes(&mut common);
    common.iter_mut().for_each(drop_straight_points);
    common
}

/// Makes shapes valid again whose rings may cross.
pub(crate) fn repair(shapes: &[Shape]) -> Vec<Shape> {
    union(shapes.iter().flatten().map(Vec::as_slice))
}

/// Twice the signed area of a ring, in square steps; positive when counter-clockwise.
pub(crate) fn doubled_area(ring: &[FlatPoint]) -> i64 {
    doubled_ring_area(ring.iter().map(|p| [p.x, p.y]))
}

/// Area of a ring, square meters, positive in either direction.
pub(crate) fn area_m2(ring: &[FlatPoint]) -> f64 {
    0.5 * doubled_area(ring).abs() as f64 * STEP_M * STEP_M
}

/// Gives holes to the shapes that they lie in: where many shapes touch in corners the library takes a
/// neighbor now and then.
fn house_holes(shapes: &mut [Shape]) {
    if shapes.len() < 2 {
        return;
    }
    let mut astray: Vec<Ring> = Vec::new();
    for shape in shapes.iter_mut() {
        let Some((outer, holes)) = shape.split_first() else { continue };
        let at_home: Vec<bool> = holes.iter().map(|hole| lies_in(hole, outer)).collect();
        for (index, _) in at_home.iter().enumerate().rev().filter(|(_, at_home)| !**at_home) {
            astray.push(shape.remove(index + 1));
        }
    }
    for hole in astray {
        let round_it =
            shapes.iter_mut().filter(|shape| shape.first().is_some_and(|outer| lies_in(&hole, outer)));
        if let Some(home) = round_it.min_by_key(|shape| doubled_area(&shape[0])) {
            home.push(hole);
        }
    }
}

/// Whether a ring that crosses no other lies in one; it may touch it in corners.
fn lies_in(hole: &[FlatPoint], outer: &[FlatPoint]) -> bool {
    let twice = |p: &FlatPoint| (2 * i64::from(p.x), 2 * i64::from(p.y));
    let corners = hole.iter().map(twice);
    let middles = hole.windows(2).map(|edge| {
        let [a, b] = [edge[0], edge[1]];
        (i64::from(a.x) + i64::from(b.x), i64::from(a.y) + i64::from(b.y))
    });
    corners.chain(middles).find_map(|place| holds(outer, place)).unwrap_or(true)
}

/// Whether a place, in half steps, lies in a ring; `None` when it lies on its border.
fn holds(ring: &[FlatPoint], (x, y): (i64, i64)) -> Option<bool> {
    let mut odd = false;
    for (a, b) in ring.iter().zip(ring.iter().cycle().skip(1)) {
        let (ay, by) = (2 * i64::from(a.y), 2 * i64::from(b.y));
        if y < ay.min(by) || y > ay.max(by) {
            continue;
        }
        let (ax, bx) = (2 * i64::from(a.x), 2 * i64::from(b.x));
        let side = (bx - ax) * (y - ay) - (by - ay) * (x - ax);
        if side == 0 && (ax.min(bx)..=ax.max(bx)).contains(&x) {
            return None;
        }
        if (ay > y) != (by > y) {
            odd ^= (side > 0) == (by > ay);
        }
    }
    Some(odd)
}

/// Removes points in the middle of straight edges, but for those where two rings, or a ring and itself,
/// touch.
fn drop_straight_points(shape: &mut Shape) {
    let mut all: Vec<(i32, i32)> = shape.iter().flatten().map(|p| (p.x, p.y)).collect();
    all.sort_unstable();
    let shared = |p: &FlatPoint| {
        let first = all.partition_point(|q| *q < (p.x, p.y));
        all.get(first + 1) == Some(&(p.x, p.y))
    };
    for ring in shape {
        let count = ring.len();
        let straight = |index: usize| {
            let [a, b, c] = [ring[(index + count - 1) % count], ring[index], ring[(index + 1) % count]];
            doubled_area(&[a, b, c]) == 0 && !shared(&b)
        };
        let kept: Ring = (0..count).filter(|index| !straight(*index)).map(|index| ring[index]).collect();
        *ring = kept;
    }
}

#[cfg(test)]
mod tests {
    use super::{Ring, area_m2, doubled_area, lies_in, repair, union};
    use crate::reconstruct::planes::paper::random::Random;
    use crate::reconstruct::polygons::plane_frame::FlatPoint;

    fn ring(points: &[(i32, i32)]) -> Vec<FlatPoint> {
        points.iter().map(|(x, y)| FlatPoint::new(*x, *y)).collect()
    }

    #[test]
    fn triangles_round_a_window_become_one_polygon_with_one_hole() {
        // A square of 30 steps without its middle third: 8 squares, each two triangles.
        let mut triangles = Vec::new();
        for (x, y) in (0..9).map(|k| (10 * (k % 3), 10 * (k / 3))).filter(|cell| *cell != (10, 10)) {
            triangles.push(ring(&[(x, y), (x + 10, y), (x + 10, y + 10)]));
            triangles.push(ring(&[(x, y), (x + 10, y + 10), (x, y + 10)]));
        }
        let shapes = union(triangles.iter().map(Vec::as_slice));
        assert_eq!(shapes.len(), 1);
        assert_eq!(shapes[0].iter().map(|r| doubled_area(r)).collect::<Vec<_>>(), [1800, -200]);
        assert_eq!(shapes[0].iter().map(Vec::len).collect::<Vec<_>>(), [4, 4], "straight points are gone");
    }

    #[test]
    fn of_a_bow_tie_the_half_that_goes_round_the_right_way_stays() {
        let shapes = repair(&[vec![ring(&[(0, 0), (100, 100), (100, 0), (0, 100)])]]);
        assert_eq!(shapes.iter().map(|s| doubled_area(&s[0])).collect::<Vec<_>>(), [5000]);
    }

    #[test]
    fn squares_that_touch_in_a_point_stay_two_polygons() {
        let (a, b) =
            (ring(&[(0, 0), (10, 0), (10, 10), (0, 10)]), ring(&[(10, 10), (20, 10), (20, 20), (10, 20)]));
        assert_eq!(union([a, b].iter().map(Vec::as_slice)).len(), 2);
    }

    /// Half of the triangles of a chequered field, chosen at random: shapes that touch in corners, with holes
    /// in holes.
    fn scattered(seed: u64, side: i32, share: f64) -> Vec<Ring> {
        let mut random = Random::new(seed);
        let mut triangles = Vec::new();
        for (x, y) in (0..side * side).map(|k| (10_000 * (k % side), 10_000 * (k / side))) {
            for corner in [(x + 10_000, y), (x, y + 10_000)] {
                if random.unit() < share {
                    let mut triangle = ring(&[(x, y), corner, (x + 10_000, y + 10_000)]);
                    if doubled_area(&triangle) < 0 {
                        triangle.reverse();
                    }
                    triangles.push(triangle);
                }
            }
        }
        triangles
    }

    #[test]
    fn every_hole_lies_in_its_own_shape_however_shapes_touch() {
        for (seed, share) in [(1, 0.5), (2, 0.6), (3, 0.7), (4, 0.8)] {
            let triangles = scattered(seed, 60, share);
            let shapes = union(triangles.iter().map(Vec::as_slice));
            let area: i64 = shapes.iter().flatten().map(|r| doubled_area(r)).sum();
            assert_eq!(area, triangles.iter().map(|r| doubled_area(r)).sum::<i64>());
            for shape in &shapes {
                for hole in &shape[1..] {
                    assert!(lies_in(hole, &shape[0]), "seed {seed}: {hole:?} is outside");
                }
            }
        }
    }

    #[test]
    fn nothing_and_rings_without_area_give_nothing() {
        assert!(union(std::iter::empty()).is_empty());
        let line = ring(&[(0, 0), (10, 0), (20, 0)]);
        assert!(union([line.as_slice()].into_iter()).is_empty());
        assert_eq!((doubled_area(&[]), area_m2(&line)), (0, 0.0));
    }
}
