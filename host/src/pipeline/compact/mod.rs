//! The compact model of any triangle mesh: planes and merging for people who have meshes from elsewhere.
//!
//! A mesh says less than a recording: not from where its points were seen. So points move onto their planes
//! along the normal instead of along the beam, planes face the way their triangles do, and jump edges and
//! mixed pixels stay. Meters.

mod divide;
mod drawn;
mod labeled;
mod orient;
mod spacing;
#[cfg(test)]
mod tests;

use crate::model::{Cloud, Mesh, Model};
use crate::pipeline::params::BuildParams;
use crate::pipeline::{BuildOutput, Counts, Observer, Stage};
use crate::reconstruct::leftovers;
use crate::reconstruct::planes;
use crate::reconstruct::polygons;
use crate::reconstruct::shapes;
use labeled::Labeled;

/// Builds the compact model of a mesh. The cloud of the output are the mesh's vertices.
pub fn compact(mesh: Mesh, params: &BuildParams, observer: &mut dyn Observer) -> BuildOutput {
    observer.begins(Stage::Planes);
    let mut progress = |percent: u64| observer.goes_on(Stage::Planes, percent as f64 / 100.0);
    let mut labeled = match divide::divide(&mesh) {
        Some(fine) => drawn::labeled(&mesh, &fine, params),
        None => scanned(&mesh, &spacing::suited(params, &mesh), &mut progress),
    };
    orient::by_faces(&mut labeled.found, &labeled.mesh);
    let Labeled { mesh: own, found, vertex_labels, rounds, leftovers: left } = labeled;
    observer.ended(Stage::Planes, found.planes.len());

    observer.begins(Stage::Polygons);
    let points = Cloud { points_m: own.vertices_m.clone(), ..Cloud::default() };
    let mut merged = polygons::merge(&params.polygons.as_drawn(), &points, &own, &found);
    rounds.settle(&points, &own, &found, &mut merged);
    observer.ended(Stage::Polygons, merged.polygons.len());

    observer.begins(Stage::Leftovers);
    let leftovers = leftovers::collect(&left, &own, &merged.rest);
    observer.ended(Stage::Leftovers, leftovers.triangles.len());

    let model = Model {
        planes: found.planes,
        polygons: merged.polygons,
        leftovers,
        cylinders: rounds.cylinders,
        ..Model::default()
    };
    let mut counts = Counts {
        raw_points: mesh.vertices_m.len(),
        raw_triangles: mesh.triangles.len(),
        planes: model.planes.len(),
        jump_edge_triangles: merged.jump_edges,
        sigma_m: found.sigma_m,
        sigma_source: found.sigma_source,
        ..Counts::default()
    };
    counts.recount(&model);
    let cloud = Cloud { points_m: mesh.vertices_m.clone(), ..Cloud::default() };
    BuildOutput { cloud, labels: vertex_labels, mesh, model, counts, ..BuildOutput::default() }
}

/// A mesh of dense, noisy points: its vertices are the cloud.
fn scanned(mesh: &Mesh, params: &BuildParams, progress: &mut dyn FnMut(u64)) -> Labeled {
    let points = Cloud { points_m: mesh.vertices_m.clone(), ..Cloud::default() };
    let mut found = planes::extract_with_progress(&params.planes, &points, progress);
    let rounds = shapes::extract(&params.shapes, &points, &mut found);
    let vertex_labels = found.labels.clone();
    Labeled { mesh: mesh.clone(), found, vertex_labels, rounds, leftovers: params.leftovers.clone() }
}
