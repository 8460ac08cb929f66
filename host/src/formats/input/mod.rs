//! Clouds and meshes of other programs, whatever their format.

pub(crate) mod cloud;
pub(crate) mod cloud_file;
#[cfg(test)]
pub(crate) mod cloud_tests;
pub(crate) mod mesh;
pub(crate) mod organize;
pub(crate) mod shift;
