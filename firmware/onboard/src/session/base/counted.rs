//! From two free-running counters to a pose: wrapping differences, exact arcs, restarts, and readings that
//! cannot be true.
//!
//! Frame: the base's own (`odom`), its pose at the first reading is zero. Units: meters, radians,
//! nanoseconds. A base that was switched off counts from zero again: the pose then goes on where it was, with
//! what was counted since. Such a base does not say so: after a time without readings the likelier
//! explanation is taken ([`super::motion::Lately`]). A reading further from the last than any base drives is
//! not believed before the next one agrees with it: a checksum of 16 bits lets one damaged reading in 65536
//! through.

use biplane_matcher::Pose2;

use crate::session::base::motion::{Lately, Motion};

/// A base that starts again is not heard for at least so long, nanoseconds.
const SHORTEST_START_NS: i64 = 150_000_000;

/// Both counters at one moment.
#[derive(Copy, Clone, PartialEq, Debug)]
pub(crate) struct Reading {
    pub counts: [i32; 2],
    pub time_ns: i64,
}

/// What a reading means.
#[derive(Copy, Clone, PartialEq, Debug)]
pub(crate) enum Step {
    /// The base is here.
    At(Pose2),
    /// The base is here, and counts anew.
    Restarted(Pose2),
    /// Not to be believed yet.
    Ambiguous,
}

impl Step {
    /// Where the base is, and whether it counts anew, when that is to be believed.
    pub(crate) fn accepted(self) -> Option<(Pose2, bool)> {
        match self {
            Self::At(pose) => Some((pose, false)),
            Self::Restarted(pose) => Some((pose, true)),
            Self::Ambiguous => None,
        }
    }
}

/// Adds up what two counters say.
#[derive(Clone, Debug, Default)]
pub(crate) struct CountedPose {
    last: Option<Reading>,
    ambiguous: Option<Reading>,
    /// Motion that was possible before and not made.
    spare: Motion,
    lately: Lately,
    odom_from_base: Pose2,
}

impl CountedPose {
    /// Takes a reading; `motion` says what differences of counts are worth.
    pub(crate) fn take(&mut self, now: Reading, motion: impl Fn([i32; 2]) -> Motion) -> Step {
        let ambiguous = self.ambiguous.take();
        let Some(last) = self.last else {
            self.last = Some(now);
            return Step::At(self.odom_from_base);
        };
        let since = |before: Reading| {
            let counts = [0, 1].map(|i| now.counts[i].wrapping_sub(before.counts[i]));
            (motion(counts), now.time_ns.saturating_sub(before.time_ns))
        };
        let (step, gap_ns) = since(last);
        let from_zero = motion(now.counts);
        let starts_again = gap_ns >= SHORTEST_START_NS
            && from_zero.is_within(Motion::max_in(gap_ns))
            && self.lately.weigh(gap_ns, step, from_zero).note_restart();
        if starts_again {
            self.spare = Motion::default();
            self.go(now, from_zero);
            return Step::Restarted(self.odom_from_base);
        }
        // The time of a gap counts in full for what comes at once behind it, and less and less later.
        let maximum = self.spare.faded(gap_ns).plus(Motion::max_in(gap_ns));
        if step.is_within(maximum) {
            self.spare = maximum.less(step);
            self.lately.goes(step, gap_ns);
            self.go(now, step);
            return Step::At(self.odom_from_base);
        }
        match ambiguous.map(since) {
            Some((step, gap_ns)) if step.is_within(Motion::max_in(gap_ns)) => {
                self.spare = Motion::default();
                self.go(now, step);
                Step::Restarted(self.odom_from_base)
            }
            _ => {
                self.ambiguous = Some(now);
                Step::Ambiguous
            }
        }
    }

