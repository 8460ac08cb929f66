//! Poses whose stamps step back: of a clock that was set, or of recordings that overlap in one file.
//!
//! Who looks up a pose by its time then finds that of another moment.

use super::deskew::StampedPose;

/// Logs of real robots have stamps out of order by up to a second, each with a pose of its own.
const USUAL_NS: i64 = 2_000_000_000;

/// How far a stamp lies before the latest one ahead of it, at the farthest.
pub(crate) fn longest_step_back_ns(poses: &[StampedPose]) -> i64 {
    let mut latest_ns = i64::MIN;
    let back = |pose: &StampedPose| {
        latest_ns = latest_ns.max(pose.stamp_ns);
        latest_ns.saturating_sub(pose.stamp_ns)
    };
    poses.iter().map(back).max().unwrap_or(0)
}

/// What is wrong with poses that step back so far; `None` where that is usual.
pub(crate) fn words(step_back_ns: i64) -> Option<String> {
    (step_back_ns > USUAL_NS).then(|| {
        format!(
            "the times of its poses step back by up to {:.0} s, so scans may get poses of another moment; a file of \
             recordings that overlap in time has to be joined anew, by `biplane optimize` of this version",
            step_back_ns as f64 * 1e-9
        )
    })
}

#[cfg(test)]
mod tests {
    use super::{StampedPose, longest_step_back_ns, words};

    #[test]
    fn a_step_back_counts_from_the_latest_stamp_and_a_second_of_it_is_usual() {
        let of = |stamps_s: &[i64]| {
            let pose = |s: &i64| StampedPose { stamp_ns: s * 1_000_000_000, ..StampedPose::default() };
            longest_step_back_ns(&stamps_s.iter().map(pose).collect::<Vec<_>>())
        };
        assert_eq!(of(&[]), 0);
        assert_eq!(of(&[5, 6, 7]), 0);
        assert_eq!(of(&[5, 30, 29, 10, 40]), 20_000_000_000);
        assert!(words(of(&[5, 4])).is_none());
        assert!(words(of(&[30, 10])).unwrap().contains("by up to 20 s"));
    }
}
