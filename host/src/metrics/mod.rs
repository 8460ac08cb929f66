//! How true a model or a trajectory is.

pub(crate) mod blocked_rays;
pub(crate) mod building;
pub(crate) mod compare;
pub(crate) mod evaluate;
pub(crate) mod surface_distance;
