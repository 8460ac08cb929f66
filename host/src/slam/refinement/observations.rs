//! What each node saw of each surface of a common map, and how well they agree.
//!
//! A row is a surface across its line, or one axis of a surface that is no line (a leg, a corner). All of a
//! node's points on it are one observation: a weight, a mean offset, and the lever by which the node's turn
//! moves them. The cost is the weighted variance of the offsets of each row, so the rows' own places drop
//! out; its Hessian is a Laplacian among the nodes, and moving all of them together costs nothing. Steps of a
//! node are (x, y) along the map's axes and the turn about itself (meters, radians).

use biplane_geometry::PortableMath;
use biplane_geometry::vec2::{cross, dot};
use biplane_matcher::{EndPoint, Kind, LocalMap, MapParams, Placement, Pose2, Surfel};
use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;

use crate::slam::keyframes::Node;
use crate::slam::refinement::params::JointParams;
use crate::slam::refinement::params::Level;

/// Memory of the map: tiles of 32 cells' side, and surfaces. What does not fit is not compared.
const TILES: usize = 16_384;
const SURFACES: usize = 4_000_000;
/// The mean of a surface counts at most so many points.
const MEMORY_HITS: f64 = 1000.0;
/// Cosine between the directions of one surface's points.
const SAME_DIRECTION: f64 = 0.7;
/// The same between surfaces that go on in one line.
const SAME_LINE: f64 = 0.9;
/// A point's own direction tells as much of its surface's as a second point this far along it, meters.
const DIRECTION_LEVER_M: f64 = 0.03;

/// What one node saw of one row.
#[derive(Clone, Copy, Debug)]
struct Observation {
    row: u32,
    /// 1 / m^2.
    weight: f64,
    offset_m: f64,
    lever_m: f64,
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
    /// By node, in the order of rows.
    of_node: Vec<Vec<Observation>>,
}

impl Observations {
    /// Maps the nodes at these poses, and looks what each saw of the map.
    pub(crate) fn new(nodes: &[&Node], poses: &[Pose2], level: &Level, params: &JointParams) -> Self {
        let map = map(nodes, poses, level);
        let straight = |surface| direction(&map, surface, level, params.straight_m);
        let normals: Vec<[f64; 2]> = map.surfels().par_iter().map(straight).collect();
        let watch = Watch { map: &map, normals: &normals, level, params };
        let of_node: Vec<Vec<Observation>> = nodes
            .par_iter()
            .zip(poses)
            .map(|(node, pose)| watch.of(&node.keyframe_scan.points, pose))
            .collect();
        let directions: Vec<[f64; 2]> =
            normals.iter().flat_map(|normal| [*normal, [1.0, 0.0], [0.0, 1.0]]).collect();
        let mut sums = vec![0.0; directions.len()];
        for observation in of_node.iter().flatten() {
            sums[observation.row as usize] += observation.weight;
        }
        Self { directions, sums, of_node }
    }

    /// Adds the Hessian times `steps` to `out`.
    pub(crate) fn apply(&self, steps: &[[f64; 3]], out: &mut [[f64; 3]]) {
        let across = |node: usize, observation: &Observation| {
            let ([x, y], by) = (self.directions[observation.row as usize], &steps[node]);
            x * by[0] + y * by[1] + observation.lever_m * by[2]
        };
        self.spread(across, out);
    }

    /// Adds the gradient to `out`.
    pub(crate) fn gradient(&self, out: &mut [[f64; 3]]) {
        self.spread(|_, observation| observation.offset_m, out);
    }

