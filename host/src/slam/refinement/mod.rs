//! The last step: all scans and one map of all of them, together.
//!
//! The map is the matcher's: small surfaces with normals, here of every node at its pose. Each surface says
//! of each node that saw it how far that node's points lie off across it
//! ([`crate::slam::refinement::observations`]). Poses are sought for which the nodes agree on every surface,
//! where the surface itself lies being unknown, so that each beam counts once however many nodes saw the same
//! wall; and no map that was there first draws the others to it. With the steps between nodes this is one
//! large system, solved by conjugate gradients ([`crate::slam::refinement::conjugate_gradient`]). A few
//! rounds, each with a new map at the poses found so far.
//!
//! That is planar. What both lasers saw together, and poses with height, roll and pitch: [`spatial`].

pub(crate) mod conjugate_gradient;
pub(crate) mod every_scan;
pub(crate) mod node_map;
pub(crate) mod observations;
pub(crate) mod params;
pub(crate) mod spatial;

pub(crate) use params::JointParams;

use biplane_matcher::Pose2;

use crate::slam::keyframes::Node;
use crate::slam::pose_graph::Edge;
use crate::slam::refinement::conjugate_gradient::ConjugateGradient;
use crate::slam::refinement::observations::Observations;

/// Refines the poses of some of all nodes, by their ascending numbers, and leaves the others as they are.
pub(crate) fn refine_some(
    members: &[usize],
    nodes: &[Node],
    poses: &mut [Pose2],
    chain: &[Edge],
    params: &JointParams,
    progress: &mut dyn FnMut(usize),
) {
    let place = |node: usize| members.binary_search(&node).ok();
    let inner = |edge: &Edge| Some(Edge { from: place(edge.from)?, to: place(edge.to)?, ..*edge });
    let chain: Vec<Edge> = chain.iter().filter_map(inner).collect();
    let nodes: Vec<&Node> = members.iter().map(|&node| &nodes[node]).collect();
    let mut moving: Vec<Pose2> = members.iter().map(|&node| poses[node]).collect();
    refine(&nodes, &mut moving, &chain, params, progress);
    for (&node, pose) in members.iter().zip(moving) {
        poses[node] = pose;
    }
}

