//! How true a model is: its distance to the true surfaces, and what of these it misses, beside the raw mesh's.
//!
//! Frame `map`, metres.

use crate::model::Mesh;
use crate::surface_distance::{Distances, Surface, distances_m, sample};
use serde::Serialize;

/// How surfaces are compared.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CompareParams {
    /// Samples of each surface. Larger: steadier figures, more time.
    pub samples: usize,
    /// Truth counts as seen when the raw mesh has surface this near, metres. Larger: hidden sides count as missed.
    /// Smaller: noisy parts of the truth are ignored.
    pub seen_within_m: f64,
}

impl Default for CompareParams {
    fn default() -> Self {
        Self { samples: 200_000, seen_within_m: 0.05 }
    }
}

/// Distances of one surface to the truth, both ways.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct ToTruth {
    /// From the surface to the truth: how wrong it is.
    pub surface_to_truth: Distances,
    /// From the seen truth to the surface: what it misses.
    pub truth_to_surface: Distances,
}

/// The raw mesh, the flat surfaces alone and the whole model against the truth.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Comparison {
    /// The raw mesh.
    pub raw: ToTruth,
    /// The polygons alone.
    pub planes: ToTruth,
    /// Polygons and leftovers.
    pub model: ToTruth,
}

/// Compares the three meshes of a build with the true surfaces.
pub fn compare(params: &CompareParams, truth: &Mesh, raw: &Mesh, planes: &Mesh, model: &Mesh) -> Comparison {
    let true_surface = Surface::new(truth);
    let on_truth = sample(truth, params.samples);
    let to_raw = distances_m(&on_truth, &Surface::new(raw));
    let seen: Vec<[f64; 3]> = on_truth
        .into_iter()
        .zip(&to_raw)
        .filter(|(_, d)| **d <= params.seen_within_m)
        .map(|(p, _)| p)
        .collect();
    let against = |mesh: &Mesh| ToTruth {
        surface_to_truth: Distances::of(distances_m(&sample(mesh, params.samples), &true_surface)),
        truth_to_surface: Distances::of(distances_m(&seen, &Surface::new(mesh))),
    };
    Comparison { raw: against(raw), planes: against(planes), model: against(model) }
}

#[cfg(test)]
mod tests {
    use super::{CompareParams, compare};
    use crate::model::Mesh;

    /// A level square of 2 m with its corner at `x_m`, at height `z_m`.
    fn square(x_m: f32, z_m: f32) -> Mesh {
        let vertices_m =
            [(0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (0.0, 2.0)].map(|(x, y)| [x_m + x, y, z_m]).to_vec();
        Mesh { vertices_m, triangles: vec![[0, 1, 2], [0, 2, 3]] }
    }

    #[test]
    fn a_model_above_the_truth_is_off_by_its_height_and_hidden_truth_does_not_count() {
        let mut truth = square(0.0, 0.0);
        let hidden = square(10.0, 0.0);
        truth.triangles.extend(hidden.triangles.iter().map(|t| t.map(|corner| corner + 4)));
        truth.vertices_m.extend(hidden.vertices_m);
        let params = CompareParams { samples: 2000, ..CompareParams::default() };
        let found = compare(&params, &truth, &square(0.0, 0.01), &Mesh::default(), &square(0.0, 0.02));
        assert!((found.model.surface_to_truth.rms_m - 0.02).abs() < 1e-6);
        assert!((found.model.truth_to_surface.max_m - 0.02).abs() < 1e-6);
        assert!((found.raw.surface_to_truth.mean_m - 0.01).abs() < 1e-6);
        assert_eq!(found.planes.surface_to_truth.samples, 0);
        let seen = found.raw.truth_to_surface.samples;
        assert!((seen as i64 - 1000).abs() <= 1, "half of the truth is seen: {seen}");
    }
}
