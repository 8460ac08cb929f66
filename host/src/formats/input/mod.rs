//! Clouds and meshes of other programs, whatever their format.

pub(crate) mod cloud;
pub(crate) mod cloud_file;
#[cfg(test)]
pub(crate) mod cloud_tests;
#[cfg(feature = "e57")]
pub(crate) mod e57;
pub(crate) mod lines;
pub(crate) mod mesh;
pub(crate) mod organize;
pub(crate) mod pcd;
#[cfg(any(feature = "e57", feature = "las"))]
pub(crate) mod quietly;
pub(crate) mod range_limit;
pub(crate) mod shift;
