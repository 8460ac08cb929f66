//! Doors and windows stay open: which rays of the laser a surface blocks before they reach what they really
//! hit.
//!
//! A ray runs from where the laser was to the point that it measured. A surface blocks it wrongly when it
//! stands in the ray's way by more than a margin before that point. Frame `map`, meters. Source: the paper,
//! section 3.2 ("doors and windows stay open").

use crate::metrics::surface_distance::{Hit, Surface};
use rayon::prelude::*;
use serde::Serialize;

/// When a ray counts as blocked.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct RayParams {
    /// A surface this near before the measured point is that point's own, meters, beside the noise. Larger: a
    /// model may close a shallow niche unseen. Smaller: where rays graze a floor, its own roughness counts as
    /// closed doors.
    pub margin_m: f64,
    /// How many standard deviations of the range noise are added to the margin. Larger: see `margin_m`.
    /// Smaller: noise counts as blocking.
    pub noise_sigmas: f64,
    /// Rays that are tried, evenly spread over all. Larger: steadier figures, more time.
    pub rays: usize,
}

impl Default for RayParams {
    fn default() -> Self {
        Self { margin_m: 0.10, noise_sigmas: 3.0, rays: 200_000 }
    }
}

/// Rays of a laser.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Rays {
    /// Where each began and what it hit.
    ends_m: Vec<[[f64; 3]; 2]>,
}

/// How many rays a surface blocks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub(crate) struct Blocked {
    /// Rays tried.
    pub rays: usize,
    /// Of these, blocked wrongly.
    pub blocked: usize,
    /// The same as a share, percent; 0 without rays.
    pub percent: f64,
    /// A surface must stand more than this before the measured point, meters.
    pub margin_m: f64,
}

impl Rays {
    /// At most `params.rays` of the rays to `points_m`, evenly spread in their order. `scans` has for each
    /// point the index of its origin; points without one, and those that are not finite, give no ray.
    pub(crate) fn new(
        params: &RayParams,
        points_m: &[[f32; 3]],
        scans: &[f64],
        origins_m: &[[f64; 3]],
    ) -> Self {
        let stride = points_m.len().div_ceil(params.rays.max(1)).max(1);
        let ray = |(point, scan): (&[f32; 3], &f64)| {
            let origin = (*scan >= 0.0).then(|| origins_m.get(*scan as usize)).flatten()?;
            let ends = [*origin, point.map(f64::from)];
            ends.as_flattened().iter().all(|v| v.is_finite()).then_some(ends)
        };
        Self { ends_m: points_m.iter().zip(scans).step_by(stride).filter_map(ray).collect() }
    }

    /// Whether there is none.
    pub(crate) fn is_empty(&self) -> bool {
        self.ends_m.is_empty()
    }

    /// How many of the rays a surface blocks wrongly; `sigma_m` is the range noise.
    pub(crate) fn blocked_by(&self, surface: &Surface, params: &RayParams, sigma_m: f64) -> Blocked {
        let margin_m = params.margin_m + params.noise_sigmas * sigma_m;
        let is_blocked = |ends: &&[[f64; 3]; 2]| first_hit(ends, surface, -margin_m).is_some();
        let blocked = self.ends_m.par_iter().filter(is_blocked).count();
        let rays = self.ends_m.len();
        Blocked { rays, blocked, percent: 100.0 * blocked as f64 / rays.max(1) as f64, margin_m }
    }

    /// For each triangle of a surface with `triangles` of them, how many rays meet it first, not more than
    /// `beyond_m` behind what they hit.
    pub(crate) fn met(&self, surface: &Surface, triangles: usize, beyond_m: f64) -> Vec<usize> {
        let first = |ends: &[[f64; 3]; 2]| first_hit(ends, surface, beyond_m).map(|hit| hit.triangle);
        let hits: Vec<Option<usize>> = self.ends_m.par_iter().map(first).collect();
        let mut met = vec![0; triangles];
        for triangle in hits.into_iter().flatten() {
            met[triangle] += 1;
        }
        met
    }
}

