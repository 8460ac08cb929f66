//! Meshes from and to files.

pub mod obj;
pub mod ply;
