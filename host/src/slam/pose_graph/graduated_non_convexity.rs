//! Which loops to believe: graduated non-convexity over the truncated squares of their errors (Yang et al.
//! 2020), after Black and Rangarajan. Steps of the chain always count; a loop that the others contradict ends
//! with weight zero, wherever one begins.

use biplane_matcher::Pose2;

use crate::slam::pose_graph;
use crate::slam::pose_graph::Edge;

/// A loop whose squared Mahalanobis distance is larger than this is false, no unit: the chi-square quantile
/// of three degrees of freedom (x, y and the turn) at 99.9 %.
pub(crate) const MAX_LOOP_SQUARED: f64 = 16.3;
/// The surrogate comes so much closer to the truncated square each round.
const GRADUATION: f64 = 1.6;
/// Rounds at most.
const ROUNDS: usize = 40;

/// Poses that fit chain and loops, and a weight for each loop, 0 or 1 but for doubtful ones.
pub(crate) fn optimize(poses: &mut [Pose2], chain: &[Edge], loops: &[Edge]) -> Vec<f64> {
    if loops.is_empty() {
        return Vec::new();
    }
    let edges: Vec<Edge> = chain.iter().chain(loops).copied().collect();
    let structure = pose_graph::structure(poses.len(), &edges);
    let mut weights = vec![1.0; edges.len()];
    let start = poses.to_vec();
    pose_graph::optimize(poses, &edges, &weights, &structure);
    let largest = loops.iter().map(|edge| edge.squared(poses)).fold(0.0, f64::max);
    if largest <= MAX_LOOP_SQUARED {
        return weights.split_off(chain.len());
    }
    // The first weights come from the poses before any loop pulled: a single grossly false loop bends
    // everything.
    let mut control = MAX_LOOP_SQUARED / (2.0 * largest - MAX_LOOP_SQUARED);
    for _ in 0..ROUNDS {
        let mut decided = true;
        for (weight, edge) in weights[chain.len()..].iter_mut().zip(loops) {
            *weight = weight_of(edge.squared(poses), control);
            decided &= *weight == 0.0 || *weight == 1.0;
        }
        poses.copy_from_slice(&start);
        pose_graph::optimize(poses, &edges, &weights, &structure);
        if decided {
            break;
        }
        control *= GRADUATION;
    }
    weights.split_off(chain.len())
}

/// The weight of the surrogate of the truncated square.
fn weight_of(squared: f64, control: f64) -> f64 {
    let above = (control + 1.0) / control * MAX_LOOP_SQUARED;
    let below = control / (control + 1.0) * MAX_LOOP_SQUARED;
    if squared >= above {
        0.0
    } else if squared <= below {
        1.0
    } else {
        (MAX_LOOP_SQUARED * control * (control + 1.0) / squared).sqrt() - control
    }
}

#[cfg(test)]
mod tests {
    use biplane_matcher::Pose2;

    use super::optimize;
    use crate::slam::pose_graph::Edge;
    use crate::slam::pose_graph::tests::{chained, edge, square, worst_m};

    #[test]
    fn three_false_loops_of_ten_are_told_and_change_nothing() {
        let (truth, chain) = square(0.003);
        let sigma = [0.03, 0.03, 0.005];
        let true_loop = |at: usize| edge(at, at + 40, truth[at].between(&truth[at + 40]), sigma);
        let loops: Vec<Edge> = (0..40).step_by(4).map(true_loop).collect();
        let mut clean = chained(&chain);
        assert_eq!(optimize(&mut clean, &chain, &loops), vec![1.0; 10]);
        let mut spoiled = loops.clone();
        for (at, off) in [(1, [3.0, -2.0, 0.3]), (4, [-1.5, 0.5, -0.2]), (8, [0.0, 4.0, 0.4])] {
            let was = spoiled[at].measured;
            spoiled[at].measured = Pose2::new(was.x_m + off[0], was.y_m + off[1], was.theta_rad + off[2]);
        }
        let mut poses = chained(&chain);
        let weights = optimize(&mut poses, &chain, &spoiled);
        let inlier: Vec<bool> = weights.iter().map(|weight| *weight > 0.5).collect();
        let expected: Vec<bool> = (0..10).map(|at| ![1, 4, 8].contains(&at)).collect();
        assert_eq!(inlier, expected, "{weights:?}");
        let (without, with) = (worst_m(&clean, &truth), worst_m(&poses, &truth));
        assert!(with < 1.1 * without + 0.01, "{with} m with false loops, {without} m without");
    }
}
