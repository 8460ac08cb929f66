//! Areas of triangles and of rings, whose first corner is not repeated at the end.

use crate::{vec2, vec3};

/// Twice the signed area of a flat ring of whole coordinates, exact; positive counter-clockwise.
///
/// Coordinates are below 2^29 in size, as differences and products have to fit.
pub fn doubled_ring_area(mut ring: impl Iterator<Item = [i32; 2]>) -> i64 {
    let Some(first) = ring.next() else { return 0 };
    let mut sum = 0;
    let mut before = [0, 0];
    for point in ring {
        let now = [0, 1].map(|k| i64::from(point[k]) - i64::from(first[k]));
        sum += before[0] * now[1] - before[1] * now[0];
        before = now;
    }
    sum
}

/// Twice the signed area of a flat triangle; positive counter-clockwise.
#[inline]
#[must_use]
pub fn doubled_flat_triangle([a, b, c]: [[f64; 2]; 3]) -> f64 {
    vec2::cross(vec2::minus(b, a), vec2::minus(c, a))
}

/// The normal of a triangle with the length of twice its area; it points to where the corners are
/// counter-clockwise from.
#[inline]
#[must_use]
pub fn doubled_triangle_normal<T: crate::Scalar>([a, b, c]: [[T; 3]; 3]) -> [T; 3] {
    vec3::cross(vec3::minus(b, a), vec3::minus(c, a))
}

/// Area of a triangle, square meters.
#[cfg(feature = "std")]
#[must_use]
pub fn triangle_area_m2(corners_m: [[f64; 3]; 3]) -> f64 {
    0.5 * vec3::norm(doubled_triangle_normal(corners_m))
}

/// Area of a ring of points of one plane, square meters.
#[cfg(feature = "std")]
#[must_use]
pub fn ring_area_m2(ring_m: &[[f64; 3]]) -> f64 {
    let Some(first) = ring_m.first() else { return 0.0 };
    let normals = ring_m.windows(2).map(|pair| doubled_triangle_normal([*first, pair[0], pair[1]]));
    0.5 * vec3::norm(normals.fold([0.0; 3], vec3::plus))
}

#[cfg(all(test, feature = "std"))]
mod tests {
    use alloc::vec::Vec;

    use super::*;

    /// An L of area 3.
    const L: [[i32; 2]; 6] = [[0, 0], [2, 0], [2, 1], [1, 1], [1, 2], [0, 2]];

    /// Unit cells whose middle has the ring to its right an odd number of times.
    fn cells_inside(ring: &[[i32; 2]]) -> i64 {
        let passes = |x: f64, y: f64, a: [i32; 2], b: [i32; 2]| {
            let [ax, ay, bx, by] = [a[0], a[1], b[0], b[1]].map(f64::from);
            (ay > y) != (by > y) && ax + (y - ay) / (by - ay) * (bx - ax) > x
        };
        let inside = |x: i32, y: i32| {
            let ends = ring.iter().zip(ring.iter().cycle().skip(1));
            ends.filter(|(a, b)| passes(f64::from(x) + 0.5, f64::from(y) + 0.5, **a, **b)).count() % 2 == 1
        };
        (-50..50).flat_map(|x| (-50..50).map(move |y| (x, y))).filter(|(x, y)| inside(*x, *y)).count() as i64
    }

    #[test]
    fn a_ring_of_right_angles_has_the_area_of_the_cells_in_it() {
        for (scale, shift) in [(1, 0), (7, -3), (20, -40)] {
            let ring: Vec<[i32; 2]> = L.iter().map(|p| p.map(|v| scale * v + shift)).collect();
            let doubled = doubled_ring_area(ring.iter().copied());
            assert_eq!(doubled, 2 * cells_inside(&ring));
            assert_eq!(doubled_ring_area(ring.iter().rev().copied()), -doubled);
            let tilted: Vec<[f64; 3]> = ring
                .iter()
                .map(|[x, y]| [0.6 * f64::from(*x), f64::from(*y), 5.0 + 0.8 * f64::from(*x)])
                .collect();
            assert!((ring_area_m2(&tilted) - 0.5 * doubled as f64).abs() < 1e-9);
        }
        assert_eq!((doubled_ring_area(core::iter::empty()), ring_area_m2(&[])), (0, 0.0));
    }

    #[test]
    fn a_triangle_has_the_area_of_heron() {
        for k in 0..300_i32 {
            let at = |by: i32| [31, 37, 41].map(|of| f64::from(k * by % of) * 0.1);
            let [a, b, c] = [at(3), at(5), at(11)];
            let [p, q, r] = [vec3::distance(a, b), vec3::distance(b, c), vec3::distance(c, a)];
            let s = 0.5 * (p + q + r);
            let heron = (s * (s - p) * (s - q) * (s - r)).max(0.0).sqrt();
            assert!((triangle_area_m2([a, b, c]) - heron).abs() < 1e-6, "{k}");
            let flat = [a, b, c].map(|p| [p[0], p[1]]);
            assert!(
                (doubled_flat_triangle(flat) - doubled_triangle_normal([a, b, c])[2]).abs() < 1e-12,
                "{k}"
            );
        }
    }
}
