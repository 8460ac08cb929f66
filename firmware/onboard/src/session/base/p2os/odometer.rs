//! From a base's wrapped counts to a pose that goes on: 15 bits of position, a heading, and restarts.
//!
//! Frame: the base's own (`odom`), as it was when the first report came. Units: metres, radians, nanoseconds. Known drivers
//! lose a unit at every wrap or throw jumps away; a sign-extended 15-bit difference is exact (`p2os.md`).

use biplane_matcher::{Pose2, wrap_angle};
use biplane_wire::p2os::{self, Sip};

use super::parameters::Parameters;

/// Faster than any of these bases, metres per second: a larger jump is a restart, not motion.
const MAX_SPEED_M_S: f64 = 3.0;
/// A jump of this size is motion at any speed, metres: stamps jitter.
const MAX_STEP_M: f64 = 0.3;

/// A base that has just been switched on has come no further than this, metres and radians.
const NEAR_ZERO: (f64, f64) = (0.01, 0.05);

fn is_near_zero(pose: Pose2) -> bool {
    pose.x_m.hypot(pose.y_m) <= NEAR_ZERO.0 && wrap_angle(pose.theta_rad).abs() <= NEAR_ZERO.1
}

/// Unwraps the base's position and continues it when the base starts to count anew.
#[derive(Clone, Debug, Default)]
pub(super) struct Odometer {
    last: Option<Reported>,
    /// Position that the wrapped counts stand for, in the base's own frame, metres.
    raw_from_base: Pose2,
    odom_from_raw: Pose2,
    session_restarted: bool,
}

#[derive(Copy, Clone, Debug)]
struct Reported {
    x_raw: u16,
    y_raw: u16,
    time_ns: i64,
}

impl Odometer {
    /// The base was opened anew: it may have kept its position, or count from zero.
    pub(super) fn session_restarts(&mut self) {
        self.session_restarted = true;
    }

    /// The pose that a report stands for, and whether the base had started to count anew.
    pub(super) fn pose(&mut self, now_ns: i64, sip: &Sip, units: Parameters) -> (Pose2, bool) {
        let heading_rad = wrap_angle(f64::from(sip.theta_raw) * units.radians_per_unit);
        let reported = Reported { x_raw: sip.x_raw, y_raw: sip.y_raw, time_ns: now_ns };
        let metres = |from: u16, to: u16| f64::from(p2os::wrap15(from, to)) * units.metres_per_tick;
        let previous = self.odom_from_raw * self.raw_from_base;
        let mut restarted = false;
        match self.last {
            None => {
                self.raw_from_base = Pose2::new(metres(0, sip.x_raw), metres(0, sip.y_raw), heading_rad);
            }
            Some(last) => {
                let step_m = [metres(last.x_raw, sip.x_raw), metres(last.y_raw, sip.y_raw)];
                let gap_s = (now_ns - last.time_ns).max(0) as f64 * 1e-9;
                let now = Pose2::new(metres(0, sip.x_raw), metres(0, sip.y_raw), heading_rad);
                let counts_from_zero =
                    self.session_restarted && is_near_zero(now) && !is_near_zero(self.raw_from_base);
                restarted =
                    counts_from_zero || step_m[0].hypot(step_m[1]) > MAX_STEP_M + MAX_SPEED_M_S * gap_s;
                self.raw_from_base = if restarted {
                    Pose2::new(metres(0, sip.x_raw), metres(0, sip.y_raw), heading_rad)
                } else {
                    let now = &self.raw_from_base;
                    Pose2::new(now.x_m + step_m[0], now.y_m + step_m[1], heading_rad)
                };
            }
        }
        if restarted {
            self.odom_from_raw = previous * self.raw_from_base.inverse();
        }
        self.session_restarted = false;
        self.last = Some(reported);
        (self.odom_from_raw * self.raw_from_base, restarted)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const S: i64 = 1_000_000_000;

    fn sip(x_raw: u16, theta_raw: i16) -> Sip {
        Sip { x_raw, theta_raw, ..Sip::default() }
    }

    fn after_a_silence(before: &Sip, after: &Sip) -> (Pose2, bool) {
        let mut odometer = Odometer::default();
        odometer.pose(0, before, Parameters::default());
        odometer.session_restarts();
        odometer.pose(3 * S, after, Parameters::default())
    }

    #[test]
    fn a_base_near_its_zero_after_a_silence_was_switched_on_unless_it_was_there_before() {
        // Half a metre back in 3 s could have been driven; to within a centimetre of zero it was not.
        let (pose, restarted) = after_a_silence(&sip(500, 1024), &sip(3, -2));
        assert!(restarted && (pose.x_m - 0.5).abs() < 1e-9, "{pose:?}");
        let (pose, restarted) = after_a_silence(&sip(500, 1024), &sip(100, 1024));
        assert!(!restarted && (pose.x_m - 0.1).abs() < 1e-9, "{pose:?}");
        let (pose, restarted) = after_a_silence(&sip(4, 0), &sip(0, 0));
        assert!(!restarted && pose.x_m.abs() < 1e-9, "{pose:?}");
    }
}
