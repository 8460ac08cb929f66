//! Camera presets over a scene: from outside, from above, and inside along the trajectory. Frame `map`, metres.

use super::camera::{Camera, Lens};
use super::scene::{Facet, Scene};
use super::vector::{Vec3, add, dot, scale, sub, unit};
use crate::deskew::StampedPose;

const UP: Vec3 = [0.0, 0.0, 1.0];
/// Part of the points on either side of each axis that may lie outside of the picture: beams that left through a window.
const OUTLIERS: f64 = 0.015;
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

/// What of a scene should be in the picture: most of its points.
#[derive(Clone, Debug, PartialEq)]
pub struct Extent {
    min: Vec3,
    max: Vec3,
    points_m: Vec<Vec3>,
}

impl Extent {
    /// Of the surfaces that a preset sees, but for the few farthest along each axis; `None` without points.
    pub fn of(view: View, scene: &Scene) -> Option<Self> {
        let corners = |facet: &Facet| facet.corners_m;
        let all = Self::of_most(scene.facets.iter().flat_map(corners).collect())?;
        let direction = match view {
            View::Outside => outside_direction(&all),
            View::Top => [0.0, 0.0, -1.0],
            View::Inside => return Some(all),
        };
        let faces_us = |facet: &&Facet| dot(facet.facing, direction) < 0.0;
        let seen = Self::of_most(scene.facets.iter().filter(faces_us).flat_map(corners).collect());
        // The direction was chosen for all of it and must not turn.
        seen.filter(|seen| outside_direction(seen) == outside_direction(&all)).or(Some(all))
    }

    fn of_most(mut points_m: Vec<Vec3>) -> Option<Self> {
        let (mut min, mut max) = ([0.0; 3], [0.0; 3]);
        for axis in 0..3 {
            let mut values: Vec<f64> = points_m.iter().map(|point| point[axis]).collect();
            values.sort_by(f64::total_cmp);
            let cut = (values.len() as f64 * OUTLIERS) as usize;
            min[axis] = *values.get(cut)?;
            max[axis] = *values.get(values.len() - 1 - cut)?;
        }
        points_m.retain(|point| (0..3).all(|axis| (min[axis]..=max[axis]).contains(&point[axis])));
        Some(Self { min, max, points_m })
    }

    fn middle(&self) -> Vec3 {
        scale(add(self.min, self.max), 0.5)
    }

    fn size(&self) -> Vec3 {
        sub(self.max, self.min)
    }
}

/// Direction of looking from outside: across the longer side, a little from its end, downwards.
fn outside_direction(extent: &Extent) -> Vec3 {
    let size = extent.size();
    let flat: [f64; 2] = if size[0] >= size[1] { [0.5, 1.0] } else { [-1.0, 0.5] };
    let down = 0.7 * (flat[0] * flat[0] + flat[1] * flat[1]).sqrt();
    unit([flat[0], flat[1], -down])
}

/// The height over the width that suits what a preset sees.
pub fn aspect(view: View, extent: &Extent) -> f64 {
    let camera = match view {
        View::Inside => return 0.6,
        View::Top => top(extent, 1.0),
        View::Outside => outside(extent, 1.0),
    };
    let (mut min, mut max) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    for point in &extent.points_m {
        let seen = camera.see(*point);
        for (axis, value) in [seen.x, seen.y].into_iter().enumerate() {
            min[axis] = min[axis].min(value);
            max[axis] = max[axis].max(value);
        }
    }
    (max[1] - min[1]) / (max[0] - min[0]).max(1e-9)
}

/// The camera of a preset. `height_over_width` is the picture's shape; `poses` are needed inside.
pub fn camera(view: View, extent: &Extent, height_over_width: f64, poses: &[StampedPose]) -> Camera {
    match view {
        View::Top => top(extent, height_over_width),
        View::Outside => outside(extent, height_over_width),
        View::Inside => inside(poses).unwrap_or_else(|| outside(extent, height_over_width)),
    }
}

