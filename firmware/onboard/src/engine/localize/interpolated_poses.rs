//! Poses between the matched ones: a vertical scan is posed at its own stamp.
//!
//! Between two matched poses the base has moved as its odometry says, up to a small rest that is spread
//! evenly over the time; without odometry the motion was even. Before the first and after the last matched
//! pose, the odometry alone leads on, and the covariance grows with what it drove, or with the time where it
//! says nothing. Frames: `map`, `odom`, `base_link`; nanoseconds.

use biplane_geometry::PortableMath;
use biplane_matcher::{MotionParams, Pose2};

use crate::engine::localize::odometry_history::OdometryBuffer;

/// Matched poses kept: 7 s at the highest rate of scans.
const CAPACITY: usize = 512;
/// Without odometry the base is held to have stood still; in truth it may have driven so fast, m/s (standard
/// deviation).
const UNKNOWN_SPEED_M_S: f64 = 0.5;
/// The same of its turning, rad/s.
const UNKNOWN_TURN_RAD_S: f64 = 0.5;

/// A covariance of x, y (m) and theta (rad) in the map's axes.
pub(crate) type Covariance = [[f64; 3]; 3];

/// A matched pose.
#[derive(Copy, Clone, PartialEq, Debug, Default)]
pub(crate) struct MatchedPose {
    /// The scan's stamp, nanoseconds.
    pub stamp_ns: i64,
    /// The base in the map.
    pub map_from_base: Pose2,
    /// How sure that is.
    pub covariance: Covariance,
    /// The base in the odometry's frame at the same time, when known.
    pub odom_from_base: Option<Pose2>,
}

/// The latest matched poses, in order of arrival.
#[derive(Clone, Debug)]
pub(crate) struct PoseTrack {
    motion: MotionParams,
    poses: Box<[MatchedPose; CAPACITY]>,
    pushed: usize,
}

impl PoseTrack {
    /// No poses yet; `motion` says what the odometry is worth beyond them, as it does in the matcher.
    #[must_use]
    pub(crate) fn new(motion: MotionParams) -> Self {
        Self { motion, poses: Box::new([MatchedPose::default(); CAPACITY]), pushed: 0 }
    }

    /// Adds a pose.
    pub(crate) fn push(&mut self, pose: MatchedPose) {
        self.poses[self.pushed % CAPACITY] = pose;
        self.pushed += 1;
    }

    fn back(&self, back: usize) -> Option<&MatchedPose> {
        (back <= self.pushed.min(CAPACITY)).then(|| &self.poses[(self.pushed - back) % CAPACITY])
    }

    /// Whether a pose at or after this time is known.
    #[must_use]
    pub(crate) fn reaches(&self, stamp_ns: i64) -> bool {
        self.back(1).is_some_and(|pose| pose.stamp_ns >= stamp_ns)
    }

    /// The pose at a time with its covariance; `None` before the first matched pose came.
    #[must_use]
    pub(crate) fn at(&self, stamp_ns: i64, odometry: &OdometryBuffer) -> Option<(Pose2, Covariance)> {
        let mut after = self.back(1)?;
        if after.stamp_ns <= stamp_ns {
            return Some(self.led_on(after, stamp_ns, odometry));
        }
        for back in 2..=self.pushed.min(CAPACITY) {
            let before = self.back(back)?;
            if before.stamp_ns <= stamp_ns && stamp_ns <= after.stamp_ns {
                return Some(between(before, after, stamp_ns, odometry));
            }
            after = before;
        }
        Some(self.led_on(after, stamp_ns, odometry))
    }

    /// Beyond the known poses: as the odometry says, and less sure the further it goes.
    fn led_on(&self, known: &MatchedPose, stamp_ns: i64, odometry: &OdometryBuffer) -> (Pose2, Covariance) {
        if stamp_ns == known.stamp_ns {
            return (known.map_from_base, known.covariance);
        }
        let (motion, sigma) = match (known.odom_from_base, odometry.at(stamp_ns)) {
            (Some(then), Some(now)) => {
                let motion = then.between(&now);
                (motion, odometry_sigma(&self.motion, &motion))
            }
            _ => {
                let away_s = stamp_ns.saturating_sub(known.stamp_ns).unsigned_abs() as f64 * 1e-9;
                (Pose2::IDENTITY, [UNKNOWN_SPEED_M_S * away_s, UNKNOWN_TURN_RAD_S * away_s])
            }
        };
        (known.map_from_base * motion, grown(known, &motion, sigma))
    }
}

