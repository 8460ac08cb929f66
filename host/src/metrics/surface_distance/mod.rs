//! How far one surface is from another: evenly spread samples of one, the nearest point of the other for
//! each; and where rays meet it.
//!
//! Meters. Deterministic: samples lie on a fixed low-discrepancy sequence, sums are made in one order.

mod cast;
mod tree;

use crate::metrics::surface_distance::tree::corners;
use crate::model::Mesh;
use biplane_geometry::{polygon_area::triangle_area_m2, quantile::nearest_rank};
pub(crate) use cast::Hit;
use rayon::prelude::*;
use serde::Serialize;
pub use tree::Surface;

/// Distances of samples, meters.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Distances {
    /// Number of samples; with 0 all distances are 0 and mean nothing.
    pub samples: usize,
    /// Mean distance.
    pub mean_m: f64,
    /// Root mean square distance.
    pub rms_m: f64,
    /// 95 % are nearer than this.
    pub p95_m: f64,
    /// The largest.
    pub max_m: f64,
}

impl Distances {
    /// Sums up distances; those that are not finite are left out.
    pub fn of(mut distances_m: Vec<f64>) -> Self {
        distances_m.retain(|d| d.is_finite());
        distances_m.sort_unstable_by(f64::total_cmp);
        let samples = distances_m.len();
        let Some(max_m) = distances_m.last().copied() else { return Self::default() };
        let count = samples as f64;
        Self {
            samples,
            mean_m: distances_m.iter().sum::<f64>() / count,
            rms_m: (distances_m.iter().map(|d| d * d).sum::<f64>() / count).sqrt(),
            p95_m: nearest_rank(&distances_m, 0.95).unwrap_or(max_m),
            max_m,
        }
    }
}

/// Distances of points to a surface, in their order; infinite when the surface is empty.
pub fn distances_m(points_m: &[[f64; 3]], surface: &Surface) -> Vec<f64> {
    points_m.par_iter().map(|p| surface.distance_m(*p)).collect()
}

/// `count` points on a mesh, as many on each part as its area asks for.
pub fn sample(mesh: &Mesh, count: usize) -> Vec<[f64; 3]> {
    let mut reached_m2 = Vec::with_capacity(mesh.triangles.len());
    let mut total_m2 = 0.0;
    for triangle in &mesh.triangles {
        total_m2 += corners(mesh, *triangle).map_or(0.0, triangle_area_m2);
        reached_m2.push(total_m2);
    }
    if total_m2 <= 0.0 || !total_m2.is_finite() {
        return Vec::new();
    }
    let one = |k: usize| {
        let at_m2 = (k as f64 + 0.5) / count as f64 * total_m2;
        let index = reached_m2.partition_point(|reached| *reached <= at_m2);
        let [a, b, c] = corners(mesh, *mesh.triangles.get(index)?)?;
        // Two irrational steps fill a square evenly (Roberts 2018); the half beyond the diagonal is folded
        // back.
        let (mut u, mut v) =
            ((k as f64 * 0.754_877_666_246_692_8).fract(), (k as f64 * 0.569_840_290_998_053_3).fract());
        if u + v > 1.0 {
            (u, v) = (1.0 - u, 1.0 - v);
        }
        Some(std::array::from_fn(|k| a[k] + u * (b[k] - a[k]) + v * (c[k] - a[k])))
    };
    (0..count).filter_map(one).collect()
}

#[cfg(test)]
mod tests {
    use super::{Distances, Surface, distances_m, sample};
    use crate::model::Mesh;
    use crate::reconstruct::planes::paper::random::Random;

    /// Two triangles of area 2 and 6 in the floor.
    fn floor() -> Mesh {
        let vertices_m = vec![[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0], [-6.0, 0.0, 0.0]];
        Mesh { vertices_m, triangles: vec![[0, 1, 2], [0, 2, 3]] }
    }

    #[test]
    fn samples_lie_on_the_mesh_and_follow_its_areas() {
        let points = sample(&floor(), 4000);
        assert_eq!(points.len(), 4000);
        assert!(points.iter().all(|p| p[2] == 0.0 && p[1] >= 0.0 && p[1] <= 2.0));
        let right = points.iter().filter(|p| p[0] > 0.0).count();
        assert!((right as i64 - 1000).abs() <= 2, "{right}");
        // Evenly within a triangle: the mean is its center.
        let mean = points.iter().filter(|p| p[0] > 0.0).map(|p| p[0]).sum::<f64>() / right as f64;
        assert!((mean - 2.0 / 3.0).abs() < 0.02);
    }

    #[test]
    fn distances_agree_with_brute_force() {
        let mut random = Random::new(11);
        let mut point = || -> [f32; 3] { std::array::from_fn(|_| (4.0 * random.unit()) as f32) };
        let vertices_m: Vec<[f32; 3]> = (0..90).map(|_| point()).collect();
        let mesh = Mesh { vertices_m, triangles: (0..30).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]).collect() };
        let surface = Surface::new(&mesh);
        // Truth: the nearest of many points laid out over each triangle, its corners and edges included.
        let mut cloud = Vec::new();
        for t in &mesh.triangles {
            let [a, b, c] = t.map(|corner| mesh.vertices_m[corner as usize].map(f64::from));
            for (u, v) in
                (0..=60).flat_map(|i| (0..=60 - i).map(move |j| (f64::from(i) / 60.0, f64::from(j) / 60.0)))
            {
                cloud.push([0, 1, 2].map(|k| a[k] + u * (b[k] - a[k]) + v * (c[k] - a[k])));
            }
        }
        for _ in 0..40 {
            let p = point().map(f64::from);
            let nearest = cloud
                .iter()
                .map(|q| (0..3).map(|k| (p[k] - q[k]).powi(2)).sum::<f64>())
                .fold(f64::INFINITY, f64::min);
            let ours = surface.distance_m(p);
            assert!(
                ours <= nearest.sqrt() + 1e-9 && ours >= nearest.sqrt() - 0.05,
                "{ours} {}",
                nearest.sqrt()
            );
        }
    }

    #[test]
    fn figures_of_known_distances() {
        let d = Distances::of(vec![3.0, 4.0, f64::INFINITY]);
        // Nearest rank: of two values, 95 % do not exceed the second.
        assert_eq!((d.samples, d.mean_m, d.max_m, d.p95_m), (2, 3.5, 4.0, 4.0));
        assert!((d.rms_m - 12.5f64.sqrt()).abs() < 1e-12);
        assert_eq!(Distances::of(vec![]), Distances::default());
    }

    #[test]
    fn empty_and_broken_meshes_have_no_samples_and_no_near_point() {
        assert!(sample(&Mesh::default(), 10).is_empty());
        let broken = Mesh { vertices_m: vec![[f32::NAN; 3]; 3], triangles: vec![[0, 1, 2], [7, 8, 9]] };
        assert!(sample(&broken, 10).is_empty());
        assert_eq!(distances_m(&[[0.0; 3]], &Surface::new(&broken)), [f64::INFINITY]);
    }
}
