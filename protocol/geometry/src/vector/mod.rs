//! Vectors as arrays of two or three numbers. Each expression has one order of operations, so that results
//! have the same bits.

pub(crate) mod scalar;
pub mod vec2;
pub mod vec3;
