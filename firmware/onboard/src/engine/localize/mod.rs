//! The tracker with what it needs around it: scans that wait for odometry, beams, and the poses it has found.

pub(crate) mod beams;
pub(crate) mod interpolated_poses;
pub(crate) mod odometry_history;
pub(crate) mod pending_scans;
pub(crate) mod posing;
pub(crate) mod tracker_inputs;

use biplane_matcher::{Journal, Outcome, Scan, Tracker, TrackerParams};
use biplane_recording::rig::Mount;

use crate::engine::localize::beams::BeamMaker;
use crate::engine::localize::interpolated_poses::{MatchedPose, PoseTrack};
use crate::engine::localize::odometry_history::OdometryBuffer;
use crate::engine::localize::pending_scans::WaitingScans;
use crate::engine::localize::tracker_inputs::KeptScans;
use crate::engine::out::health::MatcherHealth;
use crate::engine::out::sink::ITERATIONS_PER_SCAN;
use crate::engine::scan_data::ScanData;

/// Poses the base in the map, scan by scan.
#[derive(Debug)]
pub(crate) struct Localizer {
    waiting: WaitingScans,
    beams: BeamMaker,
    tracker: Tracker,
    poses: PoseTrack,
    laser_in_base_m: [f64; 2],
    health: MatcherHealth,
    latency_ns: i64,
    kept: Option<KeptScans>,
}

impl Localizer {
    /// For a laser with this mount, matched with these parameters.
    #[must_use]
    pub(crate) fn new(mount: &Mount, params: TrackerParams) -> Self {
        Self {
            waiting: WaitingScans::default(),
            beams: BeamMaker::new(mount),
            tracker: Tracker::new(params),
            poses: PoseTrack::new(params.motion),
            laser_in_base_m: [mount.x, mount.y],
            health: MatcherHealth::default(),
            latency_ns: 0,
            kept: None,
        }
    }

    /// A scan that waits for odometry until `due_ns`; another one that must not wait any longer comes back
    /// when too many wait.
    pub(crate) fn push(&mut self, due_ns: i64, scan: ScanData) -> Option<ScanData> {
        self.waiting.push(due_ns, scan)
    }

    /// The next scan that need not wait any longer.
    pub(crate) fn pop(
        &mut self,
        now_ns: i64,
        odometry: &OdometryBuffer,
        odometry_ns: Option<i64>,
    ) -> Option<ScanData> {
        self.waiting.pop(now_ns, odometry, odometry_ns)
    }

    /// The next scan, whatever it waits for.
    pub(crate) fn pop_any(&mut self) -> Option<ScanData> {
        self.waiting.pop_any()
    }

    /// When the oldest scan has waited long enough.
    #[must_use]
    pub(crate) fn deadline_ns(&self) -> i64 {
        self.waiting.deadline_ns()
    }

    /// The poses found.
    #[must_use]
    pub(crate) fn poses(&self) -> &PoseTrack {
        &self.poses
    }

    /// Matches a scan.
    pub(crate) fn localize(
        &mut self,
        now_ns: i64,
        scan: &ScanData,
        odometry: &OdometryBuffer,
    ) -> MatchedPose {
        let odom_from_base = odometry.at(scan.stamp_ns);
        let given = Scan {
            stamp_ns: scan.stamp_ns,
            laser_in_base_m: self.laser_in_base_m,
            beams: self.beams.beams(scan),
            twist_in_base: odometry.twist_at(scan.stamp_ns),
        };
        if let Some(kept) = &mut self.kept {
            kept.push(&given, odom_from_base);
        }
        let tracked = self.tracker.track(&given, odom_from_base);
        let unmatched = matches!(tracked.outcome, Outcome::Lost | Outcome::NoReturns);
        self.health.poses += 1;
        self.health.unmatched += u64::from(unmatched);
        self.health.last_outcome = Some(tracked.outcome);
        self.health.note_odometry(tracked.odometry);
        self.health.last_score = tracked.score;
        self.health.last_iterations = tracked.iterations;
        let map_from_base = tracked.map_from_base;
        self.health.last_pose = [map_from_base.x_m, map_from_base.y_m, map_from_base.theta_rad];
        self.latency_ns = self.latency_ns.max(now_ns.saturating_sub(scan.stamp_ns));
        let pose = MatchedPose {
            stamp_ns: scan.stamp_ns,
            map_from_base: tracked.map_from_base,
            covariance: tracked.covariance,
            odom_from_base,
        };
        self.poses.push(pose);
        pose
    }

    /// Keeps from here on the iterations of each match.
    pub(crate) fn keep_journal(&mut self) {
        self.tracker.keep_journal(ITERATIONS_PER_SCAN);
    }

    /// The iterations of the last match.
    #[must_use]
    pub(crate) fn journal(&self) -> &Journal {
        self.tracker.journal()
    }

    /// Keeps from here on what the tracker is given.
    pub(crate) fn keep_scans(&mut self) {
        self.kept = Some(KeptScans::default());
    }

    /// What was kept so far.
    pub(crate) fn take_kept_scans(&mut self) -> KeptScans {
        self.kept.take().unwrap_or_default()
    }

    /// The state since the last call.
    pub(crate) fn health(&mut self) -> MatcherHealth {
        let latency_s = std::mem::take(&mut self.latency_ns) as f64 * 1e-9;
        let (waiting, map) = (self.waiting.len(), self.tracker.map_size());
        let odometry_scale = self.tracker.odometry_scale();
        MatcherHealth { latency_s, waiting, map, odometry_scale, ..self.health }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::localize::odometry_history::OdometrySample;
    use biplane_matcher::Pose2;

    /// Standard deviations of x (m) and theta (rad) 0.4 m and 0.2 rad of odometry after the only matched
    /// pose, of which nothing is in doubt.
    fn led_on_sigma(matcher: TrackerParams) -> [f64; 2] {
        let mut odometry = OdometryBuffer::default();
        for (stamp_ns, odom_from_base) in [(0, Pose2::IDENTITY), (100_000_000, Pose2::new(0.4, 0.0, 0.2))] {
            odometry.push(OdometrySample { stamp_ns, odom_from_base });
        }
        let mut localizer = Localizer::new(&Mount::default(), matcher);
        let scan = ScanData {
            stamp_ns: 0,
            angle_min_rad: 0.0,
            angle_increment_rad: 0.01,
            turns: 1,
            time_increment_s: 0.0,
            scan_time_s: 0.01,
            range_min_m: 0.01,
            range_max_m: 8.0,
            ranges_m: heapless::Vec::new(),
        };
        let matched = localizer.localize(0, &scan, &odometry);
        let (_, covariance) = localizer.poses().at(100_000_000, &odometry).unwrap();
        [0, 2].map(|axis| (covariance[axis][axis] - matched.covariance[axis][axis]).sqrt())
    }

    #[test]
    fn a_pose_led_on_by_the_odometry_is_as_sure_as_the_motion_parameters_say() {
        let mut matcher = TrackerParams::default();
        for (name, value) in [
            ("motion.position_m_per_m", 0.5),
            ("motion.position_m_per_rad", 0.25),
            ("motion.heading_rad_per_rad", 0.75),
            ("motion.heading_rad_per_m", 0.125),
        ] {
            matcher.set(name, value).unwrap();
        }
        for (matcher, expected) in [(TrackerParams::default(), [0.05, 0.04]), (matcher, [0.25, 0.2])] {
            let found = led_on_sigma(matcher);
            assert!((0..2).all(|k| (found[k] - expected[k]).abs() < 1e-9), "{found:?} is not {expected:?}");
        }
    }
}
