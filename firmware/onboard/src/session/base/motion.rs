//! Motions of a base along arcs: what is possible, what is likely after a time in which nothing was heard.
//!
//! Units: meters, radians, nanoseconds.

use biplane_geometry::PortableMath;
use biplane_matcher::Pose2;

/// Faster than any of these bases, meters per second.
const MAX_SPEED_M_S: f64 = 3.0;
/// Turns faster than any of these bases, radians per second.
const MAX_TURN_RAD_S: f64 = 7.0;
/// Readings that an adapter held back come all at once: for about so long the time in which none came counts
/// for those that follow, seconds. Speeds are means over about so long.
const HELD_BACK_S: f64 = 0.3;
/// A step of this size is motion at any speed: readings jitter in time.
const SLACK_M: f64 = 0.05;
/// The same for turns.
const SLACK_RAD: f64 = 0.2;
/// Counters that have just started again have come no further than this, meters, when the base stands.
const NEAR_ZERO_M: f64 = 0.01;
/// Nor further than this, radians.
const NEAR_ZERO_RAD: f64 = 0.05;
/// A radian counts as so many meters of a wheel's way where both are weighed together.
const METERS_PER_RADIAN: f64 = 0.3;
/// A base that was switched on boots, is asked and counts for no longer than this before its first reading,
/// seconds.
const FOUND_S: f64 = 2.5;

/// A motion along an arc.
#[derive(Copy, Clone, PartialEq, Debug, Default)]
pub(crate) struct Motion {
    /// Length of the arc, meters, forward positive.
    pub path_m: f64,
    /// Turn, radians, to the left positive.
    pub turn_rad: f64,
}

impl Motion {
    /// The pose at the arc's end, seen from its beginning.
    pub(crate) fn pose(self) -> Pose2 {
        let half = self.turn_rad / 2.0;
        // The chord of an arc; its direction is the heading half way.
        let chord_m = if half.abs() < 1e-6 { self.path_m } else { self.path_m * half.portable_sin() / half };
        Pose2::new(chord_m * half.portable_cos(), chord_m * half.portable_sin(), self.turn_rad)
    }

    /// What a base can have made in this time at most.
    pub(crate) fn max_in(gap_ns: i64) -> Self {
        Self { path_m: MAX_SPEED_M_S, turn_rad: MAX_TURN_RAD_S }.times(seconds(gap_ns))
    }

    pub(crate) fn plus(self, other: Self) -> Self {
        Self { path_m: self.path_m + other.path_m, turn_rad: self.turn_rad + other.turn_rad }
    }

    fn times(self, factor: f64) -> Self {
        Self { path_m: self.path_m * factor, turn_rad: self.turn_rad * factor }
    }

    pub(crate) fn is_within(self, maximum: Self) -> bool {
        self.path_m.abs() <= SLACK_M + maximum.path_m && self.turn_rad.abs() <= SLACK_RAD + maximum.turn_rad
    }

    /// What is left of this after some time.
    pub(crate) fn faded(self, gap_ns: i64) -> Self {
        self.times(kept(gap_ns))
    }

    /// What a step leaves of it.
    pub(crate) fn less(self, step: Self) -> Self {
        let left = |maximum: f64, made: f64| (maximum - made.abs()).max(0.0);
        Self { path_m: left(self.path_m, step.path_m), turn_rad: left(self.turn_rad, step.turn_rad) }
    }

    fn is_near_zero(self) -> bool {
        self.path_m.abs() <= NEAR_ZERO_M && self.turn_rad.abs() <= NEAR_ZERO_RAD
    }

    /// How far this is from every motion between standing still and `going_on`, meters.
    fn misfit_m(self, going_on: Self) -> f64 {
        let beyond = |made: f64, maximum: f64| made - made.clamp(maximum.min(0.0), maximum.max(0.0));
        let turn_m = METERS_PER_RADIAN * beyond(self.turn_rad, going_on.turn_rad);
        beyond(self.path_m, going_on.path_m).portable_hypot(turn_m)
    }
}

fn seconds(gap_ns: i64) -> f64 {
    gap_ns.max(0) as f64 * 1e-9
}

fn kept(gap_ns: i64) -> f64 {
    (-seconds(gap_ns) / HELD_BACK_S).portable_exp()
}

/// How fast a base went lately.
#[derive(Copy, Clone, Debug, Default)]
pub(crate) struct Lately {
    made: Motion,
    in_s: f64,
}

impl Lately {
    /// The base has made a step.
    pub(crate) fn goes(&mut self, step: Motion, gap_ns: i64) {
        self.made = self.made.faded(gap_ns).plus(step);
        self.in_s = self.in_s * kept(gap_ns) + seconds(gap_ns);
    }

    fn going_on(&self, for_s: f64) -> Motion {
        if self.in_s > 0.0 { self.made.times(for_s / self.in_s) } else { Motion::default() }
    }

    /// What speaks against either explanation of what is read after a time without readings.
    pub(crate) fn weigh(&self, gap_ns: i64, step: Motion, from_zero: Motion) -> Misfits {
        let gap_s = seconds(gap_ns);
        Misfits {
            went_on_m: step.misfit_m(self.going_on(gap_s)),
            restarted_m: from_zero.misfit_m(self.going_on(gap_s.min(FOUND_S))),
            slack_m: if from_zero.is_near_zero() { NEAR_ZERO_M } else { SLACK_M },
        }
    }
}

/// How far two explanations are from a base that came to rest, went on as before, or did something between.
#[derive(Copy, Clone, Debug)]
pub(crate) struct Misfits {
    went_on_m: f64,
    restarted_m: f64,
    slack_m: f64,
}

impl Misfits {
    /// Nothing is known of how the base fared: it went on counting unless that explains clearly less than a
    /// start from zero.
    pub(crate) fn note_restart(self) -> bool {
        self.went_on_m > self.slack_m && self.restarted_m < self.went_on_m
    }

    /// The base is known to have been opened anew: it counts from zero unless that explains clearly less.
    pub(crate) fn allow_restart(self) -> bool {
        self.restarted_m <= self.went_on_m + self.slack_m
    }
}
