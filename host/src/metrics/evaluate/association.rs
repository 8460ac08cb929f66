//! Which pose of an estimate belongs to which pose of the truth: the nearest in time, as evo pairs them.
//!
//! Each pose of the shorter trajectory takes the nearest one of the longer; one pose may so be taken twice.

use crate::recordings::deskew::StampedPose;

/// An estimated and a true pose of one moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PosePair {
    /// What is judged.
    pub estimate: StampedPose,
    /// What it should be.
    pub truth: StampedPose,
}

/// Pairs poses that are at most `max_dt_ns` apart, in the order of time. Both trajectories may come in any
/// order.
pub fn associate(estimate: &[StampedPose], truth: &[StampedPose], max_dt_ns: u64) -> Vec<PosePair> {
    let (estimate, truth) = (by_time(estimate), by_time(truth));
    let truth_is_longer = truth.len() >= estimate.len();
    let (short, long) = if truth_is_longer { (&estimate, &truth) } else { (&truth, &estimate) };
    let pair = |of_short: &StampedPose| {
        let of_long = *nearest(long, of_short.stamp_ns, max_dt_ns)?;
        let (estimate, truth) = if truth_is_longer { (*of_short, of_long) } else { (of_long, *of_short) };
        Some(PosePair { estimate, truth })
    };
    short.iter().filter_map(pair).collect()
}

fn by_time(poses: &[StampedPose]) -> Vec<StampedPose> {
    let mut poses = poses.to_vec();
    poses.sort_by_key(|pose| pose.stamp_ns);
    poses
}

/// The nearest pose in time; the earlier of two that are equally near.
fn nearest(poses: &[StampedPose], stamp_ns: i64, max_dt_ns: u64) -> Option<&StampedPose> {
    let after = poses.partition_point(|pose| pose.stamp_ns <= stamp_ns);
    let around = &poses[after.saturating_sub(1)..(after + 1).min(poses.len())];
    let away_ns = |pose: &StampedPose| pose.stamp_ns.abs_diff(stamp_ns);
    around.iter().min_by_key(|pose| away_ns(pose)).filter(|pose| away_ns(pose) <= max_dt_ns)
}

#[cfg(test)]
mod tests {
    use super::associate;
    use crate::recordings::deskew::StampedPose;

    fn at(stamps_ms: &[i64]) -> Vec<StampedPose> {
        let pose = |ms: &i64| StampedPose { stamp_ns: ms * 1_000_000, ..StampedPose::default() };
        stamps_ms.iter().map(pose).collect()
    }

    fn pairs_ms(estimate: &[i64], truth: &[i64]) -> Vec<[i64; 2]> {
        associate(&at(estimate), &at(truth), 10_000_000)
            .iter()
            .map(|pair| [pair.estimate.stamp_ns, pair.truth.stamp_ns].map(|ns| ns / 1_000_000))
            .collect()
    }

    #[test]
    fn each_pose_of_the_shorter_one_takes_the_nearest_in_time_within_the_limit() {
        assert_eq!(
            pairs_ms(&[300, 100, 211, 409], &[0, 104, 98, 200, 295, 305, 400, 500]),
            [[100, 98], [300, 295], [409, 400]]
        );
        assert_eq!(pairs_ms(&[0, 96, 105, 110, 300], &[100, 101]), [[96, 100], [105, 101]]);
        assert_eq!(pairs_ms(&[-10, 20], &[0, 10, 700]), [[-10, 0], [20, 10]]);
        assert!(pairs_ms(&[0], &[11]).is_empty() && pairs_ms(&[], &[0]).is_empty());
    }
}
