//! Meshes and clouds of other programs: OBJ, PLY, LAS, as models' inputs and as worlds to simulate.

use biplane::cloud_file;
use biplane::shift::Shift;
use biplane::{obj_read, ply_read};

use super::memory_file::MemoryFile;

/// Every corner of every triangle is a vertex, for both readers.
pub fn obj(input: &[u8]) {
    if let Ok(obj) = obj_read::read(input) {
        let _ = Shift::Find.of(&obj.vertices_m);
        assert_corners(&obj.triangles, obj.vertices_m.len());
    }
    if let Ok((mesh, objects)) = biplane_mock::obj::parse(&String::from_utf8_lossy(input)) {
        assert_corners(&mesh.faces, mesh.vertices_m.len());
        assert!(objects.iter().all(|object| object.faces.end <= mesh.faces.len()));
        assert!(mesh.vertices_m.iter().flatten().all(|v| v.is_finite()));
    }
}

/// The same, and every column is as long as what it describes.
pub fn ply(input: &[u8]) {
    if let Ok(ply) = ply_read::read(input) {
        assert_corners(&ply.mesh.triangles, ply.mesh.vertices_m.len());
        assert!(ply.vertex_columns.iter().all(|column| column.1.len() == ply.mesh.vertices_m.len()));
        assert!(ply.face_columns.iter().all(|column| column.1.len() == ply.mesh.triangles.len()));
    }
    if let Ok(found) = cloud_file::from_ply(input) {
        let order = found.order.unwrap_or_default();
        assert!(order.iter().all(|place| (*place as usize) < found.cloud.len()));
    }
    if let Ok((mesh, _)) = biplane_mock::ply::parse(input) {
        assert_corners(&mesh.faces, mesh.vertices_m.len());
        assert_eq!(mesh.planes.len(), mesh.faces.len());
        assert!(mesh.vertices_m.iter().flatten().all(|v| v.is_finite()));
    }
}

/// A LAS or LAZ file, by its first bytes.
pub fn las(input: &[u8]) {
    let _ = cloud_file::read(&MemoryFile::of(input).path());
}

fn assert_corners(triangles: &[[u32; 3]], vertices: usize) {
    let lost = triangles.iter().flatten().find(|corner| **corner as usize >= vertices);
    assert!(lost.is_none(), "corner {lost:?} of {vertices} vertices");
}
