//! Points of a submap through which other scans of it looked: people, and what else was there for a moment.
//!
//! Somebody who walks along leaves a trail of points. Each is seen by a scan or two, and the scans before and
//! after look through its place. In another visit nobody walks there, so a trail speaks against every loop.
//! Frame of the submap, meters.

use biplane_geometry::PortableMath;
use biplane_geometry::vec2::{dot, minus};
use biplane_matcher::{EndPoint, Placement, Pose2};

use crate::slam::keyframes::Node;
use crate::slam::keyframes::cell_index::CellIndex;

/// Side of a cell in which points are looked up, meters.
const CELL_M: f32 = 0.1;
/// A beam passes through a point that is so close to it, meters. Larger: thin legs that are just missed go;
/// smaller: fewer beams tell.
const ASIDE_M: f32 = 0.03;
/// A beam ends this far before what it sees, meters.
const MARGIN_M: f32 = 0.3;
/// Farther from the laser a beam tells nothing, meters: its neighbors are too far apart.
const NEAR_M: f32 = 8.0;
/// A beam that runs along a surface does not pass through it: the sine of the angle between them.
const GRAZING_SINE: f32 = 0.3;
/// Of so many beams one is followed.
const EVERY_BEAM: usize = 2;
/// A point goes when so many scans looked through it, and more than saw something there.
const SCANS: u16 = 2;

/// A point, the scan that it is of, and what the others say of it.
struct Candidate {
    point: EndPoint,
    node: usize,
    /// So many scans looked through it.
    passed: u16,
    /// The last one of them.
    passed_by: usize,
}

/// A beam of a scan, as far as nothing stood in its way.
struct Ray {
    node: usize,
    from_m: [f32; 2],
    direction: [f32; 2],
    clear_m: f32,
}

impl Ray {
    fn new(node: usize, from_m: [f32; 2], to_m: [f32; 2]) -> Self {
        let way_m = minus(to_m, from_m);
        let range_m = way_m[0].portable_hypot(way_m[1]);
        let direction = way_m.map(|part| part / range_m);
        Self { node, from_m, direction, clear_m: (range_m - MARGIN_M).min(NEAR_M) }
    }

    fn passes(&self, point: &EndPoint) -> bool {
        let offset_m = minus(point.at_m, self.from_m);
        let aside_m = offset_m[0] * self.direction[1] - offset_m[1] * self.direction[0];
        let runs_along = point.has_normal() && dot(point.normal, self.direction).abs() < GRAZING_SINE;
        aside_m.abs() < ASIDE_M && dot(offset_m, self.direction) < self.clear_m && !runs_along
    }
}

/// All points of scans, found by their place.
struct Candidates {
    /// Cell by cell.
    all: Vec<Candidate>,
    cells: CellIndex,
}

/// The points of all scans at these poses, without those that other ones looked through.
pub(crate) fn standing(nodes: &[Node], poses: &[Pose2]) -> Vec<EndPoint> {
    let mut candidates = Candidates::new(nodes, poses);
    for (number, (node, pose)) in nodes.iter().zip(poses).enumerate() {
        for [from_m, to_m] in node.keyframe_scan.beams(pose, EVERY_BEAM) {
            candidates.look_along(&Ray::new(number, from_m, to_m));
        }
    }
    let mut standing: Vec<(u32, EndPoint)> = candidates
        .all
        .iter()
        .zip(candidates.cells.numbers())
        .filter_map(|(one, &number)| candidates.stands(one).then_some((number, one.point)))
        .collect();
    standing.sort_unstable_by_key(|(number, _)| *number);
    standing.into_iter().map(|(_, point)| point).collect()
}

impl Candidates {
    fn new(nodes: &[Node], poses: &[Pose2]) -> Self {
        let mut in_order = Vec::new();
        for (node, (scan, pose)) in nodes.iter().map(|node| &node.keyframe_scan).zip(poses).enumerate() {
            let placement = Placement::new(pose);
            in_order.extend(scan.points.iter().map(|point| (node, point.placed(&placement))));
        }
        let cells = CellIndex::new(in_order.iter().map(|(_, point)| cell_of(point.at_m)));
        let candidate = |&number: &u32| {
            let (node, point) = in_order[number as usize];
            Candidate { point, node, passed: 0, passed_by: node }
        };
        Self { all: cells.numbers().iter().map(candidate).collect(), cells }
    }

