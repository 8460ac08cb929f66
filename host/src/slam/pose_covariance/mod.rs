//! How far optimized poses may be from the truth, the first pose of their frame being exact.
//!
//! What holds the poses is the Hessian of the last step ([`crate::slam::refinement`]): what nodes saw in
//! common, and the steps between them. Its inverse at a pose is the pose's covariance. That system is far too
//! full for a factorization of all nodes, so a pose's error is taken apart in two:
//! - the error of the map where the scan looks, against where the first scan looks. The nodes that saw a
//!   surface made the map there, so it is the mean of their errors: motions of the map about its origin that
//!   change linearly between *knots* along the way ([`knots`]), all of them in one dense system;
//! - the part of its own: how well the scan, with those before and after it, knows its place on that map
//!   ([`smoothed`]).
//!
//! Both are large along what nobody saw, such as a bare corridor. The last step gives each beam a share of
//! one independent beam only, so that steps hold against scans; here the noise is what the residuals show,
//! and it averages out over beams and scans. What does not is the error of each view of a wall.
//! Frame `map`; x, y (meters), turn (radians).

mod knots;
mod map_motion;
mod rows;
mod smoothed;

use biplane_matcher::Pose2;
use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;

use crate::slam::keyframes::Node;
use crate::slam::pose_graph::{self, Edge, Parts};
use crate::slam::refinement::JointParams;
use crate::slam::refinement::every_scan::ALIKE;
use crate::slam::refinement::observations::Observations;
use knots::Knots;
use map_motion::{about, back_from};
use rows::Rows;
use smoothed::{Chain, Step};

/// Added to each variance, so that the first pose's covariance can be inverted too: square meters, square
/// radians.
const MIN_VARIANCE: f64 = 1e-10;

/// What a row is off by in each view of it, a variance in square meters, so that half a meter of wall is off
/// by 3 mm. No number of beams or scans makes it smaller, and residuals do not show it: the poses follow it.
/// Chosen, as the next one and the share of lengths, by what ellipses of simulated drives hold and by how
/// likely their errors are (`docs/loops.md`).
const COMMON_M2: f64 = 7.5e-5;
/// So many nodes that follow each other have the same view: about a meter of the way.
const ALIKE_NODES: f64 = 4.0;
/// The variance of a step counts so many times: what steps are off by along a corridor that nobody saw, such
/// as wheels larger than thought, is the same in all of them and adds up. With 9 a corridor of 10 to 30 m is
/// known as well as odometry that is 1 % off tells it.
const STEPS_ALIKE: f64 = ALIKE * ALIKE;
/// What lengths are off by, as a share: normals of walls are noisy, and scans seem to know more of where
/// along a wall they are than they do.
const LENGTH_SHARE: f64 = 3e-4;

/// Covariances of the poses of some of all nodes that lie in one frame, by their ascending numbers. `chain`
/// has the steps between nodes. `None` when the poses are held by nothing.
pub(crate) fn of_poses(
    members: &[usize],
    nodes: &[Node],
    poses: &[Pose2],
    chain: &[Edge],
    params: &JointParams,
) -> Option<Vec<Matrix3<f64>>> {
    let place = |node: usize| members.binary_search(&node).ok();
    let inner = |edge: &Edge| Some(Edge { from: place(edge.from)?, to: place(edge.to)?, ..*edge });
    let chain: Vec<Edge> = chain.iter().filter_map(inner).collect();
    let nodes: Vec<&Node> = members.iter().map(|&node| &nodes[node]).collect();
    let poses: Vec<Pose2> = members.iter().map(|&node| poses[node]).collect();
    let weaker = |edge: &Edge| Edge { information: edge.information / STEPS_ALIKE, ..*edge };
    let parts: Vec<Parts> = chain.iter().map(|edge| pose_graph::parts(&weaker(edge), &poses)).collect();
    let [.., finest] = &params.levels;
    let observations = Observations::new(&nodes, &poses, finest, params);
    let rows = Rows::new(&observations, &poses);
    let noise = rows.noise_share(&observations, poses.len());
    let held = held(poses.len(), &chain, &parts);
    let knots =
        Knots::new(&poses, (&chain, &parts), &rows.clone().with_errors(noise, ALIKE_NODES * COMMON_M2));
    let seen: Vec<Matrix3<f64>> = (0..poses.len()).map(|node| observations.diagonal(node)).collect();
    let steps: Vec<Step> = chain.iter().zip(&parts).map(|(edge, part)| step(edge, part, &nodes)).collect();
    let step_noise = 1.0 / STEPS_ALIKE;
    let smoothed =
        Chain { poses: &poses, seen: &seen, steps: &steps, noise, step_noise, reach: knots.nodes_apart() };
    let own: Vec<Matrix3<f64>> = (0..poses.len())
        .into_par_iter()
        .map(|node| {
            let view = (seen[node] + held[node]).cholesky().map(|known| known.inverse());
            let view = view.map(|known| carried(&known, &observations.common_pull(node, COMMON_M2)));
            smoothed.covariance(node).unwrap_or_default() + view.unwrap_or_default()
        })
        .collect();
    let about_origin = |(pose, held): (&Pose2, &Matrix3<f64>)| carried(&about(pose).transpose(), held);
    let held: Vec<Matrix3<f64>> = poses.iter().zip(&held).map(about_origin).collect();
    let shared = knots.covariances(&rows, &held)?;
    Some(against_the_first(&poses, &shared, &own))
}

