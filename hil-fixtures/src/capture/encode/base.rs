//! Odometry as packets of the base, and when they are sent: ticks and angle steps, or counts of way and turn.

use super::busy_line::BusyLine;
use super::{EncodeError, EncodeOptions, EncodeReport};
use crate::devices::base::base_encoder::BaseEncoder;
use crate::line::{SerialRead, transfer_ns};
use crate::rig::drive::odometry::{OdometryParams, theta_steps, ticks};
use crate::rig::simulated::metres_per_tick;
use crate::rig::source::OdometrySample;
use biplane_recording::Rig;
use biplane_recording::messages::Odometry;
use std::f64::consts::{PI, TAU};

/// A base's line that is behind by more than this cannot keep up.
const MAX_LATE_NS: i64 = 50_000_000;

/// From a question to its answer.
const THINKING_NS: i64 = 1_000_000;

/// A base's packets on their line, and what it was asked where it has to be.
pub(crate) struct BaseLine {
    pub(crate) line: BusyLine,
    pub(crate) asked: Vec<SerialRead>,
    encoder: BaseEncoder,
    baud: u32,
    metres_per_tick: f64,
    way: Travel,
}

impl BaseLine {
    pub(crate) fn new(options: &EncodeOptions, rig: &Rig) -> Self {
        Self {
            line: BusyLine::new(options, 2),
            asked: Vec::new(),
            encoder: BaseEncoder::new(rig.base.protocol),
            baud: rig.base.baud,
            metres_per_tick: metres_per_tick(&rig.base),
            way: Travel::default(),
        }
    }

    pub(crate) fn send(&mut self, odometry: &Odometry, report: &mut EncodeReport) -> Result<(), EncodeError> {
        let sample = self.sample(odometry);
        let packet = self.encoder.odometry(&sample, odometry.stamp_ns)?;
        let asking_ns = match packet.asked.len() {
            0 => 0,
            count => THINKING_NS + transfer_ns(count, self.baud),
        };
        // On a line that cannot keep up, waiting would only make all later packets late. One that is late
        // because its stamp stepped back is sent: the line has time for it.
        let latest_ns = self.line.latest_stamp_ns.max(odometry.stamp_ns);
        let patience_ns = MAX_LATE_NS.max(2 * transfer_ns(packet.answer.len(), self.baud));
        if self.line.free_ns.saturating_add(asking_ns) > latest_ns.saturating_add(patience_ns) {
            report.odometry_skipped += 1;
            return Ok(());
        }
        let due_ns = odometry.stamp_ns.max(self.line.free_ns.saturating_add(asking_ns));
        if asking_ns > 0 {
            self.asked.push(SerialRead { time_ns: due_ns - asking_ns, bytes: packet.asked });
        }
        let arrival_ns = |index| transfer_ns(index + 1, self.baud);
        let wait_ns = self.line.send(&packet.answer, due_ns, transfer_ns(1, self.baud), arrival_ns);
        self.line.count(odometry.stamp_ns, due_ns - odometry.stamp_ns + wait_ns, report);
        report.odometry += 1;
        Ok(())
    }

    /// What the base would have reported.
    fn sample(&mut self, odometry: &Odometry) -> OdometrySample {
        let heading_rad = heading_rad(odometry);
        let [x_m, y_m, _] = odometry.position_m;
        self.way.go([x_m, y_m], heading_rad);
        let plain = sample(odometry, heading_rad, self.metres_per_tick);
        OdometrySample {
            path_um: (self.way.path_m * 1e6).round() as i64,
            heading_urad: (self.way.turned_rad * 1e6).round() as i64,
            ..plain
        }
    }
}

/// Way and turn of a base whose poses are known: what its wheels would have counted.
#[derive(Clone, Copy, Debug, Default)]
struct Travel {
    last: Option<([f64; 2], f64)>,
    path_m: f64,
    turned_rad: f64,
}

impl Travel {
    fn go(&mut self, position_m: [f64; 2], heading_rad: f64) {
        if let Some((before_m, before_rad)) = self.last {
            let turn_rad = (heading_rad - before_rad + PI).rem_euclid(TAU) - PI;
            let (half, middle) = (turn_rad / 2.0, before_rad + turn_rad / 2.0);
            let step = [position_m[0] - before_m[0], position_m[1] - before_m[1]];
            let chord_m = step[0] * middle.cos() + step[1] * middle.sin();
            self.path_m += if half.abs() < 1e-6 { chord_m } else { chord_m * half / half.sin() };
            self.turned_rad += turn_rad;
        }
        self.last = Some((position_m, heading_rad));
    }
}

fn heading_rad(odometry: &Odometry) -> f64 {
    let [x, y, z, w] = odometry.orientation_xyzw;
    (2.0 * (w * z + x * y)).atan2(1.0 - 2.0 * (y * y + z * z))
}

/// Pose and speeds as a packet has them.
fn sample(odometry: &Odometry, heading_rad: f64, metres_per_tick: f64) -> OdometrySample {
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
        ..OdometrySample::default()
    }
}
