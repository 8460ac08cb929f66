//! A mesh as a binary PLY file.

use crate::world::mesh::LabeledMesh;
use std::io::{self, Write};

/// Writes a mesh.
pub fn write_ply(out: &mut dyn Write, mesh: &LabeledMesh) -> io::Result<()> {
    writeln!(out, "ply\nformat binary_little_endian 1.0\ncomment meters; plane -1: no plane")?;
    writeln!(out, "element vertex {}", mesh.vertices_m.len())?;
    writeln!(out, "property float x\nproperty float y\nproperty float z")?;
    writeln!(out, "element face {}", mesh.faces.len())?;
    writeln!(out, "property list uchar int vertex_indices\nproperty int plane\nend_header")?;
    for vertex in &mesh.vertices_m {
        for coordinate in vertex {
            out.write_all(&(*coordinate as f32).to_le_bytes())?;
        }
    }
    for (face, plane) in mesh.faces.iter().zip(&mesh.planes) {
        out.write_all(&[3])?;
        for index in face {
            out.write_all(&index.to_le_bytes())?;
        }
        out.write_all(&plane.to_le_bytes())?;
    }
    Ok(())
}
