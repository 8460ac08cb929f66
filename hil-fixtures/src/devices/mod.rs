//! Mock devices without input or output of their own, and the serial lines that they speak on.

pub mod base;
#[cfg(test)]
pub(crate) mod bench;
pub mod cola;
pub mod device;
pub mod inertial;
pub mod lms;
pub mod pacing;
pub mod pty;
pub mod run;
pub mod scip;
pub mod telegrams;
