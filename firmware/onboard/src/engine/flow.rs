//! The way of a measurement through the engine: stamped, recorded, waiting for what comes a moment later, posed.

use biplane_recording::{Port, Topic};

use super::Engine;
use super::scan_data::ScanData;
use super::waiting::WAIT_OF_LINES_NS;
use crate::odometry::OdometrySample;
use crate::session::base::OdometryReading;
use crate::session::laser::ScanReading;
use crate::sink::Sink;

impl<S: Sink> Engine<S> {
    /// Whether a laser may be at work on its EEPROM, which takes up to 15 s: whoever stops waits that long.
    #[must_use]
    pub fn is_writing(&self) -> bool {
        let vertical = self.vertical.as_ref().is_some_and(|laser| laser.line.session.is_writing());
        self.horizontal.line.session.is_writing() || vertical
    }

    /// Gives the sink from here on the iterations of every match.
    pub fn keep_journal(&mut self) {
        self.localiser.keep_journal();
    }

    pub(super) fn scan(&mut self, now_ns: i64, port: Port, reading: &ScanReading) {
        self.stranger_of(port).measured();
        let (topic, data) = match (port, &mut self.vertical) {
            (Port::Vertical, Some(vertical)) => (Topic::ScanVertical, vertical.stamped(now_ns, reading)),
            _ => (Topic::ScanHorizontal, self.horizontal.stamped(now_ns, reading)),
        };
        self.publisher.scan(now_ns, topic, &data, &reading.intensities);
        self.take_scan(now_ns, topic, data, WAIT_OF_LINES_NS);
    }

    /// A scan, posed as soon as odometry covers it, and after `wait_ns` without.
    pub(super) fn take_scan(&mut self, now_ns: i64, topic: Topic, data: ScanData, wait_ns: i64) {
        if topic == Topic::ScanVertical {
            self.mounting.fan_scan(&data);
            if let Some(oldest_ns) = self.waiting_verticals.push(now_ns, data.stamp_ns) {
                self.pose_vertical(now_ns, oldest_ns);
            }
        } else if let Some(oldest) = self.localiser.push(now_ns.saturating_add(wait_ns), data) {
            self.localise(now_ns, &oldest);
        }
    }

    pub(super) fn odometry(&mut self, now_ns: i64, reading: &OdometryReading) {
        self.stranger_of(Port::Base).measured();
        let stamp_ns = self.base.stamp_ns(now_ns, reading);
        let sample = OdometrySample { stamp_ns, odom_from_base: reading.odom_from_base };
        self.take_odometry(now_ns, sample);
        let twist_in_base = self.odometry.twist_at(stamp_ns);
        self.publisher.odometry(now_ns, stamp_ns, &reading.odom_from_base, twist_in_base);
    }

    pub(super) fn take_odometry(&mut self, now_ns: i64, sample: OdometrySample) {
        if sample.odom_from_base.is_finite() {
            self.odometry.push(sample);
            self.odometry_ns = Some(now_ns);
        }
    }

    /// Lets go on whatever has what it waited for.
    pub(super) fn settle(&mut self, now_ns: i64) {
        while let Some(scan) = self.localiser.pop(now_ns, &self.odometry, self.odometry_ns) {
            self.localise(now_ns, &scan);
        }
        while let Some(stamp_ns) = self.waiting_verticals.pop(now_ns, self.localiser.poses()) {
            self.pose_vertical(now_ns, stamp_ns);
        }
    }

    pub(super) fn localise(&mut self, now_ns: i64, scan: &ScanData) {
        let pose = self.localiser.localise(now_ns, scan, &self.odometry);
        self.mounting.level_scan(scan, &pose);
        let odom_from_base = pose.odom_from_base.unwrap_or_default();
        let map_from_odom = pose.map_from_base * odom_from_base.inverse();
        self.publisher.pose(now_ns, Topic::Pose, pose.stamp_ns, &pose.map_from_base, &pose.covariance);
        self.publisher.frames(now_ns, pose.stamp_ns, &map_from_odom, &odom_from_base);
        let iterations = self.localiser.journal().iterations();
        if !iterations.is_empty() {
            self.publisher.sink().iterations(pose.stamp_ns, iterations);
        }
    }

    pub(super) fn pose_vertical(&mut self, now_ns: i64, stamp_ns: i64) {
        // Without any matched pose there is no map yet.
        if let Some((map_from_base, covariance)) = self.localiser.poses().at(stamp_ns, &self.odometry) {
            self.publisher.pose(now_ns, Topic::PoseVertical, stamp_ns, &map_from_base, &covariance);
            self.poses_vertical += 1;
            self.mounting.fan_posed(stamp_ns, &map_from_base, self.odometry.at(stamp_ns));
        }
    }
}
