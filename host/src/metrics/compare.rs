//! How true surfaces are: their distances to the true ones, or to the raw points where nobody knows the
//! truth, both ways.
//!
//! Frame `map`, meters.

use crate::metrics::blocked_rays::{RayParams, Rays};
use crate::metrics::surface_distance::{Distances, Surface, distances_m, sample};
use crate::model::Mesh;
use serde::Serialize;
use std::collections::BTreeMap;

/// How surfaces are compared.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct CompareParams {
    /// Samples of each surface. Larger: steadier figures, more time.
    pub samples: usize,
    /// Truth counts as seen when the raw mesh has surface this near, meters. Larger: hidden sides count as
    /// missed. Smaller: noisy parts of the truth are ignored.
    pub seen_within_m: f64,
    /// A face of the truth counts as seen when so many rays hit it. Larger: small faces, of which a model
    /// should have one too, are not counted. Smaller: so are those that noise alone hits.
    pub face_rays: usize,
    /// Which rays count as blocked.
    pub rays: RayParams,
}

impl Default for CompareParams {
    fn default() -> Self {
        Self { samples: 200_000, seen_within_m: 0.05, face_rays: 10, rays: RayParams::default() }
    }
}

/// Distances of one surface to the reference, both ways.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub(crate) struct BothWays {
    /// From the surface to the reference: how wrong it is. To raw points it is never less than their spacing
    /// allows.
    pub to_reference: Distances,
    /// From what was seen of the reference to the surface: what it misses.
    pub from_reference: Distances,
}

impl BothWays {
    /// Mean of the two mean distances, meters.
    pub(crate) fn symmetric_mean_m(&self) -> f64 {
        (self.to_reference.mean_m + self.from_reference.mean_m) / 2.0
    }
}

/// What surfaces are measured against.
#[derive(Clone, Debug)]
pub(crate) struct Reference {
    surface: Surface,
    /// What was seen of it.
    seen_m: Vec<[f64; 3]>,
    samples: usize,
}

impl Reference {
    /// The true surfaces, as far as the raw mesh shows that they were seen.
    pub(crate) fn truth(params: &CompareParams, truth: &Mesh, raw: &Surface) -> Self {
        let on_truth = sample(truth, params.samples);
        let to_raw = distances_m(&on_truth, raw);
        let seen = on_truth.into_iter().zip(&to_raw).filter(|(_, d)| **d <= params.seen_within_m);
        let seen_m = seen.map(|(p, _)| p).collect();
        Self { surface: Surface::new(truth), seen_m, samples: params.samples }
    }

    /// The raw points; all of them were seen.
    pub(crate) fn points(params: &CompareParams, points_m: &[[f32; 3]]) -> Self {
        // A point is a triangle without extent.
        let triangles = (0..points_m.len() as u32).map(|k| [k; 3]).collect();
        let surface = Surface::new(&Mesh { vertices_m: points_m.to_vec(), triangles });
        let stride = points_m.len().div_ceil(params.samples.max(1)).max(1);
        let seen_m = points_m.iter().step_by(stride).map(|p| p.map(f64::from)).collect();
        Self { surface, seen_m, samples: params.samples }
    }

    /// Measures a surface.
    pub(crate) fn measure(&self, mesh: &Mesh, surface: &Surface) -> BothWays {
        BothWays {
            to_reference: Distances::of(distances_m(&sample(mesh, self.samples), &self.surface)),
            from_reference: Distances::of(distances_m(&self.seen_m, surface)),
        }
    }
}

/// How many faces of the truth the rays hit; `faces` has the number of its face for each triangle, negative
/// for none.
pub(crate) fn faces_seen(params: &CompareParams, truth: &Mesh, faces: &[f64], rays: &Rays) -> usize {
    let met = rays.met(&Surface::new(truth), truth.triangles.len(), params.seen_within_m);
    let mut of_face: BTreeMap<i64, usize> = BTreeMap::new();
    for (face, rays) in faces.iter().zip(met).filter(|(face, _)| **face >= 0.0) {
        *of_face.entry(*face as i64).or_default() += rays;
    }
    of_face.values().filter(|rays| **rays >= params.face_rays).count()
}

