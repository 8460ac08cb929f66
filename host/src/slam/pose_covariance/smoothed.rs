//! How far a scan lies off the map that it is laid on, by the noise of its own beams.
//!
//! Scans between two nodes are laid on the map as the nodes are, and steps join one to the next
//! ([`crate::slam::refinement::every_scan`]): each place is what a few scans before and after say of it. That
//! filter is run here with the weights that it was made with, and the noise as it is found is carried along.

use biplane_matcher::Pose2;
use nalgebra::Matrix3;

use crate::slam::pose_covariance::map_motion::{about, back_from};

/// Scans between two nodes count at most so many: what a robot sees that stands still. More tell no more.
const MAX_SCANS: usize = 64;

/// A step between two nodes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Step {
    /// The nodes.
    pub from: usize,
    pub to: usize,
    /// Scans from one to the other, at least one.
    pub scans: usize,
    /// What the step says of the pose `to`, as it was weighed.
    pub held: Matrix3<f64>,
}

/// What nodes say of their poses, where they are.
pub(super) struct Chain<'a> {
    pub poses: &'a [Pose2],
    /// What each scan says, as it was weighed.
    pub seen: &'a [Matrix3<f64>],
    /// By ascending nodes.
    pub steps: &'a [Step],
    /// The variance of what scans say, as a multiple of what they were weighed with.
    pub noise: f64,
    /// The same of steps.
    pub step_noise: f64,
    /// Nodes farther off than so many stay where they are.
    pub reach: usize,
}

/// What neighbors on one side say of a pose: as it is weighed, and how far it is off.
#[derive(Clone, Copy, Debug)]
struct Known {
    information: Matrix3<f64>,
    covariance: Matrix3<f64>,
}

impl Chain<'_> {
    /// The covariance of a node's pose, the map being exact.
    pub(super) fn covariance(&self, node: usize) -> Option<Matrix3<f64>> {
        let center = self.poses[node];
        let from_here =
            |pose: &Pose2| Pose2::new(pose.x_m - center.x_m, pose.y_m - center.y_m, pose.theta_rad);
        let sides = [false, true].into_iter().filter_map(|is_after| self.beside(node, is_after, &from_here));
        let mut information = self.seen[node];
        let mut spread = self.seen[node] * self.noise;
        for Known { information: of_side, covariance } in sides {
            information += of_side;
            spread += of_side * covariance * of_side;
        }
        let known = information.cholesky()?.inverse();
        Some(known * spread * known)
    }

    /// What the nodes before it, or after it, say of a node's pose: motions of the map about that node.
    fn beside(&self, node: usize, is_after: bool, from_here: &impl Fn(&Pose2) -> Pose2) -> Option<Known> {
        let way = self.way(node, is_after);
        if way.is_empty() {
            return None;
        }
        // As the filter takes it, and as it is. The farthest node stays.
        let (mut taken, mut is) = (Matrix3::<f64>::zeros(), Matrix3::<f64>::zeros());
        for (number, (from, step)) in way.iter().rev().enumerate() {
            let back = back_from(&from_here(&self.poses[step.to]));
            let walk = back * step.held.cholesky()?.inverse() * back.transpose() / step.scans as f64;
            let by = about(&from_here(&self.poses[*from]));
            let seen = by.transpose() * self.seen[*from] * by;
            for scan in 0..step.scans {
                if number > 0 || scan > 0 {
                    let left = (Matrix3::identity() + taken * seen).try_inverse()?;
                    taken = left * taken;
                    is = left * is * left.transpose() + taken * seen * taken.transpose() * self.noise;
                }
                taken += walk;
                is += walk * self.step_noise;
            }
        }
        let symmetric = (taken + taken.transpose()) * 0.5;
        Some(Known { information: symmetric.cholesky()?.inverse(), covariance: is })
    }

    /// The steps from a node, as far as its neighbors reach, each with its farther node.
    fn way(&self, node: usize, is_after: bool) -> Vec<(usize, &Step)> {
        let mut way = Vec::new();
        let mut at = node;
        while way.len() < self.reach {
            let Some(step) = (if is_after { self.after(at) } else { self.before(at) }) else { break };
            at = if is_after { step.to } else { step.from };
            way.push((at, step));
        }
        way
    }

    fn after(&self, node: usize) -> Option<&Step> {
        let at = self.steps.partition_point(|step| step.from < node);
        self.steps.get(at).filter(|step| step.from == node)
    }

    fn before(&self, node: usize) -> Option<&Step> {
        let at = self.steps.partition_point(|step| step.to < node);
        self.steps.get(at).filter(|step| step.to == node)
    }
}

impl Step {
    /// With as many scans as lie between its nodes.
    pub(super) fn new(nodes: [usize; 2], scans: usize, held: Matrix3<f64>) -> Self {
        Self { from: nodes[0], to: nodes[1], scans: scans.clamp(1, MAX_SCANS), held }
    }
}

#[cfg(test)]
mod tests {
    use biplane_matcher::Pose2;
    use nalgebra::Matrix3;

    use super::{Chain, Step};

    /// The variance of the first of two nodes with scans of 1 cm each and a step of 1 cm between them.
    fn variance_m2(scans: usize) -> f64 {
        let poses = [Pose2::IDENTITY, Pose2::new(0.3, 0.0, 0.0)];
        let seen = [Matrix3::identity() * 1e4; 2];
        let steps = [Step::new([0, 1], scans, Matrix3::identity() * 1e4)];
        let chain =
            Chain { poses: &poses, seen: &seen, steps: &steps, noise: 1.0, step_noise: 1.0, reach: 3 };
        chain.covariance(0).unwrap()[(0, 0)]
    }

    #[test]
    fn many_scans_between_two_nodes_average_their_noise_out() {
        // One that sees and a neighbor that stays, equally sure: half of one's variance.
        assert!((variance_m2(1) - 5e-5).abs() < 1e-9, "{}", variance_m2(1));
        assert!(variance_m2(30) < 0.5 * variance_m2(1), "{}", variance_m2(30));
    }
}
