//! Cylinders that are parts of one become one. Meters.

use crate::model::Cloud;
use crate::reconstruct::shapes::fit::judge::Accepted;
use crate::reconstruct::shapes::fit::surface::Evidence;
use crate::reconstruct::shapes::params::ShapeParams;
use crate::reconstruct::shapes::search::guesses::fitted;
use biplane_geometry::PortableMath;
use biplane_geometry::vec3::dot;

/// Two axes are one when they run within this angle and distance of each other.
const MIN_COSINE: f64 = 0.98;
const MAX_APART_M: f64 = 0.04;
/// The same in radii, and how much the radii differ at most.
const MAX_APART_RADII: f64 = 0.2;
/// Parts further apart along the axis are two things.
const MAX_GAP_M: f64 = 1.0;

/// Unites parts, pair after pair, as long as the whole is accepted as well.
pub(crate) fn unite(
    params: &ShapeParams,
    cloud: &Cloud,
    sigma_m: f64,
    mut all: Vec<Accepted>,
) -> Vec<Accepted> {
    all.sort_by(|a, b| b.on.len().cmp(&a.on.len()).then(a.on.first().cmp(&b.on.first())));
    let mut whole: Vec<Accepted> = Vec::new();
    for part in all {
        let same = (0..whole.len()).find(|index| are_one(&whole[*index], &part));
        let united =
            same.and_then(|index| Some((index, together(params, cloud, sigma_m, &whole[index], &part)?)));
        match (united, same) {
            (Some((index, united)), _) => whole[index] = united,
            // Two that lie in each other, but are not one: the larger is right.
            (None, Some(_)) => {}
            (None, None) => whole.push(part),
        }
    }
    whole
}

fn are_one(a: &Accepted, b: &Accepted) -> bool {
    let (small, large) = (a.tube.radius_m.min(b.tube.radius_m), a.tube.radius_m.max(b.tube.radius_m));
    let apart_m = MAX_APART_M.max(MAX_APART_RADII * small);
    if a.inside != b.inside || large - small > apart_m {
        return false;
    }
    if dot(a.tube.axis.direction(), b.tube.axis.direction()).abs() < MIN_COSINE {
        return false;
    }
    let ends = b.along_m.map(|along| {
        let [_, _, direction] = b.tube.axis.frame;
        a.tube.axis.local([0, 1, 2].map(|k| b.tube.axis.point_m[k] + along * direction[k]))
    });
    let [x, y] = [0, 1].map(|k| 0.5 * (ends[0][k] + ends[1][k]));
    let [from, to] = [ends[0][2].min(ends[1][2]), ends[0][2].max(ends[1][2])];
    x.portable_hypot(y) <= apart_m && from <= a.along_m[1] + MAX_GAP_M && to >= a.along_m[0] - MAX_GAP_M
}

/// Both as one.
fn together(
    params: &ShapeParams,
    cloud: &Cloud,
    sigma_m: f64,
    a: &Accepted,
    b: &Accepted,
) -> Option<Accepted> {
    let mut points: Vec<usize> = a.on.iter().chain(&b.on).copied().collect();
    points.sort_unstable();
    points.dedup();
    let points_m: Vec<[f64; 3]> = points.iter().map(|point| cloud.points_m[*point].map(f64::from)).collect();
    let origin_of = |point: &usize| Some(cloud.origin_of(*point)?.map(f64::from));
    let origins_m: Vec<[f64; 3]> = points.iter().filter_map(origin_of).collect();
    let seen = Evidence { points_m: &points_m, origins_m: &origins_m, sigma_m };
    let mut accepted = fitted(params, a.tube, &seen).ok()?;
    // A gap along the axis splits what was one: then they stay apart.
    if (accepted.on.len() as f64) < 0.9 * points.len() as f64 {
        return None;
    }
    accepted.on.iter_mut().for_each(|i| *i = points[*i]);
    Some(accepted)
}
