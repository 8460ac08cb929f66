//! Camera presets over a scene: from outside, from above, and inside along the trajectory. Frame `map`,
//! meters.

use super::camera::{Camera, Lens};
use super::raster;
use super::scene::{Facet, Scene};
use super::vector::Vec3;
use crate::recordings::deskew::StampedPose;
use biplane_geometry::vec3::{dot, minus, plus, scaled, unit};

const UP: Vec3 = [0.0, 0.0, 1.0];
/// Part of the points on either side of each axis that may lie outside of the picture: beams that left
/// through a window.
const OUTLIERS: f64 = 0.02;
/// Points beside the others by no more than this part of their span are shown all the same.
const BESIDE: f64 = 0.1;
/// So far beside the scene surfaces are in the picture, as a share of its size.
const SURFACES_BESIDE: f64 = 0.5;
/// A surface is seen when it faces us, or edge-on: cosine of the angle.
const EDGE_ON: f64 = 0.1;
/// Part of the picture that stays free around the scene.
const MARGIN: f64 = 0.03;
/// Width of a picture from outside at a distance of one: a long lens, as buildings are photographed.
const LONG_LENS: f64 = 0.55;
/// Width of a picture from inside at a distance of one: about 85 degrees.
const WIDE_LENS: f64 = 1.8;
/// Height of the eye inside, meters.
const EYE_HEIGHT_M: f64 = 1.5;
/// Inside, the eye looks to where the robot is this much later, meters of way.
const LOOK_AHEAD_M: f64 = 3.0;
/// Parts of the way at which the eye may stand.
const PLACES: [f64; 4] = [0.2, 0.4, 0.6, 0.8];
/// Cosine and sine of the turn from ahead, and what such a view is worth: ahead, 60 degrees left, 60 degrees
/// right.
const DIRECTIONS: [(f64, f64, f64); 3] = [(1.0, 0.0, 1.3), (0.5, 0.866_025_4, 1.0), (0.5, -0.866_025_4, 1.0)];
/// Columns of the small pictures by which views are chosen.
const PROBE_PIXELS: usize = 64;
/// What is nearer blocks the view, meters.
const NEAREST_M: f64 = 1.0;

/// A preset.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum View {
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
pub(crate) struct Extent {
    min: Vec3,
    max: Vec3,
    points_m: Vec<Vec3>,
    /// Whether the points spread farther along x than along y.
    along_x: bool,
}

impl Extent {
    /// Of the surfaces that a preset sees, but for the few farthest along each axis; `None` without points.
    pub(crate) fn of(view: View, scene: &Scene) -> Option<Self> {
        let corners = |facet: &Facet| facet.corners_m;
        let all = Self::of_bulk(scene.facets.iter().flat_map(corners).collect())?;
        let direction = match view {
            View::Outside => outside_direction(&all),
            View::Top => [0.0, 0.0, -1.0],
            View::Inside => return Some(all),
        };
        let faces_us = |facet: &&Facet| dot(facet.facing, direction) < 0.0;
        let seen = Self::of_bulk(scene.facets.iter().filter(faces_us).flat_map(corners).collect());
        // The direction was chosen for all of it and must not turn.
        seen.filter(|seen| outside_direction(seen) == outside_direction(&all)).or(Some(all))
    }

    /// The same with the flat surfaces of a model whole that the preset sees: few points tell of a room that
    /// was seen through its door. What lies farther off than half of the scene's size stays outside.
    pub(crate) fn with_surfaces(mut self, view: View, model: &Scene) -> Self {
        let direction = match view {
            View::Outside => outside_direction(&self),
            View::Top => [0.0, 0.0, -1.0],
            View::Inside => return self,
        };
        let beside = scaled(self.size(), SURFACES_BESIDE);
        let (low, high) = (minus(self.min, beside), plus(self.max, beside));
        let is_near = |p: &Vec3| (0..3).all(|axis| (low[axis]..=high[axis]).contains(&p[axis]));
        for (ends_m, normal) in model.lines_m.iter().zip(&model.line_normals) {
            if dot(*normal, direction) < EDGE_ON && ends_m.iter().all(is_near) {
                for point in ends_m {
                    self.min = [0, 1, 2].map(|axis| self.min[axis].min(point[axis]));
                    self.max = [0, 1, 2].map(|axis| self.max[axis].max(point[axis]));
                }
                self.points_m.extend(ends_m);
            }
        }
        self
    }

    fn of_bulk(mut points_m: Vec<Vec3>) -> Option<Self> {
        let (mut min, mut max) = ([0.0; 3], [0.0; 3]);
        for axis in 0..3 {
            let mut values: Vec<f64> = points_m.iter().map(|point| point[axis]).collect();
            values.sort_by(f64::total_cmp);
            let cut = (values.len() as f64 * OUTLIERS) as usize;
            let (low, high) = (*values.get(cut)?, *values.get(values.len() - 1 - cut)?);
            let beside = BESIDE * (high - low);
            min[axis] = values[0].max(low - beside);
            max[axis] = values[values.len() - 1].min(high + beside);
        }
        points_m.retain(|point| (0..3).all(|axis| (min[axis]..=max[axis]).contains(&point[axis])));
        let along_x = variance(&points_m, 0) >= variance(&points_m, 1);
        Some(Self { min, max, points_m, along_x })
    }

