//! What the base's counts are worth: its own odometry against the matched poses, segment by segment.
//!
//! Over each segment of half a meter driven or half a radian turned: matched way = `way` x counted way;
//! matched turn = `turn` x counted turn + `drift` x counted way. Robust (Tukey), because wheels slip; the
//! standard deviations are from what is left, with segments that are far off left out.

use biplane_geometry::PortableMath;
use nalgebra::{Matrix2, Vector2};

use crate::calibrate::robust_scale;
use crate::recordings::deskew::{StampedPose, Trajectory};

/// A segment ends after so much way or turn.
const PATH_M: f64 = 0.5;
const TURN_RAD: f64 = 0.5;
/// A segment that takes longer is none: the robot stood or the poses have a gap.
const LONGEST_NS: i64 = 20_000_000_000;
const LONGEST_GAP_NS: i64 = 500_000_000;
const ROUNDS: usize = 20;
/// How segments differ: slip of the way for the root of a meter, error of a pose; the same of headings, and
/// slip as a share of a turn.
const PATH_SLIP_M: f64 = 0.005;
const POSE_M: f64 = 0.003;
const HEADING_SLIP_RAD: f64 = 0.007;
const POSE_RAD: f64 = 0.002;
const TURN_SLIP: f64 = 0.02;
/// Fewer say nothing.
const FEWEST: usize = 8;

/// A value and its standard deviation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Known {
    /// The value.
    pub value: f64,
    /// Its standard deviation.
    pub sigma: f64,
}

/// What the odometry is off by.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Scales {
    /// True way over counted way.
    pub way: Known,
    /// True turn over counted turn.
    pub turn: Known,
    /// Turn that the base does not count, radians a meter of counted way.
    pub drift_rad_per_m: Known,
    /// Segments.
    pub segments: usize,
}

struct Segment {
    matched_m: [f64; 2],
    counted_m: [f64; 2],
    matched_rad: f64,
    counted_rad: f64,
    path_m: f64,
}

/// Compares both; `None` when there is no odometry or too little was driven.
pub(super) fn scales(poses: &[StampedPose], odometry: &[StampedPose]) -> Option<Scales> {
    let segments = segments(poses, &Trajectory::new(odometry.to_vec()));
    if segments.len() < FEWEST {
        return None;
    }
    let (way, distance_cov) = fit(&segments.iter().map(distance_row).collect::<Vec<_>>());
    let (turn, turn_cov) = fit(&segments.iter().map(turn_row).collect::<Vec<_>>());
    let known = |value: f64, variance: f64| Known { value, sigma: variance.max(0.0).sqrt() };
    Some(Scales {
        way: known(way[0], distance_cov[(0, 0)]),
        turn: known(turn[0], turn_cov[(0, 0)]),
        drift_rad_per_m: known(turn[1], turn_cov[(1, 1)]),
        segments: segments.len(),
    })
}

/// What a segment says: value = slopes x of, in units of its standard deviation.
struct Row {
    of: Vector2<f64>,
    value: f64,
}

fn distance_row(segment: &Segment) -> Row {
    let [x, y] = segment.counted_m;
    let counted_m = x.portable_hypot(y).max(1e-9);
    let along_m = (segment.matched_m[0] * x + segment.matched_m[1] * y) / counted_m;
    let sigma = (PATH_SLIP_M * PATH_SLIP_M * segment.path_m + POSE_M * POSE_M).sqrt();
    Row { of: Vector2::new(counted_m, 0.0) / sigma, value: along_m / sigma }
}

fn turn_row(segment: &Segment) -> Row {
    let slip = TURN_SLIP * TURN_SLIP * segment.counted_rad * segment.counted_rad;
    let sigma = (HEADING_SLIP_RAD * HEADING_SLIP_RAD * segment.path_m + slip + POSE_RAD * POSE_RAD).sqrt();
    Row { of: Vector2::new(segment.counted_rad, segment.path_m) / sigma, value: segment.matched_rad / sigma }
}

fn segments(poses: &[StampedPose], odometry: &Trajectory) -> Vec<Segment> {
    let counted: Vec<Option<StampedPose>> =
        poses.iter().map(|pose| odometry.at(pose.stamp_ns, LONGEST_GAP_NS)).collect();
    let mut segments = Vec::new();
    let mut start = 0;
    let (mut path_m, mut counted_rad, mut matched_rad) = (0.0, 0.0, 0.0);
    for i in 1..poses.len() {
        let joined = poses[i].stamp_ns - poses[i - 1].stamp_ns <= LONGEST_GAP_NS
            && poses[i].stamp_ns - poses[start].stamp_ns <= LONGEST_NS;
        let step = counted[i - 1].zip(counted[i]).filter(|_| joined);
        if let Some((from, to)) = step {
            path_m += from.step_m(&to);
            counted_rad += from.turn_rad(&to);
            matched_rad += poses[i - 1].turn_rad(&poses[i]);
            if path_m < PATH_M && counted_rad.abs() < TURN_RAD {
                continue;
            }
            if let Some(first) = counted[start] {
                let (matched_m, counted_m) = (in_first(&poses[start], &poses[i]), in_first(&first, &to));
                segments.push(Segment { matched_m, counted_m, matched_rad, counted_rad, path_m });
            }
        }
        (start, path_m, counted_rad, matched_rad) = (i, 0.0, 0.0, 0.0);
    }
    segments
}

/// Where the second pose lies, seen from the first.
fn in_first(first: &StampedPose, second: &StampedPose) -> [f64; 2] {
    let (x, y) = (second.x_m - first.x_m, second.y_m - first.y_m);
    let (sin, cos) = first.theta_rad.portable_sin_cos();
    [cos * x + sin * y, cos * y - sin * x]
}

/// Robust line through the origin with up to two slopes, and their covariance; a slope of nothing but zeros
/// is zero.
fn fit(rows: &[Row]) -> (Vector2<f64>, Matrix2<f64>) {
    let mut weights = vec![1.0; rows.len()];
    let mut solution = (Vector2::zeros(), Matrix2::zeros());
    for _ in 0..ROUNDS {
        let (mut normal, mut right) = (Matrix2::from_diagonal_element(1e-9), Vector2::zeros());
        for (row, weight) in rows.iter().zip(&weights) {
            normal += row.of * row.of.transpose() * *weight;
            right += row.of * (row.value * weight);
        }
        let inverse = normal.try_inverse().unwrap_or_else(Matrix2::zeros);
        let slopes = inverse * right;
        let left: Vec<f64> = rows.iter().map(|row| row.value - row.of.dot(&slopes)).collect();
        let mut meat = Matrix2::zeros();
        for ((row, left), weight) in rows.iter().zip(&left).zip(&weights) {
            let score = row.of * (left * weight);
            meat += score * score.transpose();
        }
        // What little was driven may fit by chance: half of what the model expects is the least.
        let (found, minimum) = (inverse * meat * inverse, inverse * 0.25);
        solution = (slopes, if found[(0, 0)] < minimum[(0, 0)] { minimum } else { found });
        let scale = robust_scale::scale(left.iter().map(|left| left.abs()).collect()).max(1e-9);
        weights = left.iter().map(|left| robust_scale::weight(left / scale)).collect();
    }
    solution
}
