//! Parts of a mesh as meshes of their own.

use crate::model::Mesh;

/// Some triangles of a mesh as a mesh of their own, without unused vertices.
pub(crate) fn only(mesh: &Mesh, which: &[usize]) -> Mesh {
    let mut new_index = vec![u32::MAX; mesh.vertices_m.len()];
    let mut out = Mesh::default();
    for triangle in which.iter().filter_map(|index| mesh.triangles.get(*index)) {
        if triangle.iter().any(|corner| *corner as usize >= new_index.len()) {
            continue;
        }
        let corners = triangle.map(|old| {
            let slot = &mut new_index[old as usize];
            if *slot == u32::MAX {
                *slot = out.vertices_m.len() as u32;
                out.vertices_m.push(mesh.vertices_m[old as usize]);
            }
            *slot
        });
        out.triangles.push(corners);
    }
    out
}
