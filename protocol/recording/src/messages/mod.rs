//! The messages of a recording as owned structs, one file a type, with their CDR bytes.
//!
//! Field names carry units; the ROS names are those without them, in the same order.

mod bytes;
pub mod cdr;
mod diagnostics;
mod imu;
mod laser_scan;
mod odometry;
mod pose;
pub mod schema;
pub mod shown;
mod tf;

pub use bytes::ByteArray;
pub use diagnostics::{DiagnosticArray, DiagnosticStatus, KeyValue};
pub use imu::Imu;
pub use laser_scan::LaserScan;
pub use odometry::Odometry;
pub use pose::PoseWithCovarianceStamped;
pub use tf::{TfMessage, TransformStamped};

use crate::messages::cdr::{CdrError, Decoder, Encoder};

/// A message type of our files.
pub trait Message: Sized {
    /// Its ROS 2 name, `package/msg/Type`.
    const TYPE: &'static str;

    /// Writes the fields after the CDR header.
    fn write(&self, encoder: &mut Encoder);

    /// Reads the fields after the CDR header.
    ///
    /// # Errors
    /// What is wrong with the bytes, and where.
    fn read(decoder: &mut Decoder) -> Result<Self, CdrError>;

    /// Writes the whole message; replaces what is in `out` and keeps its memory.
    fn encode(&self, out: &mut Vec<u8>) {
        self.write(&mut Encoder::new(out));
    }

    /// Reads a whole message.
    ///
    /// # Errors
    /// What is wrong with the bytes, and where. Never panics, and allocates no more than the bytes justify.
    fn decode(bytes: &[u8]) -> Result<Self, CdrError> {
        let mut decoder = Decoder::new(bytes)?;
        let message = Self::read(&mut decoder)?;
        decoder.finish()?;
        Ok(message)
    }

    /// Reads the bytes of a ROS 1 message.
    ///
    /// # Errors
    /// As [`Message::decode`], but for the header.
    fn decode_ros1(bytes: &[u8]) -> Result<Self, CdrError> {
        let mut decoder = Decoder::ros1(bytes);
        let message = Self::read(&mut decoder)?;
        decoder.finish()?;
        Ok(message)
    }
}

/// A message of any type that Biplane knows.
#[derive(Clone, PartialEq, Debug)]
#[expect(
    clippy::large_enum_variant,
    reason = "one at a time passes by, and a box would cost each an allocation"
)]
pub enum AnyMessage {
    /// `sensor_msgs/msg/LaserScan`.
    Scan(LaserScan),
    /// `nav_msgs/msg/Odometry`.
    Odometry(Odometry),
    /// A sample of an inertial measurement unit.
    Imu(Imu),
    /// `geometry_msgs/msg/PoseWithCovarianceStamped`.
    Pose(PoseWithCovarianceStamped),
    /// `tf2_msgs/msg/TFMessage`.
    Tf(TfMessage),
    /// `diagnostic_msgs/msg/DiagnosticArray`.
    Diagnostics(DiagnosticArray),
    /// `std_msgs/msg/UInt8MultiArray`.
    Bytes(ByteArray),
    /// Another type, or another encoding than CDR.
    Other,
}

impl AnyMessage {
    /// Decodes CDR bytes as the type of that name; [`AnyMessage::Other`] for a type that Biplane does not
    /// know.
    ///
    /// # Errors
    /// What is wrong with the bytes, and where.
    pub fn decode(type_name: &str, bytes: &[u8]) -> Result<Self, CdrError> {
        Ok(match type_name {
            LaserScan::TYPE => Self::Scan(LaserScan::decode(bytes)?),
            Odometry::TYPE => Self::Odometry(Odometry::decode(bytes)?),
            Imu::TYPE => Self::Imu(Imu::decode(bytes)?),
            PoseWithCovarianceStamped::TYPE => Self::Pose(PoseWithCovarianceStamped::decode(bytes)?),
            TfMessage::TYPE => Self::Tf(TfMessage::decode(bytes)?),
            DiagnosticArray::TYPE => Self::Diagnostics(DiagnosticArray::decode(bytes)?),
            ByteArray::TYPE => Self::Bytes(ByteArray::decode(bytes)?),
            _ => Self::Other,
        })
    }

    /// The message's own stamp: that of its header, or of the first transform. `None` where the type has
    /// none.
    #[must_use]
    pub fn stamp_ns(&self) -> Option<i64> {
        match self {
            Self::Scan(scan) => Some(scan.stamp_ns),
            Self::Odometry(odometry) => Some(odometry.stamp_ns),
            Self::Imu(imu) => Some(imu.stamp_ns),
            Self::Pose(pose) => Some(pose.stamp_ns),
            Self::Tf(tf) => tf.transforms.first().map(|transform| transform.stamp_ns),
            Self::Diagnostics(diagnostics) => Some(diagnostics.stamp_ns),
            Self::Bytes(_) | Self::Other => None,
        }
    }

    /// Adds so much to every stamp in it.
    pub(crate) fn delay(&mut self, by_ns: i64) {
        let add = |stamp_ns: &mut i64| *stamp_ns = stamp_ns.saturating_add(by_ns);
        match self {
            Self::Scan(scan) => add(&mut scan.stamp_ns),
            Self::Odometry(odometry) => add(&mut odometry.stamp_ns),
            Self::Imu(imu) => add(&mut imu.stamp_ns),
            Self::Pose(pose) => add(&mut pose.stamp_ns),
            Self::Tf(tf) => tf.transforms.iter_mut().for_each(|transform| add(&mut transform.stamp_ns)),
            Self::Diagnostics(diagnostics) => add(&mut diagnostics.stamp_ns),
            Self::Bytes(_) | Self::Other => {}
        }
    }

    /// Its CDR bytes; `None` of a message that has no stamp.
    pub(crate) fn encode_stamped(&self) -> Option<Vec<u8>> {
        let mut bytes = Vec::new();
        match self {
            Self::Scan(scan) => scan.encode(&mut bytes),
            Self::Odometry(odometry) => odometry.encode(&mut bytes),
            Self::Imu(imu) => imu.encode(&mut bytes),
            Self::Pose(pose) => pose.encode(&mut bytes),
            Self::Tf(tf) => tf.encode(&mut bytes),
            Self::Diagnostics(diagnostics) => diagnostics.encode(&mut bytes),
            Self::Bytes(_) | Self::Other => return None,
        }
        Some(bytes)
    }
}
