//! From a scan telegram to checked ranges in meters with their directions.

pub(crate) mod condition;
pub(crate) mod plausible;
pub(crate) mod ranges;
pub(crate) mod scan_geometry;
