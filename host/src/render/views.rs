//! Camera presets over a scene: from outside, from above, and inside along the trajectory. Frame `map`, metres.

use super::camera::{Camera, Lens};
use super::vector::{Vec3, add, dot, scale, sub, unit};
use crate::deskew::StampedPose;

const UP: Vec3 = [0.0, 0.0, 1.0];
/// Part of the points on either side of each axis that may lie outside of the picture: beams that left through a window.
const OUTLIERS: f64 = 0.002;
/// Part of the picture that stays free around the scene.
const MARGIN: f64 = 0.03;
/// Width of a picture from outside at a distance of one: a long lens, as buildings are photographed.
const LONG_LENS: f64 = 0.55;
/// Width of a picture from inside at a distance of one: about 85 degrees.
const WIDE_LENS: f64 = 1.8;
/// Height of the eye inside, metres.
const EYE_HEIGHT_M: f64 = 1.5;
/// Inside, the eye looks to where the robot is this much later, metres of way.
const LOOK_AHEAD_M: f64 = 3.0;

/// A preset.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum View {
    /// From above one corner, into the rooms: near walls and ceilings turn their backs and are left out.
    #[default]
    Outside,
    /// From where the robot drove.
    Inside,
    /// From above, as a plan.
    Top,
}

/// A box around most of some points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    min: Vec3,
    max: Vec3,
}

impl Bounds {
    /// Of points, but for the few farthest along each axis; `None` without points.
    pub fn of_most(points_m: impl Iterator<Item = Vec3>) -> Option<Self> {
        let mut axes = [Vec::new(), Vec::new(), Vec::new()];
        for point in points_m {
            for axis in 0..3 {
                axes[axis].push(point[axis]);
            }
        }
        let mut bounds = Self { min: [0.0; 3], max: [0.0; 3] };
        for (axis, values) in axes.iter_mut().enumerate() {
            values.sort_by(f64::total_cmp);
            let cut = (values.len() as f64 * OUTLIERS) as usize;
            bounds.min[axis] = *values.get(cut)?;
            bounds.max[axis] = *values.get(values.len() - 1 - cut)?;
        }
        Some(bounds)
    }

    fn corners(&self) -> [Vec3; 8] {
        let pick = |bit: bool, axis: usize| if bit { self.max[axis] } else { self.min[axis] };
        std::array::from_fn(|index| [pick(index & 1 > 0, 0), pick(index & 2 > 0, 1), pick(index & 4 > 0, 2)])
    }

    fn middle(&self) -> Vec3 {
        scale(add(self.min, self.max), 0.5)
    }

    fn size(&self) -> Vec3 {
        sub(self.max, self.min)
    }
}

/// Directions of looking from outside: across the longer side, a little from its end, down at 35 degrees.
fn outside_direction(bounds: &Bounds) -> Vec3 {
    let size = bounds.size();
    let flat: [f64; 2] = if size[0] >= size[1] { [0.5, 1.0] } else { [-1.0, 0.5] };
    let down = 0.7 * (flat[0] * flat[0] + flat[1] * flat[1]).sqrt();
    unit([flat[0], flat[1], -down])
}

/// The height over the width of the box as a preset sees it, for choosing the picture's shape.
pub fn aspect(view: View, bounds: &Bounds) -> f64 {
    let camera = match view {
        View::Inside => return 0.6,
        View::Top => top(bounds, 1.0),
        View::Outside => outside(bounds, 1.0),
    };
    let seen = bounds.corners().map(|corner| camera.see(corner));
    let span = |of: fn(&super::camera::Seen) -> f64| {
        let values = seen.iter().map(of);
        values.clone().fold(f64::NEG_INFINITY, f64::max) - values.fold(f64::INFINITY, f64::min)
    };
    span(|seen| seen.y) / span(|seen| seen.x).max(1e-9)
}

/// The camera of a preset. `height_over_width` is the picture's shape; `poses` are needed inside.
pub fn camera(view: View, bounds: &Bounds, height_over_width: f64, poses: &[StampedPose]) -> Camera {
    match view {
        View::Top => top(bounds, height_over_width),
        View::Outside => outside(bounds, height_over_width),
        View::Inside => inside(poses).unwrap_or_else(|| outside(bounds, height_over_width)),
    }
}

fn top(bounds: &Bounds, height_over_width: f64) -> Camera {
    let size = bounds.size();
    // The longer side lies across the picture.
    let (across, along, up) = if size[0] >= size[1] {
        (size[0], size[1], [0.0, 1.0, 0.0])
    } else {
        (size[1], size[0], [-1.0, 0.0, 0.0])
    };
    let width_m = (across.max(along / height_over_width) * (1.0 + 2.0 * MARGIN)).max(0.1);
    let [x, y, _] = bounds.middle();
    let eye = [x, y, bounds.max[2] + 10.0];
    Camera::new(eye, [0.0, 0.0, -1.0], up, Lens::Parallel { width_m })
}