/// Refines the poses of nodes that are in one frame; the first one stays. `chain` has the steps between them;
/// `progress` hears of each round.
fn refine(
    nodes: &[&Node],
    poses: &mut [Pose2],
    chain: &[Edge],
    params: &JointParams,
    progress: &mut dyn FnMut(usize),
) {
    let conjugate_gradient = ConjugateGradient::new(poses, chain);
    let levels = params.levels.iter().flat_map(|level| std::iter::repeat_n(level, level.rounds));
    for (round, level) in levels.enumerate() {
        progress(round);
        let observations = Observations::new(nodes, poses, level, params);
        let Some(steps) = conjugate_gradient.step(&observations, poses) else { return };
        for (pose, by) in poses.iter_mut().zip(steps) {
            *pose = pose.stepped(by);
        }
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use biplane_matcher::{EndPoint, Kind, Pose2};
    use nalgebra::Matrix3;

    use super::refine_some;
    use crate::slam::keyframes::Node;
    use crate::slam::keyframes::keyframe_scan::KeyframeScan;
    use crate::slam::pose_graph::Edge;
    use crate::slam::refinement::observations::Observations;
    use crate::slam::refinement::params::JointParams;

    /// The walls of a room 8 m by 6 m, as they are seen from this pose: points of its own, without noise.
    pub(crate) fn scan_of_room(truth: &Pose2, phase_m: f64) -> KeyframeScan {
        let (back, turn) = (truth.inverse(), Pose2::new(0.0, 0.0, -truth.theta_rad));
        let wall = |at: [f64; 2], normal: [f64; 2]| EndPoint {
            at_m: back.transform(at).map(|value| value as f32),
            normal: turn.transform(normal).map(|value| value as f32),
            kind: Kind::Line,
            weight: 1.0,
            ..EndPoint::default()
        };
        let mut points = Vec::new();
        for step in 0..60 {
            let along = f64::from(step) * 0.1 + phase_m;
            points.push(wall([along - 3.0, 3.0], [0.0, -1.0]));
            points.push(wall([along - 3.0, -3.0], [0.0, 1.0]));
            points.push(wall([4.0, along - 3.0], [-1.0, 0.0]));
            points.push(wall([-4.0, along - 3.0], [1.0, 0.0]));
        }
        KeyframeScan { points, laser_m: [0.0; 2] }
    }

    fn drive() -> (Vec<Pose2>, Vec<Node>) {
        let truth: Vec<Pose2> = (0..12)
            .map(|at| f64::from(at) * 0.3)
            .map(|way| Pose2::new(way - 1.8, 0.5 * way.sin(), 0.2 * way))
            .collect();
        let nodes = truth
            .iter()
            .enumerate()
            .map(|(at, pose)| Node::at(*pose, scan_of_room(pose, 0.013 * at as f64)))
            .collect();
        (truth, nodes)
    }

    /// Poses that are centimeters off, but for the first one.
    fn disturbed(truth: &[Pose2]) -> Vec<Pose2> {
        let off = |at: usize| ((at * 7919) % 13) as f64 / 6.0 - 1.0;
        let moved = |(at, pose): (usize, &Pose2)| match at {
            0 => *pose,
            _ => Pose2::new(
                pose.x_m + 0.03 * off(at),
                pose.y_m - 0.03 * off(at + 5),
                pose.theta_rad + 0.01 * off(at + 2),
            ),
        };
        truth.iter().enumerate().map(moved).collect()
    }

    /// Steps that say next to nothing.
    fn chain(poses: &[Pose2]) -> Vec<Edge> {
        let step = |to: usize| Edge {
            from: to - 1,
            to,
            measured: poses[to - 1].between(&poses[to]),
            information: Matrix3::identity(),
        };
        (1..poses.len()).map(step).collect()
    }

    #[test]
    fn scans_of_one_room_come_to_lie_upon_each_other_and_others_stay() {
        let (truth, mut nodes) = drive();
        let mut poses = disturbed(&truth);
        // One more node, which is not among the members.
        nodes.push(Node::at(Pose2::IDENTITY, scan_of_room(&Pose2::IDENTITY, 0.0)));
        poses.push(Pose2::new(5.0, 5.0, 1.0));
        let members: Vec<usize> = (0..truth.len()).collect();
        let mut rounds = 0;
        let chain = chain(&poses[..truth.len()]);
        refine_some(&members, &nodes, &mut poses, &chain, &JointParams::default(), &mut |_| rounds += 1);
        for (pose, truth) in poses.iter().zip(&truth) {
            let off = truth.between(pose);
            assert!(off.distance_m() < 3e-3 && off.theta_rad.abs() < 5e-4, "{pose:?} is not {truth:?}");
        }
        assert_eq!(poses[truth.len()], Pose2::new(5.0, 5.0, 1.0));
        assert_eq!(rounds, JointParams::default().rounds());
    }

    /// Poles 3 cm thick on both sides of a straight way, as a node on it sees them: the side that is turned
    /// to it.
    fn among_poles(truth: Pose2) -> Node {
        let mut points = Vec::new();
        for number in 0..24 {
            let middle = [f64::from(number) - 6.0, if number % 2 == 0 { 2.0 } else { -2.5 }];
            let away = [middle[0] - truth.x_m, middle[1]];
            let far_m = away[0].hypot(away[1]);
            let at_m = away.map(|axis| (axis * (1.0 - 0.015 / far_m)) as f32);
            if far_m < 6.0 {
                points.push(EndPoint { at_m, kind: Kind::Point, weight: 1.0, ..EndPoint::default() });
            }
        }
        Node::at(truth, KeyframeScan { points, laser_m: [0.0; 2] })
    }

    #[test]
    fn poles_that_are_seen_from_before_and_behind_do_not_make_the_way_shorter() {
        let truth: Vec<Pose2> = (0..40).map(|at| Pose2::new(0.3 * f64::from(at), 0.0, 0.0)).collect();
        let nodes: Vec<Node> = truth.iter().map(|pose| among_poles(*pose)).collect();
        let members: Vec<usize> = (0..truth.len()).collect();
        let mut poses = truth.clone();
        let chain = chain(&truth);
        refine_some(&members, &nodes, &mut poses, &chain, &JointParams::default(), &mut |_| ());
        let short_m = truth[39].x_m - poses[39].x_m;
        assert!(short_m.abs() < 0.003, "{short_m} m of {} m", truth[39].x_m);
    }

    #[test]
    fn to_move_all_nodes_together_costs_nothing() {
        let (truth, nodes) = drive();
        let poses = disturbed(&truth);
        let nodes: Vec<&Node> = nodes.iter().collect();
        let params = JointParams::default();
        let observations = Observations::new(&nodes, &poses, &params.levels[1], &params);
        for [x, y, turn] in [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]] {
            // A turn about the map's origin moves each node along, too.
            let together: Vec<[f64; 3]> =
                poses.iter().map(|pose| [x - turn * pose.y_m, y + turn * pose.x_m, turn]).collect();
            let (mut held, mut alone) = (vec![[0.0; 3]; poses.len()], vec![[0.0; 3]; poses.len()]);
            observations.apply(&together, &mut held);
            let mut one = vec![[0.0; 3]; poses.len()];
            one[5] = together[5];
            observations.apply(&one, &mut alone);
            let size =
                |of: &[[f64; 3]]| of.as_flattened().iter().map(|value| value.abs()).fold(0.0, f64::max);
            assert!(size(&held) < 1e-9 * size(&alone), "{} of {}", size(&held), size(&alone));
        }
    }
}
