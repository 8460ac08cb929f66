//! Drives a rig through a known world: the serial bytes that its devices would have sent, and the truth.
//!
//! The lasers turn freely, each with its own phase, and send every n-th scan as their line allows; the base
//! sends its packet every 100 ms; samples of an inertial unit come as messages, or as bytes of its line.
//! Lasers of today are their mock devices, which answer who they are and stream as the rig asks. The capture
//! begins when all of them stream (or with the replies of their start-up), the robot stands still for a
//! moment, drives, and stands again. Only whole telegrams are in the capture.

mod devices;
mod fan_laser;
mod inertial;
mod options;
mod run;
#[cfg(test)]
mod tests;
mod times;
pub mod truth;
pub mod truth_folder;

pub use options::{LaserOptions, SimulateError, SimulateOptions, SimulateReport};
pub use run::run;
