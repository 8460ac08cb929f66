//! From two free-running counters to a pose: wrapping differences, exact arcs, restarts, and readings that cannot be true.
//!
//! Frame: the base's own (`odom`), its pose at the first reading is zero. Units: metres, radians, nanoseconds. A base that was
//! switched off counts from zero again: the pose then goes on where it was. A reading further from the last than any base drives is
//! not believed before the next one agrees with it: a checksum of 16 bits lets one damaged reading in 65536 through.

use biplane_matcher::Pose2;

/// Faster than any of these bases, metres per second.
const MAX_SPEED_M_S: f64 = 3.0;
/// Turns faster than any of these bases, radians per second.
const MAX_TURN_RAD_S: f64 = 7.0;
/// Readings that an adapter held back come all at once: for about so long the time in which none came counts for those that follow,
/// seconds.
const HELD_BACK_S: f64 = 0.3;
/// A step of this size is motion at any speed: readings jitter in time.
const SLACK_M: f64 = 0.05;
/// The same for turns.
const SLACK_RAD: f64 = 0.2;
/// Counters that have just started again have come no further than this, metres.
const NEAR_ZERO_M: f64 = 0.01;
/// Nor further than this, radians.
const NEAR_ZERO_RAD: f64 = 0.05;
/// A base that starts again is not heard for at least so long, nanoseconds.
const SHORTEST_START_NS: i64 = 150_000_000;

/// A motion along an arc.
#[derive(Copy, Clone, PartialEq, Debug, Default)]
pub(super) struct Motion {
    /// Length of the arc, metres, forward positive.
    pub way_m: f64,
    /// Turn, radians, to the left positive.
    pub turn_rad: f64,
}

impl Motion {
    /// The pose at the arc's end, seen from its beginning.
    fn pose(self) -> Pose2 {
        let half = self.turn_rad / 2.0;
        // The chord of an arc; its direction is the heading half way.
        let chord_m = if half.abs() < 1e-6 { self.way_m } else { self.way_m * half.sin() / half };
        Pose2::new(chord_m * half.cos(), chord_m * half.sin(), self.turn_rad)
    }

    /// What a base can have made in this time at most.
    fn most_in(gap_ns: i64) -> Self {
        let gap_s = gap_ns.max(0) as f64 * 1e-9;
        Self { way_m: MAX_SPEED_M_S * gap_s, turn_rad: MAX_TURN_RAD_S * gap_s }
    }

    fn plus(self, other: Self) -> Self {
        Self { way_m: self.way_m + other.way_m, turn_rad: self.turn_rad + other.turn_rad }
    }

    fn is_within(self, most: Self) -> bool {
        self.way_m.abs() <= SLACK_M + most.way_m && self.turn_rad.abs() <= SLACK_RAD + most.turn_rad
    }

    /// What is left of this after some time.
    fn faded(self, gap_ns: i64) -> Self {
        let kept = (-(gap_ns.max(0) as f64) * 1e-9 / HELD_BACK_S).exp();
        Self { way_m: self.way_m * kept, turn_rad: self.turn_rad * kept }
    }

    /// What a step leaves of it.
    fn less(self, step: Self) -> Self {
        let left = |most: f64, made: f64| (most - made.abs()).max(0.0);
        Self { way_m: left(self.way_m, step.way_m), turn_rad: left(self.turn_rad, step.turn_rad) }
    }

    fn is_near_zero(self) -> bool {
        self.way_m.abs() <= NEAR_ZERO_M && self.turn_rad.abs() <= NEAR_ZERO_RAD
    }
}

/// Both counters at one moment.
#[derive(Copy, Clone, PartialEq, Debug)]
pub(super) struct Reading {
    pub counts: [i32; 2],
    pub time_ns: i64,
}

/// What a reading means.
#[derive(Copy, Clone, PartialEq, Debug)]
pub(super) enum Step {
    /// The base is here.
    At(Pose2),
    /// The base is here, and counts anew.
    Restarted(Pose2),
    /// Not to be believed yet.
    Doubtful,
}

/// Adds up what two counters say.
#[derive(Clone, Debug, Default)]
pub(super) struct CountedPose {
    last: Option<Reading>,
    doubtful: Option<Reading>,
    /// Motion that was possible before and not made.
    spare: Motion,
    odom_from_base: Pose2,
}

impl CountedPose {
    /// Takes a reading; `motion` says what differences of counts are worth.
    pub(super) fn take(&mut self, now: Reading, motion: impl Fn([i32; 2]) -> Motion) -> Step {
        let doubtful = self.doubtful.take();
        let Some(last) = self.last else {
            self.last = Some(now);
            return Step::At(self.odom_from_base);
        };
        let since = |before: Reading| {
            let counts = [0, 1].map(|i| now.counts[i].wrapping_sub(before.counts[i]));
            (motion(counts), now.time_ns.saturating_sub(before.time_ns))
        };
        let (step, gap_ns) = since(last);
        let starts_again = gap_ns >= SHORTEST_START_NS
            && motion(now.counts).is_near_zero()
            && !motion(last.counts).is_near_zero();
        if starts_again {
            self.last = Some(now);
            self.spare = Motion::default();
            return Step::Restarted(self.odom_from_base);
        }
        // The time of a gap counts in full for what comes at once behind it, and less and less later.
        let most = self.spare.faded(gap_ns).plus(Motion::most_in(gap_ns));
        if step.is_within(most) {
            self.spare = most.less(step);
            self.go(now, step);
            return Step::At(self.odom_from_base);
        }
        match doubtful.map(since) {
            Some((step, gap_ns)) if step.is_within(Motion::most_in(gap_ns)) => {
                self.spare = Motion::default();
                self.go(now, step);
                Step::Restarted(self.odom_from_base)
            }
            _ => {
                self.doubtful = Some(now);
                Step::Doubtful
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

    /// Ticks of a millimetre and of a thousandth of a radian.
    fn millis([way, turn]: [i32; 2]) -> Motion {
        Motion { way_m: f64::from(way) * 1e-3, turn_rad: f64::from(turn) * 1e-3 }
    }

    fn take(pose: &mut CountedPose, ms: i64, counts: [i32; 2]) -> Step {
        pose.take(Reading { counts, time_ns: ms * MS }, millis)
    }

    #[test]
    fn a_circle_in_coarse_steps_closes_exactly() {
        let mut pose = CountedPose::default();
        // Radius 1 m: 20 steps of a twentieth of the way round; an arc taken as a chord would be 0.4 % too long.
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
        assert_eq!(at.x_m, 2.0);
        let Step::At(at) = take(&mut pose, 2600, [103, 0]) else { panic!("a step") };
        assert!((at.x_m - 2.1).abs() < 1e-12);
    }

    #[test]
    fn one_wild_reading_is_forgotten_and_two_that_agree_are_a_restart() {
        let mut pose = CountedPose::default();
        take(&mut pose, 0, [5000, 0]);
        assert_eq!(take(&mut pose, 20, [123_456, 7]), Step::Doubtful);
        assert_eq!(take(&mut pose, 40, [5010, 0]), Step::At(Pose2::new(0.01, 0.0, 0.0)));
        assert_eq!(take(&mut pose, 60, [-90_000, 0]), Step::Doubtful);
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
        assert_eq!(take(&mut pose, 3200, [16_000, 0]), Step::Doubtful);
    }

    #[test]
    fn a_base_that_stands_near_its_zero_does_not_start_again() {
        let mut pose = CountedPose::default();
        take(&mut pose, 0, [4, 0]);
        assert!(matches!(take(&mut pose, 2000, [6, 0]), Step::At(_)));
    }
}
