//! Where planes meet: the common line of two, the common corner of three.
//!
//! Frame `map`, meters.

use crate::model::Plane;
use biplane_geometry::vec3::{cross, dot};

/// Planes that are closer to parallel than this have no useful common line (sine of the angle; 15 degrees).
const MIN_SINE: f64 = 0.26;

/// The point on the common line of two planes nearest to `p_m`; `None` for planes that are nearly parallel.
pub(crate) fn foot_on_seam(a: &Plane, b: &Plane, p_m: [f64; 3]) -> Option<[f64; 3]> {
    let cosine = dot(a.normal, b.normal);
    let determinant = 1.0 - cosine * cosine;
    if determinant < MIN_SINE * MIN_SINE {
        return None;
    }
    let (da, db) = (a.distance_m(p_m), b.distance_m(p_m));
    let along_a = (da - cosine * db) / determinant;
    let along_b = (db - cosine * da) / determinant;
    Some(std::array::from_fn(|k| p_m[k] - along_a * a.normal[k] - along_b * b.normal[k]))
}

/// The common line of two planes: a point of it near `near_m`, and its unit direction. The order of the two
/// makes no difference but for the direction's sign.
pub(crate) fn line(a: &Plane, b: &Plane, near_m: [f64; 3]) -> Option<([f64; 3], [f64; 3])> {
    let at = foot_on_seam(a, b, near_m)?;
    let along = cross(a.normal, b.normal);
    let length = dot(along, along).sqrt();
    Some((at, along.map(|v| v / length)))
}

/// The common corner of three planes; `None` when two are nearly parallel or all share one direction.
pub(crate) fn corner(a: &Plane, b: &Plane, c: &Plane) -> Option<[f64; 3]> {
    let (bc, ca, ab) = (cross(b.normal, c.normal), cross(c.normal, a.normal), cross(a.normal, b.normal));
    let determinant = dot(a.normal, bc);
    if determinant.abs() < MIN_SINE {
        return None;
    }
    Some(std::array::from_fn(|k| {
        (a.offset_m * bc[k] + b.offset_m * ca[k] + c.offset_m * ab[k]) / determinant
    }))
}

#[cfg(test)]
mod tests {
    use biplane_geometry::vec3::{cross, distance as distance_m};

    use super::{corner, foot_on_seam};
    use crate::model::sample::plane;

    #[test]
    fn the_foot_is_on_both_planes_and_no_point_of_the_line_is_nearer() {
        let (a, b) = (plane([0.6, 0.8, 0.0], 2.0), plane([0.0, 0.6, 0.8], 1.0));
        let p = [3.0, -1.0, 2.0];
        let foot = foot_on_seam(&a, &b, p).unwrap();
        assert!(a.distance_m(foot).abs() < 1e-12 && b.distance_m(foot).abs() < 1e-12);
        let along = cross(a.normal, b.normal);
        for step in [-0.01, 0.01] {
            let other = std::array::from_fn(|k| foot[k] + step * along[k]);
            assert!(distance_m(other, p) > distance_m(foot, p));
        }
    }

    #[test]
    fn parallel_planes_have_no_seam() {
        let (a, b) = (plane([0.0, 0.0, 1.0], 2.0), plane([0.0, 0.1_f64.sin(), 0.1_f64.cos()], 1.0));
        assert!(foot_on_seam(&a, &b, [0.0; 3]).is_none());
        assert!(corner(&a, &b, &plane([1.0, 0.0, 0.0], 0.0)).is_none());
    }

    #[test]
    fn the_corner_of_a_room_is_on_all_three_planes() {
        let [a, b, c] =
            [plane([1.0, 0.0, 0.0], 4.0), plane([0.0, -1.0, 0.0], 5.0), plane([0.6, 0.0, 0.8], 6.0)];
        let x = corner(&a, &b, &c).unwrap();
        assert!([a, b, c].iter().all(|p| p.distance_m(x).abs() < 1e-12));
    }
}
