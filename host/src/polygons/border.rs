//! Straight borders: fewer corners, none of the old ones further from the new border than a tolerance.
//!
//! Plane coordinates in whole steps ([`super::frame`]). Source: Douglas and Peucker 1973, on rings.

use super::frame::FlatPoint;
use super::union::Ring;

/// A ring with as few of its corners as the tolerance (in steps) allows; empty when nothing with an area is left.
pub fn straighten(ring: &[FlatPoint], tolerance_steps: f64) -> Ring {
    let Some(start) = (0..ring.len()).min_by_key(|index| (ring[*index].x, ring[*index].y)) else {
        return Ring::new();
    };
    let turned: Ring = ring[start..].iter().chain(&ring[..start]).copied().collect();
    let far = (0..turned.len()).max_by_key(|index| distance2(turned[0], turned[*index])).unwrap_or(0);
    // The leftmost point and the one furthest from it are corners of the ring's hull: both stay.
    let mut closed = turned;
    closed.push(closed[0]);
    let mut keep = vec![false; closed.len()];
    keep[0] = true;
    keep[far] = true;
    let mut open = vec![(0, far), (far, closed.len() - 1)];
    while let Some((from, to)) = open.pop() {
        if let Some((middle, off)) = furthest_off(&closed, from, to)
            && off > tolerance_steps
        {
            keep[middle] = true;
            open.extend([(from, middle), (middle, to)]);
        }
    }
    let kept: Ring = (0..closed.len() - 1).filter(|index| keep[*index]).map(|index| closed[index]).collect();
    if kept.len() < 3 { Ring::new() } else { kept }
}

/// The point between two others of the list that is furthest from their segment, and how far, in steps.
fn furthest_off(points: &[FlatPoint], from: usize, to: usize) -> Option<(usize, f64)> {
    let off = |index: &usize| segment_distance(points[from], points[to], points[*index]);
    (from + 1..to).map(|index| (index, off(&index))).max_by(|a, b| a.1.total_cmp(&b.1).then(b.0.cmp(&a.0)))
}

/// Distance of a point to a segment, steps.
pub(super) fn segment_distance(a: FlatPoint, b: FlatPoint, p: FlatPoint) -> f64 {
    let (bx, by) = (f64::from(b.x) - f64::from(a.x), f64::from(b.y) - f64::from(a.y));
    let (px, py) = (f64::from(p.x) - f64::from(a.x), f64::from(p.y) - f64::from(a.y));
    let length2 = bx * bx + by * by;
    let along = if length2 > 0.0 { ((px * bx + py * by) / length2).clamp(0.0, 1.0) } else { 0.0 };
    (px - along * bx).hypot(py - along * by)
}

/// Squared distance of two points, square steps.
pub(super) fn distance2(a: FlatPoint, b: FlatPoint) -> i64 {
    let (x, y) = (i64::from(a.x) - i64::from(b.x), i64::from(a.y) - i64::from(b.y));
    x * x + y * y
}

#[cfg(test)]
mod tests {
    use super::{segment_distance, straighten};
    use crate::planes::random::Random;
    use crate::polygons::frame::FlatPoint;

    /// A square of 10,000 steps whose border wanders by up to `wander` steps.
    fn ragged(wander: f64) -> Vec<FlatPoint> {
        let mut random = Random::new(5);
        let corners = [(0, 0), (10_000, 0), (10_000, 10_000), (0, 10_000)];
        let mut ring = Vec::new();
        for (from, to) in corners.iter().zip(corners.iter().cycle().skip(1)) {
            ring.push(FlatPoint::new(from.0, from.1));
            for k in 1..20 {
                let at =
                    |a: i32, b: i32| a + (b - a) / 20 * k + (wander * (2.0 * random.unit() - 1.0)) as i32;
                let mut at = at;
                ring.push(FlatPoint::new(at(from.0, to.0), at(from.1, to.1)));
            }
        }
        ring
    }

    #[test]
    fn a_ragged_square_becomes_its_four_corners() {
        let straight = straighten(&ragged(100.0), 300.0);
        assert!(straight.len() <= 6 && straight.len() >= 4, "{straight:?}");
    }

    #[test]
    fn no_old_corner_is_further_from_the_new_border_than_the_tolerance() {
        let ring = ragged(300.0);
        let straight = straighten(&ring, 200.0);
        assert!(straight.len() < ring.len());
        for p in ring {
            let near = straight.iter().zip(straight.iter().cycle().skip(1));
            let nearest = near.map(|(a, b)| segment_distance(*a, *b, p)).fold(f64::INFINITY, f64::min);
            assert!(nearest <= 200.0);
        }
    }

    #[test]
    fn what_is_thinner_than_the_tolerance_vanishes() {
        let sliver = [(0, 0), (5000, 20), (10_000, 0), (5000, -20)].map(|(x, y)| FlatPoint::new(x, y));
        assert!(straighten(&sliver, 300.0).is_empty());
        assert!(straighten(&[], 300.0).is_empty());
    }
}
