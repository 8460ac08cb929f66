//! The tracker with what it needs around it: scans that wait for odometry, beams, and the poses it has found.

use biplane_matcher::{Journal, Outcome, Scan, Tracker, TrackerParams};
use biplane_recording::rig::Mount;

use super::beams::BeamMaker;
use super::kept::KeptScans;
use super::poses::{MatchedPose, PoseTrack};
use super::scan_data::ScanData;
use super::waiting::WaitingScans;
use crate::health::MatcherHealth;
use crate::journal::ITERATIONS_A_SCAN;
use crate::odometry::OdometryBuffer;

/// Poses the base in the map, scan by scan.
#[derive(Debug)]
pub struct Localiser {
    waiting: WaitingScans,
    beams: BeamMaker,
    tracker: Tracker,
    poses: PoseTrack,
    laser_in_base_m: [f64; 2],
    health: MatcherHealth,
    latency_ns: i64,
    kept: Option<KeptScans>,
}

impl Localiser {
    /// For a laser with this mount, matched with these parameters.
    #[must_use]
    pub fn new(mount: &Mount, params: TrackerParams) -> Self {
        Self {
            waiting: WaitingScans::default(),
            beams: BeamMaker::new(mount),
            tracker: Tracker::new(params),
            poses: PoseTrack::default(),
            laser_in_base_m: [mount.x, mount.y],
            health: MatcherHealth::default(),
            latency_ns: 0,
            kept: None,
        }
    }

    /// A scan that waits for odometry until `due_ns`; another one that must not wait any longer comes back when too many wait.
    pub fn push(&mut self, due_ns: i64, scan: ScanData) -> Option<ScanData> {
        self.waiting.push(due_ns, scan)
    }

    /// The next scan that need not wait any longer.
    pub fn pop(
        &mut self,
        now_ns: i64,
        odometry: &OdometryBuffer,
        odometry_ns: Option<i64>,
    ) -> Option<ScanData> {
        self.waiting.pop(now_ns, odometry, odometry_ns)
    }

    /// The next scan, whatever it waits for.
    pub fn pop_any(&mut self) -> Option<ScanData> {
        self.waiting.pop_any()
    }

    /// When the oldest scan has waited long enough.
    #[must_use]
    pub fn deadline_ns(&self) -> i64 {
        self.waiting.deadline_ns()
    }

    /// The poses found.
    #[must_use]
    pub fn poses(&self) -> &PoseTrack {
        &self.poses
    }

    /// Matches a scan.
    pub fn localise(&mut self, now_ns: i64, scan: &ScanData, odometry: &OdometryBuffer) -> MatchedPose {
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
    pub fn keep_journal(&mut self) {
        self.tracker.keep_journal(ITERATIONS_A_SCAN);
    }

    /// The iterations of the last match.
    #[must_use]
    pub fn journal(&self) -> &Journal {
        self.tracker.journal()
    }

    /// Keeps from here on what the tracker is given.
    pub fn keep_scans(&mut self) {
        self.kept = Some(KeptScans::default());
    }

    /// What was kept so far.
    pub fn take_kept_scans(&mut self) -> KeptScans {
        self.kept.take().unwrap_or_default()
    }

    /// The state since the last call.
    pub fn health(&mut self) -> MatcherHealth {
        let latency_s = std::mem::take(&mut self.latency_ns) as f64 * 1e-9;
        MatcherHealth { latency_s, waiting: self.waiting.len(), ..self.health }
    }
}
