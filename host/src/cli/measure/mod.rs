//! Commands that measure models and trajectories.

pub(crate) mod compare;
pub(crate) mod evaluate;
