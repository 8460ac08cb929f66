//! Poses and what is known between them: the graph, its costs, and the poses that fit it best (Gauss-Newton).
//!
//! An edge measures `from_pose^-1 * to_pose`; its error is (x, y) along the axes of the pose `from`, and the
//! turn (meters, radians).

pub(crate) mod breaks;
pub(crate) mod elimination_order;
pub(crate) mod graduated_non_convexity;
pub(crate) mod odometry_edges;
pub(crate) mod relative_covariance;
pub(crate) mod solver;
pub(crate) mod wheel_calibration;

use biplane_geometry::PortableMath;
use biplane_matcher::Pose2;
use nalgebra::{Matrix3, Vector3};

use crate::slam::pose_graph::solver::{Block, Structure, System};

/// A measurement between two poses.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Edge {
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
    pub(crate) fn error(&self, poses: &[Pose2]) -> Vector3<f64> {
        Vector3::from(poses[self.from].between(&poses[self.to]).step_from(&self.measured))
    }

    /// Squared Mahalanobis distance at these poses.
    pub(crate) fn squared(&self, poses: &[Pose2]) -> f64 {
        let error = self.error(poses);
        error.dot(&(self.information * error))
    }
}

/// Iterations at most.
const ITERATIONS: usize = 20;
/// Steps shorter than this end it, meters and radians.
const REST: f64 = 1e-5;
/// Keeps poses that nothing holds where they are.
pub(crate) const DAMPING: f64 = 1e-6;
/// How surely the first pose stays, 1 / m^2.
pub(crate) const ANCHOR: f64 = 1e12;

/// The structure of a graph's system.
pub(crate) fn structure(count: usize, edges: &[Edge]) -> Structure {
    Structure::new(count, edges.iter().map(|edge| (edge.from, edge.to)))
}

/// The poses that fit the edges best, each edge's information times its weight. The first pose stays.
pub(crate) fn optimize(poses: &mut [Pose2], edges: &[Edge], weights: &[f64], structure: &Structure) {
    for _ in 0..ITERATIONS {
        let Some(largest) = step(poses, edges, weights, structure) else { return };
        if largest < REST {
            return;
        }
    }
}

/// One Gauss-Newton step; how far it moved a pose at most. `None` when there was none to take.
pub(crate) fn step(
    poses: &mut [Pose2],
    edges: &[Edge],
    weights: &[f64],
    structure: &Structure,
) -> Option<f64> {
    let mut system = System::new(structure);
    for (edge, &weight) in edges.iter().zip(weights).filter(|(_, weight)| **weight > 0.0) {
        add(&mut system, edge, weight, poses);
    }
    system.damp(DAMPING);
    system.add(0, &block(&(Matrix3::identity() * ANCHOR)), [0.0; 3]);
    let steps = system.solve().ok()?;
    let mut largest = 0.0_f64;
    for (pose, by) in poses.iter_mut().zip(steps) {
        largest = largest.max(Vector3::from(by).amax());
        *pose = pose.stepped(by);
    }
    Some(largest)
}

/// An edge's part of the normal equations.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Parts {
    /// Block of the pose `from`.
    pub from_from: Matrix3<f64>,
    /// Block of both.
    pub from_to: Matrix3<f64>,
    /// Block of the pose `to`.
    pub to_to: Matrix3<f64>,
    /// Right hand side of the pose `from`.
    pub right_from: [f64; 3],
    /// Right hand side of the pose `to`.
    pub right_to: [f64; 3],
}

/// What an edge says at these poses.
pub(crate) fn parts(edge: &Edge, poses: &[Pose2]) -> Parts {
    let error = edge.error(poses);
    let seen = poses[edge.from].between(&poses[edge.to]);
    let (sin, cos) = poses[edge.from].theta_rad.portable_sin_cos();
    let to = Matrix3::new(cos, sin, 0.0, -sin, cos, 0.0, 0.0, 0.0, 1.0);
    let mut from = -to;
    (from[(0, 2)], from[(1, 2)]) = (seen.y_m, -seen.x_m);
    let information = &edge.information;
    let (held_from, held_to) = (information * from, information * to);
    let right =
        |jacobian: &Matrix3<f64>| -> [f64; 3] { (-(jacobian.transpose() * (information * error))).into() };
    Parts {
        from_from: from.transpose() * held_from,
        from_to: from.transpose() * held_to,
        to_to: to.transpose() * held_to,
        right_from: right(&from),
        right_to: right(&to),
    }
}

fn add(system: &mut System<'_>, edge: &Edge, weight: f64, poses: &[Pose2]) {
    add_parts(system, edge, &parts(edge, poses), weight);
}