#[cfg(test)]
mod tests {
    use super::{BothWays, CompareParams, Reference, faces_seen};
    use crate::metrics::blocked_rays::Rays;
    use crate::metrics::surface_distance::Surface;
    use crate::model::Mesh;

    /// A level square of 2 m with its corner at `x_m`, at height `z_m`.
    fn square(x_m: f32, z_m: f32) -> Mesh {
        let vertices_m =
            [(0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (0.0, 2.0)].map(|(x, y)| [x_m + x, y, z_m]).to_vec();
        Mesh { vertices_m, triangles: vec![[0, 1, 2], [0, 2, 3]] }
    }

    /// A square at the origin and one that nobody saw.
    fn truth() -> Mesh {
        let mut truth = square(0.0, 0.0);
        let hidden = square(10.0, 0.0);
        truth.triangles.extend(hidden.triangles.iter().map(|t| t.map(|corner| corner + 4)));
        truth.vertices_m.extend(hidden.vertices_m);
        truth
    }

    fn measure(reference: &Reference, mesh: &Mesh) -> BothWays {
        reference.measure(mesh, &Surface::new(mesh))
    }

    #[test]
    fn a_model_above_the_truth_is_off_by_its_height_and_hidden_truth_does_not_count() {
        let params = CompareParams { samples: 2000, ..CompareParams::default() };
        let raw = square(0.0, 0.01);
        let reference = Reference::truth(&params, &truth(), &Surface::new(&raw));
        let model = measure(&reference, &square(0.0, 0.02));
        assert!((model.to_reference.rms_m - 0.02).abs() < 1e-6);
        assert!((model.from_reference.max_m - 0.02).abs() < 1e-6);
        assert!((model.symmetric_mean_m() - 0.02).abs() < 1e-6);
        assert!((measure(&reference, &raw).to_reference.mean_m - 0.01).abs() < 1e-6);
        assert_eq!(measure(&reference, &Mesh::default()).to_reference.samples, 0);
        let seen = model.from_reference.samples;
        assert!((seen as i64 - 1000).abs() <= 1, "half of the truth is seen: {seen}");
    }

    #[test]
    fn without_a_truth_the_raw_points_are_the_reference() {
        let points: Vec<[f32; 3]> =
            (0..400).map(|k| [0.05 + 0.1 * (k % 20) as f32, 0.05 + 0.1 * (k / 20) as f32, 0.0]).collect();
        let params = CompareParams { samples: 200, ..CompareParams::default() };
        let reference = Reference::points(&params, &points);
        let found = measure(&reference, &square(0.0, 0.03));
        assert_eq!(found.from_reference.samples, 200);
        assert!((found.from_reference.rms_m - 0.03).abs() < 1e-6);
        // No place of the square is farther from the grid of points than half its diagonal and the height.
        let farthest_m = (0.05_f64.powi(2) * 2.0 + 0.03_f64.powi(2)).sqrt();
        let to = found.to_reference;
        assert!(to.rms_m > 0.03 && to.max_m <= farthest_m + 1e-6, "{to:?}");
    }

    #[test]
    fn a_face_that_few_rays_hit_is_not_seen() {
        let params = CompareParams::default();
        let points: Vec<[f32; 3]> = (0..30).map(|k| [0.1 + 0.05 * k as f32, 1.0, 0.01]).collect();
        let rays =
            |count: usize| Rays::new(&params.rays, &points[..count], &vec![0.0; count], &[[1.0, 1.0, 2.0]]);
        let faces = [3.0, 3.0, 8.0, 8.0];
        assert_eq!(faces_seen(&params, &truth(), &faces, &rays(30)), 1);
        assert_eq!(faces_seen(&params, &truth(), &faces, &rays(9)), 0);
        assert_eq!(faces_seen(&params, &truth(), &[-1.0; 4], &rays(30)), 0);
    }
}
