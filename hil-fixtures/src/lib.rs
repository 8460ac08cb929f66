//! Mock lasers and base, simulated worlds, serial captures. See ARCHITECTURE.md.
pub mod capture;
pub mod cli;
pub mod devices;
pub mod faults;
pub mod line;
pub mod rig;
pub mod rng;
pub mod serve;
pub mod simulate;
pub mod world;
