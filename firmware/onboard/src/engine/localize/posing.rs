//! The way of a measurement from its stamp to a pose: it waits for what comes a moment later, is matched, and
//! published.

use biplane_matcher::TrackerParams;
use biplane_recording::{Port, Rig, Topic};

use crate::engine::localize::Localizer;
use crate::engine::localize::odometry_history::{OdometryBuffer, OdometrySample};
use crate::engine::localize::pending_scans::WaitingStamps;
use crate::engine::mount_check::MountWatch;
use crate::engine::out::health::MatcherHealth;
use crate::engine::out::publisher::Publisher;
use crate::engine::out::sink::Sink;
use crate::engine::scan_data::ScanData;
use crate::types::run_report::{OdometryReport, RunReport};

/// Poses scans, as soon as what they need is there.
#[derive(Debug)]
pub(crate) struct Posing {
    pub(crate) localizer: Localizer,
    pub(crate) odometry: OdometryBuffer,
    pub(crate) mounting: MountWatch,
    /// When the last odometry came.
    odometry_ns: Option<i64>,
    waiting_verticals: WaitingStamps,
    /// Poses of vertical scans so far.
    poses_vertical: u64,
    has_vertical: bool,
}

impl Posing {
    /// For the lasers of this rig, matched with these parameters.
    pub(crate) fn new(rig: &Rig, matcher: TrackerParams) -> Self {
        Self {
            localizer: Localizer::new(&rig.horizontal.mount, matcher),
            odometry: OdometryBuffer::default(),
            mounting: MountWatch::new(rig),
            odometry_ns: None,
            waiting_verticals: WaitingStamps::default(),
            poses_vertical: 0,
            has_vertical: rig.vertical.is_some(),
        }
    }

    /// When something that waits has waited long enough.
    pub(crate) fn deadline_ns(&self) -> i64 {
        self.localizer.deadline_ns().min(self.waiting_verticals.deadline_ns())
    }

    /// The state of the matcher since the last call.
    pub(crate) fn health(&mut self) -> MatcherHealth {
        MatcherHealth { waiting_vertical: self.waiting_verticals.len(), ..self.localizer.health() }
    }

    /// A scan of the localizing laser, posed as soon as odometry covers it, and at `due_ns` without.
    pub(crate) fn take_scan<S: Sink>(
        &mut self,
        out: &mut Publisher<S>,
        now_ns: i64,
        data: ScanData,
        due_ns: i64,
    ) {
        if let Some(oldest) = self.localizer.push(due_ns, data) {
            self.localize(out, now_ns, &oldest);
        }
    }

    /// A scan of the laser that sees the building, posed between the poses of the other.
    pub(crate) fn take_vertical<S: Sink>(&mut self, out: &mut Publisher<S>, now_ns: i64, data: &ScanData) {
        self.mounting.vertical_scan(data);
        if let Some(oldest_ns) = self.waiting_verticals.push(now_ns, data.stamp_ns) {
            self.pose_vertical(out, now_ns, oldest_ns);
        }
    }

    /// A report of the base.
    pub(crate) fn take_odometry(&mut self, now_ns: i64, sample: OdometrySample) {
        if sample.odom_from_base.is_finite() {
            self.odometry.push(sample);
            self.odometry_ns = Some(now_ns);
        }
    }

    /// Lets go on whatever has what it waited for.
    pub(crate) fn settle<S: Sink>(&mut self, out: &mut Publisher<S>, now_ns: i64) {
        while let Some(scan) = self.localizer.pop(now_ns, &self.odometry, self.odometry_ns) {
            self.localize(out, now_ns, &scan);
        }
        while let Some(stamp_ns) = self.waiting_verticals.pop(now_ns, self.localizer.poses()) {
            self.pose_vertical(out, now_ns, stamp_ns);
        }
    }

    /// The input ends: everything that waits goes on with what is known.
    pub(crate) fn finish<S: Sink>(&mut self, out: &mut Publisher<S>, now_ns: i64) {
        while let Some(scan) = self.localizer.pop_any() {
            self.localize(out, now_ns, &scan);
        }
        while let Some(stamp_ns) = self.waiting_verticals.pop_any() {
            self.pose_vertical(out, now_ns, stamp_ns);
        }
    }

    /// Adds the poses, and how the lasers sit.
    pub(crate) fn account(&mut self, report: &mut RunReport) {
        let matcher = self.localizer.health();
        report.recorded.poses = matcher.poses;
        report.recorded.unmatched = matcher.unmatched;
        report.map.map_filled_percent = matcher.map_filled_percent();
        report.map.map_forgotten_tiles = matcher.map.forgotten;
        report.odometry = OdometryReport::new(&matcher.odometry_scale);
        report.recorded.poses_vertical = self.poses_vertical;
        report.mounting.mounting_horizontal = self.mounting.mounting(Port::Horizontal).words();
        report.mounting.mounting_vertical =
            self.has_vertical.then(|| self.mounting.mounting(Port::Vertical).words());
    }

    fn localize<S: Sink>(&mut self, out: &mut Publisher<S>, now_ns: i64, scan: &ScanData) {
        let pose = self.localizer.localize(now_ns, scan, &self.odometry);
        self.mounting.level_scan(scan, &pose);
        let odom_from_base = pose.odom_from_base.unwrap_or_default();
        let map_from_odom = pose.map_from_base * odom_from_base.inverse();
        out.pose(now_ns, Topic::Pose, pose.stamp_ns, &pose.map_from_base, &pose.covariance);
        out.frames(now_ns, pose.stamp_ns, &map_from_odom, &odom_from_base);
        let iterations = self.localizer.journal().iterations();
        if !iterations.is_empty() {
            out.sink().iterations(pose.stamp_ns, iterations);
        }
    }

    fn pose_vertical<S: Sink>(&mut self, out: &mut Publisher<S>, now_ns: i64, stamp_ns: i64) {
        // Without any matched pose there is no map yet.
        if let Some((map_from_base, covariance)) = self.localizer.poses().at(stamp_ns, &self.odometry) {
            out.pose(now_ns, Topic::PoseVertical, stamp_ns, &map_from_base, &covariance);
            self.poses_vertical += 1;
            self.mounting.vertical_posed(stamp_ns, &map_from_base, self.odometry.at(stamp_ns));
        }
    }
}