/// Adds an edge's part, times a weight, to a system.
pub(crate) fn add_parts(system: &mut System<'_>, edge: &Edge, parts: &Parts, weight: f64) {
    system.add(edge.from, &block(&(parts.from_from * weight)), parts.right_from.map(|value| value * weight));
    system.add(edge.to, &block(&(parts.to_to * weight)), parts.right_to.map(|value| value * weight));
    system.add_pair(edge.from, edge.to, &block(&(parts.from_to * weight)));
}

/// A matrix as the solver takes it.
pub(crate) fn block(matrix: &Matrix3<f64>) -> Block {
    std::array::from_fn(|at| matrix[(at / 3, at % 3)])
}

#[cfg(test)]
pub(crate) mod tests {
    use biplane_matcher::Pose2;
    use nalgebra::Matrix3;

    use super::{Edge, optimize, structure};

    /// A way around a square of 10 m, twice, a pose a meter; and what its steps measure when each turns
    /// `drift_rad` too far.
    pub(crate) fn square(drift_rad: f64) -> (Vec<Pose2>, Vec<Edge>) {
        let mut truth = vec![Pose2::IDENTITY];
        let mut chain = Vec::new();
        for step in 1..=80 {
            let turn = if step % 10 == 0 { std::f64::consts::FRAC_PI_2 } else { 0.0 };
            let way = Pose2::new(1.0, 0.0, turn);
            truth.push(truth[step - 1] * way);
            let measured = Pose2::new(1.0, 0.0, turn + drift_rad);
            chain.push(edge(step - 1, step, measured, [0.05, 0.05, 0.02]));
        }
        (truth, chain)
    }

    /// An edge of standard deviations.
    pub(crate) fn edge(from: usize, to: usize, measured: Pose2, sigma: [f64; 3]) -> Edge {
        let information = Matrix3::from_diagonal(&sigma.map(|sigma| 1.0 / (sigma * sigma)).into());
        Edge { from, to, measured, information }
    }

    /// Poses by the chain alone.
    pub(crate) fn chained(chain: &[Edge]) -> Vec<Pose2> {
        let mut poses = vec![Pose2::IDENTITY];
        for edge in chain {
            poses.push(poses[edge.from] * edge.measured);
        }
        poses
    }

    /// The largest error of a position, meters.
    pub(crate) fn worst_m(poses: &[Pose2], truth: &[Pose2]) -> f64 {
        let away = |(pose, truth): (&Pose2, &Pose2)| (pose.x_m - truth.x_m).hypot(pose.y_m - truth.y_m);
        poses.iter().zip(truth).map(away).fold(0.0, f64::max)
    }

    #[test]
    fn exact_loops_take_a_drift_of_meters_out_of_a_square() {
        let (truth, chain) = square(0.01);
        let mut poses = chained(&chain);
        assert!(worst_m(&poses, &truth) > 3.0);
        let loops =
            (0..41).step_by(5).map(|at| edge(at, at + 40, truth[at].between(&truth[at + 40]), [0.01; 3]));
        let edges: Vec<Edge> = chain.iter().copied().chain(loops).collect();
        let structure = structure(truth.len(), &edges);
        optimize(&mut poses, &edges, &vec![1.0; edges.len()], &structure);
        assert!(worst_m(&poses, &truth) < 0.4, "{}", worst_m(&poses, &truth));
        // The cost is at rest: it falls in no direction.
        let cost = |poses: &[Pose2]| edges.iter().map(|edge| edge.squared(poses)).sum::<f64>();
        let minimum = cost(&poses);
        for at in [1, 20, 57, 80] {
            for (x, y, turn) in [(1e-3, 0.0, 0.0), (0.0, -1e-3, 0.0), (0.0, 0.0, 1e-3)] {
                let mut other = poses.clone();
                let pose = other[at];
                other[at] = Pose2::new(pose.x_m + x, pose.y_m + y, pose.theta_rad + turn);
                assert!(cost(&other) > minimum);
            }
        }
    }

    #[test]
    fn along_a_direction_without_information_the_chain_decides() {
        let (truth, chain) = square(0.0);
        let mut poses = chained(&chain);
        // A corridor match that is 2 m off along the corridor, about which it claims nothing.
        let mut corridor = edge(5, 45, Pose2::new(2.0, 0.0, 0.0), [0.01; 3]);
        corridor.information[(0, 0)] = 0.0;
        let edges: Vec<Edge> = chain.iter().copied().chain([corridor]).collect();
        let structure = structure(truth.len(), &edges);
        optimize(&mut poses, &edges, &vec![1.0; edges.len()], &structure);
        assert!(worst_m(&poses, &truth) < 1e-3, "{}", worst_m(&poses, &truth));
    }
}
