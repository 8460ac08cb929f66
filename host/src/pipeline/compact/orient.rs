//! Which way planes face when no sensor is known: the way most of their triangles do, by area.

use crate::model::Mesh;
use crate::reconstruct::planes::labeled::Planes;
use biplane_geometry::polygon_area::doubled_triangle_normal;
use biplane_geometry::vec3::dot;

/// Turns the normals of planes to the side that their triangles are seen from.
pub(super) fn by_faces(found: &mut Planes, mesh: &Mesh) {
    let mut towards = vec![0.0; found.planes.len()];
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(|corner| found.labels[corner as usize]);
        let Some(plane) = usize::try_from(a).ok().filter(|_| a == b && b == c) else { continue };
        let [p, q, r] = triangle.map(|corner| mesh.vertices_m[corner as usize].map(f64::from));
        let face = doubled_triangle_normal([p, q, r]);
        towards[plane] += dot(face, found.planes[plane].normal);
    }
    for (plane, towards) in found.planes.iter_mut().zip(towards) {
        if towards < 0.0 {
            plane.normal = plane.normal.map(|v| -v);
            plane.offset_m = -plane.offset_m;
        }
    }
}
