//! What a scan says of its pose, laid upon what the nodes saw; and the poses that many of them come to.

use biplane_matcher::Pose2;
use nalgebra::{Matrix3, Vector3};

use crate::slam::keyframes::Node;
use crate::slam::keyframes::keyframe_scan::KeyframeScan;
use crate::slam::pose_graph::solver::{Structure, System};
use crate::slam::pose_graph::{self, DAMPING, Edge};
use crate::slam::refinement::node_map::{NodeMap, Observation, ROWS};
use crate::slam::refinement::observations::{Known, Observations};
use crate::slam::refinement::params::JointParams;

/// What a scan says of its pose: to second order about where it is.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ScanCost {
    hessian: Matrix3<f64>,
    gradient: Vector3<f64>,
}

impl ScanCost {
    /// The same of a scan that is a node. All nodes move at once, each against a map that the others have
    /// made with it: half a step.
    pub(crate) fn of_node(self) -> Self {
        Self { hessian: 2.0 * self.hessian, ..self }
    }
}

/// What all nodes of a frame tell of the surfaces about them.
pub(crate) struct FixedMap<'a> {
    map: NodeMap<'a>,
    directions: Vec<[f64; 2]>,
    known: Known,
}

impl<'a> FixedMap<'a> {
    /// Of nodes in one frame, at these poses.
    pub(crate) fn new(nodes: &[&Node], poses: &[Pose2], params: &'a JointParams) -> Self {
        let [.., finest] = &params.levels;
        let map = NodeMap::new(nodes, poses, finest, params);
        let known = Observations::of(&map, nodes, poses).known();
        Self { directions: map.directions(), map, known }
    }

    /// What a scan at a pose says.
    pub(crate) fn cost(&self, scan: &KeyframeScan, pose: &Pose2) -> ScanCost {
        let mut cost = ScanCost { hessian: Matrix3::zeros(), gradient: Vector3::zeros() };
        let seen = self.map.seen(scan, pose);
        for of_surface in seen.chunk_by(|a, b| a.row as usize / ROWS == b.row as usize / ROWS) {
            self.add(of_surface, &mut cost);
        }
        cost
    }

    /// Adds what was seen of one surface: its own place and depth are known as well as the nodes tell them.
    fn add(&self, seen: &[Observation], cost: &mut ScanCost) {
        let surface = seen[0].row as usize / ROWS;
        let depth = &self.known.depths[surface];
        let (mut pull, mut off_depth, mut sum) = (Vector3::zeros(), 0.0, depth.weight);
        for seen in seen {
            let row = seen.row as usize;
            let place = self.known.places[row];
            if place.weight <= 0.0 {
                continue;
            }
            let [x, y] = self.directions[row];
            let step = Vector3::new(x, y, seen.lever_m);
            let weight = seen.weight * place.weight / (seen.weight + place.weight);
            let towards = seen.towards - self.known.towards[row];
            let off = seen.offset_m - place.value - towards * depth.value;
            cost.hessian += step * (step.transpose() * weight);
            cost.gradient += step * (weight * off);
            pull += step * (weight * towards);
            off_depth += weight * towards * off;
            sum += weight * towards * towards;
        }
        if sum > 0.0 {
            cost.hessian -= pull * (pull.transpose() / sum);
            cost.gradient -= pull * (off_depth / sum);
        }
    }
}

/// Moves the poses of scans, in their order, by what each says and by the steps between them.
pub(crate) fn smooth(poses: &mut [Pose2], costs: &[ScanCost], steps: &[Edge]) {
    let structure = Structure::new(poses.len(), steps.iter().map(|step| (step.from, step.to)));
    let mut system = System::new(&structure);
    for (number, cost) in costs.iter().enumerate() {
        system.add(number, &pose_graph::block(&cost.hessian), (-cost.gradient).into());
    }
    for step in steps {
        pose_graph::add_parts(&mut system, step, &pose_graph::parts(step, poses), 1.0);
    }
    system.damp(DAMPING);
    let Ok(by) = system.solve() else { return };
    for (pose, by) in poses.iter_mut().zip(by) {
        *pose = pose.stepped(by);
    }
}

#[cfg(test)]
mod tests {
    use biplane_matcher::Pose2;
    use nalgebra::{Matrix3, Vector3};

