//! Where neighboring polygons meet: common lines, common corners, no cracks.

pub(crate) mod clearance;
pub(crate) mod jogs;
pub(crate) mod met_edges;
pub(crate) mod plane_intersection;
#[cfg(test)]
pub(crate) mod t_junctions;
pub(crate) mod weld;
