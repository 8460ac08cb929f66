//! How well the graph knows one pose from another: covariances added up along the surest way between them
//! (Dijkstra).
//!
//! The surest single way, not all ways together, so what it says is never too little. Covariances are of (x,
//! y) along the axes of the pose that one starts at, and the turn.

use std::cmp::Ordering;
use std::collections::{BTreeMap, BinaryHeap};
use std::ops::ControlFlow;

use biplane_geometry::covariance::{self, Covariance2};
use biplane_matcher::Pose2;
use nalgebra::Matrix3;

use crate::slam::pose_graph::Edge;

/// Heading counts as much as position this far off, meters.
pub(crate) const LEVER_M: f64 = 5.0;

/// Steps of a graph with their covariances, by pose.
#[derive(Clone, Debug)]
pub(crate) struct PathCovariances {
    steps: Vec<Vec<(usize, Pose2, Matrix3<f64>)>>,
}

/// What is known of a pose.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Known {
    /// Covariance seen from the start.
    pub covariance: Matrix3<f64>,
    /// Length of the way there, meters.
    pub path_m: f64,
}

/// The surest way to a pose that was found so far.
struct Reach {
    pose: Pose2,
    known: Known,
    /// There is no surer one.
    done: bool,
}

#[derive(PartialEq)]
struct Reached {
    cost: f64,
    pose: usize,
}

impl Eq for Reached {}

impl Ord for Reached {
    fn cmp(&self, other: &Self) -> Ordering {
        other.cost.total_cmp(&self.cost).then_with(|| other.pose.cmp(&self.pose))
    }
}

impl PartialOrd for Reached {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PathCovariances {
    /// The ways of a graph.
    pub(crate) fn new<'a>(count: usize, edges: impl Iterator<Item = &'a Edge>) -> Self {
        let mut steps = vec![Vec::new(); count];
        for edge in edges {
            let Some(factors) = (edge.information + Matrix3::identity() * 1e-6).cholesky() else { continue };
            let covariance = factors.inverse();
            steps[edge.from].push((edge.to, edge.measured, covariance));
            let (pose, covariance) = reversed(&edge.measured, &covariance);
            steps[edge.to].push((edge.from, pose, covariance));
        }
        Self { steps }
    }

    /// Tells `visit` what is known of each pose seen from `start`, the surest one first, until it breaks.
    /// Time and memory follow what was visited, not the graph.
    pub(crate) fn visit(&self, start: usize, mut visit: impl FnMut(usize, &Known) -> ControlFlow<()>) {
        let origin = Known { covariance: Matrix3::zeros(), path_m: 0.0 };
        let mut best = BTreeMap::from([(start, Reach { pose: Pose2::IDENTITY, known: origin, done: false })]);
        let mut queue = BinaryHeap::from([Reached { cost: 0.0, pose: start }]);
        while let Some(Reached { pose: at, .. }) = queue.pop() {
            let Some(reach) = best.get_mut(&at).filter(|reach| !reach.done) else { continue };
            reach.done = true;
            let (pose, here) = (reach.pose, reach.known);
            if visit(at, &here).is_break() {
                return;
            }
            for (to, step, more) in &self.steps[at] {
                let held = best.get(to);
                if held.is_some_and(|held| held.done) {
                    continue;
                }
                let (reached, covariance) = joined((&pose, &here.covariance), (step, more));
                let cost = cost(&covariance);
                if held.is_none_or(|held| cost < self::cost(&held.known.covariance)) {
                    let known = Known { covariance, path_m: here.path_m + step.distance_m() };
                    best.insert(*to, Reach { pose: reached, known, done: false });
                    queue.push(Reached { cost, pose: *to });
                }
            }
        }
    }
}

fn cost(covariance: &Matrix3<f64>) -> f64 {
    covariance[(0, 0)] + covariance[(1, 1)] + LEVER_M * LEVER_M * covariance[(2, 2)]
}

/// Two steps after each other.
pub(crate) fn joined(
    (first, one): (&Pose2, &Matrix3<f64>),
    (second, other): (&Pose2, &Matrix3<f64>),
) -> (Pose2, Matrix3<f64>) {
    (*first * *second, from_rows(&covariance::compound(first, &rows(one), second, &rows(other))))
}

/// The same step the other way.
pub(crate) fn reversed(step: &Pose2, covariance: &Matrix3<f64>) -> (Pose2, Matrix3<f64>) {
    (step.inverse(), from_rows(&covariance::inverse(step, &rows(covariance))))
}

