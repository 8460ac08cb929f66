//! What each node saw of each surface of a common map, and how well they agree.
//!
//! A row is a surface across its line, or one axis of a surface that is no line (a leg, a corner). All of a
//! node's points on it are one observation: a weight, a mean offset, and the lever by which the node's turn
//! moves them. The cost is the weighted variance of the offsets of each row, so the rows' own places drop
//! out; its Hessian is a Laplacian among the nodes, and moving all of them together costs nothing. Steps of a
//! node are (x, y) along the map's axes and the turn about itself (meters, radians).
//!
//! What is no line has a depth. A laser sees the side of a pole or trunk that is turned to it: one side
//! before it drives past, the other one afterwards. Taken for one place they make the way shorter, by half a
//! millimeter a meter around a building. So how far each such surface stands out towards the laser is
//! unknown, too, and drops out like its place.

use biplane_matcher::Pose2;
use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;

use crate::slam::keyframes::Node;
use crate::slam::refinement::node_map::{NodeMap, Observation, ROWS};
use crate::slam::refinement::params::{JointParams, Level};

/// Standard deviation of what is no line towards the laser, off its middle, meters. Larger: what stands about
/// tells less of the way by it; smaller: thick trunks make it too short.
const DEPTH_M: f64 = 0.3;

/// Whether a row is one of what is no line.
fn has_depth(row: usize) -> bool {
    !row.is_multiple_of(ROWS)
}

/// The observations of what is no line, in their order.
fn deep(of_node: &[Vec<Observation>]) -> Vec<Deep> {
    let places = (0..).zip(of_node).flat_map(|(node, seen)| (0..).zip(seen).map(move |seen| (node, seen)));
    (0..)
        .zip(places)
        .filter(|(_, (_, (_, observation)))| has_depth(observation.row as usize))
        .map(|(number, (node, (at, _)))| Deep { node, at, number })
        .collect()
}

/// What all nodes together tell of a number.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Estimate {
    /// The number.
    pub value: f64,
    /// How surely it is known, 1 / its square's unit.
    pub weight: f64,
}

/// What all nodes together tell of the surfaces.
#[derive(Clone, Debug)]
pub(crate) struct Known {
    /// How far each row lies off its surface's place, meters.
    pub places: Vec<Estimate>,
    /// How far each surface stands out towards the laser, meters; zero for lines.
    pub depths: Vec<Estimate>,
    /// The mean of `towards` of each row.
    pub towards: Vec<f64>,
}

/// What one node saw of one row, for others to look at.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Seen {
    /// The row.
    pub row: usize,
    /// How far a step of the node moves what it saw across the row.
    pub step: Vector3<f64>,
    /// 1 / m^2.
    pub weight: f64,
    /// How far off it lies, meters.
    pub offset_m: f64,
}

/// See the module's text.
#[derive(Clone, Debug)]
pub(crate) struct Observations {
    /// The direction of each row.
    directions: Vec<[f64; 2]>,
    /// Weight of all observations of each row.
    sums: Vec<f64>,
    /// The mean of `towards` of each row.
    towards: Vec<f64>,
    /// How surely the depth of each surface is known, 1 / m^2.
    depth_sums: Vec<f64>,
    /// By node, in the order of rows.
    of_node: Vec<Vec<Observation>>,
    /// Those of what is no line.
    deep: Vec<Deep>,
}

/// Which observation is one of what is no line: its node, its number there, and that among all.
#[derive(Clone, Copy, Debug)]
struct Deep {
    node: u32,
    at: u32,
    number: u32,
}

impl Observations {
    /// Maps the nodes at these poses, and looks what each saw of the map.
    pub(crate) fn new(nodes: &[&Node], poses: &[Pose2], level: &Level, params: &JointParams) -> Self {
        Self::of(&NodeMap::new(nodes, poses, level, params), nodes, poses)
    }

    /// Looks what each node saw of a map.
    pub(crate) fn of(map: &NodeMap<'_>, nodes: &[&Node], poses: &[Pose2]) -> Self {
        let of_node: Vec<Vec<Observation>> =
            nodes.par_iter().zip(poses).map(|(node, pose)| map.seen(&node.keyframe_scan, pose)).collect();
        let directions = map.directions();
        let mut sums = vec![0.0; directions.len()];
        for observation in of_node.iter().flatten() {
            sums[observation.row as usize] += observation.weight;
        }
        let deep = deep(&of_node);
        let mut found = Self { directions, sums, towards: Vec::new(), depth_sums: Vec::new(), of_node, deep };
        let towards = found.values(|_, observation| observation.towards);
        found.towards = found.means(&towards);
        found.depth_sums = found.depth_pulls(&found.towards, &towards);
        found.depth_sums.iter_mut().for_each(|sum| *sum += DEPTH_M.powi(-2));
        found
    }

    /// Adds the Hessian times `steps` to `out`.
    pub(crate) fn apply(&self, steps: &[[f64; 3]], out: &mut [[f64; 3]]) {
        let across = |node: usize, observation: &Observation| {
            let ([x, y], by) = (self.directions[observation.row as usize], &steps[node]);
            x * by[0] + y * by[1] + observation.lever_m * by[2]
        };
        self.spread(&self.values(across), out);
    }

    /// Adds the gradient to `out`.
    pub(crate) fn gradient(&self, out: &mut [[f64; 3]]) {
        self.spread(&self.values(|_, observation| observation.offset_m), out);
    }

