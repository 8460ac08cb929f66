//! Surfaces of elements: profiles, swept solids, faceted bodies, cuts.

pub(crate) mod bsp;
pub(crate) mod curve;
pub(crate) mod item;
pub(crate) mod mesh;
pub(crate) mod placement;
pub(crate) mod profile;
pub(crate) mod swept;
pub(crate) mod vector;
