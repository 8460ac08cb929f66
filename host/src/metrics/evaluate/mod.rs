//! How good a trajectory is: against known relations, against the truth, or by its map alone.
//!
//! Each measure is one that others publish or another program computes, so that figures can be compared. The
//! base moves on the floor: poses are planar.

pub(crate) mod association;
pub(crate) mod pose_error;
pub(crate) mod relations;
pub(crate) mod statistics;