/// What a ray meets first up to `beyond_m` behind (negative: before) its end.
fn first_hit([from, to]: &[[f64; 3]; 2], surface: &Surface, beyond_m: f64) -> Option<Hit> {
    let way: [f64; 3] = std::array::from_fn(|k| to[k] - from[k]);
    let length_m = way.iter().map(|v| v * v).sum::<f64>().sqrt();
    (length_m > 0.0).then(|| surface.cast(*from, way.map(|v| v / length_m), length_m + beyond_m)).flatten()
}

#[cfg(test)]
mod tests {
    use super::{RayParams, Rays};
    use crate::metrics::surface_distance::Surface;
    use crate::model::Mesh;

    /// A wall across the y axis at `y_m`, 2 m wide, with `parts` of its left and right halves.
    fn wall(y_m: f32, left: bool, right: bool) -> Mesh {
        let vertices_m = [(-1.0, 0.0), (0.0, 0.0), (1.0, 0.0), (-1.0, 2.0), (0.0, 2.0), (1.0, 2.0)]
            .map(|(x, z)| [x, y_m, z]);
        let mut mesh = Mesh { vertices_m: vertices_m.to_vec(), triangles: Vec::new() };
        if left {
            mesh.triangles.extend([[0, 1, 4], [0, 4, 3]]);
        }
        if right {
            mesh.triangles.extend([[1, 2, 5], [1, 5, 4]]);
        }
        mesh
    }

    /// A laser at 1 m height that looks through the plane y = 2 at a wall at y = 4: a point every 2 cm from x
    /// = -1.5 to 1.5.
    fn rays(params: &RayParams) -> Rays {
        let points: Vec<[f32; 3]> = (0..150).map(|k| [-1.49 + 0.02 * k as f32, 4.0, 1.0]).collect();
        Rays::new(params, &points, &[0.0; 150], &[[0.0, 0.0, 1.0]])
    }

    #[test]
    fn a_closed_door_blocks_the_rays_that_went_through_it_and_an_open_one_none() {
        let params = RayParams::default();
        let blocked = |mesh: &Mesh| rays(&params).blocked_by(&Surface::new(mesh), &params, 0.0);
        let half = blocked(&wall(2.0, true, false));
        assert_eq!((half.rays, half.blocked, half.percent), (150, 75, 50.0));
        assert_eq!(blocked(&wall(2.0, true, true)).blocked, 150);
        assert_eq!(blocked(&wall(2.0, false, false)).blocked, 0);
    }

    #[test]
    fn a_surface_within_the_margin_before_the_hit_is_what_was_hit() {
        let params = RayParams::default();
        let near = Surface::new(&wall(3.85, true, true));
        let at = |sigma_m: f64| rays(&params).blocked_by(&near, &params, sigma_m);
        // 15 cm before the point: 5 cm more than the margin, but not with 3 cm noise.
        assert!(at(0.0).blocked >= 100 && at(0.03).blocked < 10, "{:?} {:?}", at(0.0), at(0.03));
        assert!((at(0.03).margin_m - 0.19).abs() < 1e-12);
        let patient = RayParams { margin_m: 0.2, ..params };
        assert!(rays(&patient).blocked_by(&near, &patient, 0.0).blocked < 10);
    }

    #[test]
    fn rays_are_thinned_evenly_and_need_an_origin() {
        let few = RayParams { rays: 50, ..RayParams::default() };
        assert_eq!(rays(&few).blocked_by(&Surface::default(), &few, 0.0).rays, 50);
        let lost = Rays::new(&few, &[[1.0; 3]; 3], &[-1.0, 7.0, 0.0], &[[f64::NAN; 3]]);
        assert!(lost.is_empty());
        assert_eq!(lost.blocked_by(&Surface::default(), &few, 0.0).percent, 0.0);
    }

    #[test]
    fn the_faces_that_rays_meet_are_counted() {
        let mesh = wall(4.02, true, true);
        let met = rays(&RayParams::default()).met(&Surface::new(&mesh), 4, 0.05);
        assert_eq!(met.iter().sum::<usize>(), 100);
        assert_eq!(met[0] + met[1], 50);
    }
}
