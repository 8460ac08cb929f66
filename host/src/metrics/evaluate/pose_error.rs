//! Errors against the truth: of each pose (ATE), and of the way between two poses (RPE), as Sturm et al. 2012
//! ("A benchmark for the evaluation of RGB-D SLAM systems") define them and evo computes them.
//!
//! ATE: the estimate is laid upon the truth by the one turn and shift that makes the squared distances
//! smallest (Umeyama 1991, in the plane, no scale). RPE needs none: both ways are seen from where they begin;
//! pairs follow each other, the end of one begins the next, and their length is measured along the estimate.

use biplane_geometry::PortableMath;
use biplane_matcher::{Pose2, wrap_angle};
use serde::Serialize;

use super::association::PosePair;
use super::statistics::ErrorFigures;
use crate::recordings::deskew::StampedPose;

/// Ways that stay nearer to their middle than this, meters, have no size that could be compared.
const MIN_SPREAD_M: f64 = 1e-3;

/// Translation and rotation of a set of errors.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PoseErrors {
    /// Distances, meters.
    pub translation_m: ErrorFigures,
    /// Angles, degrees.
    pub rotation_deg: ErrorFigures,
}

impl PoseErrors {
    fn of(errors: &[Pose2]) -> Option<Self> {
        let translation_m: Vec<f64> = errors.iter().map(Pose2::distance_m).collect();
        let turn_deg = |error: &Pose2| wrap_angle(error.theta_rad).abs().to_degrees();
        let rotation_deg: Vec<f64> = errors.iter().map(turn_deg).collect();
        Some(Self {
            translation_m: ErrorFigures::of(&translation_m)?,
            rotation_deg: ErrorFigures::of(&rotation_deg)?,
        })
    }
}

/// The turn and shift that lay the estimate upon the truth: `truth_from_estimate`. Where all poses are at one
/// place only the shift is known, and nothing is turned.
pub fn alignment(pairs: &[PosePair]) -> Pose2 {
    let middle = |of: fn(&PosePair) -> StampedPose| {
        let sum = pairs.iter().map(of).fold([0.0; 2], |sum, pose| [sum[0] + pose.x_m, sum[1] + pose.y_m]);
        sum.map(|value| value / pairs.len().max(1) as f64)
    };
    let (estimate, truth) = (middle(|pair| pair.estimate), middle(|pair| pair.truth));
    let (mut dot, mut cross) = (0.0, 0.0);
    for pair in pairs {
        let from = [pair.estimate.x_m - estimate[0], pair.estimate.y_m - estimate[1]];
        let to = [pair.truth.x_m - truth[0], pair.truth.y_m - truth[1]];
        dot += from[0] * to[0] + from[1] * to[1];
        cross += from[0] * to[1] - from[1] * to[0];
    }
    let turn = Pose2::new(0.0, 0.0, cross.portable_atan2(dot));
    let turned = turn.transform(estimate);
    Pose2::new(truth[0] - turned[0], truth[1] - turned[1], turn.theta_rad)
}

/// How many times larger than the truth the estimate is: how far its poses lie from their middle, root mean
/// square, over the same of the truth. `None` where one of both hardly moved.
pub(crate) fn size_ratio(pairs: &[PosePair]) -> Option<f64> {
    let spread_m = |of: fn(&PosePair) -> StampedPose| {
        let count = pairs.len().max(1) as f64;
        let mean = |value: &dyn Fn(StampedPose) -> f64| {
            pairs.iter().map(|pair| value(of(pair))).sum::<f64>() / count
        };
        let (x_m, y_m) = (mean(&|pose| pose.x_m), mean(&|pose| pose.y_m));
        mean(&|pose| (pose.x_m - x_m).powi(2) + (pose.y_m - y_m).powi(2)).sqrt()
    };
    let (estimate_m, truth_m) = (spread_m(|pair| pair.estimate), spread_m(|pair| pair.truth));
    (estimate_m.min(truth_m) >= MIN_SPREAD_M).then(|| estimate_m / truth_m)
}

/// The error of each pose after the estimate was moved by `truth_from_estimate`; `None` without pairs.
pub fn absolute(pairs: &[PosePair], truth_from_estimate: &Pose2) -> Option<PoseErrors> {
    let error = |pair: &PosePair| {
        let estimate = *truth_from_estimate * pair.estimate.pose();
        pair.truth.pose().between(&estimate)
    };
    PoseErrors::of(&pairs.iter().map(error).collect::<Vec<_>>())
}

/// How far two compared poses are apart.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub enum Step {
    /// This many paired poses.
    #[serde(rename = "frames")]
    Frames(usize),
    /// At least this long a way of the estimate.
    #[serde(rename = "metres")]
    Meters(f64),
    /// At least this much time.
    #[serde(rename = "seconds")]
    Seconds(f64),
}

/// The error of the way between poses one step apart; `None` when nothing is that far apart.
pub fn relative(pairs: &[PosePair], step: Step) -> Option<PoseErrors> {
    let ends = ends(pairs, step);
    let error = |ends: &[usize]| {
        let [from, to] = [&pairs[ends[0]], &pairs[ends[1]]];
        let truth = from.truth.pose().between(&to.truth.pose());
        truth.between(&from.estimate.pose().between(&to.estimate.pose()))
    };
    PoseErrors::of(&ends.windows(2).map(error).collect::<Vec<_>>())
}

