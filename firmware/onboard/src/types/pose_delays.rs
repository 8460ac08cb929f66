//! How long poses took into the file.

use serde::Serialize;

/// How delays are spread, milliseconds; quantiles to 0.05 ms, rounded up.
#[derive(Copy, Clone, PartialEq, Debug, Default, Serialize)]
pub struct DelaySpread {
    /// Half of all are no longer.
    pub p50: f64,
    /// 99 of 100 are no longer.
    pub p99: f64,
    /// 999 of 1000 are no longer.
    pub p99_9: f64,
    /// The longest.
    pub max: f64,
}

/// How long poses took until they were written to the file, all of the run.
#[derive(Copy, Clone, PartialEq, Debug, Default, Serialize)]
pub struct PoseDelays {
    /// Poses.
    pub poses: u64,
    /// From the last byte that the pose needed, milliseconds.
    pub from_last_byte_ms: DelaySpread,
    /// From the last byte of the scan, the wait for odometry included, milliseconds.
    pub from_scan_ms: DelaySpread,
}
