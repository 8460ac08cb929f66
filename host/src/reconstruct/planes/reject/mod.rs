//! Planes that are no surface: mixed pixels and slices through foliage.

pub(crate) mod foliage_planes;
pub(crate) mod mixed_pixel_planes;
