//! The map of all nodes at their poses, and what a scan sees of it.
//!
//! Small surfaces, as the matcher's, each with the direction of the line that it is part of.

use biplane_geometry::PortableMath;
use biplane_geometry::vec2::{cross, dot};
use biplane_matcher::{EndPoint, Kind, LocalMap, MapParams, Placement, Pose2, Surfel};
use rayon::prelude::*;

use crate::slam::keyframes::Node;
use crate::slam::keyframes::keyframe_scan::KeyframeScan;
use crate::slam::refinement::params::{JointParams, Level};

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

/// Rows of a surface: across its line, or x and y of what is no line.
pub(crate) const ROWS: usize = 3;

/// What a scan saw of one row.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Observation {
    /// Three of each surface: across its line, and x and y of what is no line.
    pub row: u32,
    /// 1 / m^2.
    pub weight: f64,
    /// How far off it lies, meters.
    pub offset_m: f64,
    /// How far a turn by one radian moves it across the row, meters.
    pub lever_m: f64,
    /// How far a meter towards the laser is across the row; zero for lines, which have no depth.
    pub towards: f64,
}

/// See the module's text.
pub(crate) struct NodeMap<'a> {
    map: LocalMap,
    normals: Vec<[f64; 2]>,
    level: &'a Level,
    params: &'a JointParams,
}

/// Where a node saw from.
struct Sight<'a> {
    pose: &'a Pose2,
    /// In the map.
    laser_m: [f32; 2],
}

impl<'a> NodeMap<'a> {
    /// Maps the nodes at these poses.
    pub(crate) fn new(nodes: &[&Node], poses: &[Pose2], level: &'a Level, params: &'a JointParams) -> Self {
        let map = map(nodes, poses, level);
        let straight = |surface| direction(&map, surface, level, params.straight_m);
        let normals = map.surfels().par_iter().map(straight).collect();
        Self { map, normals, level, params }
    }

    /// The direction of each row.
    pub(crate) fn directions(&self) -> Vec<[f64; 2]> {
        self.normals.iter().flat_map(|normal| [*normal, [1.0, 0.0], [0.0, 1.0]]).collect()
    }

    /// What a scan saw from a pose, in the order of rows.
    pub(crate) fn seen(&self, scan: &KeyframeScan, pose: &Pose2) -> Vec<Observation> {
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

fn unit(v: [f32; 2]) -> [f64; 2] {
    let [x, y] = v.map(f64::from);
    let length = x.portable_hypot(y).max(1e-9);
    [x / length, y / length]
}
