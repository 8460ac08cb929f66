//! Stretches of the way, each with its points in the frame of its middle node, the grid of where they are, and where nothing is.
//!
//! The grid says of each cell how likely a point of another scan falls there (0 to 255); its pyramid holds the largest value of ever
//! larger squares, which bounds what a search can find there (Olson 2009; Hess et al. 2016).

use std::ops::Range;

use biplane_matcher::Pose2;

use super::surfaces::{Surfaces, merged, placed};
use super::trail::Node;
use biplane_matcher::EndPoint;

/// How stretches are cut.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SubmapParams {
    /// Way of a stretch, metres. Longer: more to tell one place from another, and more drift within.
    pub way_m: f64,
    /// Way from one stretch's beginning to the next one's, metres. Shorter: loops are found at more places, at more time.
    pub stride_m: f64,
    /// Side of a cell of the search, metres. Larger: faster and rougher; what is found is refined on the points.
    pub cell_m: f64,
}

impl Default for SubmapParams {
    fn default() -> Self {
        Self { way_m: 8.0, stride_m: 4.0, cell_m: 0.1 }
    }
}

/// Points closer than this share one of the outline, metres.
const THIN_M: f32 = 0.05;
/// How far a point blurs in the grid, cells.
const BLUR: i64 = 2;
/// Levels of the pyramid above the grid itself.
pub const LEVELS: usize = 5;
/// Side of a cell of free space, metres.
const FREE_CELL_M: f32 = 0.2;
/// Beams end this far before what they see, metres.
const FREE_MARGIN_M: f32 = 0.3;

/// One stretch. Its frame is the base at its middle node.
#[derive(Clone, Debug)]
pub struct Submap {
    /// Its nodes in the graph.
    pub nodes: Range<usize>,
    /// The middle one.
    pub middle: usize,
    /// Its points, thinned.
    pub points: Vec<EndPoint>,
    /// A few of them, evenly chosen, for the search.
    pub few: Vec<EndPoint>,
    /// The farthest point, metres from the middle.
    pub reach_m: f32,
    /// The points to align with.
    pub surfaces: Surfaces,
    /// The grid and its pyramid.
    pub pyramid: Pyramid,
    /// Where its beams went through.
    pub free: FreeSpace,
}

/// Ranges of nodes with about the same way, in order.
pub fn stretches(poses: &[Pose2], params: &SubmapParams) -> Vec<Range<usize>> {
    let mut way = vec![0.0];
    for pair in poses.windows(2) {
        let turned = pair[0].between(&pair[1]);
        // A turn on the spot sees new things, too.
        way.push(way[way.len() - 1] + turned.distance_m() + 0.5 * turned.theta_rad.abs());
    }
    let mut found = Vec::new();
    let mut first = 0;
    while first < poses.len() {
        let end = way.partition_point(|&way_m| way_m < way[first] + params.way_m).max(first + 1);
        found.push(first..end);
        if end >= poses.len() {
            break;
        }
        first = way.partition_point(|&way_m| way_m < way[first] + params.stride_m).max(first + 1);
    }
    found
}

impl Submap {
    /// Makes a stretch of nodes; `poses` are theirs, in any frame, `first` the number of the first one in the graph.
    pub fn new(nodes: &[Node], poses: &[Pose2], first: usize, params: &SubmapParams) -> Self {
        let middle = nodes.len() / 2;
        let from_node: Vec<Pose2> = poses.iter().map(|pose| poses[middle].between(pose)).collect();
        let points = thinned(merged(from_node.iter().copied().zip(nodes.iter().map(|node| &node.outline))));
        let with_normal = points.iter().filter(|point| point.has_normal()).count();
        let pool: Vec<&EndPoint> =
            points.iter().filter(|point| point.has_normal() || with_normal < 40).collect();
        let few = (0..pool.len().min(FEW)).map(|at| *pool[at * pool.len() / pool.len().min(FEW)]).collect();
        let reach_m = points.iter().map(|point| point.at_m[0].hypot(point.at_m[1])).fold(0.0, f32::max);
        let free = FreeSpace::new(nodes, &from_node, &points);
        Self {
            nodes: first..first + nodes.len(),
            middle: first + middle,
            few,
            reach_m,
            surfaces: Surfaces::new(&points),
            pyramid: Pyramid::new(&points, params.cell_m as f32),
            free,
            points,
        }
    }
}

