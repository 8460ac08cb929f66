//! The base's odometry by time: what the base's pose was when a laser looked.
//!
//! Frames: `odom` (the odometry's own) and `base_link`. Units: meters, radians, nanoseconds. Samples are kept
//! in the order in which they came; their stamps may step back (they do in recordings made by others), so a
//! look-up goes from the newest sample backwards and takes the first pair that encloses the time.

use biplane_geometry::PortableMath;
use biplane_matcher::Pose2;

/// Samples kept: 25 s at 20 Hz.
const CAPACITY: usize = 512;
/// Beyond the newest sample the motion is continued for so long, nanoseconds; after that the odometry is not
/// known.
const EXTRAPOLATE_NS: i64 = 400_000_000;
/// A pair of samples that are both further away than this encloses nothing, nanoseconds.
const NEAREST_NS: i64 = 1_000_000_000;
/// A pair of samples further apart than this tells no speed, nanoseconds.
const WIDEST_GAP_NS: i64 = 2_000_000_000;
/// Two samples closer than this say too little of the speed, nanoseconds.
const SPEED_BASE_NS: i64 = 50_000_000;

/// One odometry report.
#[derive(Copy, Clone, PartialEq, Debug, Default)]
pub(crate) struct OdometrySample {
    /// When it was taken, nanoseconds.
    pub stamp_ns: i64,
    /// The base's pose in the odometry's frame.
    pub odom_from_base: Pose2,
}

/// The latest odometry samples in order of arrival.
#[derive(Clone, Debug)]
pub(crate) struct OdometryBuffer {
    samples: Box<[OdometrySample; CAPACITY]>,
    pushed: usize,
}

impl Default for OdometryBuffer {
    fn default() -> Self {
        Self { samples: Box::new([OdometrySample::default(); CAPACITY]), pushed: 0 }
    }
}

impl OdometryBuffer {
    /// Adds a sample.
    pub(crate) fn push(&mut self, sample: OdometrySample) {
        self.samples[self.pushed % CAPACITY] = sample;
        self.pushed += 1;
    }

    /// The sample that came last.
    #[must_use]
    pub(crate) fn newest(&self) -> Option<OdometrySample> {
        self.back(1)
    }

    /// The sample that came `back`-th from the end (1 = the last).
    fn back(&self, back: usize) -> Option<OdometrySample> {
        (back <= self.pushed.min(CAPACITY)).then(|| self.samples[(self.pushed - back) % CAPACITY])
    }

    /// Whether the time is enclosed by samples, so that waiting for another one would not help.
    #[must_use]
    pub(crate) fn covers(&self, stamp_ns: i64) -> bool {
        self.newest().is_some_and(|newest| newest.stamp_ns >= stamp_ns) || self.enclosing(stamp_ns).is_some()
    }

    /// The base's pose at a time: that of the sample with this very stamp, else interpolated between the
    /// newest enclosing pair, else continued for a moment beyond the ends. `None` when the odometry does not
    /// reach.
    #[must_use]
    pub(crate) fn at(&self, stamp_ns: i64) -> Option<Pose2> {
        if let Some((before, after)) = self.enclosing(stamp_ns) {
            let span_ns = after.stamp_ns - before.stamp_ns;
            if span_ns == 0 {
                return Some(after.odom_from_base);
            }
            let u = (stamp_ns - before.stamp_ns) as f64 / span_ns as f64;
            return Some(before.odom_from_base.interpolate(&after.odom_from_base, u));
        }
        let nearest = self.nearest_end(stamp_ns)?;
        let ahead_ns = stamp_ns - nearest.stamp_ns;
        let [x, y, theta] = self.twist_at(nearest.stamp_ns);
        let ahead_s = ahead_ns as f64 * 1e-9;
        Some(nearest.odom_from_base * Pose2::new(x * ahead_s, y * ahead_s, theta * ahead_s))
    }

    /// The base's velocity at a time, in its own frame: ahead and left in m/s, turn in rad/s; zeros when not
    /// known.
    #[must_use]
    pub(crate) fn twist_at(&self, stamp_ns: i64) -> [f64; 3] {
        let Some((first, last)) = self.speed_pair(stamp_ns) else { return [0.0; 3] };
        let seconds = (last.stamp_ns - first.stamp_ns) as f64 * 1e-9;
        let step = first.odom_from_base.between(&last.odom_from_base);
        // The chord of the arc, seen from its middle: half of the turn is already made there.
        let (sin, cos) = (step.theta_rad / 2.0).portable_sin_cos();
        let ahead_m = cos * step.x_m + sin * step.y_m;
        let left_m = cos * step.y_m - sin * step.x_m;
        [ahead_m / seconds, left_m / seconds, step.theta_rad / seconds]
    }

