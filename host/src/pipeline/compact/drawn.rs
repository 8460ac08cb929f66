//! Drawn meshes: few large triangles with exact corners.
//!
//! The search finds planes among points inside the triangles; then whole triangles choose their plane, and
//! planes are fitted to whole triangles, so that what was drawn straight stays exactly straight and no
//! triangle is cut. Meters.

use super::divide::Division;
use crate::model::{Cloud, Mesh, Plane};
use crate::pipeline::compact::labeled::Labeled;
use crate::pipeline::params::BuildParams;
use crate::reconstruct::leftovers::LeftoverParams;
use crate::reconstruct::planes;
use crate::reconstruct::planes::fit::noise::Noise;
use crate::reconstruct::planes::fit::scatter::Scatter;
use crate::reconstruct::planes::labeled::Planes;
use crate::reconstruct::shapes::Rounds;
use biplane_geometry::polygon_area::doubled_triangle_normal;
use biplane_geometry::vec3::dot;
use std::collections::HashMap;

/// A triangle lies in a plane when its normal is within 20 degrees of the plane's (cosine); slivers of an
/// edge would do otherwise.
const MIN_COSINE: f64 = 0.94;

/// The planes of a drawn mesh; triangles of different planes get corners of their own.
pub(super) fn labeled(mesh: &Mesh, fine: &Division, params: &BuildParams) -> Labeled {
    let points = Cloud { points_m: fine.mesh.vertices_m.clone(), ..Cloud::default() };
    let mut found = planes::extract(&fine.search(&params.planes), &points);
    let limit_m = Noise::new(found.sigma_m).point_limit_m();
    let of_triangles = choose(mesh, fine, &found, limit_m);
    refit(&mut found, fine, &of_triangles);
    let mut vertex_labels = vec![-1; mesh.vertices_m.len()];
    let mut own = Mesh::default();
    let mut labels = Vec::new();
    let mut known: HashMap<(u32, i32), u32> = HashMap::new();
    for (triangle, label) in mesh.triangles.iter().zip(&of_triangles) {
        own.triangles.push(triangle.map(|corner| {
            let slot = &mut vertex_labels[corner as usize];
            *slot = if *slot < 0 { *label } else { *slot };
            *known.entry((corner, *label)).or_insert_with(|| {
                own.vertices_m.push(mesh.vertices_m[corner as usize]);
                labels.push(*label);
                labels.len() as u32 - 1
            })
        }));
    }
    found.labels = labels;
    // Small pieces of a drawing were drawn on purpose, and large triangles.
    let leftovers =
        LeftoverParams { min_triangles: 1, max_edge_m: f32::INFINITY, ..params.leftovers.clone() };
    Labeled { mesh: own, found, vertex_labels, rounds: Rounds::default(), leftovers }
}

/// The plane of each triangle, or -1: that of most of the points in it, if its corners lie in that plane.
fn choose(mesh: &Mesh, fine: &Division, found: &Planes, limit_m: f64) -> Vec<i32> {
    let mut chosen = vec![-1; mesh.triangles.len()];
    let mut first = 0;
    for run in fine.parent.chunk_by(|a, b| a == b) {
        let mut votes: Vec<(i32, usize)> = Vec::new();
        for corner in fine.mesh.triangles[first..first + run.len()].iter().flatten() {
            let label = found.labels[*corner as usize];
            match votes.iter_mut().find(|vote| vote.0 == label) {
                Some(vote) => vote.1 += 1,
                None => votes.push((label, 1)),
            }
        }
        first += run.len();
        // Most points first; of equals the larger plane.
        votes.sort_unstable_by(|a, b| b.1.cmp(&a.1).then(a.0.cmp(&b.0)));
        let triangle =
            mesh.triangles[run[0] as usize].map(|corner| mesh.vertices_m[corner as usize].map(f64::from));
        let fits = |label: &i32| {
            let plane = usize::try_from(*label).ok().map(|label| &found.planes[label]);
            plane.is_some_and(|plane| lies_in(plane, triangle, limit_m))
        };
        chosen[run[0] as usize] = votes.iter().map(|vote| vote.0).find(fits).unwrap_or(-1);
    }
    chosen
}

fn lies_in(plane: &Plane, corners: [[f64; 3]; 3], limit_m: f64) -> bool {
    let normal = doubled_triangle_normal(corners);
    let length = dot(normal, normal).sqrt();
    let along = dot(normal, plane.normal).abs() >= MIN_COSINE * length;
    along && corners.iter().all(|corner| plane.distance_m(*corner).abs() <= limit_m)
}

/// Planes through the triangles that chose them, as far as there are any.
fn refit(found: &mut Planes, fine: &Division, of_triangles: &[i32]) {
    let mut sums = vec![Scatter::default(); found.planes.len()];
    for (part, parent) in fine.mesh.triangles.iter().zip(&fine.parent) {
        let Ok(label) = usize::try_from(of_triangles[*parent as usize]) else { continue };
        part.iter().for_each(|corner| sums[label].add(fine.mesh.vertices_m[*corner as usize].map(f64::from)));
    }
    for (plane, fit) in found.planes.iter_mut().zip(sums.iter().map(Scatter::fit)) {
        plane.points = fit.map_or(0, |fit| fit.count as usize);
        let Some(fit) = fit else { continue };
        let sign = if dot(fit.normal, plane.normal) < 0.0 { -1.0 } else { 1.0 };
        plane.normal = fit.normal.map(|v| sign * v);
        plane.offset_m = sign * fit.offset_m;
        plane.rms_m = fit.variances_m2[0].sqrt();
    }
}
