//! `tf2_msgs/msg/TFMessage`: transforms between frames.

use super::Message;
use crate::messages::cdr::{CdrError, Decoder, Encoder};

/// The pose of `child_frame_id` in `frame_id`: p_frame = rotation * p_child + translation.
#[derive(Clone, PartialEq, Debug)]
pub struct TransformStamped {
    /// The moment of the transform, in ns.
    pub stamp_ns: i64,
    /// The parent frame.
    pub frame_id: String,
    /// The child frame.
    pub child_frame_id: String,
    /// The child's origin in the parent, in m.
    pub translation_m: [f64; 3],
    /// The child's orientation in the parent, a unit quaternion.
    pub rotation_xyzw: [f64; 4],
}

impl Default for TransformStamped {
    /// The identity, no frames.
    fn default() -> Self {
        Self {
            stamp_ns: 0,
            frame_id: String::new(),
            child_frame_id: String::new(),
            translation_m: [0.0; 3],
            rotation_xyzw: [0.0, 0.0, 0.0, 1.0],
        }
    }
}

/// Transforms that were published together.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct TfMessage {
    /// The transforms.
    pub transforms: Vec<TransformStamped>,
}

/// The least bytes a transform takes: stamp 8, two empty strings 4 each, seven numbers of 8.
const TRANSFORM_MIN_SIZE: usize = 8 + 4 + 4 + 56;

impl Message for TfMessage {
    const TYPE: &'static str = "tf2_msgs/msg/TFMessage";

    fn write(&self, encoder: &mut Encoder) {
        encoder.count(self.transforms.len());
        for transform in &self.transforms {
            encoder.header(transform.stamp_ns, &transform.frame_id);
            encoder.string(&transform.child_frame_id);
            encoder.f64_array(&transform.translation_m);
            encoder.f64_array(&transform.rotation_xyzw);
        }
    }

    fn read(decoder: &mut Decoder) -> Result<Self, CdrError> {
        let count = decoder.count(TRANSFORM_MIN_SIZE)?;
        let mut transforms = Vec::with_capacity(count);
        for _ in 0..count {
            let (stamp_ns, frame_id) = decoder.header()?;
            transforms.push(TransformStamped {
                stamp_ns,
                frame_id,
                child_frame_id: decoder.string()?,
                translation_m: decoder.f64_array()?,
                rotation_xyzw: decoder.f64_array()?,
            });
        }
        Ok(Self { transforms })
    }
}
