//! When the devices stream, the drive begins and the capture ends.

use super::SimulateOptions;
use crate::rig::simulated::SimulatedRig;

/// Time that a start-up takes.
const START_UP_NS: i64 = 600_000_000;

/// When what happens, in device time: 0 is the start of the capture.
pub(crate) struct Times {
    pub(crate) stream_ns: i64,
    pub(crate) drive_ns: i64,
    pub(crate) end_ns: i64,
}

impl Times {
    pub(crate) fn plan(rig: &SimulatedRig, options: &SimulateOptions) -> Self {
        let stream_ns = if options.start_up { START_UP_NS } else { 0 };
        let stand_ns = (options.stand_s * 1e9) as i64;
        let drive_ns = stream_ns + stand_ns;
        let end_ns = drive_ns + (rig.drive_duration_s() * 1e9) as i64 + stand_ns;
        Self { stream_ns, drive_ns, end_ns }
    }
}
