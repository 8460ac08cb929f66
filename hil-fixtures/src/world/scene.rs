//! A world as a sensor meets it: surfaces in `map`, ready for rays.

use super::mesh::LabeledMesh;
use crate::world::raycast::{Raycaster, normal};
use crate::world::vec3::{Vec3, dot};

/// Labeled surfaces in `map` with their ray caster.
#[derive(Clone, Debug)]
pub struct Scene {
    mesh: LabeledMesh,
    normals: Vec<Vec3>,
    caster: Raycaster,
}

/// What a ray met.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RayHit {
    /// Distance, meters.
    pub range_m: f64,
    /// Plane label of the surface.
    pub plane: i32,
    /// Cosine of the angle between the ray and the surface's normal, 0 (grazing) to 1.
    pub cosine: f64,
}

impl Scene {
    /// Sorts the surfaces; they must be in `map` already.
    #[must_use]
    pub fn new(mesh: LabeledMesh) -> Self {
        let caster = Raycaster::new(&mesh.vertices_m, &mesh.faces);
        let normals = (0..mesh.faces.len()).map(|i| normal(mesh.corners(i))).collect();
        Self { mesh, normals, caster }
    }

    /// The surfaces, in `map`.
    #[must_use]
    pub fn mesh(&self) -> &LabeledMesh {
        &self.mesh
    }

    /// The nearest surface along a ray in `map`; `direction` of length 1.
    #[must_use]
    pub fn look(&self, origin: Vec3, direction: Vec3, max_m: f64) -> Option<RayHit> {
        let hit = self.caster.cast(origin, direction, max_m)?;
        let face = hit.triangle as usize;
        let cosine = dot(self.normals[face], direction).abs();
        Some(RayHit { range_m: hit.range_m, plane: self.mesh.planes[face], cosine })
    }
}
