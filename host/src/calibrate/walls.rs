//! The walls that the horizontal laser sees: short pieces of line on the floor plan, each from a second of
//! driving.
//!
//! Frame `map`, meters. A piece knows when it was seen, so that what the vertical laser sees is held against
//! what the horizontal one saw at about the same time: the drift of the poses is then the same for both.

use biplane_geometry::PortableMath;
use std::collections::HashMap;

use rayon::prelude::*;

use super::strips::{principal, scatter};
use crate::recordings::deskew::{StampedPose, Trajectory};
use crate::recordings::scan_geometry::RangeScan;
use crate::recordings::scan_geometry::ScanGeometry;

/// Side of a cell of the floor plan.
const CELL_M: f64 = 0.3;
/// How long scans are gathered for a piece.
const GATHER_NS: i64 = 1_000_000_000;
/// Points of a piece at least.
const FEWEST: usize = 8;
/// Root mean square distance of a piece's points from its line at most, and along it at least.
const ROUGH_M: f64 = 0.03;
const SHORTEST_M: f64 = 0.05;
/// Ranges that are looked at.
const RANGES_M: (f32, f32) = (0.3, 15.0);
const LONGEST_GAP_NS: i64 = 500_000_000;

/// Pieces belong to one straight wall when one lies in the other's line but for so much, both are turned
/// alike (cosine), and they are not farther apart.
const STEP_M: f64 = 0.02;
const ALIKE: f64 = 0.98;
const FARTHEST_M: f64 = 1.2;

/// A piece of wall on the floor plan.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Piece {
    /// When it was seen, nanoseconds.
    pub stamp_ns: i64,
    /// Mean of its points.
    pub center_m: [f64; 2],
    /// The line that it lies in.
    pub line: Line,
}

/// A line through points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Line {
    /// Mean of the points.
    pub center_m: [f64; 2],
    /// Across it, unit length.
    pub normal: [f64; 2],
    /// Variance of the points along it.
    pub spread_m2: f64,
    /// The points.
    pub points: usize,
}

impl Line {
    /// Where a point is: across the line and along it from its center.
    pub(super) fn off(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let (x, y) = (x - self.center_m[0], y - self.center_m[1]);
        [x * self.normal[0] + y * self.normal[1], y * self.normal[0] - x * self.normal[1]]
    }
}

/// All pieces, by cell of the floor plan.
#[derive(Clone, Debug, Default)]
pub(super) struct Walls {
    cells: HashMap<[i32; 2], Vec<Piece>>,
}

impl Walls {
    /// From the horizontal laser's scans.
    pub(super) fn of(geometry: &ScanGeometry, range_scans: &[RangeScan], trajectory: &Trajectory) -> Self {
        let groups: Vec<&[RangeScan]> = range_scans
            .chunk_by(|a, b| a.stamp_ns.div_euclid(GATHER_NS) == b.stamp_ns.div_euclid(GATHER_NS))
            .collect();
        let pieces: Vec<Vec<Piece>> =
            groups.par_iter().map(|group| pieces_of(geometry, group, trajectory)).collect();
        let mut walls = Self::default();
        for piece in pieces.into_iter().flatten() {
            walls.cells.entry(cell(piece.center_m)).or_default().push(piece);
        }
        walls
    }

    /// The pieces of the cell of a point and of those around it.
    pub(super) fn near(&self, point_m: [f64; 2]) -> impl Iterator<Item = &Piece> {
        let [x, y] = cell(point_m);
        let around =
            (-1..=1).flat_map(move |dx| (-1..=1).map(move |dy| [x.saturating_add(dx), y.saturating_add(dy)]));
        around.filter_map(|cell| self.cells.get(&cell)).flatten()
    }
}

fn cell(point_m: [f64; 2]) -> [i32; 2] {
    point_m.map(|value| (value / CELL_M).floor() as i32)
}

