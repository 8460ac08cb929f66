//! All parameters of a build, one struct a stage.

use crate::reconstruct::cloud::CloudParams;
use crate::reconstruct::leftovers::LeftoverParams;
use crate::reconstruct::mesh::MeshParams;
use crate::reconstruct::planes::params::PlaneParams;
use crate::reconstruct::polygons::params::PolygonParams;
use crate::reconstruct::revisits::params::RevisitParams;
use crate::reconstruct::shapes::params::ShapeParams;
use serde::Serialize;

/// The parameters of every stage of [`crate::pipeline::build`].
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct BuildParams {
    /// Which beams become points.
    pub cloud: CloudParams,
    /// Which points show nothing new.
    pub revisits: RevisitParams,
    /// Which points are joined to raw triangles.
    pub mesh: MeshParams,
    /// What a plane is.
    pub planes: PlaneParams,
    /// What is round.
    pub shapes: ShapeParams,
    /// How triangles of one plane become polygons.
    pub polygons: PolygonParams,
    /// Which of the other triangles stay.
    pub leftovers: LeftoverParams,
}
