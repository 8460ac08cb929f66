//! Poses and what is known between them: the graph, its costs, and the poses that fit it best (Gauss-Newton).
//!
//! An edge measures `from_pose^-1 * to_pose`; its error is (x, y) along the axes of the pose `from`, and the turn (metres, radians).

use biplane_matcher::Pose2;
use nalgebra::{Matrix3, Vector3};

use super::align::{difference, moved};
use super::cholesky::{Block, Structure, System};

/// A measurement between two poses.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Edge {
    /// The pose in whose frame is measured.
    pub from: usize,
    /// The pose that is measured.
    pub to: usize,
    /// `from_pose^-1 * to_pose`.
    pub measured: Pose2,
    /// Inverse covariance of x, y and turn; zero along what is not known.
    pub information: Matrix3<f64>,
}

impl Edge {
    /// The error at these poses.
    pub fn error(&self, poses: &[Pose2]) -> Vector3<f64> {
        difference(&poses[self.from].between(&poses[self.to]), &self.measured)
    }

    /// Squared Mahalanobis distance at these poses.
    pub fn squared(&self, poses: &[Pose2]) -> f64 {
        let error = self.error(poses);
        error.dot(&(self.information * error))
    }
}

/// Iterations at most.
const ITERATIONS: usize = 20;
/// Steps shorter than this end it, metres and radians.
const REST: f64 = 1e-5;
/// Keeps poses that nothing holds where they are.
const DAMPING: f64 = 1e-6;
/// How surely the first pose stays, 1 / m^2.
const ANCHOR: f64 = 1e12;

/// The structure of a graph's system.
pub fn structure(count: usize, edges: &[Edge]) -> Structure {
    Structure::new(count, edges.iter().map(|edge| (edge.from, edge.to)))
}

/// The poses that fit the edges best, each edge's information times its weight. The first pose stays.
pub fn optimise(poses: &mut [Pose2], edges: &[Edge], weights: &[f64], structure: &Structure) {
    for _ in 0..ITERATIONS {
        let Some(largest) = step(poses, edges, weights, structure) else { return };
        if largest < REST {
            return;
        }
    }
}

/// One Gauss-Newton step; how far it moved a pose at most. `None` when there was none to take.
pub fn step(poses: &mut [Pose2], edges: &[Edge], weights: &[f64], structure: &Structure) -> Option<f64> {
    let mut system = System::new(structure);
    for (edge, &weight) in edges.iter().zip(weights).filter(|(_, weight)| **weight > 0.0) {
        add(&mut system, edge, weight, poses);
    }
    system.damp(DAMPING);
    system.add(0, &block(&(Matrix3::identity() * ANCHOR)), [0.0; 3]);
    let steps = system.solve().ok()?;
    let mut largest = 0.0_f64;
    for (pose, by) in poses.iter_mut().zip(steps) {
        let by = Vector3::from(by);
        largest = largest.max(by.amax());
        *pose = moved(pose, &by);
    }
    Some(largest)
}

fn add(system: &mut System<'_>, edge: &Edge, weight: f64, poses: &[Pose2]) {
    let error = edge.error(poses);
    let seen = poses[edge.from].between(&poses[edge.to]);
    let (sin, cos) = poses[edge.from].theta_rad.sin_cos();
    let to = Matrix3::new(cos, sin, 0.0, -sin, cos, 0.0, 0.0, 0.0, 1.0);
    let mut from = -to;
    (from[(0, 2)], from[(1, 2)]) = (seen.y_m, -seen.x_m);
    let information = edge.information * weight;
    let (held_from, held_to) = (information * from, information * to);
    let right =
        |jacobian: &Matrix3<f64>| -> [f64; 3] { (-(jacobian.transpose() * (information * error))).into() };
    system.add(edge.from, &block(&(from.transpose() * held_from)), right(&from));
    system.add(edge.to, &block(&(to.transpose() * held_to)), right(&to));
    system.add_pair(edge.from, edge.to, &block(&(from.transpose() * held_to)));
}

fn block(matrix: &Matrix3<f64>) -> Block {
    std::array::from_fn(|at| matrix[(at / 3, at % 3)])
}
