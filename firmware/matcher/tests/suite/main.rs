//! The tracker from outside: simulated rooms and corridors with known truth, drawn by a ray-caster that
//! shares no code with the crate.

mod convergence;
mod corridor;
mod drive;
mod journal;
mod knobs;
mod odometry_faults;
mod odometry_scale;
mod pair;
mod trouble;
mod world;
