//! Poses between the matched ones: a vertical scan is posed at its own stamp.
//!
//! Between two matched poses the base has moved as its odometry says, up to a small rest that is spread evenly over the
//! time; without odometry the motion was even. Before the first and after the last matched pose, the odometry alone leads on. Frames:
//! `map`, `odom`, `base_link`; nanoseconds.

use biplane_matcher::Pose2;

use crate::odometry::OdometryBuffer;

/// Matched poses kept: 7 s at the highest rate of scans.
const CAPACITY: usize = 512;

/// A covariance of x, y (m) and theta (rad) in the map's axes.
pub type Covariance = [[f64; 3]; 3];

/// A matched pose.
#[derive(Copy, Clone, PartialEq, Debug, Default)]
pub struct MatchedPose {
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
pub struct PoseTrack {
    poses: Box<[MatchedPose; CAPACITY]>,
    pushed: usize,
}

impl Default for PoseTrack {
    fn default() -> Self {
        Self { poses: Box::new([MatchedPose::default(); CAPACITY]), pushed: 0 }
    }
}

impl PoseTrack {
    /// Adds a pose.
    pub fn push(&mut self, pose: MatchedPose) {
        self.poses[self.pushed % CAPACITY] = pose;
        self.pushed += 1;
    }

    fn back(&self, back: usize) -> Option<&MatchedPose> {
        (back <= self.pushed.min(CAPACITY)).then(|| &self.poses[(self.pushed - back) % CAPACITY])
    }

    /// Whether a pose at or after this time is known.
    #[must_use]
    pub fn reaches(&self, stamp_ns: i64) -> bool {
        self.back(1).is_some_and(|pose| pose.stamp_ns >= stamp_ns)
    }

    /// The pose at a time with its covariance; `None` before the first matched pose came.
    #[must_use]
    pub fn at(&self, stamp_ns: i64, odometry: &OdometryBuffer) -> Option<(Pose2, Covariance)> {
        let mut after = self.back(1)?;
        if after.stamp_ns <= stamp_ns {
            return Some(led_on(after, stamp_ns, odometry));
        }
        for back in 2..=self.pushed.min(CAPACITY) {
            let before = self.back(back)?;
            if before.stamp_ns <= stamp_ns && stamp_ns <= after.stamp_ns {
                return Some(between(before, after, stamp_ns, odometry));
            }
            after = before;
        }
        Some(led_on(after, stamp_ns, odometry))
    }
}

/// Beyond the known poses: as the odometry says.
fn led_on(known: &MatchedPose, stamp_ns: i64, odometry: &OdometryBuffer) -> (Pose2, Covariance) {
    let motion = match (known.odom_from_base, odometry.at(stamp_ns)) {
        (Some(then), Some(now)) if stamp_ns != known.stamp_ns => then.between(&now),
        _ => Pose2::IDENTITY,
    };
    (known.map_from_base * motion, known.covariance)
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
    use crate::odometry::OdometrySample;

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
        let mut track = PoseTrack::default();
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
        let mut track = PoseTrack::default();
        track.push(matched(0, 5.0, Some(0.0)));
        track.push(matched(200, 6.0, Some(0.8)));
        assert!((track.at(100 * MS, &odometry).unwrap().0.x_m - 5.1).abs() < 1e-12);
        assert!((track.at(150 * MS, &odometry).unwrap().0.x_m - 5.55).abs() < 1e-12);
    }

    #[test]
    fn before_the_first_and_after_the_last_pose_the_odometry_leads_on() {
        let odometry = odometry(&[(0, 0.0), (100, 0.1), (200, 0.2), (300, 0.3)]);
        let mut track = PoseTrack::default();
        track.push(matched(100, 7.0, Some(0.1)));
        track.push(matched(200, 7.1, Some(0.2)));
        assert!((track.at(50 * MS, &odometry).unwrap().0.x_m - 6.95).abs() < 1e-12);
        assert!((track.at(300 * MS, &odometry).unwrap().0.x_m - 7.2).abs() < 1e-12);
    }
}