    /// Least and greatest coordinates of most of the points, meters.
    pub(crate) fn bounds_m(&self) -> [Vec3; 2] {
        [self.min, self.max]
    }

    fn middle(&self) -> Vec3 {
        scaled(plus(self.min, self.max), 0.5)
    }

    fn size(&self) -> Vec3 {
        minus(self.max, self.min)
    }
}

fn variance(points_m: &[Vec3], axis: usize) -> f64 {
    let count = points_m.len().max(1) as f64;
    let mean = points_m.iter().map(|point| point[axis]).sum::<f64>() / count;
    points_m.iter().map(|point| (point[axis] - mean) * (point[axis] - mean)).sum::<f64>() / count
}

/// Direction of looking from outside: across the longer side, a little from its end, downwards.
fn outside_direction(extent: &Extent) -> Vec3 {
    let flat: [f64; 2] = if extent.along_x { [0.5, 1.0] } else { [-1.0, 0.5] };
    let down = 0.7 * (flat[0] * flat[0] + flat[1] * flat[1]).sqrt();
    unit([flat[0], flat[1], -down])
}

/// The height over the width that suits what a preset sees.
pub(crate) fn aspect(view: View, extent: &Extent) -> f64 {
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

/// The camera of a preset over a scene. `height_over_width` is the picture's shape; `poses` are needed
/// inside.
pub(crate) fn camera(
    view: View,
    scene: &Scene,
    extent: &Extent,
    height_over_width: f64,
    poses: &[StampedPose],
) -> Camera {
    match view {
        View::Top => top(extent, height_over_width),
        View::Outside => outside(extent, height_over_width),
        View::Inside => {
            inside(scene, height_over_width, poses).unwrap_or_else(|| outside(extent, height_over_width))
        }
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
    // Each point bounds the eye on both sides: |across| <= depth * reach. The tightest of each side fix place
    // and distance.
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
    let eye = plus(plus(scaled(right, across), scaled(up, above)), scaled(forward, back));
    Camera::new(eye, direction, UP, lens)
}

/// The one of some places along the way, looking ahead or to a side, from which most is seen; ahead counts
/// more.
fn inside(scene: &Scene, height_over_width: f64, poses: &[StampedPose]) -> Option<Camera> {
    let size = [PROBE_PIXELS, ((PROBE_PIXELS as f64 * height_over_width) as usize).max(1)];
    let mut best: Option<(f64, Camera)> = None;
    for (camera, weight) in inside_candidates(poses) {
        let score = weight * raster::covered(scene, &camera, size, NEAREST_M);
        if best.is_none_or(|(known, _)| score > known) {
            best = Some((score, camera));
        }
    }
    best.map(|(_, camera)| camera)
}

/// The camera of someone who stands where the robot was after this part of its way (0 to 1), looking ahead;
/// `None` without poses.
pub(crate) fn inside_at(poses: &[StampedPose], part: f64) -> Option<Camera> {
    let (eye, ahead) = CameraPath::along(poses).stand(part)?;
    Some(Camera::new(eye, ahead, UP, Lens::Perspective { width: WIDE_LENS }))
}

fn inside_candidates(poses: &[StampedPose]) -> Vec<(Camera, f64)> {
    let way = CameraPath::along(poses);
    let mut candidates = Vec::new();
    for part in PLACES {
        let Some((eye, ahead)) = way.stand(part) else { continue };
        for (cos, sin, weight) in DIRECTIONS {
            let direction = [cos * ahead[0] - sin * ahead[1], sin * ahead[0] + cos * ahead[1], 0.0];
            candidates
                .push((Camera::new(eye, direction, UP, Lens::Perspective { width: WIDE_LENS }), weight));
        }
    }
    candidates
}

/// The robot's way with the length of it so far at each pose.
struct CameraPath<'a> {
    poses: &'a [StampedPose],
    so_far_m: Vec<f64>,
}

impl<'a> CameraPath<'a> {
    fn along(poses: &'a [StampedPose]) -> Self {
        let mut so_far_m = vec![0.0];
        for pair in poses.windows(2) {
            let step = minus(eye_at(&pair[1]), eye_at(&pair[0]));
            so_far_m.push(so_far_m[so_far_m.len() - 1] + dot(step, step).sqrt());
        }
        Self { poses, so_far_m }
    }

    /// The eye after this part of the way, and the level direction ahead.
    fn stand(&self, part: f64) -> Option<(Vec3, Vec3)> {
        let all_m = self.so_far_m[self.so_far_m.len() - 1];
        let after = |path_m: f64| {
            let index = self.so_far_m.partition_point(|so_far| *so_far < path_m);
            self.poses.get(index.min(self.poses.len().max(1) - 1)).map(eye_at)
        };
        let here = after(part * all_m)?;
        let ahead = minus(after(part * all_m + LOOK_AHEAD_M.min(0.2 * all_m))?, here);
        Some((here, if dot(ahead, ahead) > 0.01 { ahead } else { [1.0, 0.0, 0.0] }))
    }
}

fn eye_at(pose: &StampedPose) -> Vec3 {
    [pose.x_m, pose.y_m, EYE_HEIGHT_M]
}

#[cfg(test)]
mod tests {
    use super::{Extent, View, aspect, camera, inside_at};
    use crate::recordings::deskew::StampedPose;
    use crate::view::render::scene::{Facet, Scene};

    /// Corners of a box 12 m by 3 m by 2.6 m.
    fn corridor() -> Extent {
        let pick = |bit: usize, low: f64, high: f64| if bit > 0 { high } else { low };
        let corner = |i: usize| [pick(i & 1, -1.0, 11.0), pick(i & 2, -1.5, 1.5), pick(i & 4, 0.0, 2.6)];
        Extent::of_bulk((0..8).map(corner).collect()).unwrap()
    }

    #[test]
    fn a_preset_shows_the_whole_scene_and_wastes_no_room() {
        for view in [View::Outside, View::Top] {
            for shape in [0.3, aspect(view, &corridor()), 1.5] {
                let camera = camera(view, &Scene::default(), &corridor(), shape, &[]);
                let seen = corridor().points_m.into_iter().map(|point| camera.see(point));
                let x = seen.clone().map(|s| s.x.abs()).fold(0.0, f64::max);
                let y = seen.map(|s| s.y.abs()).fold(0.0, f64::max) / shape;
                assert!(x <= 0.5 && y <= 0.5, "{view:?} {shape}: {x} {y}");
                assert!(x.max(y) > 0.44, "{view:?} {shape}: {x} {y}");
            }
        }
    }

    #[test]
    fn inside_the_eye_looks_ahead_unless_there_is_more_to_see_beside() {
        let poses: Vec<StampedPose> =
            (0..=100).map(|i| StampedPose { x_m: f64::from(i) * 0.1, ..StampedPose::default() }).collect();
        let ahead = camera(View::Inside, &Scene::default(), &corridor(), 0.6, &poses);
        assert!((ahead.eye_m[0] - 2.0).abs() < 0.11 && ahead.eye_m[2] == 1.5);
        assert!(ahead.forward()[0] > 0.999);
        let half_way = inside_at(&poses, 0.5).unwrap();
        assert!((half_way.eye_m[0] - 5.0).abs() < 0.11 && half_way.forward() == [1.0, 0.0, 0.0]);
        assert_eq!(inside_at(&[], 0.5), None);
        // A facade far to the left of the way, as a robot outdoors has it.
        let [a, b] = [[-90.0, 6.0, 0.0], [99.0, 6.0, 0.0]];
        let facet = |corners_m| Facet {
            corners_m,
            normal: [0.0, -1.0, 0.0],
            facing: [0.0, -1.0, 0.0],
            color: [0; 3],
        };
        let top = [4.0, 6.0, 99.0];
        let scene = Scene { facets: vec![facet([a, b, top])], ..Scene::default() };
        assert!(camera(View::Inside, &scene, &corridor(), 0.6, &poses).forward()[1] > 0.8);
    }

    #[test]
    fn surfaces_of_the_model_are_in_the_picture_whole_unless_they_lie_far_off() {
        let wall = |from: f64, to: f64| ([[from, 1.5, 0.0], [to, 1.5, 0.0]], [0.0, -1.0, 0.0]);
        let (lines_m, line_normals) = [wall(-4.0, 0.0), wall(90.0, 95.0)].into_iter().unzip();
        let model = Scene { lines_m, line_normals, ..Scene::default() };
        let extent = corridor().with_surfaces(View::Top, &model);
        assert_eq!((extent.min[0], extent.max[0]), (-4.0, 11.0));
        let camera = camera(View::Top, &model, &extent, 0.5, &[]);
        assert!(camera.see([-4.0, 1.5, 0.0]).x.abs() <= 0.5);
        // A ceiling turns its back.
        let ceiling = Scene { line_normals: vec![[0.0, 0.0, -1.0]; 2], ..model };
        assert_eq!(corridor().with_surfaces(View::Top, &ceiling), corridor());
    }

    #[test]
    fn a_few_far_points_and_surfaces_that_turn_their_back_do_not_shrink_the_scene() {
        let near = (0..1000).map(|i| [f64::from(i) * 0.001, 0.0, 1.0]);
        let extent = Extent::of_bulk(near.chain([[500.0, 0.0, 0.0]]).collect()).unwrap();
        assert!(extent.max[0] < 1.2 && extent.min[2] == 1.0);
        assert_eq!(Extent::of_bulk(Vec::new()), None);

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