/// Where one step ends and the next begins, the first pose first.
fn ends(pairs: &[PosePair], step: Step) -> Vec<usize> {
    let mut ends = vec![0];
    let (mut frames, mut path_m, mut time_s) = (0, 0.0, 0.0);
    for (index, pair) in pairs.windows(2).enumerate() {
        let [a, b] = [&pair[0].estimate, &pair[1].estimate];
        frames += 1;
        path_m += (b.x_m - a.x_m).portable_hypot(b.y_m - a.y_m);
        time_s += b.stamp_ns.abs_diff(a.stamp_ns) as f64 / 1e9;
        let far_enough = match step {
            Step::Frames(count) => frames >= count,
            Step::Meters(length_m) => path_m >= length_m,
            Step::Seconds(duration_s) => time_s >= duration_s,
        };
        if far_enough {
            ends.push(index + 1);
            (frames, path_m, time_s) = (0, 0.0, 0.0);
        }
    }
    ends
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use biplane_matcher::Pose2;

    use super::{Step, absolute, alignment, ends, relative};
    use crate::metrics::evaluate::association::PosePair;
    use crate::recordings::deskew::StampedPose;

    fn pair(second: i64, estimate: Pose2, truth: Pose2) -> PosePair {
        let stamped = |pose: Pose2| StampedPose::planar(second * 1_000_000_000, pose);
        PosePair { estimate: stamped(estimate), truth: stamped(truth) }
    }

    /// Truth: three meters along x. Estimate: the same, a step of the middle one 0.3 m to the left, all of it
    /// turned and shifted.
    fn drive(estimate_from_truth: Pose2) -> Vec<PosePair> {
        let truth = [0.0, 1.0, 2.0, 3.0].map(|x_m| Pose2::new(x_m, 0.0, 0.0));
        let off = [0.0, 0.3, 0.3, 0.0];
        let pair_of = |index: usize| {
            let wrong = Pose2::new(truth[index].x_m, off[index], 0.0);
            pair(index as i64, estimate_from_truth * wrong, truth[index])
        };
        (0..4).map(pair_of).collect()
    }

    #[test]
    fn a_trajectory_that_is_only_turned_and_shifted_has_no_absolute_error() {
        let moved = Pose2::new(5.0, -2.0, 2.5);
        let pairs: Vec<PosePair> = (0..5)
            .map(|i| {
                let truth = Pose2::new(f64::from(i), f64::from(i * i), 0.3 * f64::from(i));
                pair(i64::from(i), moved * truth, truth)
            })
            .collect();
        let errors = absolute(&pairs, &alignment(&pairs)).unwrap();
        assert!(errors.translation_m.max < 1e-12 && errors.rotation_deg.max < 1e-12, "{errors:?}");
        let unaligned = absolute(&pairs[..1], &Pose2::IDENTITY).unwrap();
        assert!((unaligned.translation_m.mean - 29.0_f64.sqrt()).abs() < 1e-12);
        assert!((unaligned.rotation_deg.mean - 2.5_f64.to_degrees()).abs() < 1e-9);
    }

    #[test]
    fn the_best_shift_halves_an_error_that_only_part_of_the_poses_have() {
        for moved in [Pose2::IDENTITY, Pose2::new(-7.0, 1.0, FRAC_PI_2)] {
            let pairs = drive(moved);
            let errors = absolute(&pairs, &alignment(&pairs)).unwrap();
            assert!((errors.translation_m.rmse - 0.15).abs() < 1e-12, "{errors:?}");
            assert!((errors.translation_m.max - 0.15).abs() < 1e-12, "{errors:?}");
        }
    }

    #[test]
    fn the_error_of_a_step_is_seen_from_its_start() {
        let pairs = drive(Pose2::new(1.0, 2.0, -3.0));
        let frame = relative(&pairs, Step::Frames(1)).unwrap().translation_m;
        assert!((frame.mean - 0.2).abs() < 1e-12 && (frame.max - 0.3).abs() < 1e-12, "{frame:?}");
        let whole = relative(&pairs, Step::Frames(3)).unwrap().translation_m;
        assert!(whole.max < 1e-12, "{whole:?}");
        assert!(relative(&pairs, Step::Frames(4)).is_none() && relative(&[], Step::Frames(1)).is_none());
    }

    #[test]
    fn steps_end_where_the_estimates_way_or_time_is_long_enough() {
        let pairs = drive(Pose2::IDENTITY);
        // The estimate's way: 1.044 m, 1 m, 1.044 m.
        assert_eq!(ends(&pairs, Step::Meters(1.04)), [0, 1, 3]);
        assert_eq!(ends(&pairs, Step::Meters(1.0)), [0, 1, 2, 3]);
        assert_eq!(ends(&pairs, Step::Seconds(2.0)), [0, 2]);
        assert_eq!(ends(&pairs, Step::Frames(2)), [0, 2]);
    }
}
