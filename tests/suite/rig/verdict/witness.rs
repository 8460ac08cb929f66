//! A sink that remembers what was recorded, to be held against what the devices sent.

use biplane_onboard::{Health, Sink};
use biplane_recording::Topic;
use biplane_recording::messages::{Imu, LaserScan, Message};

/// A range that says "nothing in range"; see [`RecordedScan::ranges_mm`].
pub(crate) const NOTHING: u32 = u32::MAX;
/// A range that is none; see [`RecordedScan::ranges_mm`].
pub(crate) const INVALID: u32 = u32::MAX - 1;

/// A scan that was recorded.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct RecordedScan {
    /// When it was recorded.
    pub log_ns: i64,
    /// Its stamp.
    pub stamp_ns: i64,
    /// Longest range that it can say, millimeters.
    pub range_max_mm: u32,
    /// Its ranges in millimeters.
    pub ranges_mm: Vec<u32>,
}

/// A sample of an inertial unit that was recorded.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct RecordedSample {
    /// When it was recorded.
    pub log_ns: i64,
    /// Its stamp.
    pub stamp_ns: i64,
    /// Its turn rates and accelerations.
    pub numbers: [f32; 6],
}

/// What was recorded.
#[derive(Debug, Default)]
pub(crate) struct Witness {
    /// Scans of the horizontal and of the vertical laser.
    pub scans: [Vec<RecordedScan>; 2],
    /// When odometry was recorded.
    pub odometry_ns: Vec<i64>,
    /// Samples of the inertial unit.
    pub samples: Vec<RecordedSample>,
    /// Matched poses.
    pub poses: u64,
    /// State, once a second, and when.
    pub health: Vec<(i64, Health)>,
}

impl Sink for Witness {
    fn message(&mut self, topic: Topic, log_ns: i64, _publish_ns: i64, cdr: &[u8]) {
        match topic {
            Topic::ScanHorizontal => self.scans[0].push(scan(log_ns, cdr)),
            Topic::ScanVertical => self.scans[1].push(scan(log_ns, cdr)),
            Topic::Odom => self.odometry_ns.push(log_ns),
            Topic::Imu => self.samples.push(sample(log_ns, cdr)),
            Topic::Pose => self.poses += 1,
            _ => {}
        }
    }

    fn health(&mut self, now_ns: i64, health: &Health) {
        self.health.push((now_ns, *health));
    }

    fn dropped(&self) -> u64 {
        0
    }
}

fn scan(log_ns: i64, cdr: &[u8]) -> RecordedScan {
    let scan = LaserScan::decode(cdr).unwrap();
    let millimeters = |range_m: &f32| match *range_m {
        range_m if range_m.is_nan() => INVALID,
        f32::INFINITY => NOTHING,
        range_m => (range_m * 1000.0).round() as u32,
    };
    RecordedScan {
        log_ns,
        stamp_ns: scan.stamp_ns,
        range_max_mm: millimeters(&scan.range_max_m),
        ranges_mm: scan.ranges_m.iter().map(millimeters).collect(),
    }
}

fn sample(log_ns: i64, cdr: &[u8]) -> RecordedSample {
    let sample = Imu::decode(cdr).unwrap();
    let ([a, b, c], [d, e, f]) = (sample.angular_rad_s, sample.acceleration_m_s2);
    RecordedSample { log_ns, stamp_ns: sample.stamp_ns, numbers: [a, b, c, d, e, f].map(|x| x as f32) }
}