/// Points of a search.
const FEW: usize = 100;

/// One point a cell, in the order of the cells.
fn thinned(points: Vec<EndPoint>) -> Vec<EndPoint> {
    let cell = |point: &EndPoint| point.at_m.map(|value| (value / THIN_M).floor() as i32);
    let mut keyed: Vec<([i32; 2], usize, EndPoint)> =
        points.into_iter().enumerate().map(|(index, point)| (cell(&point), index, point)).collect();
    keyed.sort_by_key(|(cell, index, point)| (*cell, !point.has_normal(), *index));
    keyed.dedup_by_key(|(cell, ..)| *cell);
    keyed.into_iter().map(|(.., point)| point).collect()
}

/// See the module's text.
#[derive(Clone, Debug)]
pub struct Pyramid {
    /// Side of a cell of the lowest level, metres.
    pub cell_m: f32,
    origin: [i64; 2],
    levels: Vec<Level>,
}

#[derive(Clone, Debug)]
struct Level {
    columns: i64,
    rows: i64,
    values: Vec<u8>,
}

impl Level {
    fn at(&self, column: i64, row: i64) -> u8 {
        if column < 0 || row < 0 || column >= self.columns || row >= self.rows {
            return 0;
        }
        self.values[(row * self.columns + column) as usize]
    }
}

impl Pyramid {
    /// Of points, with cells of this side (metres).
    pub fn new(points: &[EndPoint], cell_m: f32) -> Self {
        let cells: Vec<[i64; 2]> =
            points.iter().map(|point| point.at_m.map(|value| (value / cell_m).floor() as i64)).collect();
        let bound = |axis: usize, pick: fn(i64, i64) -> i64| {
            cells.iter().map(|cell| cell[axis]).reduce(pick).unwrap_or(0)
        };
        // One empty square of the highest level before the points: a square that begins outside may reach in.
        let largest = 1_i64 << LEVELS;
        let origin = [0, 1].map(|axis| bound(axis, i64::min) - BLUR - largest);
        let [columns, rows] = [0, 1].map(|axis| bound(axis, i64::max) + BLUR + 1 - origin[axis]);
        let mut level = Level { columns, rows, values: vec![0; (columns * rows) as usize] };
        for cell in &cells {
            for y in -BLUR..=BLUR {
                for x in -BLUR..=BLUR {
                    let value = (255.0 * (-((x * x + y * y) as f64) / 2.0).exp()) as u8;
                    let at = (cell[1] - origin[1] + y) * columns + cell[0] - origin[0] + x;
                    let held = &mut level.values[at as usize];
                    *held = (*held).max(value);
                }
            }
        }
        let mut levels = vec![level];
        for _ in 0..LEVELS {
            levels.push(halved(&levels[levels.len() - 1]));
        }
        Self { cell_m, origin, levels }
    }

    /// The cells of the lowest level that points lie in at a pose.
    pub fn cells(&self, points: &[EndPoint], pose: &Pose2) -> impl Iterator<Item = [i64; 2]> {
        let (sin, cos) = pose.theta_rad.sin_cos();
        points.iter().map(move |point| {
            let [x, y] = point.at_m.map(f64::from);
            [pose.x_m + cos * x - sin * y, pose.y_m + sin * x + cos * y]
                .map(|value| (value / f64::from(self.cell_m)).floor() as i64)
        })
    }

    /// Mean value of points at a pose, 0 to 1.
    pub fn score(&self, points: &[EndPoint], pose: &Pose2) -> f64 {
        let sum: f64 = self.cells(points, pose).map(|cell| f64::from(self.bound(0, cell))).sum();
        sum / (255.0 * points.len().max(1) as f64)
    }

