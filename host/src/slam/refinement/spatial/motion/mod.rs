//! What tells how the robot moved without looking around: wheels on a ground, and an inertial unit where
//! there is one.

pub(crate) mod inertial;
pub(crate) mod inertial_samples;
pub(crate) mod wheels;
