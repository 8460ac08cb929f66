//! Mock lasers and base, simulated worlds, serial captures. See ARCHITECTURE.md.
pub mod drive;
pub mod odometry;
pub mod pose;
pub mod raycast;
pub mod rng;
pub mod scanner;
pub mod source;
pub mod vec3;
pub mod world;
