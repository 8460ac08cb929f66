//! Cylinders that lie for the greater part behind the flat wall on which they are seen: ledges and moldings
//! whose edges the noise has rounded. Meters.
//!
//! A ledge of 20 by 10 cm, seen from below with a noise of 2 cm, is a circle as well as three faces. What
//! tells both apart is where the axis is: that of a pipe or a column is not behind the wall.

use crate::model::Cloud;
use crate::reconstruct::planes::fit::scatter::Scatter;
use crate::reconstruct::shapes::fit::judge::Accepted;
use crate::reconstruct::shapes::fit::surface::WALL_RADIUS_M;
use crate::reconstruct::shapes::search::patches::{Patch, Patches, is_wide};
use biplane_geometry::plane::distance_m;
use biplane_geometry::vec3::{cross, dot, minus, plus, scaled};

/// How far behind the wall an axis is at most, in radii: 150 degrees stand out then, 180 of a half column.
const MAX_BEHIND_RADII: f64 = 0.26;
/// Sine between an axis and a plane that runs along it.
const MAX_ALONG_SINE: f64 = 0.1;
/// The wall is there when it has points so near to a line in which both meet.
const BESIDE_M: f64 = 0.3;
/// Lengths along the axis that are told apart, and the share of them in which the wall is there.
const STEP_M: f64 = 0.25;
const MIN_BESIDE: f64 = 0.5;

/// Leaves out what does not stand out of the wall that it is on by about half of its way round.
pub(crate) fn retain(cloud: &Cloud, divided: &Patches, all: &mut Vec<Accepted>) {
    all.retain(|one| {
        // Curved walls may bulge out of flat ones.
        if one.inside || one.tube.radius_m >= WALL_RADIUS_M {
            return true;
        }
        let seen_m = middle_of(cloud, &one.on);
        let mut walls = divided.patches.iter().filter(|patch| is_wide(&patch.fit));
        !walls.any(|wall| hides(cloud, wall, one, seen_m))
    });
}

/// The mean of some points.
fn middle_of(cloud: &Cloud, points: &[usize]) -> [f64; 3] {
    let mut sum = Scatter::default();
    points.iter().for_each(|i| sum.add(cloud.points_m[*i].map(f64::from)));
    sum.mean()
}

/// Whether a wall has the greater part of a cylinder behind it, whose points have their middle at `seen_m`.
fn hides(cloud: &Cloud, wall: &Patch, one: &Accepted, seen_m: [f64; 3]) -> bool {
    let axis = &one.tube.axis;
    if dot(wall.fit.normal, axis.direction()).abs() > MAX_ALONG_SINE {
        return false;
    }
    let middle = plus(axis.point_m, scaled(axis.direction(), 0.5 * (one.along_m[0] + one.along_m[1])));
    let off_m = distance_m(wall.fit.normal, wall.fit.offset_m, middle);
    // Its points are on the side from which the wall is seen; the axis is behind when it is on the other.
    let is_ahead = distance_m(wall.fit.normal, wall.fit.offset_m, seen_m) > off_m;
    let behind_m = if is_ahead { -off_m } else { off_m };
    let radius_m = one.tube.radius_m;
    if behind_m <= MAX_BEHIND_RADII * radius_m || behind_m >= radius_m {
        return false;
    }
    let half_width_m = (radius_m * radius_m - behind_m * behind_m).sqrt();
    is_beside(cloud, wall, one, half_width_m)
}

/// Whether a wall has points beside a cylinder, along the greater part of it.
fn is_beside(cloud: &Cloud, wall: &Patch, one: &Accepted, half_width_m: f64) -> bool {
    let [from_m, to_m] = one.along_m;
    let steps = ((to_m - from_m) / STEP_M).ceil().clamp(1.0, 1000.0) as usize;
    let mut has = vec![false; steps];
    let across = cross(one.tube.axis.direction(), wall.fit.normal);
    for point in &wall.points {
        let p = cloud.points_m[*point as usize].map(f64::from);
        let from_axis = minus(p, one.tube.axis.point_m);
        let along_m = dot(from_axis, one.tube.axis.direction());
        let beside_m = dot(from_axis, across).abs() - half_width_m;
        if (from_m..to_m).contains(&along_m) && (0.0..=BESIDE_M).contains(&beside_m) {
            let step = ((along_m - from_m) / (to_m - from_m) * steps as f64) as usize;
            has[step.min(steps - 1)] = true;
        }
    }
    has.iter().filter(|has| **has).count() as f64 >= MIN_BESIDE * steps as f64
}
