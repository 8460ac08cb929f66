//! A storey of an IFC file as a world: the surfaces of all elements of the file, and the storey's plan.

use super::labels;
use super::mesh::{LabeledMesh, NO_PLANE, Object};
use biplane_ifc::{Element, Ifc, IfcError, Plan};
use std::collections::BTreeMap;

/// Which storey is driven through, and how its doors stand.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct StoreyChoice {
    /// Counted from 0 at the lowest.
    pub index: usize,
    /// Whether doors are taken out of their frames, with the frames.
    pub doors_open: bool,
}

/// A storey with everything that is in the file.
pub(super) struct IfcStorey {
    pub(super) mesh: LabeledMesh,
    pub(super) objects: Vec<Object>,
    pub(super) plan: Plan,
    /// How many bodies of which kind are left out, because their geometry is not known.
    pub(super) left_out: BTreeMap<String, usize>,
}

/// Reads a file.
pub(super) fn read(bytes: &[u8], storey: &StoreyChoice) -> Result<IfcStorey, IfcError> {
    let ifc = Ifc::read(bytes)?;
    let (mut elements, left_out) = ifc.elements();
    let mut plan = ifc.plan(storey.index, &elements)?;
    if storey.doors_open {
        elements.retain(|element| !element.kind.starts_with("IFCDOOR"));
    } else {
        plan.openings.iter_mut().for_each(|opening| opening.shut = opening.kind == "door");
    }
    let (mut mesh, objects) = meshes(&elements);
    labels::label_planes(&mut mesh);
    Ok(IfcStorey { mesh, objects, plan, left_out })
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