/// The covariances of poses in the frame of the first one: of what they share, motions of the map about its
/// origin, and of their own.
fn against_the_first(poses: &[Pose2], shared: &[Matrix3<f64>], own: &[Matrix3<f64>]) -> Vec<Matrix3<f64>> {
    let Some((first, of_first)) = poses.first().zip(own.first()) else { return Vec::new() };
    // The first scan's own error is everyone's: it is what the frame is off by.
    let frame = carried(&back_from(first), of_first);
    let of_one = |((pose, shared), own): ((&Pose2, &Matrix3<f64>), &Matrix3<f64>)| {
        let length_m = LENGTH_SHARE * first.between(pose).distance_m();
        let lengths = Matrix3::from_diagonal(&Vector3::new(length_m * length_m, length_m * length_m, 0.0));
        carried(&about(pose), &(shared + frame)) + own + lengths + Matrix3::identity() * MIN_VARIANCE
    };
    let mut found: Vec<Matrix3<f64>> = poses.iter().zip(shared).zip(own).map(of_one).collect();
    found[0] = Matrix3::identity() * MIN_VARIANCE;
    found
}

/// What the steps on both sides say of each pose when all others stay.
fn held(count: usize, chain: &[Edge], parts: &[Parts]) -> Vec<Matrix3<f64>> {
    let mut held = vec![Matrix3::zeros(); count];
    for (edge, part) in chain.iter().zip(parts) {
        held[edge.from] += part.from_from;
        held[edge.to] += part.to_to;
    }
    held
}

/// A step between nodes, with the scans that lie between them.
fn step(edge: &Edge, part: &Parts, nodes: &[&Node]) -> Step {
    let scans = nodes[edge.to].scan.saturating_sub(nodes[edge.from].scan);
    Step::new([edge.from, edge.to], scans, part.to_to)
}

/// The covariance of `jacobian * error`.
fn carried(jacobian: &Matrix3<f64>, covariance: &Matrix3<f64>) -> Matrix3<f64> {
    jacobian * covariance * jacobian.transpose()
}

#[cfg(test)]
mod tests {
    use biplane_matcher::{EndPoint, Kind, Pose2};
    use nalgebra::Matrix3;

    use super::of_poses;
    use crate::slam::keyframes::Node;
    use crate::slam::keyframes::keyframe_scan::KeyframeScan;
    use crate::slam::pose_graph::Edge;
    use crate::slam::refinement::JointParams;

    /// How far walls are seen, meters.
    const SIGHT_M: f64 = 4.0;

