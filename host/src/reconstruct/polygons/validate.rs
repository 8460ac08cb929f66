//! The plain check that a polygon is one: the brute-force oracle of everything that makes polygons.
//!
//! Quadratic in the number of edges, meant for tests and for doubters. Frame `map`, meters.

use crate::model::{PlanarPolygon, Plane};
use crate::reconstruct::polygons::outline::union::doubled_area;
use crate::reconstruct::polygons::plane_frame::{FlatPoint, Frame};

/// Why a polygon is none. Rings count from 0 = outer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Defect {
    /// A corner is not on the plane.
    #[error("ring {0} has a corner off the plane")]
    OffPlane(usize),
    /// Fewer than three corners, or two equal ones in a row.
    #[error("ring {0} has fewer than three corners or repeats one")]
    Degenerate(usize),
    /// The outer ring is not counter-clockwise or a hole not clockwise.
    #[error("ring {0} goes round the wrong way")]
    WrongWay(usize),
    /// Two edges cross or overlap.
    #[error("rings {0} and {1} cross or overlap")]
    Crossing(usize, usize),
    /// A hole is not inside the outer ring, or inside another hole.
    #[error("hole {0} is not inside the outer ring alone")]
    Misplaced(usize),
}

/// Checks one polygon. Rings may touch in single points, nothing more.
pub fn check(polygon: &PlanarPolygon, plane: &Plane) -> Result<(), Defect> {
    let near_m = polygon.outer_m.first().copied().unwrap_or_default();
    let frame = Frame::new(plane, near_m);
    let rings_m = std::iter::once(&polygon.outer_m).chain(&polygon.holes_m);
    let mut rings = Vec::new();
    for (index, ring_m) in rings_m.enumerate() {
        if ring_m.iter().any(|p| plane.distance_m(*p).abs().is_nan() || plane.distance_m(*p).abs() > 1e-6) {
            return Err(Defect::OffPlane(index));
        }
        let ring: Option<Vec<FlatPoint>> = ring_m.iter().map(|p| frame.flat(*p)).collect();
        rings.push(ring.ok_or(Defect::OffPlane(index))?);
    }
    for (index, ring) in rings.iter().enumerate() {
        let repeats = ring.iter().zip(ring.iter().cycle().skip(1)).any(|(a, b)| a == b);
        if ring.len() < 3 || repeats {
            return Err(Defect::Degenerate(index));
        }
        if (doubled_area(ring) > 0) != (index == 0) || doubled_area(ring) == 0 {
            return Err(Defect::WrongWay(index));
        }
    }
    check_crossings(&rings)?;
    for hole in 1..rings.len() {
        let alone = (1..rings.len()).all(|other| other == hole || !inside(&rings[other], &rings[hole]));
        if !inside(&rings[0], &rings[hole]) || !alone {
            return Err(Defect::Misplaced(hole));
        }
    }
    Ok(())
}

fn check_crossings(rings: &[Vec<FlatPoint>]) -> Result<(), Defect> {
    let edges: Vec<(usize, FlatPoint, FlatPoint)> = rings
        .iter()
        .enumerate()
        .flat_map(|(r, ring)| ring.iter().zip(ring.iter().cycle().skip(1)).map(move |(a, b)| (r, *a, *b)))
        .collect();
    for (index, (ring, a, b)) in edges.iter().enumerate() {
        for (other, c, d) in &edges[index + 1..] {
            let same_ring_touch = ring == other && !neighbors(&edges, index, *c, *d) && touch(*a, *b, *c, *d);
            if cross_or_overlap(*a, *b, *c, *d) || same_ring_touch {
                return Err(Defect::Crossing(*ring, *other));
            }
        }
    }
    Ok(())
}

/// Whether edge `c d` follows or precedes edge `index` in its ring.
fn neighbors(edges: &[(usize, FlatPoint, FlatPoint)], index: usize, c: FlatPoint, d: FlatPoint) -> bool {
    let (_, a, b) = edges[index];
    b == c || d == a
}

fn side(a: FlatPoint, b: FlatPoint, p: FlatPoint) -> i64 {
    doubled_area(&[a, b, p]).signum()
}

fn on_segment(a: FlatPoint, b: FlatPoint, p: FlatPoint) -> bool {
    side(a, b, p) == 0
        && (a.x.min(b.x)..=a.x.max(b.x)).contains(&p.x)
        && (a.y.min(b.y)..=a.y.max(b.y)).contains(&p.y)
}

fn touch(a: FlatPoint, b: FlatPoint, c: FlatPoint, d: FlatPoint) -> bool {
    on_segment(a, b, c) || on_segment(a, b, d) || on_segment(c, d, a) || on_segment(c, d, b)
}

