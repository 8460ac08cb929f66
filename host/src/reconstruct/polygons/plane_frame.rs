//! Coordinates within a plane: whole tenths of a millimeter, so that polygon operations are exact and
//! repeatable.
//!
//! u lies level where the plane allows, v completes it so that a ring that is counter-clockwise in (u, v) is
//! counter-clockwise seen from the normal's tip. Frame `map`, meters.

use crate::model::Plane;
use biplane_geometry::PortableMath;
use biplane_geometry::vec3::{cross, dot};
use i_overlay::i_float::int::point::IntPoint;

/// A point of a plane in steps of [`STEP_M`].
pub(crate) type FlatPoint = IntPoint<i32>;

/// The step of plane coordinates, meters.
pub(crate) const STEP_M: f64 = 1e-4;
/// Farthest coordinate that is exact in all operations on it, in steps.
const LIMIT: f64 = (1 << 26) as f64;

/// The coordinate system of one plane.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Frame {
    origin_m: [f64; 3],
    u: [f64; 3],
    v: [f64; 3],
}

impl Frame {
    /// The frame of a plane, with its origin at the foot of `near_m`.
    pub(crate) fn new(plane: &Plane, near_m: [f64; 3]) -> Self {
        let n = plane.normal;
        let level = [-n[1], n[0], 0.0];
        let length = dot(level, level).sqrt();
        // A floor or ceiling has no level direction of its own: take x of the map, made orthogonal to the
        // normal.
        let u = if length > 0.1 {
            level.map(|x| x / length)
        } else {
            let along = [1.0 - n[0] * n[0], -n[0] * n[1], -n[0] * n[2]];
            let length = dot(along, along).sqrt();
            along.map(|x| x / length)
        };
        Self { origin_m: foot(plane, near_m), u, v: cross(n, u) }
    }

    /// Coordinates of a point's foot in the plane; `None` when it is kilometers away.
    pub(crate) fn flat(&self, p_m: [f64; 3]) -> Option<FlatPoint> {
        let [x, y] = self.steps(p_m).map(f64::round);
        (x.abs() < LIMIT && y.abs() < LIMIT).then(|| FlatPoint::new(x as i32, y as i32))
    }

    /// Coordinates of a point's foot in the plane, in steps and unrounded.
    pub(crate) fn steps(&self, p_m: [f64; 3]) -> [f64; 2] {
        let from_origin = std::array::from_fn(|k| p_m[k] - self.origin_m[k]);
        [dot(self.u, from_origin) / STEP_M, dot(self.v, from_origin) / STEP_M]
    }

    /// A direction in the plane; `None` for one that hardly lies in it.
    pub(crate) fn direction(&self, along: [f64; 3]) -> Option<[f64; 2]> {
        let (x, y) = (dot(self.u, along), dot(self.v, along));
        let length = x.portable_hypot(y);
        (length > 0.5 * dot(along, along).sqrt()).then(|| [x / length, y / length])
    }

    /// The point in `map`, meters.
    pub(crate) fn lift(&self, p: FlatPoint) -> [f64; 3] {
        let (x, y) = (f64::from(p.x) * STEP_M, f64::from(p.y) * STEP_M);
        std::array::from_fn(|k| self.origin_m[k] + x * self.u[k] + y * self.v[k])
    }
}

/// The point of the plane nearest to `p_m`.
pub(crate) fn foot(plane: &Plane, p_m: [f64; 3]) -> [f64; 3] {
    biplane_geometry::plane::foot(plane.normal, plane.offset_m, p_m)
}

#[cfg(test)]
mod tests {
    use super::{Frame, cross};
    use crate::model::sample::plane;
    use biplane_geometry::vec3::dot;

    #[test]
    fn lifted_points_lie_on_the_plane_and_come_back_the_same() {
        for (normal, offset_m) in [([0.0, 0.0, -1.0], -2.6), ([0.6, 0.0, 0.8], 3.0), ([0.0, -1.0, 0.0], 1.0)]
        {
            let plane = plane(normal, offset_m);
            let frame = Frame::new(&plane, [5.0, 6.0, 7.0]);
            let flat = frame.flat([1.0, 2.0, 3.0]).unwrap();
            let lifted = frame.lift(flat);
            assert!(plane.distance_m(lifted).abs() < 1e-12);
            assert_eq!(frame.flat(lifted), Some(flat));
            assert!((dot(cross(frame.u, frame.v), normal) - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn a_point_out_of_reach_has_no_coordinates() {
        let frame = Frame::new(&plane([0.0, 0.0, 1.0], 0.0), [0.0; 3]);
        assert!(frame.flat([1e9, 0.0, 0.0]).is_none() && frame.flat([f64::NAN, 0.0, 0.0]).is_none());
    }
}
