//! The topics of a recording: name, message type and delivery of each (REP 105 frames).

use crate::messages::{
    ByteArray, DiagnosticArray, Imu, LaserScan, Message, Odometry, PoseWithCovarianceStamped, TfMessage,
};

/// The world frame of a run: `base_link` at its first matched scan.
pub const FRAME_MAP: &str = "map";
/// The frame in which the base's own odometry counts; drifts against [`FRAME_MAP`].
pub const FRAME_ODOM: &str = "odom";
/// The robot: on the floor (z = 0), x forward, y left, z up.
pub const FRAME_BASE: &str = "base_link";
/// The localizing laser's own frame: x along its middle beam, y to its left.
pub const FRAME_LASER_HORIZONTAL: &str = "laser_horizontal";
/// The building-facing laser's own frame: x along its middle beam, y to its left.
pub const FRAME_LASER_VERTICAL: &str = "laser_vertical";
/// The inertial unit's own frame.
pub const FRAME_IMU: &str = "imu";

/// A device's serial line.
#[derive(Copy, Clone, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
pub enum Port {
    /// The laser that localizes.
    Horizontal,
    /// The laser that sees the building.
    Vertical,
    /// The mobile base.
    Base,
    /// The inertial unit.
    Imu,
}

/// Which way bytes went on a serial line.
#[derive(Copy, Clone, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
pub enum Direction {
    /// From the device.
    Rx,
    /// To the device.
    Tx,
}

/// A topic that Biplane writes.
#[derive(Copy, Clone, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
pub enum Topic {
    /// Scans of the localizing laser.
    ScanHorizontal,
    /// Scans of the building-facing laser.
    ScanVertical,
    /// The base's own odometry.
    Odom,
    /// An inertial measurement unit, of the rig, of an import or a simulated drive.
    Imu,
    /// Pose of `base_link` in `map` at each horizontal scan's stamp.
    Pose,
    /// The same at each vertical scan's stamp.
    PoseVertical,
    /// The incremental poses that an optimized recording replaced.
    PoseIncremental,
    /// `map` -> `odom` and `odom` -> `base_link`.
    Tf,
    /// The lasers' mounts.
    TfStatic,
    /// Health, once a second.
    Diagnostics,
    /// Raw bytes of a serial line, one message a read.
    Serial(Port, Direction),
}

/// How a topic is delivered in ROS 2: whether late subscribers get the last message.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
pub enum Durability {
    /// Kept for subscribers that come late.
    TransientLocal,
    /// Not kept.
    Volatile,
}

impl Port {
    /// All lines of a rig.
    pub const ALL: [Self; 4] = [Self::Horizontal, Self::Vertical, Self::Base, Self::Imu];

    /// The word for this line in topic names and in `rig.toml`: `horizontal`, `vertical`, `base` or
    /// `imu`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Horizontal => "horizontal",
            Self::Vertical => "vertical",
            Self::Base => "base",
            Self::Imu => "imu",
        }
    }

    /// Its place in [`Port::ALL`]. Written out, so that a port without a place does not compile.
    #[must_use]
    pub const fn index(self) -> usize {
        match self {
            Self::Horizontal => 0,
            Self::Vertical => 1,
            Self::Base => 2,
            Self::Imu => 3,
        }
    }
}

impl Direction {
    /// Both directions.
    pub const ALL: [Self; 2] = [Self::Rx, Self::Tx];

    /// Its place in [`Direction::ALL`].
    #[must_use]
    pub const fn index(self) -> usize {
        match self {
            Self::Rx => 0,
            Self::Tx => 1,
        }
    }
}

impl Topic {
    /// The topic of a laser's scans; that of the localizing laser for a port that is no laser's.
    #[must_use]
    pub fn scan_of(port: Port) -> Self {
        if port == Port::Vertical { Self::ScanVertical } else { Self::ScanHorizontal }
    }

    /// Every topic, in a fixed order.
    pub const ALL: [Self; 18] = [
        Self::ScanHorizontal,
        Self::ScanVertical,
        Self::Odom,
        Self::Imu,
        Self::Pose,
        Self::PoseVertical,
        Self::PoseIncremental,
        Self::Tf,
        Self::TfStatic,
        Self::Diagnostics,
        Self::Serial(Port::Horizontal, Direction::Rx),
        Self::Serial(Port::Horizontal, Direction::Tx),
        Self::Serial(Port::Vertical, Direction::Rx),
        Self::Serial(Port::Vertical, Direction::Tx),
        Self::Serial(Port::Base, Direction::Rx),
        Self::Serial(Port::Base, Direction::Tx),
        Self::Serial(Port::Imu, Direction::Rx),
        Self::Serial(Port::Imu, Direction::Tx),
    ];

