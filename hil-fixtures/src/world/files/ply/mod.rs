//! Labeled triangle meshes as PLY files: written in binary, read in ASCII and binary (little-endian).
//!
//! Vertices have float properties x, y, z in meters; faces a list of vertex indices and, where there is one,
//! an int property `plane`. Polygons are cut into fans; other elements and properties are passed over.
//! Format: Turk, "The PLY polygon file format".

mod error;
mod header;
mod read;
mod write;

pub use error::PlyError;
pub use read::parse;
pub use write::write_ply;

#[cfg(test)]
mod tests {
    use super::{PlyError, parse, write_ply};
    use crate::world::mesh::LabeledMesh;

    fn square() -> LabeledMesh {
        LabeledMesh {
            vertices_m: vec![[0.0, 0.0, 0.5], [1.0, 0.0, 0.5], [1.0, 1.0, 0.5], [0.0, 1.0, 0.5]],
            faces: vec![[0, 1, 2], [0, 2, 3]],
            planes: vec![7, -1],
        }
    }

    #[test]
    fn what_is_written_is_read_again() {
        let mut bytes = Vec::new();
        write_ply(&mut bytes, &square()).expect("written");
        assert_eq!(parse(&bytes), Ok((square(), true)));
    }

    #[test]
    fn ascii_polygons_with_foreign_properties_become_fans() {
        let text = "ply\nformat ascii 1.0\ncomment by hand\nelement vertex 4\nproperty double x\nproperty double y\nproperty uchar red\n\
                    property float z\nelement face 1\nproperty list uchar int vertex_index\nelement edge 1\nproperty int a\n\
                    property int b\nend_header\n0 0 255 0.5\n1 0 255 0.5\n1 1 255 0.5\n0 1 255 0.5\n4 0 1 2 3\n0 1\n";
        let (mesh, labeled) = parse(text.as_bytes()).expect("a mesh");
        assert_eq!((mesh.vertices_m, mesh.faces, labeled), (square().vertices_m, square().faces, false));
        assert_eq!(mesh.planes, vec![-1, -1]);
    }

    #[test]
    fn every_truncation_is_an_error_and_none_a_panic() {
        let mut bytes = Vec::new();
        write_ply(&mut bytes, &square()).expect("written");
        for length in 0..bytes.len() {
            assert!(parse(&bytes[..length]).is_err(), "{length}");
        }
    }

    #[test]
    fn impossible_counts_indices_and_formats_are_refused() {
        let file = |format: &str, face: &str| {
            format!(
                "ply\nformat {format} 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 1\n\
                 property list uint int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n{face}\n"
            )
        };
        assert!(matches!(parse(file("ascii", "4000000000 0 1 2").as_bytes()), Err(PlyError::Data { .. })));
        assert!(matches!(
            parse(file("ascii", "3 0 1 3").as_bytes()),
            Err(PlyError::Index { found: 3.0, .. })
        ));
        assert!(matches!(parse(file("ascii", "3 0 1 -1").as_bytes()), Err(PlyError::Index { .. })));
        assert!(matches!(parse(file("binary_big_endian", "").as_bytes()), Err(PlyError::Format { .. })));
        assert!(matches!(parse(b"solid stl"), Err(PlyError::Header { line: 1, .. })));
    }
}
