//! `sensor_msgs/msg/Imu`: turn rates, accelerations, and an orientation where the device makes one.

use super::Message;
use crate::messages::cdr::{CdrError, Decoder, Encoder};

/// One sample of an inertial measurement unit, in its own frame.
#[derive(Clone, PartialEq, Debug)]
pub struct Imu {
    /// The moment of the sample, in ns.
    pub stamp_ns: i64,
    /// The unit's own frame.
    pub frame_id: String,
    /// Orientation, a unit quaternion.
    pub orientation_xyzw: [f64; 4],
    /// Row-major 3 x 3, in rad squared; its first number is -1 when there is no orientation.
    pub orientation_covariance: [f64; 9],
    /// Turn rates, in rad/s.
    pub angular_rad_s: [f64; 3],
    /// Row-major 3 x 3; its first number is -1 when there are no turn rates.
    pub angular_covariance: [f64; 9],
    /// Accelerations with gravity, in m/s^2: a unit at rest shows some 9.8 upward.
    pub acceleration_m_s2: [f64; 3],
    /// Row-major 3 x 3; its first number is -1 when there are no accelerations.
    pub acceleration_covariance: [f64; 9],
}

impl Default for Imu {
    /// At rest where nothing weighs, in no frame.
    fn default() -> Self {
        Self {
            stamp_ns: 0,
            frame_id: String::new(),
            orientation_xyzw: [0.0, 0.0, 0.0, 1.0],
            orientation_covariance: [0.0; 9],
            angular_rad_s: [0.0; 3],
            angular_covariance: [0.0; 9],
            acceleration_m_s2: [0.0; 3],
            acceleration_covariance: [0.0; 9],
        }
    }
}

impl Message for Imu {
    const TYPE: &'static str = "sensor_msgs/msg/Imu";

    fn write(&self, encoder: &mut Encoder) {
        encoder.header(self.stamp_ns, &self.frame_id);
        encoder.f64_array(&self.orientation_xyzw);
        encoder.f64_array(&self.orientation_covariance);
        encoder.f64_array(&self.angular_rad_s);
        encoder.f64_array(&self.angular_covariance);
        encoder.f64_array(&self.acceleration_m_s2);
        encoder.f64_array(&self.acceleration_covariance);
    }

    fn read(decoder: &mut Decoder) -> Result<Self, CdrError> {
        let (stamp_ns, frame_id) = decoder.header()?;
        Ok(Self {
            stamp_ns,
            frame_id,
            orientation_xyzw: decoder.f64_array()?,
            orientation_covariance: decoder.f64_array()?,
            angular_rad_s: decoder.f64_array()?,
            angular_covariance: decoder.f64_array()?,
            acceleration_m_s2: decoder.f64_array()?,
            acceleration_covariance: decoder.f64_array()?,
        })
    }
}
