//! The fine structure that is on no plane: it stays a mesh, without the spikes of mixed pixels.
//!
//! Frame `map`, metres. Source: the paper, section 1 ("interspersed with small fine-structured models of regions that cannot be
//! captured by a flat-surface model").

use crate::model::Mesh;
use serde::Serialize;

/// Which of the triangles on no plane stay.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct LeftoverParams {}

/// The triangles `rest` of `mesh` as a mesh of their own, without unused vertices.
pub fn collect(_params: &LeftoverParams, mesh: &Mesh, rest: &[usize]) -> Mesh {
    let mut new_index = vec![u32::MAX; mesh.vertices_m.len()];
    let mut out = Mesh::default();
    for triangle in rest.iter().filter_map(|&index| mesh.triangles.get(index)) {
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
