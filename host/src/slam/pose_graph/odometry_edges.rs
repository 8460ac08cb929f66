//! From node to node: what the recording, the scans and the odometry say of each step, as edges.
//!
//! A step is the recorded one where the scan, laid among the scans of the last meters, agrees: the onboard
//! matcher saw the whole map. Where the scan lies elsewhere, its place there is the step. Where the recorded
//! step contradicts the odometry (the matcher found back to places it had mapped before drifting, which is no
//! motion; or the odometry slipped) both are tried, and the scan tells which it was.

use biplane_matcher::{PointMap, Pose2};
use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;

use crate::slam::keyframes::Node;
use crate::slam::keyframes::keyframe_scan::merged;
use crate::slam::pose_graph::Edge;
use crate::slam::submap_alignment::{self, Approach};

/// How steps are believed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChainParams {
    /// How many nodes back the scans reach that a node is matched with. More: steadier steps, at more time.
    pub behind: usize,
    /// Standard deviation of a step a meter driven, meters. Larger: loops bend the way more easily.
    pub position_m_per_m: f64,
    /// Standard deviation of a step's heading for each root of a meter, radians; errors add up like a random
    /// walk.
    pub heading_rad_per_root_m: f64,
    /// Standard deviation that every step has, meters.
    pub floor_m: f64,
    /// Standard deviation of heading that every step has, radians.
    pub floor_rad: f64,
}

impl Default for ChainParams {
    fn default() -> Self {
        Self {
            behind: 23,
            position_m_per_m: 0.02,
            heading_rad_per_root_m: 0.005,
            floor_m: 0.003,
            floor_rad: 0.001,
        }
    }
}

/// Standard deviations of odometry a meter driven: meters, radians; and a radian turned: meters, radians.
const ODOMETRY: [f64; 4] = [0.1, 0.05, 0.05, 0.15];
/// The recorded step is a jump when it differs from the odometry's by so many standard deviations.
const JUMP: f64 = 4.0;

/// The edges from each node to the next one; `first` is the number of the first node in the graph.
pub(crate) fn edges(nodes: &[Node], first: usize, params: &ChainParams) -> Vec<Edge> {
    let edge = |at: usize| {
        let step = step(nodes, at, params);
        Edge { from: first + at - 1, to: first + at, measured: step.0, information: step.1 }
    };
    (1..nodes.len()).into_par_iter().map(edge).collect()
}

fn step(nodes: &[Node], at: usize, params: &ChainParams) -> (Pose2, Matrix3<f64>) {
    let (last, node) = (&nodes[at - 1], &nodes[at]);
    let recorded = last.recorded.between(&node.recorded);
    let odometry = match (&last.odometry, &node.odometry) {
        (Some(last), Some(now)) => Some(last.between(now)).filter(|odometry| is_jump(&recorded, odometry)),
        _ => None,
    };
    // The last ones, and fewer of those farther back: they see the same walls again.
    let back = BACK.iter().filter(|back| **back <= params.behind).filter_map(|back| at.checked_sub(*back));
    let near = back.map(|at| (last.recorded.between(&nodes[at].recorded), &nodes[at].keyframe_scan));
    let surfaces = PointMap::new(&merged(near));
    let lay = |prior: &Pose2, sigma: &[f64; 3]| {
        submap_alignment::align(&surfaces, &node.keyframe_scan.points, prior, sigma, OF_A_STEP)
    };
    let sigma = recorded_sigma(&recorded, params);
    let found = lay(&recorded, &sigma);
    // Odometry and recorded pose contradict each other: either may be wrong, and the scan tells which.
    let other = odometry.map(|odometry| (lay(&odometry, &odometry_sigma(&odometry)), odometry));
    let (prior, sigma, found) = match other {
        Some((other, odometry)) if other.explained_share > found.explained_share + CLEARLY => {
            (odometry, odometry_sigma(&odometry), other)
        }
        _ => (recorded, sigma, found),
    };
    let away = Vector3::from(found.map_from_points.step_from(&prior));
    let held = information(&sigma);
    if found.explained_share < MIN_SHARE || away.dot(&(held * away)) > FARTHEST_SQUARED {
        return (prior, information(&[2.0 * sigma[0] + 0.02, 2.0 * sigma[1] + 0.02, 2.0 * sigma[2] + 0.01]));
    }
    let known = submap_alignment::information(&found) + held;
    if prior == recorded && away.dot(&(known * away)) < AGREES_SQUARED {
        return (recorded, information(&recorded_sigma(&recorded, params)));
    }
    let drift = recorded_sigma(&found.map_from_points, params);
    (found.map_from_points, with_floor(&known, &drift))
}

/// How far back the nodes lie that a node is matched with.
const BACK: [usize; 8] = [1, 2, 3, 5, 8, 12, 17, 23];
/// Of a step: a larger scale lets the scan slide along a wall to the next door frame; with a smaller one a
/// base that slipped is not followed. Fewer iterations than after a search: it begins where the matcher or
/// the odometry saw it.
const OF_A_STEP: Approach = Approach { capture_m: 0.2, max_iterations: 5 };
/// The odometry's step has to explain so much more of the scan than the recorded one.
const CLEARLY: f64 = 0.1;
/// A scan of which less is explained by those before it says nothing.
const MIN_SHARE: f64 = 0.5;
/// A recorded step closer than this to where the scan lies among the last ones is taken as it is: the matcher
/// saw more of the map. Squared Mahalanobis distance.
const AGREES_SQUARED: f64 = 9.0;
/// A scan that is drawn farther from what was expected was drawn astray: squared Mahalanobis distance.
const FARTHEST_SQUARED: f64 = 40.0;

fn is_jump(recorded: &Pose2, odometry: &Pose2) -> bool {
    let [x, y, turn] = odometry_sigma(odometry);
    let away = recorded.step_from(odometry);
    let squared = (away[0] / x).powi(2) + (away[1] / y).powi(2) + (away[2] / turn).powi(2);
    squared > JUMP * JUMP * 2.0
}

fn odometry_sigma(step: &Pose2) -> [f64; 3] {
    let (way, turn) = (step.distance_m(), step.theta_rad.abs());
    let position = 0.02 + ODOMETRY[0] * way + ODOMETRY[2] * turn;
    [position, position, 0.01 + ODOMETRY[1] * way + ODOMETRY[3] * turn]
}

fn recorded_sigma(step: &Pose2, params: &ChainParams) -> [f64; 3] {
    let (way, turn) = (step.distance_m(), step.theta_rad.abs());
    let position = params.floor_m + params.position_m_per_m * way + 0.005 * turn;
    let heading = params.floor_rad + params.heading_rad_per_root_m * way.sqrt() + 0.005 * turn;
    [position, position, heading]
}

fn information(sigma: &[f64; 3]) -> Matrix3<f64> {
    Matrix3::from_diagonal(&Vector3::from(sigma.map(|sigma| 1.0 / (sigma * sigma))))
}

/// The information when an error of these standard deviations comes on top.
pub(crate) fn with_floor(known: &Matrix3<f64>, sigma: &[f64; 3]) -> Matrix3<f64> {
    let floor = Matrix3::from_diagonal(&Vector3::from(sigma.map(|sigma| sigma * sigma)));
    let Some(factors) = known.cholesky() else { return Matrix3::zeros() };
    let covariance = factors.inverse() + floor;
    covariance.cholesky().map_or_else(Matrix3::zeros, |factors| factors.inverse())
}
