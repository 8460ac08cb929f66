//! `nav_msgs/msg/Odometry`: pose of the base in the odometry frame, and its speed in its own frame.

use super::Message;
use crate::messages::cdr::{CdrError, Decoder, Encoder};

/// What a base says of its own motion.
#[derive(Clone, PartialEq, Debug)]
pub struct Odometry {
    /// When it was sampled, in ns.
    pub stamp_ns: i64,
    /// The frame of the pose, `odom`.
    pub frame_id: String,
    /// The frame of the speeds and the thing that moves, `base_link`.
    pub child_frame_id: String,
    /// Position in `frame_id`, in m.
    pub position_m: [f64; 3],
    /// Orientation in `frame_id`, a unit quaternion.
    pub orientation_xyzw: [f64; 4],
    /// Row-major 6 x 6 over x, y, z, roll, pitch, yaw, in m and rad.
    pub pose_covariance: [f64; 36],
    /// Velocity in `child_frame_id`, in m/s.
    pub linear_m_s: [f64; 3],
    /// Rotation speed in `child_frame_id`, in rad/s.
    pub angular_rad_s: [f64; 3],
    /// Row-major 6 x 6 as the pose's, in m/s and rad/s.
    pub twist_covariance: [f64; 36],
}

impl Default for Odometry {
    /// At rest at the origin, no frames.
    fn default() -> Self {
        Self {
            stamp_ns: 0,
            frame_id: String::new(),
            child_frame_id: String::new(),
            position_m: [0.0; 3],
            orientation_xyzw: [0.0, 0.0, 0.0, 1.0],
            pose_covariance: [0.0; 36],
            linear_m_s: [0.0; 3],
            angular_rad_s: [0.0; 3],
            twist_covariance: [0.0; 36],
        }
    }
}

impl Message for Odometry {
    const TYPE: &'static str = "nav_msgs/msg/Odometry";

    fn write(&self, encoder: &mut Encoder) {
        encoder.header(self.stamp_ns, &self.frame_id);
        encoder.string(&self.child_frame_id);
        encoder.f64_array(&self.position_m);
        encoder.f64_array(&self.orientation_xyzw);
        encoder.f64_array(&self.pose_covariance);
        encoder.f64_array(&self.linear_m_s);
        encoder.f64_array(&self.angular_rad_s);
        encoder.f64_array(&self.twist_covariance);
    }

    fn read(decoder: &mut Decoder) -> Result<Self, CdrError> {
        let (stamp_ns, frame_id) = decoder.header()?;
        Ok(Self {
            stamp_ns,
            frame_id,
            child_frame_id: decoder.string()?,
            position_m: decoder.f64_array()?,
            orientation_xyzw: decoder.f64_array()?,
            pose_covariance: decoder.f64_array()?,
            linear_m_s: decoder.f64_array()?,
            angular_rad_s: decoder.f64_array()?,
            twist_covariance: decoder.f64_array()?,
        })
    }
}
