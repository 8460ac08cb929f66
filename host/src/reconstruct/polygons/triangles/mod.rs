//! Which raw triangles a plane's polygons are made from.

pub(crate) mod assign;
pub(crate) mod jump_edges;
pub(crate) mod label_propagation;
pub(crate) mod project_to_plane;
pub(crate) mod sliver_planes;
pub(crate) mod small_components;
