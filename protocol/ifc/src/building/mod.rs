//! What the file's elements are in a building.

pub(crate) mod elements;
pub(crate) mod footprint;
pub(crate) mod plan;
pub(crate) mod relations;
pub(crate) mod storey_plan;
