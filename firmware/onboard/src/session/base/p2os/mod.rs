//! The session of a Pioneer base (PSOS, P2OS, AROS, ARCOS): synchronise, open, keep it alive, read its odometry.
//!
//! ```text
//! STOP, SYNC0 -> SYNC1 -> SYNC2 -> OPEN -> running (PULSE every 0.8 s) -> CLOSE
//!   ^  CLOSE first, when packets come instead of an echo           |
//!   +------------------------------ silence -----------------------+
//! ```
//! The motors are never enabled: the operator drives. A base that its watchdog stopped would resume its last speed at any command, so STOP
//! goes before whatever may wake it. Frame of the odometry: the base's own (`odom`). Units: metres, radians.
//! Source: Pioneer 3 operations manual, and the fact sheet `p2os.md`.

mod foreign;
mod machine;
mod odometer;
mod parameters;

pub(super) use machine::Machine;
pub use parameters::{Parameters, UNKNOWN_METRES_PER_TICK};

#[cfg(test)]
mod tests;