    /// What a node at x, heading along x, sees of two walls beside it; and of one ahead, where there is one.
    fn node(x_m: f64, ahead_m: Option<f64>, noise_m: f64) -> Node {
        let mut seed = (1e3 * x_m) as u32;
        let mut random = || {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (f64::from(seed >> 8) / f64::from(1 << 24) - 0.5) * 12.0_f64.sqrt() * noise_m
        };
        let mut points = Vec::new();
        let mut wall = |at: [f64; 2], normal: [f32; 2]| {
            let end = EndPoint { normal, kind: Kind::Line, weight: 1.0, ..EndPoint::default() };
            points.push(EndPoint { at_m: at.map(|value| value as f32), ..end });
        };
        for step in -40..40 {
            let along_m = f64::from(step) * 0.1;
            wall([along_m, 1.1 + random()], [0.0, -1.0]);
            wall([along_m, -1.1 + random()], [0.0, 1.0]);
        }
        for step in -10..10 {
            let seen_m = ahead_m.map(|ahead_m| ahead_m - x_m).filter(|seen_m| *seen_m < SIGHT_M);
            if let Some(seen_m) = seen_m {
                wall([seen_m + random(), f64::from(step) * 0.1], [-1.0, 0.0]);
            }
        }
        let keyframe_scan = KeyframeScan { points, laser_m: [0.0; 2] };
        Node::at(Pose2::new(x_m, 0.0, 0.0), keyframe_scan)
    }

    /// Covariances along a corridor, a node every 0.3 m.
    fn along(ahead_m: Option<f64>, noise_m: f64) -> Vec<Matrix3<f64>> {
        let places: Vec<f64> = (0..60).map(|step| 0.3 * f64::from(step)).collect();
        let nodes: Vec<Node> = places.iter().map(|&x_m| node(x_m, ahead_m, noise_m)).collect();
        let poses: Vec<Pose2> = nodes.iter().map(|node| node.recorded).collect();
        let step = |to: usize| Edge {
            from: to - 1,
            to,
            measured: poses[to - 1].between(&poses[to]),
            information: Matrix3::from_diagonal(&[1e4, 1e4, 1e4].into()),
        };
        let chain: Vec<Edge> = (1..poses.len()).map(step).collect();
        let members: Vec<usize> = (0..poses.len()).collect();
        of_poses(&members, &nodes, &poses, &chain, &JointParams::default()).unwrap()
    }

    #[test]
    fn along_a_bare_corridor_the_covariance_grows_step_by_step_and_across_it_stays_small() {
        let found = along(None, 0.0);
        let sigma_m = |node: usize, axis: usize| found[node][(axis, axis)].sqrt();
        assert!(sigma_m(0, 0) < 1e-4, "the first pose is exact");
        // Worked out by hand: steps of 1 cm count as 3 cm where they add up. Between two knots, three nodes
        // apart, node 56 is off by 54 + 3 (2/3)^2 steps' variance. On the map steps count once: half of three
        // for a node between others, three for the first one, a ninth of each.
        for (node, steps) in [(14, 13.83), (56, 55.83_f64)] {
            let (expected_m, found_m) = (0.03 * steps.sqrt(), sigma_m(node, 0));
            assert!((found_m / expected_m - 1.0).abs() < 0.02, "{node}: {found_m} m, {expected_m} m");
        }
        // Noise tilts pieces of wall, so that they seem to know something of the way along them: 0.157 m
        // instead of 0.226 m.
        let noisy_m = along(None, 0.01)[56][(0, 0)].sqrt();
        assert!((0.14..0.23).contains(&noisy_m), "{noisy_m}");
        assert!(sigma_m(56, 0) > 10.0 * sigma_m(56, 1), "{} {}", sigma_m(56, 0), sigma_m(56, 1));
        assert!(found.iter().all(|covariance| covariance.cholesky().is_some()));
    }

    #[test]
    fn a_wall_ahead_makes_the_poses_sure_that_see_it_of_each_other() {
        let (bare, closed) = (along(None, 0.01), along(Some(4.0), 0.01));
        // The first nodes all see the wall at 4 m.
        let (bare_m, closed_m) = (bare[10][(0, 0)].sqrt(), closed[10][(0, 0)].sqrt());
        assert!(closed_m < 0.5 * bare_m, "{closed_m} {bare_m}");
    }

    #[test]
    fn a_noisier_laser_gives_larger_covariances() {
        let [fine, rough] = [0.005, 0.02].map(|noise_m| along(None, noise_m)[40][(1, 1)].sqrt());
        assert!(rough > 1.2 * fine, "{rough} {fine}");
    }
}