/// What a motion that only the odometry tells is worth: standard deviations of position (m) and heading
/// (rad), as the matcher has them, without the floor of a whole step.
fn odometry_sigma(p: &MotionParams, motion: &Pose2) -> [f64; 2] {
    let (driven_m, turned_rad) = (motion.distance_m(), motion.theta_rad.abs());
    [
        p.position_m_per_m * driven_m + p.position_m_per_rad * turned_rad,
        p.heading_rad_per_rad * turned_rad + p.heading_rad_per_m * driven_m,
    ]
}

/// The covariance after a motion in the base's frame with these standard deviations: a heading that is off
/// swings the way that follows.
fn grown(known: &MatchedPose, motion: &Pose2, [position_m, heading_rad]: [f64; 2]) -> Covariance {
    let (sin, cos) = known.map_from_base.theta_rad.portable_sin_cos();
    let path_m = [cos * motion.x_m - sin * motion.y_m, sin * motion.x_m + cos * motion.y_m];
    let lever = [-path_m[1], path_m[0], 0.0];
    let p = &known.covariance;
    let added = [position_m * position_m, position_m * position_m, heading_rad * heading_rad];
    std::array::from_fn(|row| {
        std::array::from_fn(|column| {
            let swung = p[row][column]
                + lever[row] * p[2][column]
                + p[row][2] * lever[column]
                + lever[row] * p[2][2] * lever[column];
            swung + if row == column { added[row] } else { 0.0 }
        })
    })
}

fn between(
    before: &MatchedPose,
    after: &MatchedPose,
    stamp_ns: i64,
    odometry: &OdometryBuffer,
) -> (Pose2, Covariance) {
    let span_ns = after.stamp_ns - before.stamp_ns;
    let u = if span_ns == 0 { 0.0 } else { (stamp_ns - before.stamp_ns) as f64 / span_ns as f64 };
    let covariance = blend(&before.covariance, &after.covariance, u);
    let known = (before.odom_from_base, after.odom_from_base, odometry.at(stamp_ns));
    let (Some(odom_before), Some(odom_after), Some(odom_now)) = known else {
        return (before.map_from_base.interpolate(&after.map_from_base, u), covariance);
    };
    let by_odometry = before.map_from_base * odom_before.between(&odom_now);
    let end_by_odometry = before.map_from_base * odom_before.between(&odom_after);
    let rest = end_by_odometry.between(&after.map_from_base);
    (by_odometry * Pose2::IDENTITY.interpolate(&rest, u), covariance)
}

