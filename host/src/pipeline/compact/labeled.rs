//! A mesh whose vertices know their planes.

use crate::model::Mesh;
use crate::reconstruct::leftovers::LeftoverParams;
use crate::reconstruct::planes::labeled::Planes;
use crate::reconstruct::shapes::Rounds;

/// A mesh whose vertices have labels.
pub(super) struct Labeled {
    /// The mesh: triangle for triangle the one that was given, perhaps with vertices of its own.
    pub mesh: Mesh,
    /// Its planes, and the label of each of its vertices.
    pub found: Planes,
    /// The label of each vertex of the mesh that was given.
    pub vertex_labels: Vec<i32>,
    /// What is round.
    pub rounds: Rounds,
    /// Which triangles on no plane stay.
    pub leftovers: LeftoverParams,
}
