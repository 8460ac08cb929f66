//! Geometry that robot and workstation share, with one definition for each thing.
//!
#![cfg_attr(feature = "std", doc = include_str!("../README.md"))]
#![cfg_attr(not(feature = "std"), no_std)]

extern crate alloc;

#[cfg(feature = "std")]
pub mod angle;
#[cfg(feature = "std")]
pub mod covariance;
pub mod elementary;
pub mod plane;
pub mod polygon_area;
#[cfg(feature = "std")]
mod pose2;
#[cfg(feature = "std")]
pub mod pose3;
pub mod quantile;
#[cfg(feature = "std")]
mod trajectory;
mod union_find;
mod vector;

#[cfg(feature = "std")]
pub use crate::angle::wrap_angle;
pub use crate::elementary::PortableMath;
#[cfg(feature = "std")]
pub use crate::pose2::Pose2;
#[cfg(feature = "std")]
pub use crate::pose3::{Pose3, RollPitchYaw};
#[cfg(feature = "std")]
pub use crate::trajectory::{StampedPose, Trajectory};
pub use crate::union_find::UnionFind;
pub use crate::vector::scalar::Scalar;
pub use crate::vector::{vec2, vec3};
