//! Planes that are one surface become one plane.

pub(crate) mod coplanar;
pub(crate) mod parallel;
pub(crate) mod tilted;
