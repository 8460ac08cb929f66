//! How good a trajectory is: against known relations, against the truth, or by its map alone.
//!
//! Each measure is one that others publish or another program computes, so that figures can be compared. The base moves on the
//! floor: poses are planar.

pub mod association;
pub mod map_entropy;
pub mod pose_error;
pub mod relations;
pub mod statistics;
