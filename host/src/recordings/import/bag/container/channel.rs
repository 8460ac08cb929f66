//! What a bag says of a message besides its bytes: topic, type and encoding.

use std::ops::ControlFlow;

/// A message larger than this is none of a laser, a base or a tree of frames, bytes.
pub(crate) const LONGEST_MESSAGE: u64 = 1 << 26;
/// Takes a message; says whether to go on.
pub(crate) type Visit<'a> = dyn FnMut(&RawMessage<'_>) -> ControlFlow<()> + 'a;

/// What a message is to an import.
#[derive(Copy, Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Kind {
    Scan,
    MultiEchoScan,
    Odometry,
    Tf,
    Imu,
    Other,
}

/// How a message's bytes lie.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub(crate) enum Encoding {
    Ros1,
    Cdr,
}

/// A stream of messages of one type.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Channel {
    /// Its topic, as written.
    pub topic: String,
    /// Its type as ROS 1 writes it: `sensor_msgs/LaserScan`.
    pub type_name: String,
    /// What it is to an import.
    pub kind: Kind,
    /// How its bytes lie.
    pub encoding: Encoding,
    /// Why messages of a type that would be taken are not.
    pub refused: Option<String>,
}

/// A message as it lies in the bag.
#[derive(Debug)]
pub(crate) struct RawMessage<'a> {
    pub channel: &'a Channel,
    /// When the recorder got it, ns.
    pub received_ns: i64,
    /// Its bytes; empty where nobody takes them.
    pub bytes: &'a [u8],
}

/// Types that are taken, with the sums of their definitions in ROS 1.
const TYPES: [(&str, Kind, &str); 6] = [
    ("sensor_msgs/LaserScan", Kind::Scan, "90c7ef2dc6895d81024acba2ac42f369"),
    ("sensor_msgs/MultiEchoLaserScan", Kind::MultiEchoScan, "6fefb0c6da89d7c8abe4b339f5c2f8fb"),
    ("nav_msgs/Odometry", Kind::Odometry, "cd5e73d190d741a2f92e81eda573aca7"),
    ("tf2_msgs/TFMessage", Kind::Tf, "94810edda583a504dfda3829e70d7eec"),
    ("tf/tfMessage", Kind::Tf, "94810edda583a504dfda3829e70d7eec"),
    ("sensor_msgs/Imu", Kind::Imu, "6a62c6daae103f4ff57a132d6f95cec2"),
];

impl Channel {
    /// Of a ROS 1 connection. The sum decides: another one is another layout.
    pub(crate) fn ros1(topic: &str, type_name: &str, md5sum: &str) -> Self {
        let mut channel = Self::of(topic, type_name, Encoding::Ros1);
        let expected = TYPES.iter().find(|(name, ..)| *name == type_name).map(|(.., sum)| *sum);
        if let Some(expected) = expected.filter(|sum| *sum != md5sum && md5sum != "*") {
            channel.refuse(format!("its definition has the sum {md5sum}, expected {expected}"));
        }
        channel
    }

    /// Of a ROS 2 topic: the name alone tells, the layouts have stayed the same.
    pub(crate) fn ros2(topic: &str, type_name: &str, encoding: &str) -> Self {
        let type_name = type_name.replacen("/msg/", "/", 1);
        match encoding {
            "cdr" => Self::of(topic, &type_name, Encoding::Cdr),
            "ros1" => Self::of(topic, &type_name, Encoding::Ros1),
            other => {
                let mut channel = Self::of(topic, &type_name, Encoding::Cdr);
                channel.refuse(format!("its encoding is {other:?}, expected \"cdr\""));
                channel
            }
        }
    }

    fn of(topic: &str, type_name: &str, encoding: Encoding) -> Self {
        let kind = TYPES.iter().find(|(name, ..)| *name == type_name).map_or(Kind::Other, |found| found.1);
        let (topic, type_name) = (topic.to_owned(), type_name.to_owned());
        Self { topic, type_name, kind, encoding, refused: None }
    }

    fn refuse(&mut self, why: String) {
        if self.kind != Kind::Other {
            self.kind = Kind::Other;
            self.refused = Some(why);
        }
    }
}
