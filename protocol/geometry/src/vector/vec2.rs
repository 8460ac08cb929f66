//! Vectors and points of the plane.

use super::scalar::Scalar;

/// The scalar product.
#[inline]
#[must_use]
pub fn dot<T: Scalar>(a: [T; 2], b: [T; 2]) -> T {
    a[0] * b[0] + a[1] * b[1]
}

/// The third component of the vector product: positive when `b` lies to the left of `a`.
#[inline]
#[must_use]
pub fn cross<T: Scalar>(a: [T; 2], b: [T; 2]) -> T {
    a[0] * b[1] - a[1] * b[0]
}

/// The difference `a - b`.
#[inline]
#[must_use]
pub fn minus<T: Scalar>(a: [T; 2], b: [T; 2]) -> [T; 2] {
    [a[0] - b[0], a[1] - b[1]]
}

/// The squared distance of two points.
#[inline]
#[must_use]
pub fn squared_distance<T: Scalar>(a: [T; 2], b: [T; 2]) -> T {
    let offset = minus(a, b);
    dot(offset, offset)
}

/// The length. A square root and not `hypot`, whose last bit differs between systems' libraries.
#[cfg(feature = "std")]
#[inline]
#[must_use]
pub fn norm<T: Scalar>(a: [T; 2]) -> T {
    dot(a, a).square_root()
}

/// The distance of two points.
#[cfg(feature = "std")]
#[inline]
#[must_use]
pub fn distance<T: Scalar>(a: [T; 2], b: [T; 2]) -> T {
    squared_distance(a, b).square_root()
}

/// The distance of a point from the segment between `a` and `b`, which may be one point.
#[cfg(feature = "std")]
#[must_use]
pub fn distance_to_segment<T: Scalar>(point: [T; 2], a: [T; 2], b: [T; 2]) -> T {
    let (edge, from_start) = (minus(b, a), minus(point, a));
    let squared_length = dot(edge, edge);
    let share = if squared_length > T::ZERO { dot(from_start, edge) / squared_length } else { T::ZERO };
    let share = if share < T::ZERO {
        T::ZERO
    } else if share > T::ONE {
        T::ONE
    } else {
        share
    };
    norm([from_start[0] - share * edge[0], from_start[1] - share * edge[1]])
}

#[cfg(all(test, feature = "std"))]
mod tests {
    use super::*;

    #[test]
    fn products_and_distances_are_those_of_complex_numbers() {
        for k in 0..360 {
            let (sin, cos) = f64::from(k).to_radians().sin_cos();
            let (a, b) = ([3.0, 4.0], [3.0 * cos - 4.0 * sin, 3.0 * sin + 4.0 * cos]);
            assert!(
                (dot(a, b) - 25.0 * cos).abs() < 1e-12 && (cross(a, b) - 25.0 * sin).abs() < 1e-12,
                "{k}"
            );
            assert!((norm(b) - 5.0).abs() < 1e-12);
            let chord = 10.0 * (f64::from(k).to_radians() / 2.0).sin();
            assert!((distance(a, b) - chord.abs()).abs() < 1e-12, "{k}");
        }
    }

    #[test]
    fn the_distance_to_a_segment_is_that_of_the_nearest_of_many_points_on_it() {
        for k in 0..500_i32 {
            let at = |by: i32| [f64::from(k * by % 41) * 0.1 - 2.0, f64::from(k * by % 37) * 0.1 - 2.0];
            let (point, a, b) = (at(3), at(7), at(11));
            let on = |share: f64| [a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1])];
            let nearest =
                (0..=4000).map(|k| distance(point, on(f64::from(k) / 4000.0))).fold(f64::INFINITY, f64::min);
            assert!((distance_to_segment(point, a, b) - nearest).abs() < 2e-3, "{point:?} {a:?} {b:?}");
        }
    }
}
