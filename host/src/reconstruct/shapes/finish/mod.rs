//! From cylinders that are there to those of the model: one for each thing, with its points, its ends and the
//! lines in which it meets planes.

pub(crate) mod claim;
pub(crate) mod meet;
pub(crate) mod standing_out;
pub(crate) mod trim;
pub(crate) mod unite;