    /// The newest pair in order of arrival whose stamps enclose the time; a sample of exactly this stamp is a
    /// pair with itself.
    fn enclosing(&self, stamp_ns: i64) -> Option<(OdometrySample, OdometrySample)> {
        let mut after = self.back(1)?;
        if after.stamp_ns == stamp_ns {
            return Some((after, after));
        }
        for back in 2..=self.pushed.min(CAPACITY) {
            let before = self.back(back)?;
            if before.stamp_ns == stamp_ns {
                return Some((before, before));
            }
            let encloses = before.stamp_ns < stamp_ns && stamp_ns < after.stamp_ns;
            let nearest_ns = (stamp_ns - before.stamp_ns).min(after.stamp_ns - stamp_ns);
            if encloses && nearest_ns <= NEAREST_NS {
                return Some((before, after));
            }
            after = before;
        }
        None
    }

    /// The newest or the oldest sample, when the time lies just beyond it.
    fn nearest_end(&self, stamp_ns: i64) -> Option<OdometrySample> {
        let newest = self.back(1)?;
        let oldest = self.back(self.pushed.min(CAPACITY))?;
        let near = |sample: &OdometrySample| (stamp_ns - sample.stamp_ns).abs() <= EXTRAPOLATE_NS;
        [newest, oldest].into_iter().find(near)
    }

    /// Two samples around the time, far enough apart to tell the speed, or the last two such before it.
    fn speed_pair(&self, stamp_ns: i64) -> Option<(OdometrySample, OdometrySample)> {
        let mut last = self.back(1)?;
        for back in 2..=self.pushed.min(CAPACITY) {
            let first = self.back(back)?;
            let span_ns = last.stamp_ns - first.stamp_ns;
            if !(0..=WIDEST_GAP_NS).contains(&span_ns) {
                last = first;
            } else if span_ns >= SPEED_BASE_NS {
                let is_oldest = back == self.pushed.min(CAPACITY);
                if first.stamp_ns <= stamp_ns || is_oldest {
                    return Some((first, last));
                }
                last = first;
            }
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: i64 = 1_000_000;

    fn buffer(samples: &[(i64, f64, f64)]) -> OdometryBuffer {
        let mut buffer = OdometryBuffer::default();
        for &(ms, x_m, theta_rad) in samples {
            let odom_from_base = Pose2::new(x_m, 0.0, theta_rad);
            buffer.push(OdometrySample { stamp_ns: ms * MS, odom_from_base });
        }
        buffer
    }

    #[test]
    fn between_two_samples_the_pose_is_interpolated() {
        let buffer = buffer(&[(0, 0.0, 0.0), (100, 0.1, 0.0), (200, 0.3, 0.0)]);
        assert!((buffer.at(150 * MS).unwrap().x_m - 0.2).abs() < 1e-12);
        assert_eq!(buffer.at(100 * MS).unwrap().x_m, 0.1);
        assert!(buffer.covers(150 * MS) && !buffer.covers(201 * MS));
    }

    #[test]
    fn beyond_the_newest_sample_the_motion_goes_on_for_a_moment_only() {
        let buffer = buffer(&[(0, 0.0, 0.0), (100, 0.1, 0.0)]);
        assert!((buffer.at(200 * MS).unwrap().x_m - 0.2).abs() < 1e-12);
        assert!((buffer.at(-50 * MS).unwrap().x_m + 0.05).abs() < 1e-12);
        assert_eq!(buffer.at(600 * MS), None);
        assert_eq!(OdometryBuffer::default().at(0), None);
    }

    #[test]
    fn a_stamp_that_stepped_back_finds_its_own_sample_and_not_an_older_pair() {
        let buffer = buffer(&[(0, 0.0, 0.0), (100, 1.0, 0.0), (90, 2.0, 0.0), (200, 3.0, 0.0)]);
        assert_eq!(buffer.at(90 * MS).unwrap().x_m, 2.0);
        assert!(buffer.at(95 * MS).unwrap().x_m > 2.0, "between 90 and 200, the newest pair");
    }

    #[test]
    fn the_twist_of_a_circle_is_its_speed_and_turn() {
        let arc = |s: f64| Pose2::new(s.sin(), 1.0 - s.cos(), s);
        let mut buffer = OdometryBuffer::default();
        for step in 0..20_i64 {
            let odom_from_base = arc(step as f64 * 0.05);
            buffer.push(OdometrySample { stamp_ns: step * 100 * MS, odom_from_base });
        }
        for ms in [0, 777, 1900, 1950] {
            let [ahead, left, turn] = buffer.twist_at(ms * MS);
            assert!((ahead - 0.5).abs() < 1e-3 && left.abs() < 1e-9 && (turn - 0.5).abs() < 1e-9);
        }
        assert_eq!(OdometryBuffer::default().twist_at(0), [0.0; 3]);
    }

    #[test]
    fn old_samples_make_room_for_new_ones() {
        let mut buffer = OdometryBuffer::default();
        for step in 0..2000_i64 {
            let odom_from_base = Pose2::new(step as f64, 0.0, 0.0);
            buffer.push(OdometrySample { stamp_ns: step * 100 * MS, odom_from_base });
        }
        assert_eq!(buffer.at(199_850 * MS).unwrap().x_m, 1998.5);
        assert_eq!(buffer.at(0), None);
    }
}
