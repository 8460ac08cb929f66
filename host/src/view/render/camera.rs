//! Where a picture is taken from. Frame `map`, meters; pixels count from the top left.

use super::vector::Vec3;
use biplane_geometry::vec3::{cross, dot, minus, plus, scaled, unit};

/// Nearer than this nothing is drawn, meters.
const NEAREST_M: f64 = 0.05;

/// How space becomes flat.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Lens {
    /// As an eye sees it: width of the picture at a distance of one.
    Perspective {
        /// Picture width over distance.
        width: f64,
    },
    /// As a plan: no shortening with distance.
    Parallel {
        /// Width of the picture, meters.
        width_m: f64,
    },
}

/// A camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Camera {
    /// Where it stands.
    pub eye_m: Vec3,
    right: Vec3,
    up: Vec3,
    forward: Vec3,
    lens: Lens,
}

/// A point as the camera sees it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Seen {
    /// To the right, in units of the picture's width, from its middle.
    pub x: f64,
    /// Upwards, the same.
    pub y: f64,
    /// Larger is nearer; straight lines stay straight in it.
    pub nearness: f64,
}

impl Camera {
    /// Looks from a point in a direction; `up` is what should be upwards in the picture.
    pub(crate) fn new(eye_m: Vec3, direction: Vec3, up: Vec3, lens: Lens) -> Self {
        let forward = unit(direction);
        let right = unit(cross(forward, up));
        Self { eye_m, right, up: cross(right, forward), forward, lens }
    }

    /// The direction of looking.
    pub(crate) fn forward(&self) -> Vec3 {
        self.forward
    }

    /// Upwards in the picture.
    pub(crate) fn up(&self) -> Vec3 {
        self.up
    }

    /// To the right in the picture.
    pub(crate) fn right(&self) -> Vec3 {
        self.right
    }

    /// From the point towards the camera: where its viewer is, not normalized.
    pub(crate) fn towards(&self, point_m: Vec3) -> Vec3 {
        match self.lens {
            Lens::Perspective { .. } => minus(self.eye_m, point_m),
            Lens::Parallel { .. } => scaled(self.forward, -1.0),
        }
    }

    /// Distance along the direction of looking, meters.
    pub(crate) fn depth_m(&self, point_m: Vec3) -> f64 {
        dot(minus(point_m, self.eye_m), self.forward)
    }

    /// Where a point is in the picture; it must be in front of the camera.
    pub(crate) fn see(&self, point_m: Vec3) -> Seen {
        let offset = minus(point_m, self.eye_m);
        let (x, y, depth) = (dot(offset, self.right), dot(offset, self.up), dot(offset, self.forward));
        match self.lens {
            Lens::Perspective { width } => {
                Seen { x: x / (depth * width), y: y / (depth * width), nearness: 1.0 / depth }
            }
            Lens::Parallel { width_m } => Seen { x: x / width_m, y: y / width_m, nearness: -depth },
        }
    }

    /// Depth of what has this nearness, meters.
    pub(crate) fn depth_of(&self, nearness: f64) -> f64 {
        match self.lens {
            Lens::Perspective { .. } => 1.0 / nearness,
            Lens::Parallel { .. } => -nearness,
        }
    }

    /// How large a meter of this nearness is in the picture, in units of the picture's width.
    pub(crate) fn size_of_meter(&self, nearness: f64) -> f64 {
        match self.lens {
            Lens::Perspective { width } => nearness / width,
            Lens::Parallel { width_m } => 1.0 / width_m,
        }
    }

    /// Cuts off what is behind the camera; the corners of what is left.
    pub(crate) fn clip(&self, corners: &[Vec3; 3]) -> Vec<Vec3> {
        let Lens::Perspective { .. } = self.lens else { return corners.to_vec() };
        let mut kept = Vec::with_capacity(4);
        for (index, &a) in corners.iter().enumerate() {
            let b = corners[(index + 1) % 3];
            let (depth_a, depth_b) = (self.depth_m(a) - NEAREST_M, self.depth_m(b) - NEAREST_M);
            if depth_a >= 0.0 {
                kept.push(a);
            }
            if (depth_a >= 0.0) != (depth_b >= 0.0) {
                kept.push(plus(a, scaled(minus(b, a), depth_a / (depth_a - depth_b))));
            }
        }
        kept
    }

    /// Cuts off what of a segment is behind the camera.
    pub(crate) fn clip_segment(&self, [a, b]: [Vec3; 2]) -> Option<[Vec3; 2]> {
        let Lens::Perspective { .. } = self.lens else { return Some([a, b]) };
        let (depth_a, depth_b) = (self.depth_m(a) - NEAREST_M, self.depth_m(b) - NEAREST_M);
        let cut = || plus(a, scaled(minus(b, a), depth_a / (depth_a - depth_b)));
        match (depth_a >= 0.0, depth_b >= 0.0) {
            (true, true) => Some([a, b]),
            (true, false) => Some([a, cut()]),
            (false, true) => Some([cut(), b]),
            (false, false) => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{Camera, Lens};

    #[test]
    fn what_is_ahead_is_in_the_middle_and_left_is_left() {
        let lens = Lens::Perspective { width: 1.0 };
        let camera = Camera::new([0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0], lens);
        let ahead = camera.see([4.0, 0.0, 1.0]);
        assert_eq!((ahead.x, ahead.y, ahead.nearness), (0.0, 0.0, 0.25));
        assert_eq!(camera.size_of_meter(ahead.nearness), 0.25);
        let left_above = camera.see([4.0, 1.0, 2.0]);
        assert_eq!((left_above.x, left_above.y), (-0.25, 0.25));
        let plan =
            Camera::new([0.0, 0.0, 9.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0], Lens::Parallel { width_m: 10.0 });
        let seen = plan.see([5.0, -2.5, 0.0]);
        assert_eq!((seen.x, seen.y, plan.depth_of(seen.nearness)), (0.5, -0.25, 9.0));
    }

    #[test]
    fn a_triangle_behind_the_camera_is_cut() {
        let lens = Lens::Perspective { width: 1.0 };
        let camera = Camera::new([0.0; 3], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0], lens);
        let corners = camera.clip(&[[1.0, 0.0, 0.0], [-1.0, 1.0, 0.0], [-1.0, -1.0, 0.0]]);
        assert_eq!(corners.len(), 3);
        assert!(corners.iter().all(|corner| corner[0] >= 0.0499));
        assert!(camera.clip(&[[-1.0, 0.0, 0.0], [-1.0, 1.0, 0.0], [-2.0, 0.0, 0.0]]).is_empty());
        assert_eq!(camera.clip_segment([[-1.0, 0.0, 0.0], [-2.0, 0.0, 0.0]]), None);
        let [a, b] = camera.clip_segment([[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]]).unwrap();
        assert!(a[0] == 1.0 && (b[0] - 0.05).abs() < 1e-12);
    }
}
