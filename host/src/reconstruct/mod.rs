//! From posed scans to a model: cloud, mesh, planes, polygons, leftovers.

pub(crate) mod cloud;
pub(crate) mod decimate;
#[cfg(test)]
pub(crate) mod fixture;
pub(crate) mod leftovers;
pub(crate) mod mesh;
pub(crate) mod planes;
pub(crate) mod polygons;
pub(crate) mod revisits;
pub(crate) mod shapes;
pub(crate) mod simplify;
