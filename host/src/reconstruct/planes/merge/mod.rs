//! Planes that are one surface become one plane.

pub(crate) mod coplanar;
pub(crate) mod parallel;
pub(crate) mod seen_by;
pub(crate) mod tilted;