fn cross_or_overlap(a: FlatPoint, b: FlatPoint, c: FlatPoint, d: FlatPoint) -> bool {
    let (abc, abd, cda, cdb) = (side(a, b, c), side(a, b, d), side(c, d, a), side(c, d, b));
    if abc == 0 && abd == 0 {
        // On one line: they overlap when the middle of their common stretch is more than a point.
        let along = |p: FlatPoint| if a.x == b.x { p.y } else { p.x };
        let low = along(a).min(along(b)).max(along(c).min(along(d)));
        let high = along(a).max(along(b)).min(along(c).max(along(d)));
        return low < high;
    }
    abc * abd < 0 && cda * cdb < 0
}

/// Whether the ring `inner`, which does not cross `outer`, lies inside it.
fn inside(outer: &[FlatPoint], inner: &[FlatPoint]) -> bool {
    let on_border =
        |p: &FlatPoint| outer.iter().zip(outer.iter().cycle().skip(1)).any(|(a, b)| on_segment(*a, *b, *p));
    match inner.iter().find(|p| !on_border(p)) {
        Some(p) => winds_round(outer, *p),
        None => true,
    }
}

fn winds_round(ring: &[FlatPoint], p: FlatPoint) -> bool {
    let mut odd = false;
    for (a, b) in ring.iter().zip(ring.iter().cycle().skip(1)) {
        if (a.y > p.y) != (b.y > p.y) {
            let (low, high) = if a.y < b.y { (*a, *b) } else { (*b, *a) };
            odd ^= side(low, high, p) > 0;
        }
    }
    odd
}

#[cfg(test)]
mod tests {
    use super::{Defect, check};
    use crate::model::{PlanarPolygon, Plane};

    const FLOOR: Plane = Plane { normal: [0.0, 0.0, 1.0], offset_m: 0.0, points: 3, rms_m: 0.0 };

    fn ring(points: &[(f64, f64)]) -> Vec<[f64; 3]> {
        points.iter().map(|(x, y)| [*x, *y, 0.0]).collect()
    }

    fn polygon(outer: &[(f64, f64)], holes: &[&[(f64, f64)]]) -> PlanarPolygon {
        PlanarPolygon { plane: 0, outer_m: ring(outer), holes_m: holes.iter().map(|h| ring(h)).collect() }
    }

    const SQUARE: [(f64, f64); 4] = [(0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (0.0, 4.0)];

    #[test]
    fn a_square_with_two_holes_is_a_polygon() {
        let holes: [&[(f64, f64)]; 2] =
            [&[(1.0, 1.0), (1.0, 2.0), (2.0, 2.0)], &[(3.0, 3.0), (3.5, 3.5), (3.5, 3.0)]];
        assert_eq!(check(&polygon(&SQUARE, &holes), &FLOOR), Ok(()));
        // A hole may touch the border in a corner.
        assert_eq!(check(&polygon(&SQUARE, &[&[(0.0, 0.0), (1.0, 2.0), (2.0, 1.0)]]), &FLOOR), Ok(()));
    }

    #[test]
    fn every_defect_is_found() {
        let turned: Vec<_> = SQUARE.iter().rev().copied().collect();
        let cases = [
            (polygon(&turned, &[]), Defect::WrongWay(0)),
            (polygon(&SQUARE[..2], &[]), Defect::Degenerate(0)),
            (polygon(&[(0.0, 0.0), (4.0, 0.0), (0.5, 4.0), (4.0, 5.0)], &[]), Defect::Crossing(0, 0)),
            (
                polygon(&[(0.0, 0.0), (2.0, 0.0), (4.0, 0.0), (2.0, 0.0), (2.0, 4.0)], &[]),
                Defect::Crossing(0, 0),
            ),
            (polygon(&SQUARE, &[&[(3.0, 1.0), (3.0, 2.0), (5.0, 2.0)]]), Defect::Crossing(0, 1)),
            (polygon(&SQUARE, &[&[(1.0, 1.0), (2.0, 1.0), (2.0, 2.0)]]), Defect::WrongWay(1)),
            (polygon(&SQUARE, &[&[(6.0, 1.0), (6.0, 2.0), (7.0, 2.0)]]), Defect::Misplaced(1)),
        ];
        for (polygon, defect) in cases {
            assert_eq!(check(&polygon, &FLOOR), Err(defect), "{polygon:?}");
        }
        let mut lifted = polygon(&SQUARE, &[]);
        lifted.outer_m[2][2] = 0.1;
        assert_eq!(check(&lifted, &FLOOR), Err(Defect::OffPlane(0)));
    }
}