    /// A number for each observation, node by node.
    fn values(&self, value: impl Fn(usize, &Observation) -> f64) -> Vec<f64> {
        let mut values = Vec::with_capacity(self.of_node.iter().map(Vec::len).sum());
        for (node, observations) in self.of_node.iter().enumerate() {
            values.extend(observations.iter().map(|observation| value(node, observation)));
        }
        values
    }

    /// Adds what the rows say of each node when its observations are off by `values`.
    fn spread(&self, values: &[f64], out: &mut [[f64; 3]]) {
        let means = self.means(values);
        let mut depths = self.depth_pulls(&means, values);
        for (depth, sum) in depths.iter_mut().zip(&self.depth_sums) {
            *depth /= sum;
        }
        let mut values = values.iter();
        for (observations, out) in self.of_node.iter().zip(out) {
            for (observation, value) in observations.iter().zip(&mut values) {
                let row = observation.row as usize;
                let [x, y] = self.directions[row];
                let mut off = value - means[row];
                if has_depth(row) {
                    off -= depths[row / ROWS] * (observation.towards - self.towards[row]);
                }
                let push = observation.weight * off;
                out[0] += x * push;
                out[1] += y * push;
                out[2] += observation.lever_m * push;
            }
        }
    }

    /// The weighted mean of the values of each row.
    fn means(&self, values: &[f64]) -> Vec<f64> {
        let mut means = vec![0.0; self.sums.len()];
        for (observation, value) in self.of_node.iter().flatten().zip(values) {
            means[observation.row as usize] += observation.weight * value;
        }
        for (mean, sum) in means.iter_mut().zip(&self.sums) {
            *mean = if *sum > 0.0 { *mean / sum } else { 0.0 };
        }
        means
    }

    /// What values, off their means, say of the depth of each surface.
    fn depth_pulls(&self, means: &[f64], values: &[f64]) -> Vec<f64> {
        let mut pulls = vec![0.0; self.sums.len() / ROWS];
        for &Deep { node, at, number } in &self.deep {
            let observation = &self.of_node[node as usize][at as usize];
            let row = observation.row as usize;
            let towards = observation.towards - self.towards[row];
            pulls[row / ROWS] += observation.weight * towards * (values[number as usize] - means[row]);
        }
        pulls
    }

    /// The Hessian's part that comes from what two nodes saw both: blocks (one, one), (one, other), (other,
    /// other).
    pub(crate) fn common(&self, one: usize, other: usize) -> [Matrix3<f64>; 3] {
        let mut blocks = [Matrix3::zeros(); 3];
        let (mut ones, mut others) =
            (self.of_node[one].iter().peekable(), self.of_node[other].iter().peekable());
        while let (Some(a), Some(b)) = (ones.peek(), others.peek()) {
            match a.row.cmp(&b.row) {
                std::cmp::Ordering::Less => drop(ones.next()),
                std::cmp::Ordering::Greater => drop(others.next()),
                std::cmp::Ordering::Equal => {
                    let weight = a.weight * b.weight / self.sums[a.row as usize];
                    let (x, y) = (self.row(a), self.row(b));
                    blocks[0] += x * (x.transpose() * weight);
                    blocks[1] -= x * (y.transpose() * weight);
                    blocks[2] += y * (y.transpose() * weight);
                    ones.next();
                    others.next();
                }
            }
        }
        blocks
    }

    /// The Hessian's block of one node.
    pub(crate) fn diagonal(&self, node: usize) -> Matrix3<f64> {
        let part = |observation: &Observation| {
            let row = self.row(observation);
            row * (row.transpose()
                * (observation.weight * (1.0 - observation.weight / self.sums[observation.row as usize])))
        };
        self.of_node[node].iter().map(part).sum()
    }

    /// The covariance of the pull on one node when each row that it saw is off by this variance, however many
    /// beams met it.
    pub(crate) fn common_pull(&self, node: usize, variance_m2: f64) -> Matrix3<f64> {
        let part = |observation: &Observation| {
            let row = self.row(observation);
            row * (row.transpose() * (observation.weight.powi(2) * variance_m2))
        };
        self.of_node[node].iter().map(part).sum()
    }

    /// What the nodes, where they are, tell of the surfaces.
    pub(crate) fn known(&self) -> Known {
        let offsets = self.values(|_, observation| observation.offset_m);
        let means = self.means(&offsets);
        let pulls = self.depth_pulls(&means, &offsets);
        let estimate = |(value, &weight): (f64, &f64)| Estimate { value, weight };
        Known {
            places: means.into_iter().zip(&self.sums).map(estimate).collect(),
            depths: pulls
                .iter()
                .zip(&self.depth_sums)
                .map(|(pull, sum)| estimate((pull / sum, sum)))
                .collect(),
            towards: self.towards.clone(),
        }
    }

    /// How many rows there are.
    pub(crate) fn row_count(&self) -> usize {
        self.directions.len()
    }

    /// What a node saw, in the order of rows.
    pub(crate) fn seen_by(&self, node: usize) -> impl Iterator<Item = Seen> {
        let of = |observation: &Observation| Seen {
            row: observation.row as usize,
            step: self.row(observation),
            weight: observation.weight,
            offset_m: observation.offset_m,
        };
        self.of_node[node].iter().map(of)
    }

    fn row(&self, observation: &Observation) -> Vector3<f64> {
        let [x, y] = self.directions[observation.row as usize];
        Vector3::new(x, y, observation.lever_m)
    }
}
