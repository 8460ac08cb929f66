//! What a drive sees again: passes over surfaces that earlier passes have covered.
//!
//! Triangles and outlines are made of first views only, so everything after the points costs by the
//! building's area and not by the time driven. Points of later passes are not lost: each has the label of the
//! plane it lies on, and planes are fitted to all of them. Frame `map`, meters.

pub(crate) mod first_views;
pub(crate) mod fuse;
pub(crate) mod labels;
pub(crate) mod params;
pub(crate) mod split;
#[cfg(test)]
mod tests;
