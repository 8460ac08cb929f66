//! What a base brings: its odometry, and what it says of itself.

use biplane_matcher::Pose2;

use crate::types::device_name::ShortText;

/// One odometry report.
#[derive(Copy, Clone, PartialEq, Debug)]
pub struct OdometryReading {
    /// Index in the stream of the first byte that says it: the odometry was taken when this byte left the
    /// base.
    pub offset: u64,
    /// Bytes of that packet or answer.
    pub length: usize,
    /// Where the base believes to be; unwrapped, and continued over restarts of the base.
    pub odom_from_base: Pose2,
    /// Battery, volts, as last told; 0 before.
    pub battery_v: f32,
}

/// What a base says of itself. Empty where its protocol has no such word.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct BaseInfo {
    /// Name of a Pioneer, firmware version of a RoboClaw.
    pub name: ShortText,
    /// Kind of base: class of a Pioneer (`Pioneer`), product of a RoboClaw, `rFLEX`.
    pub class: ShortText,
    /// Subclass of a Pioneer, for example `p3dx-sh`: picks the parameters.
    pub subclass: ShortText,
    /// Whether it reports an error; `None` when it has not told.
    pub has_fault: Option<bool>,
}