    /// The name in the file, for example `/scan/horizontal`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::ScanHorizontal => "/scan/horizontal",
            Self::ScanVertical => "/scan/vertical",
            Self::Odom => "/odom",
            Self::Imu => "/imu",
            Self::Pose => "/pose",
            Self::PoseVertical => "/pose/vertical",
            Self::PoseIncremental => "/pose_incremental",
            Self::Tf => "/tf",
            Self::TfStatic => "/tf_static",
            Self::Diagnostics => "/diagnostics",
            Self::Serial(Port::Horizontal, Direction::Rx) => "/serial/horizontal/rx",
            Self::Serial(Port::Horizontal, Direction::Tx) => "/serial/horizontal/tx",
            Self::Serial(Port::Vertical, Direction::Rx) => "/serial/vertical/rx",
            Self::Serial(Port::Vertical, Direction::Tx) => "/serial/vertical/tx",
            Self::Serial(Port::Base, Direction::Rx) => "/serial/base/rx",
            Self::Serial(Port::Base, Direction::Tx) => "/serial/base/tx",
            Self::Serial(Port::Imu, Direction::Rx) => "/serial/imu/rx",
            Self::Serial(Port::Imu, Direction::Tx) => "/serial/imu/tx",
        }
    }

    /// Its place in [`Topic::ALL`]. Written out, so that a topic without a place does not compile.
    #[must_use]
    pub const fn index(self) -> usize {
        match self {
            Self::ScanHorizontal => 0,
            Self::ScanVertical => 1,
            Self::Odom => 2,
            Self::Imu => 3,
            Self::Pose => 4,
            Self::PoseVertical => 5,
            Self::PoseIncremental => 6,
            Self::Tf => 7,
            Self::TfStatic => 8,
            Self::Diagnostics => 9,
            Self::Serial(port, direction) => 10 + Direction::ALL.len() * port.index() + direction.index(),
        }
    }

    /// The topic of that name; `None` for a name that Biplane does not write.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|topic| topic.name() == name)
    }

    /// The ROS 2 message type, for example `sensor_msgs/msg/LaserScan`.
    #[must_use]
    pub const fn type_name(self) -> &'static str {
        match self {
            Self::ScanHorizontal | Self::ScanVertical => LaserScan::TYPE,
            Self::Odom => Odometry::TYPE,
            Self::Imu => Imu::TYPE,
            Self::Pose | Self::PoseVertical | Self::PoseIncremental => PoseWithCovarianceStamped::TYPE,
            Self::Tf | Self::TfStatic => TfMessage::TYPE,
            Self::Diagnostics => DiagnosticArray::TYPE,
            Self::Serial(..) => ByteArray::TYPE,
        }
    }

    /// How the topic is delivered when the file is played back in ROS 2.
    #[must_use]
    pub const fn durability(self) -> Durability {
        match self {
            Self::TfStatic => Durability::TransientLocal,
            _ => Durability::Volatile,
        }
    }

    /// Whether what is said on the topic holds until it is said anew, so that a later part of a recording
    /// must repeat it.
    #[must_use]
    pub fn is_latched(self) -> bool {
        matches!(self.durability(), Durability::TransientLocal)
    }

    /// The value of the channel's `offered_qos_profiles`: YAML as `ros2 bag` writes it. The policies stand as
    /// numbers, because Humble and Iron read nothing else (history 1 = keep last, reliability 1 = reliable,
    /// durability 1 = transient local and 2 = volatile, liveliness 1 = automatic; the longest duration means
    /// none).
    #[must_use]
    pub fn offered_qos_profiles(self) -> String {
        let (depth, durability) = match self.durability() {
            Durability::TransientLocal => (1, 1),
            Durability::Volatile => (10, 2),
        };
        let forever = "sec: 9223372036\n    nsec: 854775807";
        format!(
            "- history: 1\n  depth: {depth}\n  reliability: 1\n  durability: {durability}\n  deadline:\n    {forever}\n  \
             lifespan:\n    {forever}\n  liveliness: 1\n  liveliness_lease_duration:\n    {forever}\n  \
             avoid_ros_namespace_conventions: false"
        )
    }
}

#[cfg(test)]
mod tests {
    use super::{Direction, Port, Topic};

    #[test]
    fn every_topic_is_found_again_by_its_name() {
        for topic in Topic::ALL {
            assert_eq!(Topic::from_name(topic.name()), Some(topic), "{topic:?}");
        }
        assert_eq!(Topic::from_name("/scan"), None);
        assert_eq!(Topic::from_name("odom"), None);
    }

    #[test]
    fn ports_directions_and_topics_stand_at_their_places() {
        assert_eq!(Port::ALL.map(Port::index), [0, 1, 2, 3]);
        assert_eq!(Direction::ALL.map(Direction::index), [0, 1]);
        for (place, topic) in Topic::ALL.into_iter().enumerate() {
            assert_eq!(topic.index(), place, "{topic:?}");
        }
    }

    #[test]
    fn serial_topics_are_named_after_port_and_direction() {
        for port in Port::ALL {
            for (direction, end) in [(Direction::Rx, "rx"), (Direction::Tx, "tx")] {
                let name = Topic::Serial(port, direction).name();
                assert_eq!(name, format!("/serial/{}/{end}", port.name()));
            }
        }
    }

    #[test]
    fn qos_policies_are_numbers_and_only_tf_static_is_kept_for_late_subscribers() {
        for topic in Topic::ALL {
            let qos = topic.offered_qos_profiles();
            let kept = qos.contains("depth: 1\n") && qos.contains("durability: 1\n");
            assert_eq!(kept, topic == Topic::TfStatic, "{qos}");
            assert!(!qos.contains("keep_last") && !qos.contains("reliable"), "{qos}");
        }
    }
}
