//! All parameters of a build, one struct a stage.

use crate::cloud::CloudParams;
use crate::leftovers::LeftoverParams;
use crate::mesh::MeshParams;
use crate::planes::PlaneParams;
use crate::polygons::PolygonParams;
use serde::Serialize;

/// The parameters of every stage of [`crate::pipeline::build`].
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct BuildParams {
    /// Which beams become points.
    pub cloud: CloudParams,
    /// Which points are joined to raw triangles.
    pub mesh: MeshParams,
    /// What a plane is.
    pub planes: PlaneParams,
    /// How triangles of one plane become polygons.
    pub polygons: PolygonParams,
    /// Which of the other triangles stay.
    pub leftovers: LeftoverParams,
}
