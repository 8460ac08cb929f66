//! Which plane each point belongs to, once the planes are known.

pub(crate) mod choice;
pub(crate) mod explain;
pub(crate) mod refine;
pub(crate) mod step_detection;