    /// The most that a point in this cell of the lowest level can find in the `2^level` cells from there on along both axes.
    #[inline]
    pub fn bound(&self, level: usize, cell: [i64; 2]) -> u8 {
        let [column, row] = [0, 1].map(|axis| (cell[axis] - self.origin[axis]) >> level);
        self.levels[level].at(column, row)
    }
}

/// The next level: a cell of side 2^l holds the largest value of the square of side 2^(l+1) that begins there.
fn halved(below: &Level) -> Level {
    let (columns, rows) = (below.columns / 2 + 1, below.rows / 2 + 1);
    let mut values = Vec::with_capacity((columns * rows) as usize);
    let steps = [0_i64, 1, 2];
    for row in 0..rows {
        for column in 0..columns {
            let largest = steps
                .iter()
                .flat_map(|y| steps.iter().map(move |x| (*x, *y)))
                .map(|(x, y)| below.at(2 * column + x, 2 * row + y))
                .max();
            values.push(largest.unwrap_or(0));
        }
    }
    Level { columns, rows, values }
}

/// Cells that beams went through and no point lies near.
#[derive(Clone, Debug)]
pub struct FreeSpace {
    origin: [i64; 2],
    columns: i64,
    rows: i64,
    seen: Vec<bool>,
}

impl FreeSpace {
    fn new(nodes: &[Node], poses: &[Pose2], points: &[EndPoint]) -> Self {
        let bound = |axis: usize, start: f32, pick: fn(f32, f32) -> f32| {
            let lasers = poses.iter().map(|pose| [pose.x_m, pose.y_m][axis] as f32);
            points.iter().map(|point| point.at_m[axis]).chain(lasers).fold(start, pick)
        };
        let cell = |value: f32| (value / FREE_CELL_M).floor() as i64;
        let origin = [0, 1].map(|axis| cell(bound(axis, 0.0, f32::min)) - 1);
        let [columns, rows] = [0, 1].map(|axis| cell(bound(axis, 0.0, f32::max)) + 2 - origin[axis]);
        let mut free = Self { origin, columns, rows, seen: vec![false; (columns * rows) as usize] };
        for (node, pose) in nodes.iter().zip(poses).step_by(3) {
            let (sin, cos) = pose.theta_rad.sin_cos();
            let place = ((sin as f32, cos as f32), [pose.x_m as f32, pose.y_m as f32]);
            let laser = EndPoint { at_m: node.outline.laser_m, ..EndPoint::default() };
            let from = placed(&laser, place.0, place.1).at_m;
            for point in node.outline.points.iter().step_by(2) {
                free.pass(from, placed(point, place.0, place.1).at_m);
            }
        }
        for point in points {
            let middle = free.cell_of(point.at_m);
            for (x, y) in (-1..=1).flat_map(|y| (-1..=1).map(move |x| (x, y))) {
                free.set([middle[0] + x, middle[1] + y], false);
            }
        }
        free
    }

    fn cell_of(&self, at_m: [f32; 2]) -> [i64; 2] {
        [0, 1].map(|axis| (at_m[axis] / FREE_CELL_M).floor() as i64 - self.origin[axis])
    }

    fn set(&mut self, [column, row]: [i64; 2], value: bool) {
        if (0..self.columns).contains(&column) && (0..self.rows).contains(&row) {
            self.seen[(row * self.columns + column) as usize] = value;
        }
    }

    fn pass(&mut self, from: [f32; 2], to: [f32; 2]) {
        let along = [to[0] - from[0], to[1] - from[1]];
        let length = along[0].hypot(along[1]);
        let steps = ((length - FREE_MARGIN_M) / (0.7 * FREE_CELL_M)).max(0.0) as usize;
        for step in 0..steps {
            let share = step as f32 * 0.7 * FREE_CELL_M / length;
            let cell = self.cell_of([from[0] + share * along[0], from[1] + share * along[1]]);
            self.set(cell, true);
        }
    }

    /// Whether beams went through here.
    pub fn is_free(&self, at_m: [f32; 2]) -> bool {
        let [column, row] = self.cell_of(at_m);
        (0..self.columns).contains(&column)
            && (0..self.rows).contains(&row)
            && self.seen[(row * self.columns + column) as usize]
    }
}