fn pieces_of(geometry: &ScanGeometry, range_scans: &[RangeScan], trajectory: &Trajectory) -> Vec<Piece> {
    let mut points: Vec<([i32; 2], [f64; 2])> = Vec::new();
    for range_scan in range_scans {
        for (beam, &range_m) in geometry.beams.iter().zip(&range_scan.ranges_m) {
            if !(range_m >= RANGES_M.0 && range_m <= RANGES_M.1) {
                continue;
            }
            let stamp_ns = range_scan.stamp_ns.saturating_add(beam.delay_ns);
            let Some(pose) = trajectory.at(stamp_ns, LONGEST_GAP_NS) else { continue };
            let (sin, cos) = beam.angle_rad.portable_sin_cos();
            let in_base = geometry.base_from_laser
                * nalgebra::Point3::new(cos, sin, 0.0).coords.scale(f64::from(range_m));
            let in_base = in_base + geometry.base_from_laser.translation.vector;
            let at = on_floor(&pose, [in_base.x, in_base.y]);
            points.push((cell(at), at));
        }
    }
    points.sort_by_key(|(cell, _)| *cell);
    let stamp_ns = range_scans.get(range_scans.len() / 2).map_or(0, |range_scan| range_scan.stamp_ns);
    let lines: Vec<Line> = points.chunk_by(|a, b| a.0 == b.0).filter_map(line).collect();
    lines
        .iter()
        .map(|own| Piece { stamp_ns, center_m: own.center_m, line: straight_wall(own, &lines) })
        .collect()
}

fn line(group: &[([i32; 2], [f64; 2])]) -> Option<Line> {
    if group.len() < FEWEST {
        return None;
    }
    let count = group.len() as f64;
    let mean = |axis: usize| group.iter().map(|(_, point)| point[axis]).sum::<f64>() / count;
    let center_m = [mean(0), mean(1)];
    let sums = scatter(group.iter().map(|(_, point)| *point), center_m);
    let (along, [rough_m2, spread_m2]) = principal(sums.map(|sum| sum / count));
    let straight =
        rough_m2 <= ROUGH_M * ROUGH_M && spread_m2 >= SHORTEST_M * SHORTEST_M && rough_m2 < 0.1 * spread_m2;
    let normal = [-along[1], along[0]];
    straight.then_some(Line { center_m, normal, spread_m2, points: group.len() })
}

/// The line of the wall that a piece is of, by it and its neighbors. A short piece's own direction is that of
/// its noise: a laser that looks across it would seem to be turned by as much, and always by as much again
/// where it stands a little before the piece's middle.
fn straight_wall(own: &Line, lines: &[Line]) -> Line {
    let is_of_it = |other: &&Line| {
        let [across_m, along_m] = own.off(other.center_m);
        let back_m = other.off(own.center_m)[0];
        let alike = own.normal[0] * other.normal[0] + own.normal[1] * other.normal[1];
        across_m.abs() < STEP_M && back_m.abs() < STEP_M && along_m.abs() < FARTHEST_M && alike.abs() > ALIKE
    };
    let members: Vec<&Line> = lines.iter().filter(is_of_it).collect();
    let points: usize = members.iter().map(|line| line.points).sum();
    let share = |line: &Line| line.points as f64 / points as f64;
    let mean = |axis: usize| members.iter().map(|line| line.center_m[axis] * share(line)).sum::<f64>();
    let center_m = [mean(0), mean(1)];
    let sums = members.iter().fold([0.0; 3], |[xx, xy, yy], line| {
        let (x, y) = (line.center_m[0] - center_m[0], line.center_m[1] - center_m[1]);
        let ([across_x, across_y], spread_m2) = (line.normal, line.spread_m2);
        [
            xx + share(line) * (x * x + across_y * across_y * spread_m2),
            xy + share(line) * (x * y - across_x * across_y * spread_m2),
            yy + share(line) * (y * y + across_x * across_x * spread_m2),
        ]
    });
    let (along, [_, spread_m2]) = principal(sums);
    Line { center_m, normal: [-along[1], along[0]], spread_m2, points }
}

/// A point of the base's frame in `map`, seen from above.
pub(super) fn on_floor(pose: &StampedPose, [x, y]: [f64; 2]) -> [f64; 2] {
    let (sin, cos) = pose.theta_rad.portable_sin_cos();
    [pose.x_m + cos * x - sin * y, pose.y_m + sin * x + cos * y]
}
