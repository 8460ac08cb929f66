//! The compact model of any triangle mesh: planes and merging for people who have meshes from elsewhere.
//!
//! A mesh says less than a recording: not from where its points were seen. So points move onto their planes along the normal instead of
//! along the beam, planes face the way their triangles do, and veils and mixed pixels stay. Metres.

mod divide;
mod drawn;
mod orient;
mod spacing;

use crate::leftovers::{self, LeftoverParams};
use crate::model::{Cloud, Mesh, Model};
use crate::params::BuildParams;
use crate::pipeline::{BuildOutput, Counts, Observer, Stage};
use crate::planes::{self, Planes};
use crate::polygons;

/// A mesh whose vertices have labels.
struct Labelled {
    /// The mesh: triangle for triangle the one that was given, perhaps with vertices of its own.
    mesh: Mesh,
    /// Its planes, and the label of each of its vertices.
    found: Planes,
    /// The label of each vertex of the mesh that was given.
    vertex_labels: Vec<i32>,
    /// Which triangles on no plane stay.
    leftovers: LeftoverParams,
}

/// Builds the compact model of a mesh. The cloud of the output are the mesh's vertices.
pub fn compact(mesh: Mesh, params: &BuildParams, observer: &mut dyn Observer) -> BuildOutput {
    observer.begins(Stage::Planes);
    let mut told = |percent: u64| observer.goes_on(Stage::Planes, percent as f64 / 100.0);
    let mut labelled = match divide::divide(&mesh) {
        Some(fine) => drawn::labelled(&mesh, &fine, params),
        None => scanned(&mesh, &spacing::suited(params, &mesh), &mut told),
    };
    orient::by_faces(&mut labelled.found, &labelled.mesh);
    let Labelled { mesh: own, found, vertex_labels, leftovers: left } = labelled;
    observer.ended(Stage::Planes, found.planes.len());

    observer.begins(Stage::Polygons);
    let points = Cloud { points_m: own.vertices_m.clone(), ..Cloud::default() };
    let merged = polygons::merge(&params.polygons, &points, &own, &found);
    observer.ended(Stage::Polygons, merged.polygons.len());

    observer.begins(Stage::Leftovers);
    let leftovers = leftovers::collect(&left, &own, &merged.rest);
    observer.ended(Stage::Leftovers, leftovers.triangles.len());

    let model = Model { planes: found.planes, polygons: merged.polygons, leftovers };
    let mut counts = Counts {
        raw_points: mesh.vertices_m.len(),
        raw_triangles: mesh.triangles.len(),
        planes: model.planes.len(),
        veil_triangles: merged.veils,
        sigma_m: found.sigma_m,
        sigma_source: found.sigma_source,
        ..Counts::default()
    };
    counts.recount(&model);
    let cloud = Cloud { points_m: mesh.vertices_m.clone(), ..Cloud::default() };
    BuildOutput { cloud, labels: vertex_labels, mesh, model, counts }
}

/// A mesh of dense, noisy points: its vertices are the cloud.
fn scanned(mesh: &Mesh, params: &BuildParams, told: &mut dyn FnMut(u64)) -> Labelled {
    let points = Cloud { points_m: mesh.vertices_m.clone(), ..Cloud::default() };
    let found = planes::extract_telling(&params.planes, &points, told);
    let vertex_labels = found.labels.clone();
    Labelled { mesh: mesh.clone(), found, vertex_labels, leftovers: params.leftovers.clone() }
}

#[cfg(test)]
mod tests;