fn blend(a: &Covariance, b: &Covariance, u: f64) -> Covariance {
    std::array::from_fn(|row| std::array::from_fn(|column| a[row][column] * (1.0 - u) + b[row][column] * u))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::localize::odometry_history::OdometrySample;

    const MS: i64 = 1_000_000;

    fn matched(ms: i64, x_m: f64, odom_x_m: Option<f64>) -> MatchedPose {
        MatchedPose {
            stamp_ns: ms * MS,
            map_from_base: Pose2::new(x_m, 0.0, 0.0),
            covariance: [[ms as f64, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            odom_from_base: odom_x_m.map(|x_m| Pose2::new(x_m, 0.0, 0.0)),
        }
    }

    fn odometry(samples: &[(i64, f64)]) -> OdometryBuffer {
        let mut buffer = OdometryBuffer::default();
        for &(ms, x_m) in samples {
            let odom_from_base = Pose2::new(x_m, 0.0, 0.0);
            buffer.push(OdometrySample { stamp_ns: ms * MS, odom_from_base });
        }
        buffer
    }

    #[test]
    fn without_odometry_the_motion_between_two_poses_is_even() {
        let mut track = PoseTrack::new(MotionParams::default());
        assert_eq!(track.at(0, &OdometryBuffer::default()), None);
        track.push(matched(0, 0.0, None));
        track.push(matched(200, 1.0, None));
        let (pose, covariance) = track.at(50 * MS, &OdometryBuffer::default()).unwrap();
        assert!((pose.x_m - 0.25).abs() < 1e-12 && (covariance[0][0] - 50.0).abs() < 1e-9);
        assert!(track.reaches(200 * MS) && !track.reaches(201 * MS));
    }

    #[test]
    fn with_odometry_the_motion_follows_it_and_the_rest_is_spread() {
        // The base stood for 100 ms, then drove 0.8 m by its odometry; the matches say 1.0 m.
        let odometry = odometry(&[(0, 0.0), (100, 0.0), (200, 0.8)]);
        let mut track = PoseTrack::new(MotionParams::default());
        track.push(matched(0, 5.0, Some(0.0)));
        track.push(matched(200, 6.0, Some(0.8)));
        assert!((track.at(100 * MS, &odometry).unwrap().0.x_m - 5.1).abs() < 1e-12);
        assert!((track.at(150 * MS, &odometry).unwrap().0.x_m - 5.55).abs() < 1e-12);
    }

    #[test]
    fn before_the_first_and_after_the_last_pose_the_odometry_leads_on() {
        let odometry = odometry(&[(0, 0.0), (100, 0.1), (200, 0.2), (300, 0.3)]);
        let mut track = PoseTrack::new(MotionParams::default());
        track.push(matched(100, 7.0, Some(0.1)));
        track.push(matched(200, 7.1, Some(0.2)));
        assert!((track.at(50 * MS, &odometry).unwrap().0.x_m - 6.95).abs() < 1e-12);
        assert!((track.at(300 * MS, &odometry).unwrap().0.x_m - 7.2).abs() < 1e-12);
    }

    #[test]
    fn led_on_by_the_odometry_a_pose_is_less_sure_the_further_it_is_led() {
        let odometry = odometry(&[(0, 0.0), (100, 0.1), (200, 1.1), (300, 2.1)]);
        let mut track = PoseTrack::new(MotionParams::default());
        let sure = [[1e-6, 0.0, 0.0], [0.0, 1e-6, 0.0], [0.0, 0.0, 1e-4]];
        track.push(MatchedPose { covariance: sure, ..matched(100, 7.0, Some(0.1)) });
        let at = |ms: i64| track.at(ms * MS, &odometry).unwrap().1;
        assert_eq!(at(100), sure);
        // 1 m ahead: 10 cm of the way itself; aside also 1 m times 0.01 rad.
        assert!((at(200)[0][0] - (1e-6 + 0.01)).abs() < 1e-12, "{:?}", at(200));
        assert!((at(200)[1][1] - (1e-6 + 0.01 + 1e-4)).abs() < 1e-12, "{:?}", at(200));
        assert!((at(200)[1][2] - 1e-4).abs() < 1e-12 && (at(200)[2][1] - 1e-4).abs() < 1e-12);
        assert!((at(200)[2][2] - (1e-4 + 0.0025)).abs() < 1e-12);
        assert!(at(300)[0][0] > 3.9 * at(200)[0][0]);
    }

    #[test]
    fn without_odometry_a_pose_grows_unsure_with_the_time() {
        let nothing = OdometryBuffer::default();
        let mut track = PoseTrack::new(MotionParams::default());
        track.push(MatchedPose { covariance: [[0.0; 3]; 3], ..matched(100, 7.0, None) });
        for (ms, sigma) in [(100, 0.0), (300, 0.1), (500, 0.2), (0, 0.05)] {
            let (pose, covariance) = track.at(ms * MS, &nothing).unwrap();
            assert!((pose.x_m - 7.0).abs() < 1e-12);
            for axis in 0..3 {
                assert!((covariance[axis][axis].sqrt() - sigma).abs() < 1e-9, "{ms}: {covariance:?}");
            }
        }
    }
}
