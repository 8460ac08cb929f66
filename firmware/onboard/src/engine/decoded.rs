//! Measurements of another recording: decoded before, posed anew or passed on.

use biplane_geometry::pose3::heading_of_quaternion_rad;
use biplane_matcher::Pose2;
use biplane_recording::messages::{Imu, LaserScan, Odometry};
use biplane_recording::{Port, Topic};

use crate::engine::Engine;
use crate::engine::localize::odometry_history::OdometrySample;
use crate::engine::localize::pending_scans::WAIT_OF_RECORDINGS_NS;
use crate::engine::out::sink::Sink;
use crate::engine::scan_data::ScanData;

impl<S: Sink> Engine<S> {
    /// A scan of another recording, decoded.
    pub fn decoded_scan(&mut self, now_ns: i64, port: Port, scan: &LaserScan) {
        let now_ns = self.begin(now_ns);
        if port == Port::Vertical && self.rig.vertical.is_none() {
            // Without its mount a scan has no place: passed on, it would look posed.
            self.without_line.unknown_scans += 1;
            return;
        }
        let (topic, port, laser) = match port {
            Port::Vertical => (Topic::ScanVertical, port, self.rig.vertical.as_ref()),
            _ => (Topic::ScanHorizontal, Port::Horizontal, Some(&self.rig.horizontal)),
        };
        let data = ScanData::of_message(scan, laser);
        self.without_line.count(port, now_ns, data.stamp_ns);
        self.publisher.forward(now_ns, topic, scan.stamp_ns, scan);
        self.take_scan(now_ns, topic, data, WAIT_OF_RECORDINGS_NS);
        self.settle(now_ns);
    }

    /// An odometry report of another recording, decoded.
    pub fn decoded_odometry(&mut self, now_ns: i64, odometry: &Odometry) {
        let now_ns = self.begin(now_ns);
        self.without_line.count(Port::Base, now_ns, odometry.stamp_ns);
        self.publisher.forward(now_ns, Topic::Odom, odometry.stamp_ns, odometry);
        let [x_m, y_m, _] = odometry.position_m;
        let odom_from_base = Pose2::new(x_m, y_m, heading_of_quaternion_rad(odometry.orientation_xyzw));
        self.posing.take_odometry(now_ns, OdometrySample { stamp_ns: odometry.stamp_ns, odom_from_base });
        self.settle(now_ns);
    }

    /// A sample of an inertial unit: the matcher makes no use of it, what refines poses later does.
    pub fn decoded_inertial(&mut self, now_ns: i64, sample: &Imu) {
        let now_ns = self.begin(now_ns);
        self.without_line.count(Port::Imu, now_ns, sample.stamp_ns);
        self.publisher.forward(now_ns, Topic::Imu, sample.stamp_ns, sample);
    }
}
