//! Follows the base through scans and odometry: one pose with covariance for every scan.
//!
//! Frames: `map` is the base's frame at the first scan; `odom` is the odometry's own frame. Units: metres, radians.

use crate::params::TrackerParams;
use crate::pose::Pose2;
use crate::scan::Scan;

/// What became of a scan.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
pub enum Outcome {
    /// The first usable scan: it defines the map.
    First,
    /// Matched in every direction.
    Matched,
    /// Matched, but some direction (along a bare corridor) is left to the odometry; the covariance says which.
    Weak,
    /// No match found: the pose follows the odometry, the covariance has grown.
    Lost,
    /// The scan holds no usable range: the pose follows the odometry, the covariance has grown.
    NoReturns,
}

/// The pose of one scan.
#[derive(Copy, Clone, PartialEq, Debug)]
pub struct Tracked {
    /// The base in the map at the scan's stamp.
    pub map_from_base: Pose2,
    /// Covariance of x (m), y (m) and theta (rad) in the map's axes.
    pub covariance: [[f64; 3]; 3],
    /// How well the scan fits, 0 (nothing) to 1 (every beam on a mapped surface).
    pub score: f64,
    /// Iterations of the alignment.
    pub iterations: u32,
    /// What became of the scan.
    pub outcome: Outcome,
}

/// Matches scans one after the other; everything is allocated by [`Tracker::new`].
#[derive(Clone, Debug)]
pub struct Tracker {
    params: TrackerParams,
    last_odom_from_base: Option<Pose2>,
    map_from_base: Option<Pose2>,
}

impl Tracker {
    /// A tracker that has seen nothing.
    #[must_use]
    pub fn new(params: TrackerParams) -> Self {
        Self { params, last_odom_from_base: None, map_from_base: None }
    }

    /// The parameters it was made with.
    #[must_use]
    pub fn params(&self) -> &TrackerParams {
        &self.params
    }

    /// The pose of the next scan. `odom_from_base` is the odometry's pose at the scan's stamp, `None` when there is none.
    pub fn track(&mut self, scan: &Scan, odom_from_base: Option<Pose2>) -> Tracked {
        let _ = scan;
        let motion = match (self.last_odom_from_base, odom_from_base) {
            (Some(last), Some(now)) => last.between(&now),
            _ => Pose2::IDENTITY,
        };
        self.last_odom_from_base = odom_from_base;
        let outcome = if self.map_from_base.is_none() { Outcome::First } else { Outcome::Lost };
        let map_from_base = self.map_from_base.map_or(Pose2::IDENTITY, |pose| pose * motion);
        self.map_from_base = Some(map_from_base);
        let sigma = self.params.motion.position_floor_m;
        let covariance = [[sigma * sigma, 0.0, 0.0], [0.0, sigma * sigma, 0.0], [0.0, 0.0, sigma * sigma]];
        Tracked { map_from_base, covariance, score: 0.0, iterations: 0, outcome }
    }
}
