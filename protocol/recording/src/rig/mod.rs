//! `rig.toml`: which devices a robot carries, where they sit, and how their time is counted.
//!
//! Lengths in meters, angles in degrees (as people measure them); mounts are `base_from_laser`. Everything
//! but ports has a default; `base_link` lies on the floor (z = 0). The text is read by [`Rig::parse`] and
//! written by [`Rig::to_toml`].

mod base;
mod error;
mod hints;
mod imu;
mod laser;
mod mount;
mod parse;
mod print;
mod robot;
mod table;
#[cfg(test)]
mod tests;

pub use base::{Base, BaseProtocol, RflexModel};
pub use error::RigError;
pub use imu::{InertialProtocol, InertialUnit};
pub use laser::{ColaLaser, Laser, LaserProtocol, MIRROR_TURN_NS, ScipLaser, Units};
pub use mount::Mount;
pub use robot::Rig;
