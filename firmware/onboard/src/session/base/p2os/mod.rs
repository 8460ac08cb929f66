//! The session of a Pioneer base (PSOS, P2OS, AROS, ARCOS): synchronize, open, keep it alive, read its
//! odometry.
//!
//! ```text
//! listen -> SYNC0 -> SYNC1 -> SYNC2 -> OPEN -> running (PULSE every 0.8 s) -> CLOSE
//!             ^  STOP and CLOSE first, when packets come   |
//!             +---------------- silence -------------------+
//! ```
//! The motors are never enabled: the operator drives. In an open session a base that its watchdog stopped
//! would resume its last speed at any command, so STOP goes before whatever may wake it. Nothing is sent
//! before SYNC0 to a base that waits for it. Frame of the odometry: the base's own
//! (`odom`). Units: meters, radians. Sources: MobileRobots, Pioneer 3 Operations Manual; the drivers
//! AriaCoda, Player and CARMEN.

pub(crate) mod machine;
pub(crate) mod odometer;
pub(crate) mod parameters;
#[cfg(test)]
mod tests;
