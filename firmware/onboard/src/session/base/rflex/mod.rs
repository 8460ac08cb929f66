//! The session of an rFLEX base (B21r, ATRV, Magellan): ask for its state, ask for reports, read way and
//! bearing.
//!
//! ```text
//! status -> motion reports on, input reports on, defaults, brake off, both axes at speed 0 -> running
//! running -> status: silence
//! running -> reports off, brake on: the end
//! ```
//! Written after the drivers of Player and CARMEN; never tried on hardware, and the log says so. No axis is
//! ever given a speed other than 0: the operator drives. The base reports path length and bearing in packets
//! of their own; two that belong together make one pose. Frame of the odometry: the base's own, its pose at
//! the first pair is zero. Units: meters, radians. Sources: the drivers of Player (`drivers/mixed/rflex`) and
//! CARMEN (`base/rflexlib`).

pub(crate) mod axes;
pub(crate) mod machine;
pub(crate) mod scale;
#[cfg(test)]
mod tests;
