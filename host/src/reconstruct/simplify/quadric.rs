//! The sum of squared distances from planes, as a quadratic function of the place.
//!
//! Square meters times square meters: each plane counts by the area that it stands for. Source: Garland and
//! Heckbert, "Surface Simplification Using Quadric Error Metrics" (1997), sections 4 and 6; the weights by
//! area as in Garland's QSlim.

use biplane_geometry::vec3::{cross, dot};

/// A place or a direction, meters.
pub(crate) type Vec3 = [f64; 3];

/// How strongly a vertex is drawn to the middle of its edge, as a share of how strongly planes hold it: in a
/// flat part of a mesh, where any place is as good, it decides. Larger: corners get blunt. Smaller: vertices
/// wander off along planes that are nearly parallel.
const MIDDLE_SHARE: f64 = 1e-4;

/// See the module's text: `p^T a p + 2 b p + c`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Quadric {
    /// The upper half of the symmetric matrix: xx, xy, xz, yy, yz, zz.
    a: [f64; 6],
    b: Vec3,
    c: f64,
    /// The area of surface that it stands for, square meters.
    pub area_m2: f64,
}

impl Quadric {
    /// The plane of a triangle; nothing when it has no area.
    pub(crate) fn of_triangle([p, q, r]: [Vec3; 3]) -> Self {
        let normal = cross(minus(q, p), minus(r, p));
        let doubled_m2 = dot(normal, normal).sqrt();
        if doubled_m2 <= 0.0 || !doubled_m2.is_finite() {
            return Self::default();
        }
        let area_m2 = 0.5 * doubled_m2;
        Self { area_m2, ..Self::of_plane(normal.map(|v| v / doubled_m2), p, area_m2) }
    }

    /// The plane through the first edge of a triangle and upright on it, which keeps a border in its place.
    pub(crate) fn of_border([p, q, r]: [Vec3; 3], weight: f64) -> Self {
        let along = minus(q, p);
        let outward = cross(along, cross(along, minus(r, p)));
        let length = dot(outward, outward).sqrt();
        if length <= 0.0 || !length.is_finite() {
            return Self::default();
        }
        Self::of_plane(outward.map(|v| v / length), p, weight * dot(along, along))
    }

    fn of_plane(normal: Vec3, through: Vec3, weight: f64) -> Self {
        let [x, y, z] = normal;
        let offset = -dot(normal, through);
        Self {
            a: [x * x, x * y, x * z, y * y, y * z, z * z].map(|v| weight * v),
            b: normal.map(|v| weight * offset * v),
            c: weight * offset * offset,
            area_m2: 0.0,
        }
    }

    /// Both together.
    pub(crate) fn plus(&self, other: &Self) -> Self {
        Self {
            a: std::array::from_fn(|k| self.a[k] + other.a[k]),
            b: std::array::from_fn(|k| self.b[k] + other.b[k]),
            c: self.c + other.c,
            area_m2: self.area_m2 + other.area_m2,
        }
    }

    /// The error at a place, never below zero.
    pub(crate) fn at(&self, p: Vec3) -> f64 {
        (dot(self.times(p), p) + 2.0 * dot(self.b, p) + self.c).max(0.0)
    }

    /// Where the error is least about an edge, and the error there. It is one of the ends where that is as
    /// good.
    pub(crate) fn minimum(&self, one: Vec3, other: Vec3) -> (Vec3, f64) {
        let mut best =
            if self.at(one) <= self.at(other) { (one, self.at(one)) } else { (other, self.at(other)) };
        let middle = std::array::from_fn(|k| 0.5 * (one[k] + other[k]));
        if let Some(p) = self.drawn_minimum(middle) {
            let error = self.at(p);
            if error < best.1 {
                best = (p, error);
            }
        }
        best
    }