fn outside(bounds: &Bounds, height_over_width: f64) -> Camera {
    let direction = outside_direction(bounds);
    let lens = Lens::Perspective { width: LONG_LENS };
    let half = [0.5 * (1.0 - 2.0 * MARGIN), 0.5 * height_over_width * (1.0 - 2.0 * MARGIN)];
    let probe = Camera::new([0.0; 3], direction, UP, lens);
    let (right, up, forward) = (probe.right(), probe.up(), probe.forward());
    // Each corner bounds the eye on both sides: |across| <= depth * reach. The tightest of each side fix place and distance.
    let corners = bounds.corners();
    let fit = |axis: Vec3, half: f64| {
        let reach = half * LONG_LENS;
        let side = |sign: f64| {
            corners
                .iter()
                .map(|&corner| sign * dot(corner, axis) - reach * dot(corner, forward))
                .fold(f64::NEG_INFINITY, f64::max)
        };
        let (plus, minus) = (side(1.0), side(-1.0));
        ((plus - minus) / 2.0, -(plus + minus) / (2.0 * reach))
    };
    let ((across, depth_x), (above, depth_y)) = (fit(right, half[0]), fit(up, half[1]));
    let back = depth_x.min(depth_y);
    let eye = add(add(scale(right, across), scale(up, above)), scale(forward, back));
    Camera::new(eye, direction, UP, lens)
}

/// Where the robot was after a quarter of its way, looking to where it went.
fn inside(poses: &[StampedPose]) -> Option<Camera> {
    let at = |pose: &StampedPose| [pose.x_m, pose.y_m, EYE_HEIGHT_M];
    let mut way_m = vec![0.0];
    for pair in poses.windows(2) {
        let step = sub(at(&pair[1]), at(&pair[0]));
        way_m.push(way_m[way_m.len() - 1] + dot(step, step).sqrt());
    }
    let all_m = *way_m.last()?;
    let after = |way: f64| poses.get(way_m.partition_point(|so_far| *so_far < way).min(poses.len() - 1));
    let eye = at(after(0.2 * all_m)?);
    let ahead = sub(at(after(0.2 * all_m + LOOK_AHEAD_M.min(0.5 * all_m))?), eye);
    let direction = if dot(ahead, ahead) > 0.01 { ahead } else { [1.0, 0.0, 0.0] };
    Some(Camera::new(eye, direction, UP, Lens::Perspective { width: WIDE_LENS }))
}

#[cfg(test)]
mod tests {
    use super::{Bounds, View, aspect, camera};
    use crate::deskew::StampedPose;

    fn corridor() -> Bounds {
        Bounds { min: [-1.0, -1.5, 0.0], max: [11.0, 1.5, 2.6] }
    }

    #[test]
    fn a_preset_shows_the_whole_box_and_wastes_no_room() {
        for view in [View::Outside, View::Top] {
            for shape in [0.3, aspect(view, &corridor()), 1.5] {
                let camera = camera(view, &corridor(), shape, &[]);
                let seen = corridor().corners().map(|corner| camera.see(corner));
                let x = seen.iter().map(|s| s.x.abs()).fold(0.0, f64::max);
                let y = seen.iter().map(|s| s.y.abs()).fold(0.0, f64::max) / shape;
                assert!(x <= 0.5 && y <= 0.5, "{view:?} {shape}: {x} {y}");
                assert!(x.max(y) > 0.44, "{view:?} {shape}: {x} {y}");
            }
        }
    }

    #[test]
    fn inside_the_eye_looks_along_the_way() {
        let poses: Vec<StampedPose> =
            (0..=100).map(|i| StampedPose { x_m: f64::from(i) * 0.1, ..StampedPose::default() }).collect();
        let camera = camera(View::Inside, &corridor(), 0.6, &poses);
        assert!((camera.eye_m[0] - 2.0).abs() < 0.11 && camera.eye_m[2] == 1.5);
        assert!(camera.forward()[0] > 0.999);
    }

    #[test]
    fn a_few_far_points_do_not_shrink_the_scene() {
        let near = (0..1000).map(|i| [f64::from(i) * 0.001, 0.0, 1.0]);
        let bounds = Bounds::of_most(near.chain([[500.0, 0.0, 0.0]])).unwrap();
        assert!(bounds.max[0] < 1.0 && bounds.min[2] == 1.0);
        assert_eq!(Bounds::of_most(std::iter::empty()), None);
    }
}
