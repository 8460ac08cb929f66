//! Areas of meshes, triangles and flat rings, square meters.

use crate::model::Mesh;

/// Area of a mesh, square meters.
pub(crate) fn area_m2(mesh: &Mesh) -> f64 {
    mesh.triangles.iter().map(|triangle| triangle_area_m2(mesh, triangle)).sum()
}

/// Area of a triangle of a mesh, square meters.
pub(crate) fn triangle_area_m2(mesh: &Mesh, triangle: &[u32; 3]) -> f64 {
    let corner = |index: u32| mesh.vertices_m.get(index as usize).map_or([0.0; 3], |p| p.map(f64::from));
    biplane_geometry::polygon_area::triangle_area_m2(triangle.map(corner))
}
