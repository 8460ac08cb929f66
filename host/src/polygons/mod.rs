//! From triangles of one plane to polygons with holes (the paper, section 3.2).
//!
//! Frame `map`, metres.

use crate::model::{Cloud, Mesh, PlanarPolygon};
use crate::planes::Planes;
use serde::Serialize;

/// How triangles of one plane become polygons.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PolygonParams {
    /// A border may move by this much when it is straightened, metres. Larger: fewer corners. Smaller: noisy borders.
    pub border_tolerance_m: f64,
    /// Openings smaller than this are closed, square metres. Larger: windows close. Smaller: pinholes of noise stay.
    pub min_hole_m2: f64,
}

impl Default for PolygonParams {
    fn default() -> Self {
        Self { border_tolerance_m: 0.03, min_hole_m2: 0.02 }
    }
}

/// The flat surfaces, and the triangles that are none.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Merged {
    /// The flat surfaces.
    pub polygons: Vec<PlanarPolygon>,
    /// Indices of triangles of the raw mesh that no polygon stands for.
    pub rest: Vec<usize>,
}

/// Merges the triangles of each plane to polygons.
pub fn merge(_params: &PolygonParams, _cloud: &Cloud, mesh: &Mesh, _planes: &Planes) -> Merged {
    Merged { polygons: Vec::new(), rest: (0..mesh.triangles.len()).collect() }
}
