//! PLY, read and written.

pub(crate) mod error;
pub(crate) mod header;
pub(crate) mod points_file;
pub(crate) mod read;
pub(crate) mod values;
pub(crate) mod write;

pub(crate) use read::{read, read_wanted};
pub(crate) use write::{write_far_mesh, write_mesh, write_model, write_planes, write_points};
#[cfg(test)]
mod write_tests;
