//! From a plane's triangles to polygons with straight borders.

pub(crate) mod border;
pub(crate) mod border_context;
#[cfg(test)]
mod border_tests;
pub(crate) mod directed_edges;
pub(crate) mod jogs;
pub(crate) mod line;
pub(crate) mod shortcuts;
pub(crate) mod slits;
pub(crate) mod spikes;
pub(crate) mod tolerance;
pub(crate) mod union;
