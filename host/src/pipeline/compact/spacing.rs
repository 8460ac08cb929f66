//! How far apart the points of a scanned mesh are, and what follows from it. Meters.

use crate::model::Mesh;
use crate::pipeline::params::BuildParams;
use crate::reconstruct::leftovers::LeftoverParams;
use crate::reconstruct::planes::params::PlaneParams;
use biplane_geometry::{quantile::upper_median, vec3::distance};

/// Points further apart than this need larger cells than the search chooses by itself.
const WIDE_M: f64 = 0.15;
/// Edge of a cell of the search, in spacings: about six points a cell, as elsewhere.
const CELL_SPACINGS: f64 = 2.4;
/// The search's delta, and the longest edge of a leftover triangle, in spacings: a diagonal is one and a
/// half.
const REACH_SPACINGS: f64 = 3.0;
/// Triangles that tell the spacing.
const SAMPLE: usize = 4096;

/// Parameters for a scanned mesh: as they are, or wider where its points lie far apart, so that these hold
/// together and stay.
pub(super) fn suited(params: &BuildParams, mesh: &Mesh) -> BuildParams {
    let spacing_m = median_edge_m(mesh);
    if spacing_m <= WIDE_M {
        return params.clone();
    }
    let reach_m = REACH_SPACINGS * spacing_m;
    let planes = PlaneParams {
        cell_m: params.planes.cell_m.or(Some(CELL_SPACINGS * spacing_m)),
        delta_m: params.planes.delta_m.max(reach_m),
        ..params.planes.clone()
    };
    let max_edge_m = params.leftovers.max_edge_m.max(reach_m as f32);
    let leftovers = LeftoverParams { max_edge_m, ..params.leftovers.clone() };
    BuildParams { planes, leftovers, ..params.clone() }
}

/// The median of the edges of some triangles; 0 when there are none.
fn median_edge_m(mesh: &Mesh) -> f64 {
    let step = mesh.triangles.len().div_ceil(SAMPLE).max(1);
    let edges_of = |triangle: &[u32; 3]| {
        let [p, q, r] = triangle.map(|corner| mesh.vertices_m[corner as usize].map(f64::from));
        [distance(p, q), distance(q, r), distance(r, p)]
    };
    let mut edges_m: Vec<f64> = mesh.triangles.iter().step_by(step).flat_map(edges_of).collect();
    edges_m.sort_unstable_by(f64::total_cmp);
    upper_median(&edges_m).unwrap_or(0.0)
}
