//! Measurements of another recording, which come decoded and with their stamps instead of as bytes.

use biplane_matcher::Pose2;
use biplane_recording::msg::{LaserScan, Odometry};
use biplane_recording::{Port, Topic};

use super::Engine;
use super::scan_data::ScanData;
use super::waiting::WAIT_OF_RECORDINGS_NS;
use crate::odometry::OdometrySample;
use crate::sink::Sink;

impl<S: Sink> Engine<S> {
    /// A scan of another recording, decoded.
    pub fn decoded_scan(&mut self, now_ns: i64, port: Port, scan: &LaserScan) {
        let now_ns = self.begin(now_ns);
        if port == Port::Vertical && self.rig.vertical.is_none() {
            // Without its mount a scan has no place: passed on, it would look posed.
            self.unknown_scans += 1;
            return;
        }
        let (topic, meter, laser) = match port {
            Port::Vertical => (Topic::ScanVertical, 1, self.rig.vertical.as_ref()),
            _ => (Topic::ScanHorizontal, 0, Some(&self.rig.horizontal)),
        };
        let data = ScanData::of_message(scan, laser);
        if let Some(meter) = self.decoded.get_mut(meter) {
            meter.count(now_ns, data.stamp_ns);
        }
        self.publisher.forward(now_ns, topic, scan.stamp_ns, scan);
        self.take_scan(now_ns, topic, data, WAIT_OF_RECORDINGS_NS);
        self.settle(now_ns);
    }

    /// An odometry report of another recording, decoded.
    pub fn decoded_odometry(&mut self, now_ns: i64, odometry: &Odometry) {
        let now_ns = self.begin(now_ns);
        self.decoded[2].count(now_ns, odometry.stamp_ns);
        self.publisher.forward(now_ns, Topic::Odom, odometry.stamp_ns, odometry);
        let [x_m, y_m, _] = odometry.position_m;
        let odom_from_base = Pose2::new(x_m, y_m, heading_rad(odometry.orientation_xyzw));
        self.take_odometry(now_ns, OdometrySample { stamp_ns: odometry.stamp_ns, odom_from_base });
        self.settle(now_ns);
    }
}

/// Heading of a rotation about z; other parts of the rotation are left out.
pub(super) fn heading_rad([x, y, z, w]: [f64; 4]) -> f64 {
    (2.0 * (w * z + x * y)).atan2(1.0 - 2.0 * (y * y + z * z))
}
