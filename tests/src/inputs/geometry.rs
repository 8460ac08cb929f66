//! Meshes and clouds of other programs: OBJ, PLY, LAS, as models' inputs and as worlds to simulate.

use std::io;

use biplane::Building;
use biplane::files::{
    Shift, cloud_from_ply, read_cloud, read_model_json, read_obj, read_ply, write_cityjson, write_dxf,
    write_glb, write_ifc, write_obj, write_ply,
};

use crate::inputs::making::memory_file::MemoryFile;

/// Every corner of every triangle is a vertex, for both readers.
pub(super) fn ifc(input: &[u8]) {
    let Ok(ifc) = biplane_ifc::Ifc::read(input) else { return };
    let (elements, _) = ifc.elements();
    for storey in 0..ifc.storeys().len() {
        if let Ok(plan) = ifc.plan(storey, &elements) {
            assert!(plan.rooms.iter().all(|room| room.outline_m.len() > 2));
        }
    }
}

pub(super) fn obj(input: &[u8]) {
    if let Ok(obj) = read_obj(input) {
        let _ = Shift::Find.of(&obj.vertices_m);
        assert_corners(&obj.triangles, obj.vertices_m.len());
    }
    if let Ok((mesh, objects)) = biplane_mock::world::files::obj::parse(&String::from_utf8_lossy(input)) {
        assert_corners(&mesh.faces, mesh.vertices_m.len());
        assert!(objects.iter().all(|object| object.faces.end <= mesh.faces.len()));
        assert!(mesh.vertices_m.iter().flatten().all(|v| v.is_finite()));
    }
}

/// The same, and every column is as long as what it describes.
pub(super) fn ply(input: &[u8]) {
    if let Ok(ply) = read_ply(input) {
        assert_corners(&ply.mesh.triangles, ply.mesh.vertices_m.len());
        assert!(ply.vertex_columns.iter().all(|column| column.1.len() == ply.mesh.vertices_m.len()));
        assert!(ply.face_columns.iter().all(|column| column.1.len() == ply.mesh.triangles.len()));
    }
    if let Ok(found) = cloud_from_ply(input) {
        let order = found.order.unwrap_or_default();
        assert!(order.iter().all(|place| (*place as usize) < found.cloud.len()));
    }
    if let Ok((mesh, _)) = biplane_mock::world::files::ply::parse(input) {
        assert_corners(&mesh.faces, mesh.vertices_m.len());
        assert_eq!(mesh.planes.len(), mesh.faces.len());
        assert!(mesh.vertices_m.iter().flatten().all(|v| v.is_finite()));
    }
}

/// A model is written back as the same model, and every format takes it, however far its corners are.
pub(super) fn model_json(input: &[u8]) {
    let Ok(file) = read_model_json(input) else { return };
    let mut written = Vec::new();
    file.write(&mut written).expect("memory takes all");
    assert_eq!(read_model_json(&written).expect("it was written just now"), file);
    let (shapes, building) = (file.shapes(), Building::read(&file.model, file.floor_m));
    assert_eq!(shapes.faces.len(), file.model.polygons.len());
    let out = &mut io::sink();
    for result in [
        write_glb(out, &shapes),
        write_ply(out, &shapes),
        write_obj(out, &shapes),
        write_cityjson(out, &shapes),
        write_dxf(out, &shapes, &building),
        write_ifc(out, &shapes, &building),
    ] {
        result.expect("nothing refuses bytes");
    }
}

/// A cloud of any kind, by its first bytes.
pub(super) fn cloud(input: &[u8]) {
    let _ = read_cloud(&MemoryFile::of(input).path());
}

fn assert_corners(triangles: &[[u32; 3]], vertices: usize) {
    let lost = triangles.iter().flatten().find(|corner| **corner as usize >= vertices);
    assert!(lost.is_none(), "corner {lost:?} of {vertices} vertices");
}
