//! What the base's counts are worth: its own odometry against the matched poses, stretch by stretch.
//!
//! Over each stretch of half a metre driven or half a radian turned: matched way = `way` x counted way; matched turn = `turn` x counted turn + `drift` x counted way.
//! Robust (Tukey), because wheels slip; the standard deviations are from what is left, with stretches that are far off left out.

use nalgebra::{Matrix2, Vector2};

use super::robust;
use crate::deskew::{StampedPose, Trajectory};

/// A stretch ends after so much way or turn.
const WAY_M: f64 = 0.5;
const TURN_RAD: f64 = 0.5;
/// A stretch that takes longer is none: the robot stood or the poses have a gap.
const LONGEST_NS: i64 = 20_000_000_000;
const LONGEST_GAP_NS: i64 = 500_000_000;
const ROUNDS: usize = 20;
/// How stretches differ: slip of the way for the root of a metre, error of a pose; the same of headings, and slip as a share of a turn.
const WAY_SLIP_M: f64 = 0.005;
const POSE_M: f64 = 0.003;
const HEADING_SLIP_RAD: f64 = 0.007;
const POSE_RAD: f64 = 0.002;
const TURN_SLIP: f64 = 0.02;
/// Fewer say nothing.
const FEWEST: usize = 8;

/// A value and its standard deviation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Known {
    /// The value.
    pub value: f64,
    /// Its standard deviation.
    pub sigma: f64,
}

/// What the odometry is off by.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scales {
    /// True way over counted way.
    pub way: Known,
    /// True turn over counted turn.
    pub turn: Known,
    /// Turn that the base does not count, radians a metre of counted way.
    pub drift_rad_per_m: Known,
    /// Stretches.
    pub stretches: usize,
}

struct Stretch {
    matched_m: [f64; 2],
    counted_m: [f64; 2],
    matched_rad: f64,
    counted_rad: f64,
    way_m: f64,
}

/// Compares both; `None` when there is no odometry or too little was driven.
pub fn scales(poses: &[StampedPose], odometry: &[StampedPose]) -> Option<Scales> {
    let stretches = stretches(poses, &Trajectory::new(odometry.to_vec()));
    if stretches.len() < FEWEST {
        return None;
    }
    let (way, way_cov) = fit(&stretches.iter().map(way_row).collect::<Vec<_>>());
    let (turn, turn_cov) = fit(&stretches.iter().map(turn_row).collect::<Vec<_>>());
    let known = |value: f64, variance: f64| Known { value, sigma: variance.max(0.0).sqrt() };
    Some(Scales {
        way: known(way[0], way_cov[(0, 0)]),
        turn: known(turn[0], turn_cov[(0, 0)]),
        drift_rad_per_m: known(turn[1], turn_cov[(1, 1)]),
        stretches: stretches.len(),
    })
}

/// What a stretch says: value = slopes x of, in units of its standard deviation.
struct Row {
    of: Vector2<f64>,
    value: f64,
}

fn way_row(stretch: &Stretch) -> Row {
    let [x, y] = stretch.counted_m;
    let counted_m = x.hypot(y).max(1e-9);
    let along_m = (stretch.matched_m[0] * x + stretch.matched_m[1] * y) / counted_m;
    let sigma = (WAY_SLIP_M * WAY_SLIP_M * stretch.way_m + POSE_M * POSE_M).sqrt();
    Row { of: Vector2::new(counted_m, 0.0) / sigma, value: along_m / sigma }
}

fn turn_row(stretch: &Stretch) -> Row {
    let slip = TURN_SLIP * TURN_SLIP * stretch.counted_rad * stretch.counted_rad;
    let sigma = (HEADING_SLIP_RAD * HEADING_SLIP_RAD * stretch.way_m + slip + POSE_RAD * POSE_RAD).sqrt();
    Row { of: Vector2::new(stretch.counted_rad, stretch.way_m) / sigma, value: stretch.matched_rad / sigma }
}

fn stretches(poses: &[StampedPose], odometry: &Trajectory) -> Vec<Stretch> {
    let counted: Vec<Option<StampedPose>> =
        poses.iter().map(|pose| odometry.at(pose.stamp_ns, LONGEST_GAP_NS)).collect();
    let mut stretches = Vec::new();
    let mut start = 0;
    let (mut way_m, mut counted_rad, mut matched_rad) = (0.0, 0.0, 0.0);
    for i in 1..poses.len() {
        let joined = poses[i].stamp_ns - poses[i - 1].stamp_ns <= LONGEST_GAP_NS
            && poses[i].stamp_ns - poses[start].stamp_ns <= LONGEST_NS;
        let step = counted[i - 1].zip(counted[i]).filter(|_| joined);
        if let Some((from, to)) = step {
            way_m += from.step_m(&to);
            counted_rad += from.turn_rad(&to);
            matched_rad += poses[i - 1].turn_rad(&poses[i]);
            if way_m < WAY_M && counted_rad.abs() < TURN_RAD {
                continue;
            }
            if let Some(first) = counted[start] {
                let (matched_m, counted_m) = (in_first(&poses[start], &poses[i]), in_first(&first, &to));
                stretches.push(Stretch { matched_m, counted_m, matched_rad, counted_rad, way_m });
            }
        }
        (start, way_m, counted_rad, matched_rad) = (i, 0.0, 0.0, 0.0);
    }
    stretches
}

/// Where the second pose lies, seen from the first.
fn in_first(first: &StampedPose, second: &StampedPose) -> [f64; 2] {
    let (x, y) = (second.x_m - first.x_m, second.y_m - first.y_m);
    let (sin, cos) = first.theta_rad.sin_cos();
    [cos * x + sin * y, cos * y - sin * x]
}

/// Robust line through the origin with up to two slopes, and their covariance; a slope of nothing but zeros is zero.
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
        let (found, least) = (inverse * meat * inverse, inverse * 0.25);
        solution = (slopes, if found[(0, 0)] < least[(0, 0)] { least } else { found });
        let scale = robust::scale(left.iter().map(|left| left.abs()).collect()).max(1e-9);
        weights = left.iter().map(|left| robust::weight(left / scale)).collect();
    }
    solution
}