fn top(extent: &Extent, height_over_width: f64) -> Camera {
    let size = extent.size();
    // The longer side lies across the picture.
    let (across, along, up) = if size[0] >= size[1] {
        (size[0], size[1], [0.0, 1.0, 0.0])
    } else {
        (size[1], size[0], [-1.0, 0.0, 0.0])
    };
    let width_m = (across.max(along / height_over_width) * (1.0 + 2.0 * MARGIN)).max(0.1);
    let [x, y, _] = extent.middle();
    let eye = [x, y, extent.max[2] + 10.0];
    Camera::new(eye, [0.0, 0.0, -1.0], up, Lens::Parallel { width_m })
}

fn outside(extent: &Extent, height_over_width: f64) -> Camera {
    let direction = outside_direction(extent);
    let lens = Lens::Perspective { width: LONG_LENS };
    let half = [0.5 * (1.0 - 2.0 * MARGIN), 0.5 * height_over_width * (1.0 - 2.0 * MARGIN)];
    let probe = Camera::new([0.0; 3], direction, UP, lens);
    let (right, up, forward) = (probe.right(), probe.up(), probe.forward());
    // Each point bounds the eye on both sides: |across| <= depth * reach. The tightest of each side fix place and distance.
    let fit = |axis: Vec3, half: f64| {
        let reach = half * LONG_LENS;
        let side = |sign: f64| {
            let bound = |point: &Vec3| sign * dot(*point, axis) - reach * dot(*point, forward);
            extent.points_m.iter().map(bound).fold(f64::NEG_INFINITY, f64::max)
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
    use super::{Extent, View, aspect, camera};
    use crate::deskew::StampedPose;
    use crate::render::scene::{Facet, Scene};

    /// Corners of a box 12 m by 3 m by 2.6 m.
    fn corridor() -> Extent {
        let pick = |bit: usize, low: f64, high: f64| if bit > 0 { high } else { low };
        let corner = |i: usize| [pick(i & 1, -1.0, 11.0), pick(i & 2, -1.5, 1.5), pick(i & 4, 0.0, 2.6)];
        Extent::of_most((0..8).map(corner).collect()).unwrap()
    }

    #[test]
    fn a_preset_shows_the_whole_scene_and_wastes_no_room() {
        for view in [View::Outside, View::Top] {
            for shape in [0.3, aspect(view, &corridor()), 1.5] {
                let camera = camera(view, &corridor(), shape, &[]);
                let seen = corridor().points_m.into_iter().map(|point| camera.see(point));
                let x = seen.clone().map(|s| s.x.abs()).fold(0.0, f64::max);
                let y = seen.map(|s| s.y.abs()).fold(0.0, f64::max) / shape;
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
    fn a_few_far_points_and_surfaces_that_turn_their_back_do_not_shrink_the_scene() {
        let near = (0..1000).map(|i| [f64::from(i) * 0.001, 0.0, 1.0]);
        let extent = Extent::of_most(near.chain([[500.0, 0.0, 0.0]]).collect()).unwrap();
        assert!(extent.max[0] < 1.0 && extent.min[2] == 1.0);
        assert_eq!(Extent::of_most(Vec::new()), None);

        let facet = |z: f64, up: f64| Facet {
            corners_m: [[0.0, 0.0, z], [1.0, 0.0, z], [0.0, 1.0, z]],
            normal: [0.0, 0.0, up],
            facing: [0.0, 0.0, up],
            color: [0; 3],
        };
        let scene = Scene { facets: vec![facet(0.0, 1.0), facet(3.0, -1.0)], ..Scene::default() };
        assert_eq!(Extent::of(View::Top, &scene).unwrap().max[2], 0.0);
        assert_eq!(Extent::of(View::Inside, &scene).unwrap().max[2], 3.0);
    }
}