    /// The place of the least error, drawn a little to `middle`.
    fn drawn_minimum(&self, middle: Vec3) -> Option<Vec3> {
        let draw = MIDDLE_SHARE * (self.a[0] + self.a[3] + self.a[5]);
        let [xx, xy, xz, yy, yz, zz] = self.a;
        let (xx, yy, zz) = (xx + draw, yy + draw, zz + draw);
        // From the middle on, so that few digits are lost far from the origin.
        let slope = self.times(middle);
        let right: Vec3 = std::array::from_fn(|k| -(slope[k] + self.b[k]));
        let rows = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]];
        let minors = [cross(rows[1], rows[2]), cross(rows[2], rows[0]), cross(rows[0], rows[1])];
        let determinant = dot(rows[0], minors[0]);
        let step: Vec3 = std::array::from_fn(|k| {
            (minors[0][k] * right[0] + minors[1][k] * right[1] + minors[2][k] * right[2]) / determinant
        });
        step.iter().all(|v| v.is_finite()).then(|| std::array::from_fn(|k| middle[k] + step[k]))
    }

    fn times(&self, [x, y, z]: Vec3) -> Vec3 {
        let [xx, xy, xz, yy, yz, zz] = self.a;
        [xx * x + xy * y + xz * z, xy * x + yy * y + yz * z, xz * x + yz * y + zz * z]
    }
}

/// `p - q`.
pub(crate) fn minus(p: Vec3, q: Vec3) -> Vec3 {
    std::array::from_fn(|k| p[k] - q[k])
}

#[cfg(test)]
mod tests {
    use super::Quadric;

    const LEVEL: [[f64; 3]; 3] = [[0.0, 0.0, 1.0], [2.0, 0.0, 1.0], [0.0, 2.0, 1.0]];

    #[test]
    fn the_error_is_the_area_times_the_squared_distance() {
        let level = Quadric::of_triangle(LEVEL);
        assert_eq!(level.area_m2, 2.0);
        for (p, expected) in [([5.0, -3.0, 1.0], 0.0), ([0.0, 0.0, 1.5], 0.5), ([9.0, 9.0, -1.0], 8.0)] {
            assert!((level.at(p) - expected).abs() < 1e-12, "{p:?}");
        }
        assert_eq!(Quadric::of_triangle([[1.0; 3]; 3]), Quadric::default());
    }

    #[test]
    fn a_border_is_held_across_it_and_not_along_it() {
        let border = Quadric::of_border(LEVEL, 3.0);
        assert!(border.at([7.0, 0.0, 4.0]).abs() < 1e-12);
        assert!((border.at([0.0, 0.5, 1.0]) - 3.0 * 4.0 * 0.25).abs() < 1e-12);
    }

    #[test]
    fn three_planes_are_least_wrong_where_they_meet() {
        let wall = |axis: usize| {
            Quadric::of_triangle(LEVEL.map(|[x, y, z]| {
                let mut p = [x, y, z];
                p.rotate_right(axis);
                p
            }))
        };
        let corner = wall(0).plus(&wall(1)).plus(&wall(2));
        let (p, error) = corner.minimum([1.1, 0.9, 1.0], [1.0, 1.2, 0.9]);
        assert!(p.iter().all(|v| (v - 1.0).abs() < 1e-4), "{p:?}");
        assert!(error < 1e-8);
        assert_eq!(corner.minimum([1.0; 3], [1.0, 1.2, 0.9]), ([1.0; 3], 0.0));
    }

    #[test]
    fn in_a_plane_the_middle_of_the_edge_does() {
        let tilted = Quadric::of_triangle([[0.0, 0.0, 0.0], [1.0, 0.0, 0.3], [0.0, 1.0, 0.1]]);
        let (one, other) = ([0.0, 0.0, 0.05], [1.0, 0.0, 0.35]);
        let (p, _) = tilted.minimum(one, other);
        assert!((p[0] - 0.5).abs() < 0.05 && p[1].abs() < 0.05, "{p:?}");
        assert!(tilted.at(p) < 1e-3 * tilted.at(one));
    }
}