    /// Adds what the rows say of each node when each of its observations is off by `value`.
    fn spread(&self, value: impl Fn(usize, &Observation) -> f64, out: &mut [[f64; 3]]) {
        let mut means = vec![0.0; self.sums.len()];
        for (node, observations) in self.of_node.iter().enumerate() {
            for observation in observations {
                means[observation.row as usize] += observation.weight * value(node, observation);
            }
        }
        for (mean, sum) in means.iter_mut().zip(&self.sums) {
            *mean = if *sum > 0.0 { *mean / sum } else { 0.0 };
        }
        for ((node, observations), out) in self.of_node.iter().enumerate().zip(out) {
            for observation in observations {
                let [x, y] = self.directions[observation.row as usize];
                let push = observation.weight * (value(node, observation) - means[observation.row as usize]);
                out[0] += x * push;
                out[1] += y * push;
                out[2] += observation.lever_m * push;
            }
        }
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

    /// How many nodes there are.
    pub(crate) fn node_count(&self) -> usize {
        self.of_node.len()
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

fn map(nodes: &[&Node], poses: &[Pose2], level: &Level) -> LocalMap {
    let mut map = LocalMap::new(MapParams {
        cell_m: level.cell_m,
        merge_across_m: level.merge_m,
        reach_m: 2.0 * level.cell_m,
        memory_hits: MEMORY_HITS,
        tiles: TILES,
        surfaces: SURFACES,
    });
    for (node, pose) in nodes.iter().zip(poses) {
        map.add(pose, &node.keyframe_scan.points);
    }
    map
}

/// The normal of a surface: of the line through those on either side that go on with it, since the normals of
/// single scans are noisy.
fn direction(map: &LocalMap, surface: &Surfel, level: &Level, straight_m: f64) -> [f64; 2] {
    let own = unit(surface.normal);
    if !map.is_line(surface) {
        return own;
    }
    let steps = (straight_m / level.cell_m).round().max(1.0) as i32;
    let (mut hits, mut sums, mut last) = (0.0, [0.0; 4], None);
    for step in -steps..=steps {
        let path_m = (f64::from(step) * level.cell_m) as f32;
        let [x, y] = own.map(|part| part as f32);
        let index = map.nearest_index([surface.at_m[0] - y * path_m, surface.at_m[1] + x * path_m]);
        let Some(other) = index.filter(|_| index != last).map(|index| &map.surfels()[index as usize]) else {
            continue;
        };
        last = index;
        let away = [0, 1].map(|axis| f64::from(other.at_m[axis] - surface.at_m[axis]));
        let (across, along) = (dot(away, own), away[1] * own[0] - away[0] * own[1]);
        let goes_on = map.is_line(other)
            && dot(unit(other.normal), own) > SAME_LINE
            && across.abs() < level.merge_m
            && along.abs() < straight_m + level.cell_m;
        if goes_on {
            let weight = f64::from(other.hits);
            hits += weight;
            for (sum, term) in sums.iter_mut().zip([along, across, along * along, along * across]) {
                *sum += weight * term;
            }
        }
    }
    let [along, across, squares, products] = sums;
    let hits_or_one = f64::max(hits, 1.0);
    let spread = squares - along * along / hits_or_one + f64::from(surface.hits) * DIRECTION_LEVER_M.powi(2);
    let slope = (products - along * across / hits_or_one) / spread;
    let length = slope.portable_hypot(1.0);
    // The tangent is (-y, x): where the line rises along it, the normal leans back.
    [(own[0] + slope * own[1]) / length, (own[1] - slope * own[0]) / length]
}

/// What points are looked at with.
struct Watch<'a> {
    map: &'a LocalMap,
    normals: &'a [[f64; 2]],
    level: &'a Level,
    params: &'a JointParams,
}

impl Watch<'_> {
    /// What a node at a pose saw.
    fn of(&self, points: &[EndPoint], pose: &Pose2) -> Vec<Observation> {
        let placement = Placement::new(pose);
        let mut found = Vec::with_capacity(points.len());
        for point in points {
            self.look(point, &placement, pose, &mut found);
        }
        found.sort_by_key(|observation| observation.row);
        found.dedup_by(|more, observation| {
            let same = more.row == observation.row;
            if same {
                observation.weight += more.weight;
                observation.offset_m +=
                    (more.offset_m - observation.offset_m) * more.weight / observation.weight;
            }
            same
        });
        found
    }

    fn look(&self, point: &EndPoint, placement: &Placement, pose: &Pose2, found: &mut Vec<Observation>) {
        if point.weight <= 0.0 {
            return; // in one place with its neighbors, which count for it
        }
        let EndPoint { at_m, normal, .. } = point.placed(placement);
        let Some(index) = self.map.nearest_index(at_m) else { return };
        let surface = &self.map.surfels()[index as usize];
        let offset = [0, 1].map(|axis| f64::from(at_m[axis] - surface.at_m[axis]));
        let arm = [f64::from(surface.at_m[0]) - pose.x_m, f64::from(surface.at_m[1]) - pose.y_m];
        let mut push = |kind: u32, direction: [f64; 2], noise_m: f64, squared: f64| {
            let robust = 1.0 / (1.0 + squared / self.level.scale_m.powi(2));
            let independent = robust / self.params.beams_per_independent_one;
            found.push(Observation {
                row: 3 * index + kind,
                weight: f64::from(point.weight) * independent / noise_m.powi(2),
                offset_m: dot(offset, direction),
                lever_m: cross(arm, direction),
            });
        };
        if self.map.is_line(surface) {
            let across = self.normals[index as usize];
            if point.has_normal() && dot(normal.map(f64::from), across) < SAME_DIRECTION {
                return; // another face, or a wall that turns away
            }
            push(0, across, self.level.noise_m, dot(offset, across).powi(2));
        } else if point.kind == Kind::Point {
            let noise_m = self.level.noise_m * self.params.point_noise;
            push(1, [1.0, 0.0], noise_m, dot(offset, offset));
            push(2, [0.0, 1.0], noise_m, dot(offset, offset));
        }
    }
}

fn unit(v: [f32; 2]) -> [f64; 2] {
    let [x, y] = v.map(f64::from);
    let length = x.portable_hypot(y).max(1e-9);
    [x / length, y / length]
}
