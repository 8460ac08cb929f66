//! Mock lasers and base, simulated worlds, serial captures. See ARCHITECTURE.md.
pub mod capture_file;
pub mod drive;
pub mod line;
pub mod odometry;
pub mod ply;
pub mod pose;
pub mod raycast;
pub mod rng;
pub mod scanner;
pub mod simulate;
pub mod simulated_rig;
pub mod source;
pub mod telegrams;
pub mod truth;
pub mod vec3;
pub mod world;
