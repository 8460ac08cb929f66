//! `geometry_msgs/msg/PoseWithCovarianceStamped`: where `base_link` is in `map`, and how surely.

use super::Message;
use crate::messages::cdr::{CdrError, Decoder, Encoder};

/// A pose with its uncertainty.
#[derive(Clone, PartialEq, Debug)]
pub struct PoseWithCovarianceStamped {
    /// The moment of the pose, in ns.
    pub stamp_ns: i64,
    /// The frame of the pose, `map`.
    pub frame_id: String,
    /// Position in `frame_id`, in m.
    pub position_m: [f64; 3],
    /// Orientation in `frame_id`, a unit quaternion.
    pub orientation_xyzw: [f64; 4],
    /// Row-major 6 x 6 over x, y, z, roll, pitch, yaw, in m and rad.
    pub covariance: [f64; 36],
}

impl Default for PoseWithCovarianceStamped {
    /// At the origin, no frame, no uncertainty.
    fn default() -> Self {
        Self {
            stamp_ns: 0,
            frame_id: String::new(),
            position_m: [0.0; 3],
            orientation_xyzw: [0.0, 0.0, 0.0, 1.0],
            covariance: [0.0; 36],
        }
    }
}

impl Message for PoseWithCovarianceStamped {
    const TYPE: &'static str = "geometry_msgs/msg/PoseWithCovarianceStamped";

    fn write(&self, encoder: &mut Encoder) {
        encoder.header(self.stamp_ns, &self.frame_id);
        encoder.f64_array(&self.position_m);
        encoder.f64_array(&self.orientation_xyzw);
        encoder.f64_array(&self.covariance);
    }

    fn read(decoder: &mut Decoder) -> Result<Self, CdrError> {
        let (stamp_ns, frame_id) = decoder.header()?;
        Ok(Self {
            stamp_ns,
            frame_id,
            position_m: decoder.f64_array()?,
            orientation_xyzw: decoder.f64_array()?,
            covariance: decoder.f64_array()?,
        })
    }
}
