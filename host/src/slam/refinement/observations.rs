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

use biplane_geometry::PortableMath;
use biplane_geometry::vec2::{cross, dot};
use biplane_matcher::{EndPoint, Kind, LocalMap, MapParams, Placement, Pose2, Surfel};
use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;

use crate::slam::keyframes::Node;
use crate::slam::keyframes::keyframe_scan::KeyframeScan;
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
/// Standard deviation of what is no line towards the laser, off its middle, meters. Larger: what stands about
/// tells less of the way by it; smaller: thick trunks make it too short.
const DEPTH_M: f64 = 0.3;

/// Rows of a surface: across its line, or x and y of what is no line.
const ROWS: usize = 3;

/// Whether a row is one of what is no line.
fn has_depth(row: usize) -> bool {
    !row.is_multiple_of(ROWS)
}

/// What one node saw of one row.
#[derive(Clone, Copy, Debug)]
struct Observation {
    row: u32,
    /// 1 / m^2.
    weight: f64,
    offset_m: f64,
    lever_m: f64,
    /// How far a meter towards the laser is across the row; zero for lines, which have no depth.
    towards: f64,
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
}

impl Observations {
    /// Maps the nodes at these poses, and looks what each saw of the map.
    pub(crate) fn new(nodes: &[&Node], poses: &[Pose2], level: &Level, params: &JointParams) -> Self {
        let map = map(nodes, poses, level);
        let straight = |surface| direction(&map, surface, level, params.straight_m);
        let normals: Vec<[f64; 2]> = map.surfels().par_iter().map(straight).collect();
        let watch = Watch { map: &map, normals: &normals, level, params };
        let of_node: Vec<Vec<Observation>> =
            nodes.par_iter().zip(poses).map(|(node, pose)| watch.of(&node.keyframe_scan, pose)).collect();
        let directions: Vec<[f64; 2]> =
            normals.iter().flat_map(|normal| [*normal, [1.0, 0.0], [0.0, 1.0]]).collect();
        let mut sums = vec![0.0; directions.len()];
        for observation in of_node.iter().flatten() {
            sums[observation.row as usize] += observation.weight;
        }
        let mut found = Self { directions, sums, towards: Vec::new(), depth_sums: Vec::new(), of_node };
        found.towards = found.means(|_, observation| observation.towards);
        let towards = |_: usize, observation: &Observation| observation.towards;
        found.depth_sums = found.depth_pulls(&found.towards, towards);
        found.depth_sums.iter_mut().for_each(|sum| *sum += DEPTH_M.powi(-2));
        found
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
        let means = self.means(&value);
        let mut depths = self.depth_pulls(&means, &value);
        for (depth, sum) in depths.iter_mut().zip(&self.depth_sums) {
            *depth /= sum;
        }
        for ((node, observations), out) in self.of_node.iter().enumerate().zip(out) {
            for observation in observations {
                let row = observation.row as usize;
                let [x, y] = self.directions[row];
                let mut off = value(node, observation) - means[row];
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

    /// The weighted mean of a value of each row.
    fn means(&self, value: impl Fn(usize, &Observation) -> f64) -> Vec<f64> {
        let mut means = vec![0.0; self.sums.len()];
        for (node, observations) in self.of_node.iter().enumerate() {
            for observation in observations {
                means[observation.row as usize] += observation.weight * value(node, observation);
            }
        }
        for (mean, sum) in means.iter_mut().zip(&self.sums) {
            *mean = if *sum > 0.0 { *mean / sum } else { 0.0 };
        }
        means
    }

    /// What a value, off its means, says of the depth of each surface.
    fn depth_pulls(&self, means: &[f64], value: impl Fn(usize, &Observation) -> f64) -> Vec<f64> {
        let mut pulls = vec![0.0; self.sums.len() / ROWS];
        for (node, observations) in self.of_node.iter().enumerate() {
            for observation in observations.iter().filter(|seen| has_depth(seen.row as usize)) {
                let row = observation.row as usize;
                let towards = observation.towards - self.towards[row];
                pulls[row / ROWS] += observation.weight * towards * (value(node, observation) - means[row]);
            }
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

/// Where a node saw from.
struct Sight<'a> {
    pose: &'a Pose2,
    /// In the map.
    laser_m: [f32; 2],
}

impl Watch<'_> {
    /// What a node at a pose saw.
    fn of(&self, scan: &KeyframeScan, pose: &Pose2) -> Vec<Observation> {
        let placement = Placement::new(pose);
        let from = Sight { pose, laser_m: placement.place(scan.laser_m) };
        let mut found = Vec::with_capacity(scan.points.len());
        for point in scan.points.iter().filter(|point| point.weight > 0.0) {
            self.look(&point.placed(&placement), &from, &mut found);
        }
        found.sort_by_key(|observation| observation.row);
        found.dedup_by(|more, observation| {
            let same = more.row == observation.row;
            if same {
                observation.weight += more.weight;
                let share = more.weight / observation.weight;
                observation.offset_m += (more.offset_m - observation.offset_m) * share;
                observation.towards += (more.towards - observation.towards) * share;
            }
            same
        });
        found
    }

    fn look(&self, point: &EndPoint, from: &Sight<'_>, found: &mut Vec<Observation>) {
        let EndPoint { at_m, normal, .. } = *point;
        let Some(index) = self.map.nearest_index(at_m) else { return };
        let surface = &self.map.surfels()[index as usize];
        let offset = [0, 1].map(|axis| f64::from(at_m[axis] - surface.at_m[axis]));
        let arm = [f64::from(surface.at_m[0]) - from.pose.x_m, f64::from(surface.at_m[1]) - from.pose.y_m];
        let mut push = |kind: u32, direction: [f64; 2], noise_m: f64, squared: f64, towards: f64| {
            let robust = 1.0 / (1.0 + squared / self.level.scale_m.powi(2));
            let independent = robust / self.params.beams_per_independent_one;
            found.push(Observation {
                row: ROWS as u32 * index + kind,
                weight: f64::from(point.weight) * independent / noise_m.powi(2),
                offset_m: dot(offset, direction),
                lever_m: cross(arm, direction),
                towards,
            });
        };
        if self.map.is_line(surface) {
            let across = self.normals[index as usize];
            if point.has_normal() && dot(normal.map(f64::from), across) < SAME_DIRECTION {
                return; // another face, or a wall that turns away
            }
            push(0, across, self.level.noise_m, dot(offset, across).powi(2), 0.0);
        } else if point.kind == Kind::Point {
            let noise_m = self.level.noise_m * self.params.point_noise;
            let [x, y] = unit([0, 1].map(|axis| from.laser_m[axis] - at_m[axis]));
            push(1, [1.0, 0.0], noise_m, dot(offset, offset), x);
            push(2, [0.0, 1.0], noise_m, dot(offset, offset), y);
        }
    }
}

fn unit(v: [f32; 2]) -> [f64; 2] {
    let [x, y] = v.map(f64::from);
    let length = x.portable_hypot(y).max(1e-9);
    [x / length, y / length]
}