    use super::{FixedMap, ScanCost, smooth};
    use crate::slam::keyframes::Node;
    use crate::slam::pose_graph::Edge;
    use crate::slam::refinement::JointParams;
    use crate::slam::refinement::tests::scan_of_room;

    fn way(count: usize, step_m: f64) -> Vec<Pose2> {
        let at = |at: usize| step_m * at as f64;
        (0..count)
            .map(|number| Pose2::new(at(number) - 1.5, 0.3 * at(number).sin(), 0.2 * at(number)))
            .collect()
    }

    fn steps(poses: &[Pose2], sigma: f64) -> Vec<Edge> {
        let information = Matrix3::identity() / (sigma * sigma);
        let step =
            |to: usize| Edge { from: to - 1, to, measured: poses[to - 1].between(&poses[to]), information };
        (1..poses.len()).map(step).collect()
    }

    fn worst(poses: &[Pose2], truth: &[Pose2]) -> [f64; 2] {
        let off = poses.iter().zip(truth).map(|(pose, truth)| truth.between(pose));
        off.fold([0.0, 0.0], |[m, rad], off| [m.max(off.distance_m()), rad.max(off.theta_rad.abs())])
    }

    #[test]
    fn scans_between_nodes_come_to_lie_where_they_were_seen_from() {
        let truth = way(40, 0.05);
        let nodes: Vec<Node> =
            truth.iter().step_by(6).map(|pose| Node::at(*pose, scan_of_room(pose, 0.0))).collect();
        let places: Vec<Pose2> = nodes.iter().map(|node| node.recorded).collect();
        let params = JointParams::default();
        let map = FixedMap::new(&nodes.iter().collect::<Vec<_>>(), &places, &params);
        // The matcher leaped by 4 cm in the middle of a gap between two nodes.
        let leapt = |(at, pose): (usize, &Pose2)| match at % 6 {
            0 => *pose,
            1..4 => Pose2::new(pose.x_m + 0.04, pose.y_m - 0.02, pose.theta_rad + 0.005),
            _ => Pose2::new(pose.x_m - 0.04, pose.y_m + 0.02, pose.theta_rad - 0.005),
        };
        let mut poses: Vec<Pose2> = truth.iter().enumerate().map(leapt).collect();
        let steps = steps(&truth, 1.0);
        for _ in 0..3 {
            let costs: Vec<ScanCost> = poses
                .iter()
                .enumerate()
                .map(|(at, pose)| map.cost(&scan_of_room(&truth[at], 0.03), pose))
                .collect();
            smooth(&mut poses, &costs, &steps);
        }
        let [m, rad] = worst(&poses, &truth);
        assert!(m < 2e-3 && rad < 5e-4, "{m} m, {rad} rad");
    }

    #[test]
    fn a_node_takes_half_the_step() {
        let truth = Pose2::IDENTITY;
        let (alone, params) = (Node::at(truth, scan_of_room(&truth, 0.0)), JointParams::default());
        let map = FixedMap::new(&[&alone], &[truth], &params);
        let off = Pose2::new(0.02, 0.01, 0.0);
        let cost = map.cost(&alone.keyframe_scan, &off);
        let [whole, half] = [cost, cost.of_node()].map(|cost| {
            let mut poses = [off];
            smooth(&mut poses, &[cost], &[]);
            off.between(&poses[0]).distance_m()
        });
        assert!(whole > 0.01 && (half / whole - 0.5).abs() < 1e-6, "{half} m, {whole} m");
    }

    #[test]
    fn scans_that_say_nothing_lie_by_the_steps_between_those_that_do() {
        let truth = way(9, 0.1);
        let mut poses: Vec<Pose2> = truth.clone();
        for pose in &mut poses[1..8] {
            pose.x_m += 0.05;
        }
        let sure = ScanCost { hessian: Matrix3::identity() * 1e6, gradient: Vector3::zeros() };
        let silent = ScanCost { hessian: Matrix3::zeros(), gradient: Vector3::zeros() };
        let costs: Vec<ScanCost> = (0..9).map(|at| if at % 8 == 0 { sure } else { silent }).collect();
        for _ in 0..3 {
            let steps = steps(&truth, 0.01);
            smooth(&mut poses, &costs, &steps);
        }
        let [m, _] = worst(&poses, &truth);
        assert!(m < 1e-6, "{m} m");
    }
}
