//! Vectors and points of space.

use super::scalar::Scalar;

/// The scalar product.
#[inline]
#[must_use]
pub fn dot<T: Scalar>(a: [T; 3], b: [T; 3]) -> T {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// The vector product.
#[inline]
#[must_use]
pub fn cross<T: Scalar>(a: [T; 3], b: [T; 3]) -> [T; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// The sum.
#[inline]
#[must_use]
pub fn plus<T: Scalar>(a: [T; 3], b: [T; 3]) -> [T; 3] {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// The difference `a - b`.
#[inline]
#[must_use]
pub fn minus<T: Scalar>(a: [T; 3], b: [T; 3]) -> [T; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// The vector times a number.
#[inline]
#[must_use]
pub fn scaled<T: Scalar>(a: [T; 3], by: T) -> [T; 3] {
    [a[0] * by, a[1] * by, a[2] * by]
}

/// The length.
#[cfg(feature = "std")]
#[inline]
#[must_use]
pub fn norm<T: Scalar>(a: [T; 3]) -> T {
    dot(a, a).square_root()
}

/// The distance of two points.
#[cfg(feature = "std")]
#[inline]
#[must_use]
pub fn distance<T: Scalar>(a: [T; 3], b: [T; 3]) -> T {
    norm(minus(a, b))
}

/// The same direction with length 1; a vector of length 0 stays.
#[cfg(feature = "std")]
#[inline]
#[must_use]
pub fn unit<T: Scalar>(a: [T; 3]) -> [T; 3] {
    let length = norm(a);
    if length > T::ZERO { scaled(a, T::ONE / length) } else { a }
}

#[cfg(all(test, feature = "std"))]
mod tests {
    use super::*;

    #[test]
    fn the_vector_product_is_orthogonal_and_as_long_as_the_area() {
        for k in 0..1000_i32 {
            let at = |by: i32| [3, 5, 7].map(|of| f64::from(k * by % (of * 7)) * 0.1 - 1.0);
            let (a, b) = (at(11), at(13));
            let product = cross(a, b);
            assert!(dot(product, a).abs() < 1e-12 && dot(product, b).abs() < 1e-12, "{a:?} {b:?}");
            // Lagrange's identity.
            let area2 = dot(a, a) * dot(b, b) - dot(a, b) * dot(a, b);
            assert!((dot(product, product) - area2).abs() < 1e-9, "{a:?} {b:?}");
            assert!((distance(a, b) - norm(plus(a, scaled(b, -1.0)))).abs() < 1e-12);
        }
        assert_eq!(cross([1.0, 0.0, 0.0], [0.0, 1.0, 0.0]), [0.0, 0.0, 1.0_f64]);
    }

    #[test]
    fn a_unit_vector_keeps_the_direction_and_nothing_stays_nothing() {
        assert_eq!(unit([0.0, 3.0, 0.0_f32]), [0.0, 1.0, 0.0]);
        assert_eq!(unit([0.0; 3]), [0.0_f64; 3]);
    }
}
