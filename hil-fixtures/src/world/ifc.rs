//! A storey of an IFC file as a world: the surfaces of all elements of the file, and the storey's plan.

use super::labels;
use super::mesh::{LabeledMesh, NO_PLANE, Object};
use super::{World, WorldError};
use biplane_ifc::{Element, Ifc};
use std::path::Path;

/// Which storey is driven through, and how its doors stand.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct StoreyChoice {
    /// Counted from 0 at the lowest.
    pub index: usize,
    /// Whether doors are taken out of their frames, with the frames.
    pub doors_open: bool,
}

/// Reads a file.
pub(super) fn load(path: &Path, storey: &StoreyChoice) -> Result<World, WorldError> {
    let bytes = std::fs::read(path).map_err(|source| WorldError::File { path: path.to_owned(), source })?;
    let failed = |source| WorldError::Ifc { path: path.to_owned(), source };
    let ifc = Ifc::read(&bytes).map_err(failed)?;
    let (mut elements, unknown) = ifc.elements();
    let mut plan = ifc.plan(storey.index, &elements).map_err(failed)?;
    for (kind, count) in unknown {
        eprintln!("{}: {count} bodies of kind {kind} are left out", path.display());
    }
    if storey.doors_open {
        elements.retain(|element| !element.kind.starts_with("IFCDOOR"));
    } else {
        plan.openings.iter_mut().for_each(|opening| opening.shut = opening.kind == "door");
    }
    let (mut mesh, objects) = meshes(&elements);
    labels::label_planes(&mut mesh);
    let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    Ok(World { name, mesh, objects, plan: Some(plan), paths: Vec::new() })
}

/// All elements as one mesh, an object each.
fn meshes(elements: &[Element]) -> (LabeledMesh, Vec<Object>) {
    let mut mesh = LabeledMesh::default();
    let mut objects = Vec::new();
    for element in elements {
        let first = mesh.faces.len();
        for triangle in &element.triangles_m {
            let corners = triangle.map(|corner| mesh.vertex(corner));
            mesh.face(corners, NO_PLANE);
        }
        let name = format!("{} {}", element.kind, element.id);
        objects.push(Object { name, faces: first..mesh.faces.len() });
    }
    (mesh, objects)
}
