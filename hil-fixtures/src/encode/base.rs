//! Odometry as packets of the base: ticks and angle steps, and when they are sent.

use super::busy_line::BusyLine;
use super::{EncodeError, EncodeOptions, EncodeReport};
use crate::line::transfer_ns;
use crate::odometry::{OdometryParams, theta_steps, ticks};
use crate::simulated_rig::metres_per_tick;
use crate::source::OdometrySample;
use crate::telegrams;
use biplane_recording::Rig;
use biplane_recording::msg::Odometry;

/// A base's line that is behind by more than this cannot keep up.
const MOST_LATE_NS: i64 = 50_000_000;

/// A base's packets on their line.
pub(super) struct BaseLine {
    pub(super) line: BusyLine,
    baud: u32,
    metres_per_tick: f64,
}

impl BaseLine {
    pub(super) fn new(options: &EncodeOptions, rig: &Rig) -> Self {
        let line = BusyLine::new(options, 2);
        Self { line, baud: rig.base.baud, metres_per_tick: metres_per_tick(&rig.base) }
    }

    pub(super) fn send(&mut self, odometry: &Odometry, report: &mut EncodeReport) -> Result<(), EncodeError> {
        let packet = telegrams::odometry(&sample(odometry, self.metres_per_tick))?;
        // On a line that cannot keep up, waiting would only make all later packets late. One that is late because its stamp
        // stepped back is sent: the line has time for it.
        let latest_ns = self.line.latest_stamp_ns.max(odometry.stamp_ns);
        let patience_ns = MOST_LATE_NS.max(2 * transfer_ns(packet.len(), self.baud));
        if self.line.free_ns > latest_ns.saturating_add(patience_ns) {
            report.odometry_skipped += 1;
            return Ok(());
        }
        let arrival_ns = |index| transfer_ns(index + 1, self.baud);
        let wait_ns = self.line.send(&packet, odometry.stamp_ns, transfer_ns(1, self.baud), arrival_ns);
        self.line.count(odometry.stamp_ns, wait_ns, report);
        report.odometry += 1;
        Ok(())
    }
}

/// What the base would have reported.
fn sample(odometry: &Odometry, metres_per_tick: f64) -> OdometrySample {
    let [x, y, z, w] = odometry.orientation_xyzw;
    let heading_rad = (2.0 * (w * z + x * y)).atan2(1.0 - 2.0 * (y * y + z * z));
    let (forward, turn) = (odometry.linear_m_s[0], odometry.angular_rad_s[2]);
    let aside = 0.5 * OdometryParams::default().track_m * turn;
    let mm_s = |speed_m_s: f64| (speed_m_s * 1000.0).round().clamp(-32768.0, 32767.0) as i16;
    OdometrySample {
        x_raw: ticks(odometry.position_m[0], metres_per_tick),
        y_raw: ticks(odometry.position_m[1], metres_per_tick),
        theta_raw: theta_steps(heading_rad),
        left_mm_s: mm_s(forward - aside),
        right_mm_s: mm_s(forward + aside),
        moving: forward != 0.0 || turn != 0.0,
    }
}
