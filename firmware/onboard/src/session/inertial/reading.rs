//! What an inertial unit brings.

use crate::session::inertial::clock::SampleTime;

/// One sample, in the unit's own axes.
#[derive(Copy, Clone, PartialEq, Debug)]
pub struct InertialReading {
    /// Index in the stream of the first byte of its message.
    pub offset: u64,
    /// Bytes of that message.
    pub length: usize,
    /// When it was taken, by the unit's clock.
    pub time: SampleTime,
    /// Turn rates, radians per second.
    pub turn_rad_s: [f64; 3],
    /// Accelerations with gravity, meters per second squared.
    pub force_m_s2: [f64; 3],
}
