//! Which points are on which cylinder, and what is left of the planes. Meters, radians.

use crate::model::Cloud;
use crate::reconstruct::planes::labeled::Planes;
use crate::reconstruct::planes::labels::refine::{POINTS_PER_PIECE, scatters};
use crate::reconstruct::shapes::fit::judge::Accepted;
use crate::reconstruct::shapes::fit::surface::ON_DEVIATIONS;
use crate::reconstruct::shapes::params::ShapeParams;
use crate::reconstruct::shapes::search::curved_walls::Curved;
use crate::reconstruct::shapes::search::patches::Patches;
use biplane_geometry::PortableMath;
use biplane_geometry::vec3::{dot, plus, scaled};
use rayon::prelude::*;

/// A piece of a plane is gone when so many of its points are on cylinders.
const MAX_CLAIMED: f64 = 0.6;
/// A plane is gone when no more than this share of its points is left.
const MIN_LEFT: f64 = 0.3;
/// Points so far past the ends of the arc and of the axis belong to the cylinder still, meters.
const MARGIN_M: f64 = 0.05;

/// Cylinders with their points.
pub(crate) struct Claimed {
    /// The cylinders, the largest first.
    pub accepted: Vec<Accepted>,
    /// For every point the index of its cylinder, or -1.
    pub labels: Vec<i32>,
}

/// Gives every cylinder its points, and takes them from the planes.
pub(crate) fn claim(
    params: &ShapeParams,
    cloud: &Cloud,
    found: &mut Planes,
    divided: &Patches,
    curved: &[Curved],
    mut accepted: Vec<Accepted>,
) -> Claimed {
    accepted.sort_by(|a, b| b.on.len().cmp(&a.on.len()).then(a.on.first().cmp(&b.on.first())));
    let mut may: Vec<bool> = found.labels.iter().map(|label| *label < 0).collect();
    divided.candidates.iter().for_each(|point| may[*point as usize] = true);
    let strips = curved.iter().flat_map(|curved| &curved.patches);
    strips
        .flat_map(|patch| &divided.patches[*patch as usize].points)
        .for_each(|point| may[*point as usize] = true);
    let limit_m = ON_DEVIATIONS * found.sigma_m;
    let boxes: Vec<_> = accepted.iter().map(|one| box_of(one, limit_m)).collect();
    let label_of = |point: usize| -> i32 {
        if !may[point] {
            return -1;
        }
        let p = cloud.points_m[point].map(f64::from);
        let of = |(one, (low, high)): (&Accepted, &([f64; 3], [f64; 3]))| {
            (0..3).all(|k| low[k] <= p[k] && p[k] <= high[k]).then(|| off_m(one, p, limit_m))?
        };
        let near = accepted.iter().zip(&boxes).zip(0..).filter_map(|(one, index)| Some((of(one)?, index)));
        near.min_by(|a, b| a.0.total_cmp(&b.0)).map_or(-1, |(_, index)| index)
    };
    let labels: Vec<i32> =
        (0..cloud.len()).into_par_iter().with_min_len(POINTS_PER_PIECE).map(label_of).collect();
    dissolve(found, divided, &labels);
    drop_rests(params, cloud, found);
    Claimed { accepted, labels }
}

/// A box with all that is on a cylinder: most points are in none.
fn box_of(one: &Accepted, limit_m: f64) -> ([f64; 3], [f64; 3]) {
    let margin_m = one.tube.radius_m + limit_m + 2.0 * MARGIN_M;
    let end = |along_m: f64| plus(one.tube.axis.point_m, scaled(one.tube.axis.direction(), along_m));
    let [from, to] = one.along_m.map(end);
    let side = |pick: fn(f64, f64) -> f64, margin_m: f64| [0, 1, 2].map(|k| pick(from[k], to[k]) + margin_m);
    (side(f64::min, -margin_m), side(f64::max, margin_m))
}

/// How far a point is off the surface of a cylinder; `None` for one that is not on it.
fn off_m(one: &Accepted, p: [f64; 3], limit_m: f64) -> Option<f64> {
    let [x, y, along] = one.tube.axis.local(p);
    let radius_m = one.tube.radius_m;
    let off_m = (x.portable_hypot(y) - radius_m).abs();
    let [from_m, to_m] = one.along_m;
    if off_m > limit_m || along < from_m - MARGIN_M || along > to_m + MARGIN_M {
        return None;
    }
    let [from, to] = one.arc_rad;
    let margin = MARGIN_M / radius_m;
    let turn = (y.portable_atan2(x) - from + margin).rem_euclid(std::f64::consts::TAU);
    (turn <= to - from + 2.0 * margin).then_some(off_m)
}

/// Takes the points of cylinders from the planes, and with them the rest of pieces that were strips.
fn dissolve(found: &mut Planes, divided: &Patches, labels: &[i32]) {
    for patch in &divided.patches {
        let claimed = patch.points.iter().filter(|point| labels[**point as usize] >= 0).count();
        if claimed as f64 >= MAX_CLAIMED * patch.points.len() as f64 {
            patch.points.iter().for_each(|point| found.labels[*point as usize] = -1);
        }
    }
    found.labels.iter_mut().zip(labels).filter(|(_, round)| **round >= 0).for_each(|(label, _)| *label = -1);
}

/// Drops planes of which little is left, fits the others to what they keep, and orders them anew.
fn drop_rests(params: &ShapeParams, cloud: &Cloud, found: &mut Planes) {
    let count = found.planes.len();
    let sums = scatters(&cloud.points_m, &found.labels, count);
    let mut kept: Vec<usize> = Vec::new();
    for (index, (plane, sum)) in found.planes.iter_mut().zip(&sums).enumerate() {
        let left = sum.count();
        let before = plane.points as f64;
        if left >= before {
            kept.push(index);
            continue;
        }
        if left < MIN_LEFT * before || left < params.min_points as f64 {
            continue;
        }
        if let Some(fit) = sum.fit_along(plane.normal) {
            let sign = if dot(fit.normal, plane.normal) < 0.0 { -1.0 } else { 1.0 };
            plane.offset_m = sign * fit.offset_m;
            plane.rms_m = fit.variances_m2[0].sqrt();
            plane.points = left as usize;
            kept.push(index);
        }
    }
    kept.sort_by_key(|index| (std::cmp::Reverse(found.planes[*index].points), *index));
    let mut new_label = vec![-1; count];
    kept.iter().zip(0..).for_each(|(old, new)| new_label[*old] = new);
    found.planes = kept.iter().map(|old| found.planes[*old]).collect();
    for label in &mut found.labels {
        *label = usize::try_from(*label).map_or(-1, |old| new_label[old]);
    }
}
