//! The fast search: regions grow over the cells of a voxel grid.

pub(crate) mod blocks;
pub(crate) mod cells;
pub(crate) mod cubes;
pub(crate) mod distinct;
pub(crate) mod grid;
pub(crate) mod grow;
pub(crate) mod searched;
pub(crate) mod stitch;