    fn go(&mut self, now: Reading, step: Motion) {
        self.odom_from_base = self.odom_from_base * step.pose();
        self.last = Some(now);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: i64 = 1_000_000;

    /// Ticks of a millimeter and of a thousandth of a radian.
    fn millis([way, turn]: [i32; 2]) -> Motion {
        Motion { path_m: f64::from(way) * 1e-3, turn_rad: f64::from(turn) * 1e-3 }
    }

    fn take(pose: &mut CountedPose, ms: i64, counts: [i32; 2]) -> Step {
        pose.take(Reading { counts, time_ns: ms * MS }, millis)
    }

    #[test]
    fn a_circle_in_coarse_steps_closes_exactly() {
        let mut pose = CountedPose::default();
        // Radius 1 m: 20 steps of a twentieth of the way round; an arc taken as a chord would be 0.4 % too
        // long.
        let at = |k: i32| f64::from(k) / 20.0 * std::f64::consts::TAU * 1e3;
        for k in 0..=10 {
            take(&mut pose, i64::from(k) * 200, [at(k).round() as i32, at(k).round() as i32]);
        }
        let half = pose.odom_from_base;
        assert!(half.x_m.abs() < 2e-3 && (half.y_m - 2.0).abs() < 2e-3, "{half:?}");
        assert!((half.theta_rad.abs() - std::f64::consts::PI).abs() < 2e-3, "{half:?}");
    }

    #[test]
    fn counters_that_wrap_at_32_bits_go_on() {
        let mut pose = CountedPose::default();
        take(&mut pose, 0, [i32::MAX - 10, i32::MIN + 5]);
        let Step::At(at) = take(&mut pose, 100, [i32::MIN + 89, i32::MAX - 4]) else { panic!("a step") };
        assert!((at.x_m - 0.1).abs() < 1e-4 && (at.theta_rad + 0.01).abs() < 1e-12, "{at:?}");
    }

    #[test]
    fn a_base_that_starts_again_goes_on_where_it_was() {
        let mut pose = CountedPose::default();
        take(&mut pose, 0, [0, 0]);
        take(&mut pose, 1000, [2000, 0]);
        let Step::Restarted(at) = take(&mut pose, 2500, [3, 0]) else { panic!("a restart") };
        assert!((at.x_m - 2.003).abs() < 1e-12);
        let Step::At(at) = take(&mut pose, 2600, [103, 0]) else { panic!("a step") };
        assert!((at.x_m - 2.103).abs() < 1e-12);
    }

    #[test]
    fn one_wild_reading_is_forgotten_and_two_that_agree_are_a_restart() {
        let mut pose = CountedPose::default();
        take(&mut pose, 0, [5000, 0]);
        assert_eq!(take(&mut pose, 20, [123_456, 7]), Step::Ambiguous);
        assert_eq!(take(&mut pose, 40, [5010, 0]), Step::At(Pose2::new(0.01, 0.0, 0.0)));
        assert_eq!(take(&mut pose, 60, [-90_000, 0]), Step::Ambiguous);
        let Step::Restarted(at) = take(&mut pose, 80, [-89_990, 0]) else { panic!("a restart") };
        assert!((at.x_m - 0.02).abs() < 1e-12);
    }

    #[test]
    fn readings_that_were_held_back_and_come_all_at_once_are_motion() {
        let mut pose = CountedPose::default();
        take(&mut pose, 0, [5000, 0]);
        // Twelve readings of 0.1 m each, 1.2 s late; then one that 20 ms do not explain.
        for k in 1..=12 {
            assert!(matches!(take(&mut pose, 1200, [5000 + 100 * k, 0]), Step::At(_)), "{k}");
        }
        assert!((pose.odom_from_base.x_m - 1.2).abs() < 1e-12);
        take(&mut pose, 2200, [6300, 0]);
        assert_eq!(take(&mut pose, 3200, [16_000, 0]), Step::Ambiguous);
    }

    #[test]
    fn a_base_that_stands_near_its_zero_does_not_start_again() {
        let mut pose = CountedPose::default();
        take(&mut pose, 0, [4, 0]);
        assert!(matches!(take(&mut pose, 2000, [6, 0]), Step::At(_)));
    }

    /// Drives for 25 s at this speed and turn with readings every 20 ms, those between 20 and 23 s missing;
    /// the counters stand at `path_m` when they stop coming, and, if `reset`, at zero at 22 s. The longest
    /// leap, and the pose at the end.
    fn drive(path_m: f64, (speed, turn): (f64, f64), reset: bool) -> (f64, Pose2) {
        let mut pose = CountedPose::default();
        let (mut before, mut leap_m) = (Pose2::default(), 0.0_f64);
        for ms in (0..=25_000).step_by(20).filter(|ms| !(20_020..23_000).contains(ms)) {
            let time_s = f64::from(ms) * 1e-3;
            let counted_s = if reset && ms > 20_000 { time_s - 22.0 } else { time_s - 20.0 };
            let (way, turned) = (counted_s * speed, counted_s * turn);
            let first = if reset && ms > 20_000 { 0.0 } else { path_m };
            let counts = [first + way, turned].map(|value| (value * 1e3).round() as i32);
            let (Step::At(at) | Step::Restarted(at)) = take(&mut pose, i64::from(ms), counts) else {
                continue;
            };
            leap_m = leap_m.max((before.inverse() * at).x_m.hypot((before.inverse() * at).y_m));
            before = at;
        }
        (leap_m, before)
    }

    #[test]
    fn a_moving_base_leaps_no_further_than_it_drove_unseen_whether_it_was_reset_or_not() {
        for path_m in [0.5, 1.0, 2.0, 5.0, 8.0, 12.0, 20.0, -0.5, -5.0, -20.0] {
            for (speed, turn) in [(1.0, 0.0), (1.0, 0.4), (0.3, -0.2), (-0.5, 0.0), (0.0, 0.0), (2.0, 0.1)] {
                for reset in [false, true] {
                    let what = format!("{path_m} m, {speed} m/s, {turn} rad/s, reset: {reset}");
                    let (leap_m, end) = drive(path_m, (speed, turn), reset);
                    assert!(leap_m <= 3.0 * f64::abs(speed) + 0.05, "{what}: {leap_m} m");
                    let true_end = Motion { path_m: 25.0 * speed, turn_rad: 25.0 * turn }.pose();
                    let missed_m = (end.x_m - true_end.x_m).hypot(end.y_m - true_end.y_m);
                    let unseen_m =
                        if reset { f64::abs(speed) * (3.0 + 2.0 * 3.0 * f64::abs(turn)) } else { 0.0 };
                    assert!(missed_m <= 0.06 + unseen_m, "{what}: off by {missed_m} m");
                }
            }
        }
    }
}
