//! The session of an rFLEX base (B21r, ATRV, Magellan): ask for its state, ask for reports, read way and bearing.
//!
//! ```text
//! status -> motion reports on, input reports on, defaults, brake off, both axes at speed 0 -> running -> reports off, brake on
//!   ^                                     silence                                                |
//!   +--------------------------------------------------------------------------------------------+
//! ```
//! Written after the drivers of Player and CARMEN; never tried on hardware, and the log says so. No axis is ever given a speed
//! other than 0: the operator drives. The base reports path length and bearing in packets of their own; two that belong together
//! make one pose. Frame of the odometry: the base's own, its pose at the first pair is zero. Units: metres, radians.
//! Source: the fact sheet `rflex.md`.

mod axes;
mod machine;

use super::motion::Motion;
pub(super) use machine::Machine;

/// What the counts of a base are worth.
#[derive(Copy, Clone, PartialEq, Debug)]
pub struct Scale {
    /// Counts of a metre of way; negative when it counts backwards.
    pub counts_per_m: f64,
    /// Counts of a radian of bearing; negative when it counts clockwise.
    pub counts_per_rad: f64,
}

impl Scale {
    /// What these counts of way and bearing are as a motion.
    fn motion(&self, [way, bearing]: [i32; 2]) -> Motion {
        Motion {
            way_m: f64::from(way) / self.counts_per_m,
            turn_rad: f64::from(bearing) / self.counts_per_rad,
        }
    }
}

#[cfg(test)]
mod tests;
