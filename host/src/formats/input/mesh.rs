//! Triangle meshes from files of other programs: PLY, or OBJ by its name.
//!
//! Vertices at the same place become one, because many programs write each triangle with its own; triangles
//! that are none are left out. Coordinates are meters; those far from zero are moved near it
//! ([`crate::formats::input::shift`]).

use crate::formats::input::shift::{Shift, moved};
use crate::formats::obj::read::ObjError;
use crate::formats::ply::error::PlyError;
use crate::formats::ply::read::Wanted;
use crate::formats::{obj, ply};
use crate::model::Mesh;
use biplane_recording::file_kind::{FileKind, KIND_BYTES, describe};
use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::io;
use std::path::Path;

/// A mesh as it was in a file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MeshFile {
    /// The mesh without the shift, each place one vertex.
    pub mesh: Mesh,
    /// What was taken off every coordinate, meters.
    pub shift_m: [f64; 3],
    /// For each vertex of the file the one of `mesh` that stands for it.
    pub vertex_of: Vec<u32>,
    /// Triangles of the file, also those that are left out.
    pub triangles: usize,
}

/// Why a file gives no mesh.
#[derive(Debug, thiserror::Error)]
pub enum MeshFileError {
    /// The system refused.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// It is a PLY that cannot be read.
    #[error(transparent)]
    Ply(#[from] PlyError),
    /// It is an OBJ that cannot be read.
    #[error(transparent)]
    Obj(#[from] ObjError),
    /// It is something else.
    #[error("expected a PLY or OBJ mesh; this file {}", describe(found))]
    Unknown {
        /// How the file begins.
        found: Vec<u8>,
    },
    /// There is no surface in it.
    #[error(
        "the file holds no triangle of three different places ({vertices} vertices, {triangles} triangles)"
    )]
    NoTriangles {
        /// Vertices in the file.
        vertices: usize,
        /// Triangles in the file.
        triangles: usize,
    },
}

/// Reads a mesh: an OBJ when its name ends so, else a PLY.
///
/// # Errors
/// When the file cannot be read, is no mesh or a damaged one, or holds no triangle.
pub fn read(path: &Path) -> Result<MeshFile, MeshFileError> {
    let bytes = std::fs::read(path)?;
    let is_obj = path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("obj"));
    let start = &bytes[..bytes.len().min(KIND_BYTES as usize)];
    let is_other = match is_obj {
        // Not every OBJ begins with a word that others do not have.
        true => FileKind::of(start).is_some_and(|kind| kind != FileKind::Obj),
        false => !start.starts_with(b"ply"),
    };
    if is_other {
        return Err(MeshFileError::Unknown { found: start.to_vec() });
    }
    let (mesh, shift_m) = if is_obj {
        let obj = obj::read(&bytes)?;
        let shift_m = Shift::Find.of(&obj.vertices_m);
        (Mesh { vertices_m: moved(&obj.vertices_m, shift_m), triangles: obj.triangles }, shift_m)
    } else {
        let ply = ply::read_wanted(&bytes, &Wanted { shift: Shift::Find, columns: Some(&[]) })?;
        (ply.mesh, ply.shift_m)
    };
    drop(bytes);
    let file = welded(&mesh, shift_m);
    if file.mesh.triangles.is_empty() {
        return Err(MeshFileError::NoTriangles {
            vertices: mesh.vertices_m.len(),
            triangles: mesh.triangles.len(),
        });
    }
    Ok(file)
}

/// The mesh with one vertex a place, and without triangles that have no three finite ones.
fn welded(mesh: &Mesh, shift_m: [f64; 3]) -> MeshFile {
    let mut places: HashMap<[u32; 3], u32> = HashMap::with_capacity(mesh.vertices_m.len());
    let mut file = MeshFile { shift_m, triangles: mesh.triangles.len(), ..MeshFile::default() };
    for vertex in &mesh.vertices_m {
        // Adding zero makes -0 and 0 one.
        let index = match places.entry(vertex.map(|v| (v + 0.0).to_bits())) {
            Entry::Occupied(known) => *known.get(),
            Entry::Vacant(free) => {
                file.mesh.vertices_m.push(*vertex);
                *free.insert(file.mesh.vertices_m.len() as u32 - 1)
            }
        };
        file.vertex_of.push(index);
    }
    let finite = |corner: u32| file.mesh.vertices_m[corner as usize].iter().all(|v| v.is_finite());
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(|corner| file.vertex_of[corner as usize]);
        if a != b && b != c && c != a && [a, b, c].into_iter().all(finite) {
            file.mesh.triangles.push([a, b, c]);
        }
    }
    file
}

#[cfg(test)]
mod tests {
    use super::{MeshFileError, read};
    use std::path::PathBuf;

    fn scratch(name: &str, text: &str) -> PathBuf {
        let path = std::env::temp_dir().join(format!("biplane-mesh-{}-{name}", std::process::id()));
        std::fs::write(&path, text).unwrap();
        path
    }

    #[test]
    fn loose_triangles_are_joined_where_their_corners_meet_and_what_is_no_triangle_is_left_out() {
        // Two triangles of a square in UTM coordinates, each with its own corners; a flat one; one with a
        // corner nowhere.
        let text = "v 400000 5000000 0\nv 400001 5000000 0\nv 400001 5000001 0\nf 1 2 3\n\
            v 400000 5000000 -0\nv 400001 5000001 0\nv 400000 5000001 0\nf 4 5 6\nf 1 4 2\nv nan 0 0\nf 1 2 7\n";
        let path = scratch("loose.OBJ", text);
        let file = read(&path).unwrap();
        std::fs::remove_file(path).unwrap();
        assert_eq!(file.shift_m, [400_000.0, 5_000_000.0, 0.0]);
        assert_eq!(file.vertex_of, [0, 1, 2, 0, 2, 3, 4]);
        assert_eq!(file.mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
        assert_eq!(file.mesh.vertices_m[3], [0.0, 1.0, 0.0]);
        assert_eq!(file.triangles, 4);
    }

    #[test]
    fn a_file_without_a_surface_is_an_error() {
        let path = scratch("points.obj", "v 0 0 0\nv 1 0 0\n");
        assert!(matches!(read(&path), Err(MeshFileError::NoTriangles { vertices: 2, triangles: 0 })));
        std::fs::remove_file(path).unwrap();
    }
}