fn rows(matrix: &Matrix3<f64>) -> Covariance2 {
    std::array::from_fn(|row| std::array::from_fn(|column| matrix[(row, column)]))
}

fn from_rows(rows: &Covariance2) -> Matrix3<f64> {
    Matrix3::from_fn(|row, column| rows[row][column])
}

#[cfg(test)]
mod tests {
    use super::{Known, PathCovariances, joined, reversed};
    use crate::slam::pose_graph::tests::{edge, square};
    use biplane_matcher::Pose2;
    use nalgebra::{Matrix3, Vector3};
    use std::ops::ControlFlow;

    fn covariance() -> Matrix3<f64> {
        Matrix3::new(0.04, 0.01, 0.002, 0.01, 0.09, -0.003, 0.002, -0.003, 0.01)
    }

    /// What is known of each pose seen from the first one.
    fn from_first(path_covariances: &PathCovariances) -> Vec<Option<Known>> {
        let mut known = vec![None; path_covariances.steps.len()];
        path_covariances.visit(0, |pose, found| {
            known[pose] = Some(*found);
            ControlFlow::Continue(())
        });
        known
    }

    #[test]
    fn the_surest_poses_are_visited_first_and_no_more_than_are_wanted() {
        let (truth, chain) = square(0.0);
        let path_covariances = PathCovariances::new(truth.len(), chain.iter());
        let mut visited = Vec::new();
        path_covariances.visit(40, |pose, known| {
            visited.push((pose, known.path_m));
            if visited.len() == 7 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        });
        let poses: std::collections::BTreeSet<usize> = visited.iter().map(|(pose, _)| *pose).collect();
        assert_eq!(poses, (37..=43).collect());
        assert!(visited.is_sorted_by(|one, other| one.1 <= other.1 + 1e-9), "{visited:?}");
    }

    #[test]
    fn errors_of_two_steps_add_up_as_their_differences_do() {
        let (first, second) = (Pose2::new(3.0, -1.0, 0.7), Pose2::new(2.0, 0.5, -1.1));
        let (whole, found) = joined((&first, &covariance()), (&second, &(2.0 * covariance())));
        // By difference quotients.
        let shifted = |by: [f64; 6]| {
            let add = |pose: &Pose2, by: &[f64]| {
                Pose2::new(pose.x_m + by[0], pose.y_m + by[1], pose.theta_rad + by[2])
            };
            let pose = add(&first, &by[..3]) * add(&second, &by[3..]);
            Vector3::new(pose.x_m - whole.x_m, pose.y_m - whole.y_m, pose.theta_rad - whole.theta_rad)
        };
        let mut expected = Matrix3::zeros();
        let column = |at: usize| {
            let mut by = [0.0; 6];
            by[at] = 1e-6;
            shifted(by) / 1e-6
        };
        for (offset, held) in [(0, covariance()), (3, 2.0 * covariance())] {
            let jacobian = Matrix3::from_columns(&[column(offset), column(offset + 1), column(offset + 2)]);
            expected += jacobian * held * jacobian.transpose();
        }
        assert!((found - expected).norm() < 1e-5, "{found} {expected}");
    }

    #[test]
    fn a_step_turned_round_twice_is_itself() {
        let step = Pose2::new(3.0, -1.0, 0.7);
        let (back, turned) = reversed(&step, &covariance());
        let (again, held) = reversed(&back, &turned);
        assert!((again.x_m - step.x_m).abs() < 1e-12 && (held - covariance()).norm() < 1e-12);
    }

    #[test]
    fn a_loop_makes_a_far_pose_as_sure_as_a_near_one() {
        let (truth, chain) = square(0.0);
        let known = |edges: &[super::Edge]| {
            let path_covariances = PathCovariances::new(truth.len(), edges.iter());
            let known = from_first(&path_covariances)[80].unwrap();
            (known.covariance.trace(), known.path_m)
        };
        let open = known(&chain);
        let mut closed = chain.clone();
        closed.push(edge(0, 80, Pose2::IDENTITY, [0.05; 3]));
        let closed = known(&closed);
        assert!((open.1 - 80.0).abs() < 1e-9 && closed.1 < 1e-9, "{open:?} {closed:?}");
        assert!(open.0 > 1.0 && (closed.0 - 3.0 * 0.05 * 0.05).abs() < 1e-6, "{open:?} {closed:?}");
        let apart = PathCovariances::new(truth.len() + 1, chain.iter());
        assert!(from_first(&apart)[81].is_none());
    }
}
