//! From the counts of an rFLEX base to meters and radians.

use crate::session::base::motion::Motion;

/// What the counts of a base are worth.
#[derive(Copy, Clone, PartialEq, Debug)]
pub(crate) struct Scale {
    /// Counts of a meter of way; negative when it counts backwards.
    pub counts_per_m: f64,
    /// Counts of a radian of bearing; negative when it counts clockwise.
    pub counts_per_rad: f64,
}

impl Scale {
    /// What these counts of way and bearing are as a motion.
    pub(crate) fn motion(&self, [way, bearing]: [i32; 2]) -> Motion {
        Motion {
            path_m: f64::from(way) / self.counts_per_m,
            turn_rad: f64::from(bearing) / self.counts_per_rad,
        }
    }
}
