//! From a base's wrapped counts to a pose that goes on: 15 bits of position, a heading, and restarts.
//!
//! Frame: the base's own (`odom`), as it was when the first report came. Units: meters, radians, nanoseconds.
//! Known drivers lose a unit at every wrap or throw jumps away; a sign-extended 15-bit difference is exact.
//!
//! A base that was reset reports nothing before it is synchronized and opened, so a restart is looked for
//! behind an opening and not behind a mere silence. Behind an opening it is the rule: the way from zero then
//! goes on from the last pose.

use biplane_geometry::PortableMath;
use biplane_matcher::{Pose2, wrap_angle};
use biplane_wire::p2os::{self, Sip};

use crate::session::base::motion::{Lately, Motion};
use crate::session::base::p2os::parameters::Parameters;

/// Faster than any of these bases, meters per second: a larger jump is a restart, not motion.
const MAX_SPEED_M_S: f64 = 3.0;
/// A jump of this size is motion at any speed, meters: stamps jitter.
const MAX_STEP_M: f64 = 0.3;

/// What a report is, as seen from the one before.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
enum Count {
    /// The base counted on.
    On,
    /// It counts from zero since it was opened.
    FromZero,
    /// Somebody has set its position.
    Elsewhere,
}

/// Unwraps the base's position and continues it when the base starts to count anew.
#[derive(Clone, Debug, Default)]
pub(crate) struct Odometer {
    last: Option<Reported>,
    /// Position that the wrapped counts stand for, in the base's own frame, meters.
    raw_from_base: Pose2,
    odom_from_raw: Pose2,
    lately: Lately,
    opened: bool,
}

#[derive(Copy, Clone, Debug)]
struct Reported {
    x_raw: u16,
    y_raw: u16,
    time_ns: i64,
}

/// Distance and turn.
fn motion(pose: Pose2) -> Motion {
    Motion { path_m: pose.x_m.portable_hypot(pose.y_m), turn_rad: wrap_angle(pose.theta_rad) }
}

impl Odometer {
    /// The base has said its names, so it was opened anew: it waited for that, or somebody had closed it.
    pub(crate) fn opened(&mut self) {
        self.opened = true;
    }

    /// The pose that a report stands for, and whether the base had started to count anew.
    pub(crate) fn pose(&mut self, now_ns: i64, sip: &Sip, units: Parameters) -> (Pose2, bool) {
        let meters = |from: u16, to: u16| f64::from(p2os::wrap15(from, to)) * units.metres_per_tick;
        let heading_rad = wrap_angle(f64::from(sip.theta_raw) * units.radians_per_unit);
        let from_zero = Pose2::new(meters(0, sip.x_raw), meters(0, sip.y_raw), heading_rad);
        let opened = std::mem::take(&mut self.opened);
        let last = self.last.replace(Reported { x_raw: sip.x_raw, y_raw: sip.y_raw, time_ns: now_ns });
        let Some(last) = last else {
            self.raw_from_base = from_zero;
            return (self.odom_from_raw * self.raw_from_base, false);
        };
        let before = self.raw_from_base;
        let (dx_m, dy_m) = (meters(last.x_raw, sip.x_raw), meters(last.y_raw, sip.y_raw));
        let step = motion(Pose2::new(dx_m, dy_m, heading_rad - before.theta_rad));
        let gap_ns = now_ns.saturating_sub(last.time_ns);
        let count = self.count(opened, gap_ns, step, motion(from_zero));
        match count {
            Count::On => {
                self.lately.goes(step, gap_ns);
                self.raw_from_base = Pose2::new(before.x_m + dx_m, before.y_m + dy_m, heading_rad);
            }
            Count::FromZero => {
                self.odom_from_raw = self.odom_from_raw * before;
                self.raw_from_base = from_zero;
            }
            Count::Elsewhere => {
                self.odom_from_raw = self.odom_from_raw * before * from_zero.inverse();
                self.raw_from_base = from_zero;
            }
        }
        (self.odom_from_raw * self.raw_from_base, count != Count::On)
    }

    fn count(&self, opened: bool, gap_ns: i64, step: Motion, from_zero: Motion) -> Count {
        let max_m = MAX_STEP_M + MAX_SPEED_M_S * gap_ns.max(0) as f64 * 1e-9;
        let likelier = opened && self.lately.weigh(gap_ns, step, from_zero).allow_restart();
        if likelier && from_zero.path_m <= max_m {
            Count::FromZero
        } else if step.path_m <= max_m {
            Count::On
        } else {
            Count::Elsewhere
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const S: i64 = 1_000_000_000;

    fn sip(x_raw: u16, theta_raw: i16) -> Sip {
        Sip { x_raw, theta_raw, ..Sip::default() }
    }

    fn after_a_silence(before: &Sip, opened: bool, after: &Sip) -> (Pose2, bool) {
        let mut odometer = Odometer::default();
        odometer.pose(0, before, Parameters::default());
        if opened {
            odometer.opened();
        }
        odometer.pose(3 * S, after, Parameters::default())
    }

    #[test]
    fn a_base_counts_from_zero_when_it_was_opened_anew_and_went_on_when_it_was_not() {
        // Before, opened anew, after; restarted, x. Raw 31768 is a meter behind zero.
        let table = [
            (sip(5000, 0), true, sip(20, 0), true, 5.020),
            (sip(31_768, 0), true, sip(20, 0), true, -0.980),
            (sip(5000, 0), false, sip(20, 0), false, 0.020),
            (sip(500, 1024), true, sip(3, -2), true, 0.500),
            (sip(500, 1024), false, sip(3, -2), false, 0.003),
            (sip(4, 0), true, sip(0, 0), true, 0.004),
            // It stood and was closed and opened: it would have to have come a meter from zero.
            (sip(1000, 0), true, sip(1000, 0), false, 1.0),
            (sip(1000, 0), true, sip(1010, 0), false, 1.010),
            // Nobody drives 20 m in 3 s.
            (sip(1000, 0), false, sip(15_000, 0), true, 1.0),
        ];
        for (before, opened, after, restarted, x_m) in table {
            let (pose, reported) = after_a_silence(&before, opened, &after);
            assert!((pose.x_m - x_m).abs() < 1e-9 && reported == restarted, "{before:?} {after:?}: {pose:?}");
        }
    }

    #[test]
    fn after_a_restart_the_way_goes_on_in_the_last_heading() {
        let mut odometer = Odometer::default();
        odometer.pose(0, &sip(5000, 1024), Parameters::default());
        odometer.opened();
        let (pose, _) = odometer.pose(3 * S, &sip(200, 0), Parameters::default());
        assert!((pose.x_m - 5.0).abs() < 1e-9 && (pose.y_m - 0.2).abs() < 1e-9, "{pose:?}");
        let (pose, restarted) = odometer.pose(3 * S + S / 10, &sip(300, 0), Parameters::default());
        assert!(!restarted && (pose.y_m - 0.3).abs() < 1e-9, "{pose:?}");
    }
}
