//! Where rays end on a plane, and where they pass it, near rectangles in it.

use crate::building::spaces::evidence::Evidence;
use crate::model::Plane;
use crate::reconstruct::polygons::outline::border;
use crate::reconstruct::polygons::plane_frame::{Frame, STEP_M};
use biplane_geometry::vec3::distance;

/// A ray that goes on for more than this behind surface, meters, is blocked by it, as where models are
/// judged.
const BLOCKED_M: f64 = 0.10;
/// And for so many more standard deviations of the noise.
const BLOCKED_SIGMAS: f64 = 3.0;
/// Of rays that surface was added for, one in so many may be one that it blocks, by noise.
const OUTLIER_ONE_IN: usize = 10;
/// How far around a rectangle rays count, meters.
pub(super) const AROUND_M: f64 = 0.3;

/// Rays near one rectangle, in the coordinates of its plane, meters.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct PlaneRays {
    /// Where rays ended on the plane.
    pub hits_m: Vec<[f64; 2]>,
    /// How far each of these is from where the beam before it ended there; infinite where that one did not.
    pub rows_m: Vec<f64>,
    /// Where rays passed it, from either side.
    pub passes_m: Vec<[f64; 2]>,
    /// Where those passed that surface would block.
    pub blocked_m: Vec<[f64; 2]>,
}

impl PlaneRays {
    /// Of each of these rectangles.
    pub(super) fn of(
        evidence: &Evidence<'_>,
        plane: &Plane,
        frame: &Frame,
        rectangles: &[[[f64; 2]; 2]],
    ) -> Vec<Self> {
        let mut found = vec![Self::default(); rectangles.len()];
        if rectangles.is_empty() {
            return found;
        }
        let pass_m = evidence.pass_m();
        let blocked_m = BLOCKED_M + BLOCKED_SIGMAS * evidence.sigma_m;
        let cloud = evidence.cloud;
        let origins: Vec<([f64; 3], f64)> = cloud
            .origins_m
            .iter()
            .map(|origin| origin.map(f64::from))
            .map(|origin| (origin, plane.distance_m(origin)))
            .collect();
        let mut last = (u32::MAX, [0.0; 2]);
        for (point, scan) in cloud.points_m.iter().zip(&cloud.scan) {
            let Some((origin, before_m)) = origins.get(*scan as usize) else { continue };
            let point = point.map(f64::from);
            let behind_m = plane.distance_m(point);
            let is_hit = behind_m.abs() <= pass_m;
            if !is_hit && (*before_m > 0.0) == (behind_m > 0.0) || is_hit && *before_m <= pass_m {
                continue;
            }
            let share = if is_hit { 1.0 } else { before_m / (before_m - behind_m) };
            let at = [0, 1, 2].map(|k| origin[k] + share * (point[k] - origin[k]));
            let is_blocked = !is_hit && distance(at, point) > blocked_m;
            let at = frame.steps(at).map(|step| step * STEP_M);
            let row_m = if is_hit && last.0 == *scan { border::distance(last.1, at) } else { f64::INFINITY };
            last = if is_hit { (*scan, at) } else { (u32::MAX, at) };
            for (rays, rectangle) in found.iter_mut().zip(rectangles) {
                if (0..2).all(|k| at[k] > rectangle[k][0] - AROUND_M && at[k] < rectangle[k][1] + AROUND_M) {
                    if is_hit { &mut rays.hits_m } else { &mut rays.passes_m }.push(at);
                    rays.rows_m.extend(is_hit.then_some(row_m));
                    rays.blocked_m.extend(is_blocked.then_some(at));
                }
            }
        }
        found
    }

    /// Whether surface may be where `is_there` says: where rays end, and no rays but outliers are blocked.
    pub(super) fn allow(&self, is_there: impl Fn(&[f64; 2]) -> bool) -> bool {
        let count = |places: &[[f64; 2]]| places.iter().filter(|place| is_there(place)).count();
        OUTLIER_ONE_IN * count(&self.blocked_m) <= count(&self.hits_m)
    }
}
