//! Planes fitted to all that was seen of them, not to their first views alone: each pass makes them more
//! exact. Frame `map`, meters.

use super::labels::PlanesNear;
use super::split::{Drive, Kept};
use crate::model::{Cloud, Plane};
use crate::reconstruct::planes::fit::noise::Noise;
use crate::reconstruct::planes::fit::scatter::Scatter;
use crate::reconstruct::planes::labeled::Planes;
use crate::reconstruct::planes::labels::refine::scatters;
use biplane_geometry::vec3::dot;
use std::convert::Infallible;

/// A plane whose normal is nearer than this (sine of the angle) to that of its own points was fitted to them
/// alone.
const FREE_SINE: f64 = 1e-6;

/// Adds the points of later passes to the planes, largest first again. Returns where planes are, for whoever
/// asks for the labels of those points.
pub(crate) fn fuse(drive: &Drive<'_>, cloud: &Cloud, kept: &Kept, found: &mut Planes) -> PlanesNear {
    if kept.revisited() == 0 {
        return PlanesNear::default();
    }
    let limit_m = Noise::new(found.sigma_m).point_limit_m();
    let mut near = PlanesNear::new(cloud, &found.labels, limit_m);
    let first = scatters(&cloud.points_m, &found.labels, found.planes.len());
    let mut all = first.clone();
    let added: Result<(), Infallible> = drive.visit(kept, |point| {
        if point.first_view.is_none()
            && let Ok(label) = usize::try_from(near.label(&found.planes, point.point_m))
        {
            all[label].add(point.point_m.map(f64::from));
        }
        Ok(())
    });
    let Ok(()) = added;
    for ((plane, first), all) in found.planes.iter_mut().zip(&first).zip(&all) {
        *plane = fitted(plane, first, all);
    }
    let mut order: Vec<usize> = (0..found.planes.len()).collect();
    order.sort_by_key(|plane| std::cmp::Reverse(found.planes[*plane].points));
    let mut new_label = vec![-1; order.len()];
    order.iter().zip(0..).for_each(|(old, new)| new_label[*old] = new);
    found.planes = order.iter().map(|old| found.planes[*old]).collect();
    for label in &mut found.labels {
        *label = usize::try_from(*label).map_or(-1, |old| new_label[old]);
    }
    near.rename(&new_label);
    near
}

/// A plane through all of its points; one that had the normal of another keeps it.
fn fitted(plane: &Plane, first: &Scatter, all: &Scatter) -> Plane {
    let is_free = first.fit().is_some_and(|fit| {
        let cosine = dot(fit.normal, plane.normal);
        1.0 - cosine * cosine < FREE_SINE * FREE_SINE
    });
    let fit = if is_free { all.fit() } else { all.fit_along(plane.normal) };
    let Some(fit) = fit else { return *plane };
    let sign = if dot(fit.normal, plane.normal) < 0.0 { -1.0 } else { 1.0 };
    Plane {
        normal: fit.normal.map(|v| sign * v),
        offset_m: sign * fit.offset_m,
        points: fit.count as usize,
        rms_m: fit.variances_m2[0].sqrt(),
    }
}
