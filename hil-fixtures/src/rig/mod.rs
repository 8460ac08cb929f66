//! Rigs: named ones, and one that is driven through a world.

pub mod drive;
pub mod fan;
pub mod inertial;
pub mod named;
pub mod scanner;
pub mod simulated;
pub mod source;
pub mod tick;
