//! Planes as a unit normal and an offset: `normal . p = offset_m` for each point p of the plane.

use crate::vec3::dot;

/// Signed distance of a point from a plane, meters; positive on the side that the normal points to.
#[inline]
#[must_use]
pub fn distance_m(normal: [f64; 3], offset_m: f64, point_m: [f64; 3]) -> f64 {
    dot(normal, point_m) - offset_m
}

/// The point of a plane that is nearest to another point.
#[inline]
#[must_use]
pub fn foot(normal: [f64; 3], offset_m: f64, point_m: [f64; 3]) -> [f64; 3] {
    let away_m = distance_m(normal, offset_m, point_m);
    core::array::from_fn(|k| point_m[k] - away_m * normal[k])
}

#[cfg(test)]
mod tests {
    use super::{distance_m, foot};

    #[test]
    fn the_foot_is_on_the_plane_and_no_other_point_of_the_plane_is_nearer() {
        let (normal, offset_m, point_m) = ([0.6, 0.0, 0.8], 2.0, [3.0, -1.0, 2.0]);
        let foot_m = foot(normal, offset_m, point_m);
        assert!(distance_m(normal, offset_m, foot_m).abs() < 1e-12);
        let away2 = |p: [f64; 3]| (0..3).map(|k| (p[k] - point_m[k]).powi(2)).sum::<f64>();
        assert!((away2(foot_m).sqrt() - distance_m(normal, offset_m, point_m).abs()).abs() < 1e-12);
        for (u, v) in [(0.1, 0.0), (-0.1, 0.0), (0.0, 0.1), (0.0, -0.1), (0.1, -0.1)] {
            let other_m = [foot_m[0] + 0.8 * u, foot_m[1] + v, foot_m[2] - 0.6 * u];
            assert!(distance_m(normal, offset_m, other_m).abs() < 1e-12 && away2(other_m) > away2(foot_m));
        }
    }
}
