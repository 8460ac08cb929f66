//! The border of cells as a ring with few corners.

use crate::reconstruct::polygons::outline::border::{distance2, segment_distance};
use crate::reconstruct::polygons::outline::union::Ring;
use crate::reconstruct::polygons::plane_frame::FlatPoint;

/// A ring of which no corner that is left out is farther from it than a tolerance, in steps (Douglas and
/// Peucker 1973, from its two corners that are farthest from each other).
pub(super) fn simplified(ring: &Ring, tolerance: f64) -> Ring {
    let Some(first) = ring.first() else { return Ring::new() };
    let far = |from: &FlatPoint| (0..ring.len()).max_by_key(|at| distance2(ring[*at], *from)).unwrap_or(0);
    let one = far(first);
    let other = far(&ring[one]);
    let turned: Ring = ring.iter().cycle().skip(one).take(ring.len() + 1).copied().collect();
    let middle = (other + ring.len() - one) % ring.len();
    let mut kept = vec![0];
    keep(&turned, [0, middle], tolerance, &mut kept);
    keep(&turned, [middle, ring.len()], tolerance, &mut kept);
    kept.pop();
    kept.into_iter().map(|at| turned[at]).collect()
}

/// Adds the corners to keep after the first one, the last one included.
fn keep(line: &[FlatPoint], [from, to]: [usize; 2], tolerance: f64, kept: &mut Vec<usize>) {
    if from >= to {
        return;
    }
    let off = |at: usize| segment_distance(line[from], line[to], line[at]);
    let farthest = (from + 1..to).max_by(|a, b| off(*a).total_cmp(&off(*b)));
    match farthest.filter(|at| off(*at) > tolerance) {
        Some(at) => {
            keep(line, [from, at], tolerance, kept);
            keep(line, [at, to], tolerance, kept);
        }
        None => kept.push(to),
    }
}

#[cfg(test)]
mod tests {
    use super::simplified;
    use crate::reconstruct::polygons::plane_frame::FlatPoint;

    #[test]
    fn teeth_go_and_corners_stay() {
        // A square of 1000 steps with teeth of 10 along its lower edge.
        let mut ring: Vec<FlatPoint> =
            (0..=20).map(|at| FlatPoint::new(50 * at, if at % 2 == 0 { 0 } else { 10 })).collect();
        ring.extend([FlatPoint::new(1000, 1000), FlatPoint::new(0, 1000)]);
        let mut corners: Vec<(i32, i32)> = simplified(&ring, 20.0).iter().map(|p| (p.x, p.y)).collect();
        corners.sort_unstable();
        assert_eq!(corners, [(0, 0), (0, 1000), (1000, 0), (1000, 1000)]);
        assert_eq!(simplified(&ring, 2.0).len(), ring.len());
        assert!(simplified(&Vec::new(), 2.0).is_empty());
    }
}
