//! What the odometry's motion is worth, as parameters.

use crate::parameter_group::parameter_group;

parameter_group! { "motion";
/// How much the odometry's own motion is worth. Smaller: the match follows the odometry more; larger: it
/// follows the scans more, also where they say little (along a bare corridor).
#[derive(Copy, Clone, PartialEq, Debug)]
pub struct MotionParams {
    /// Standard deviation of position per meter driven, meters. Larger: less held by the odometry, as all of
    /// these.
    pub position_m_per_m: f64,
    /// Standard deviation of position per radian turned, meters.
    pub position_m_per_rad: f64,
    /// Standard deviation of heading per radian turned, radians.
    pub heading_rad_per_rad: f64,
    /// Standard deviation of heading per meter driven, radians.
    pub heading_rad_per_m: f64,
    /// A longer step of the odometry is a jump and not believed, meters. Smaller: dropped scans at speed look
    /// like jumps; larger: jumps cost a search.
    pub jump_m: f64,
    /// Standard deviation of position when a step is only guessed from the one before, meters. Larger: a
    /// wider search for every scan without odometry; smaller: a base that starts or stops suddenly is lost.
    pub unmeasured_m: f64 [1e-06, 100.0],
    /// Standard deviation of heading when a step is only guessed, radians. The same for turning.
    pub unmeasured_rad: f64 [1e-06, 10.0],
}
}

impl Default for MotionParams {
    fn default() -> Self {
        Self {
            position_m_per_m: 0.1,
            position_m_per_rad: 0.05,
            heading_rad_per_rad: 0.1,
            heading_rad_per_m: 0.05,
            jump_m: 3.0,
            unmeasured_m: 0.1,
            unmeasured_rad: 0.1,
        }
    }
}