    /// Counts the points of other scans that a beam passes through.
    fn look_along(&mut self, ray: &Ray) {
        let step_m = 0.5 * CELL_M;
        let mut last = None;
        for step in 0..(ray.clear_m / step_m).max(0.0) as usize {
            let along_m = step_m * step as f32;
            let cell = cell_of([0, 1].map(|axis| ray.from_m[axis] + along_m * ray.direction[axis]));
            if last.replace(cell) == Some(cell) {
                continue;
            }
            for one in &mut self.all[self.cells.find_along(cell)] {
                if ![one.node, one.passed_by].contains(&ray.node) && ray.passes(&one.point) {
                    one.passed_by = ray.node;
                    one.passed += 1;
                }
            }
        }
    }

    fn stands(&self, one: &Candidate) -> bool {
        one.passed < SCANS || usize::from(one.passed) <= self.seen_by(one.point.at_m)
    }

    /// How many scans saw something no farther from a place than a cell.
    fn seen_by(&self, at_m: [f32; 2]) -> usize {
        let [x, y] = cell_of(at_m);
        let around = (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| (dx, dy)));
        let cells = around.map(|(dx, dy)| [x.saturating_add(dx), y.saturating_add(dy)]);
        let near = cells.flat_map(|cell| &self.all[self.cells.find(cell)]).filter(|one| {
            let off_m = minus(one.point.at_m, at_m);
            dot(off_m, off_m) < CELL_M * CELL_M
        });
        let mut nodes: Vec<usize> = near.map(|one| one.node).collect();
        nodes.sort_unstable();
        nodes.dedup();
        nodes.len()
    }
}

fn cell_of(at_m: [f32; 2]) -> [i32; 2] {
    at_m.map(|value| (value / CELL_M).floor_to_i32())
}

#[cfg(test)]
mod tests {
    use biplane_matcher::{EndPoint, Pose2};

    use super::standing;
    use crate::slam::keyframes::Node;
    use crate::slam::keyframes::keyframe_scan::KeyframeScan;

    /// What scans see every 30 cm along a corridor 2.4 m wide that ends after 12 m. A thing of 40 cm stands
    /// in the way: how far from the base is given for each scan.
    fn seen(ahead_m: [f32; 8]) -> Vec<EndPoint> {
        let node = |at: usize| {
            let base_m = 0.3 * at as f32;
            let points = (-80..=80).map(|degrees| {
                let (sin, cos) = (degrees as f32).to_radians().sin_cos();
                let thing_m = ahead_m[at] / cos;
                let (end_m, wall_m) = ((12.0 - base_m) / cos, 1.2 / sin.abs());
                let (range_m, normal) = if (thing_m * sin).abs() < 0.2 {
                    (thing_m, [-1.0, 0.0])
                } else if end_m < wall_m {
                    (end_m, [-1.0, 0.0])
                } else {
                    (wall_m, [0.0, -sin.signum()])
                };
                EndPoint { at_m: [range_m * cos, range_m * sin], normal, weight: 1.0, ..EndPoint::default() }
            });
            let keyframe_scan = KeyframeScan { points: points.collect(), laser_m: [0.0; 2] };
            Node { scan: at, ..Node::at(Pose2::new(f64::from(base_m), 0.0, 0.0), keyframe_scan) }
        };
        let nodes: Vec<Node> = (0..8).map(node).collect();
        let poses: Vec<Pose2> = nodes.iter().map(|node| node.recorded).collect();
        standing(&nodes, &poses)
    }

    /// Points within the corridor, and those on its walls and end.
    fn inside_and_on_walls(points: &[EndPoint]) -> [usize; 2] {
        let inside = points.iter().filter(|point| point.at_m[1].abs() < 1.1 && point.at_m[0] < 11.9).count();
        [inside, points.len() - inside]
    }

    #[test]
    fn somebody_who_walks_away_goes_and_what_stands_stays() {
        let all = 8 * 161;
        let standing = [0, 1, 2, 3, 4, 5, 6, 7].map(|at| 6.0 - 0.3 * at as f32);
        let [inside, walls] = inside_and_on_walls(&seen(standing));
        assert!(inside > 8 && inside + walls == all, "{inside} {walls}");
        // Half as fast again as the base, from 2 m ahead of it.
        let walking = [0, 1, 2, 3, 4, 5, 6, 7].map(|at| 2.0 + 0.15 * at as f32);
        let [left, walls] = inside_and_on_walls(&seen(walking));
        let nobody = inside_and_on_walls(&seen([f32::INFINITY; 8]));
        assert_eq!(nobody, [0, all]);
        // 72 points lie on them. Where they were last no scan has looked through.
        assert!(left < 20 && walls == all - 72, "{left} {walls}");
    }
}
