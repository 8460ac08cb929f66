//! Where on a floor a robot can be: cells with their distance to the next obstacle.

use std::cmp::Reverse;
use std::collections::{BinaryHeap, VecDeque};

use crate::world::mesh::LabeledMesh;
use crate::world::vec3::Vec3;
use biplane_ifc::Plan;

/// x and y.
pub(super) type Point = [f64; 2];

/// Side of a cell, meters.
pub(super) const CELL_M: f64 = 0.05;
/// Half of the robot's width, and what its driver keeps clear besides, meters.
const RADIUS_M: f64 = 0.28;
const MARGIN_M: f64 = 0.03;
/// What stands between these heights over the floor is in the way, meters: not thresholds, but table tops,
/// under which nobody drives.
const OBSTACLE_BAND_M: [f64; 2] = [0.06, 1.0];
/// Distance of the points at which surfaces are looked at, meters.
const SAMPLE_M: f64 = 0.02;
/// Ways with less than this to the sides cost more than their length, meters.
const COMFORT_M: f64 = 0.7;
/// How much more at the obstacle itself.
const DISCOMFORT: f64 = 6.0;
/// A passage reaches so far into the rooms that it joins, meters.
const OVERLAP_M: f64 = 0.02;
/// Costs are counted in steps of this many meters.
const COST_M: f64 = 1e-6;
/// Steps from a cell to the next ones; each also the other way.
const STEPS: [(isize, isize); 8] = [(1, 0), (0, 1), (1, 1), (1, -1), (2, 1), (1, 2), (2, -1), (1, -2)];

/// Cells of a floor.
pub(super) struct Floor {
    low: Point,
    columns: usize,
    rows: usize,
    /// Distance to the next obstacle, meters.
    pub(super) clearance_m: Vec<f64>,
    /// Cells of the largest connected place where the robot can be.
    pub(super) reached: Vec<bool>,
}

impl Floor {
    /// Of a plan's rooms and of the passages between them, with what stands on them.
    pub(super) fn new(plan: &Plan, mesh: &LabeledMesh) -> Self {
        let corners = plan.rooms.iter().flat_map(|room| &room.outline_m);
        let [low, high] = corners.fold([[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]], |[low, high], p| {
            [[0, 1].map(|k| low[k].min(p[k])), [0, 1].map(|k| high[k].max(p[k]))]
        });
        let low = low.map(|value| value - 3.0 * CELL_M);
        let count =
            |axis: usize| ((high[axis] - low[axis]) / CELL_M).ceil().clamp(0.0, 20_000.0) as usize + 3;
        let (columns, rows) = if plan.rooms.is_empty() { (0, 0) } else { (count(0), count(1)) };
        let mut floor =
            Self { low, columns, rows, clearance_m: Vec::new(), reached: vec![false; columns * rows] };
        let mut free = floor.free_by_plan(plan);
        floor.take_obstacles(&mut free, mesh, plan.floor_z_m);
        floor.clearance_m = distances(&free, columns, rows);
        floor.reach();
        floor
    }

    /// Middle of a cell.
    pub(super) fn point(&self, cell: usize) -> Point {
        let at = [cell % self.columns, cell / self.columns];
        [0, 1].map(|axis| self.low[axis] + (at[axis] as f64 + 0.5) * CELL_M)
    }

    fn cell(&self, point: Point) -> Option<usize> {
        let at = [0, 1].map(|axis| ((point[axis] - self.low[axis]) / CELL_M).floor());
        let is_in = at[0] >= 0.0 && at[1] >= 0.0 && at[0] < self.columns as f64 && at[1] < self.rows as f64;
        is_in.then(|| at[1] as usize * self.columns + at[0] as usize)
    }

    fn free_by_plan(&self, plan: &Plan) -> Vec<bool> {
        let open = plan.openings.iter().filter(|opening| opening.kind != "window" && !opening.shut);
        let ways: Vec<&Vec<Point>> = open.map(|opening| &opening.box_m).collect();
        let is_free = |cell: usize| {
            let point = self.point(cell);
            let in_room = |room: &biplane_ifc::Room| {
                is_in(&room.outline_m, point) && !room.holes_m.iter().any(|hole| is_in(hole, point))
            };
            let in_way = |ring: &&Vec<Point>| is_in(ring, point) || border_m(ring, point) <= OVERLAP_M;
            plan.rooms.iter().any(in_room) || ways.iter().any(in_way)
        };
        (0..self.columns * self.rows).map(is_free).collect()
    }

    fn take_obstacles(&self, free: &mut [bool], mesh: &LabeledMesh, floor_z_m: f64) {
        let [low, high] = OBSTACLE_BAND_M.map(|height| floor_z_m + height);
        for face in 0..mesh.faces.len() {
            let corners = mesh.corners(face);
            let is_over = corners.iter().all(|corner| corner[2] >= high);
            if is_over || corners.iter().all(|corner| corner[2] <= low) {
                continue;
            }
            for point in samples(&corners).filter(|point| point[2] > low && point[2] < high) {
                if let Some(cell) = self.cell([point[0], point[1]]) {
                    free[cell] = false;
                }
            }
        }
    }

    /// The cells around one, with their way in meters.
    fn next_to(&self, cell: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        let (x, y) = ((cell % self.columns) as isize, (cell / self.columns) as isize);
        let both = STEPS.into_iter().flat_map(|(dx, dy)| [(dx, dy), (-dx, -dy)]);
        both.filter_map(move |(dx, dy)| {
            let (column, row) = (x + dx, y + dy);
            let is_in = column >= 0 && row >= 0 && column < self.columns as isize && row < self.rows as isize;
            let way_m = ((dx * dx + dy * dy) as f64).sqrt() * CELL_M;
            is_in.then(|| (row as usize * self.columns + column as usize, way_m))
        })
    }

    /// Finds the largest connected place.
    fn reach(&mut self) {
        let wide: Vec<bool> = self.clearance_m.iter().map(|m| *m >= RADIUS_M + MARGIN_M).collect();
        let mut seen = vec![false; wide.len()];
        let mut largest: Vec<usize> = Vec::new();
        for start in 0..wide.len() {
            if !wide[start] || seen[start] {
                continue;
            }
            let (mut piece, mut queue) = (Vec::new(), VecDeque::from([start]));
            seen[start] = true;
            while let Some(cell) = queue.pop_front() {
                piece.push(cell);
                for (next, way_m) in self.next_to(cell) {
                    if way_m < 1.5 * CELL_M && wide[next] && !seen[next] {
                        seen[next] = true;
                        queue.push_back(next);
                    }
                }
            }
            if piece.len() > largest.len() {
                largest = piece;
            }
        }
        for cell in largest {
            self.reached[cell] = true;
        }
    }

    /// The cheapest way from a cell to the first of some others: all cells after the first.
    pub(super) fn way_to_nearest(&self, from: usize, goals: &[usize]) -> Option<Vec<usize>> {
        let dear = |cell: usize| {
            let lack = (1.0 - self.clearance_m[cell] / COMFORT_M).clamp(0.0, 1.0);
            1.0 + DISCOMFORT * lack * lack
        };
        let mut costs = vec![u64::MAX; self.reached.len()];
        let mut before = vec![from; self.reached.len()];
        let mut queue = BinaryHeap::from([(Reverse(0_u64), from)]);
        costs[from] = 0;
        while let Some((Reverse(cost), cell)) = queue.pop() {
            if cost > costs[cell] {
                continue;
            }
            if goals.contains(&cell) {
                let mut way = vec![cell];
                while before[way[way.len() - 1]] != from {
                    way.push(before[way[way.len() - 1]]);
                }
                way.reverse();
                return Some(way);
            }
            for (next, way_m) in self.next_to(cell).filter(|(next, _)| self.reached[*next]) {
                let step = (way_m * 0.5 * (dear(cell) + dear(next)) / COST_M) as u64;
                if cost + step < costs[next] {
                    costs[next] = cost + step;
                    before[next] = cell;
                    queue.push((Reverse(cost + step), next));
                }
            }
        }
        None
    }

    /// The least clearance of the straight way between two points.
    pub(super) fn min_clearance_m(&self, a: Point, b: Point) -> f64 {
        let steps = (distance(a, b) / (0.5 * CELL_M)).ceil().max(1.0) as usize;
        let at = |k: usize| [0, 1].map(|axis| a[axis] + k as f64 / steps as f64 * (b[axis] - a[axis]));
        let clearance = |point| self.cell(point).map_or(0.0, |cell| self.clearance_m[cell]);
        (0..=steps).map(|k| clearance(at(k))).fold(f64::INFINITY, f64::min)
    }
}

pub(super) fn distance(a: Point, b: Point) -> f64 {
    (b[0] - a[0]).hypot(b[1] - a[1])
}

/// Points on a triangle.
fn samples(corners: &[Vec3; 3]) -> impl Iterator<Item = Vec3> + '_ {
    let [a, b, c] = *corners;
    let length = |p: Vec3, q: Vec3| (0..3).map(|k| (q[k] - p[k]).powi(2)).sum::<f64>().sqrt();
    let count = |p, q| ((length(p, q) / SAMPLE_M).ceil() as usize).max(1);
    let steps = count(a, b).max(count(a, c));
    (0..=steps).flat_map(move |i| {
        (0..=steps - i).map(move |j| {
            let (u, v) = (i as f64 / steps as f64, j as f64 / steps as f64);
            [0, 1, 2].map(|k| a[k] + u * (b[k] - a[k]) + v * (c[k] - a[k]))
        })
    })
}

pub(super) fn is_in(ring: &[Point], [x, y]: Point) -> bool {
    let edges = ring.iter().zip(ring.iter().cycle().skip(1));
    let passed = edges.filter(|(a, b)| (a[1] <= y) != (b[1] <= y));
    passed.filter(|(a, b)| a[0] + (y - a[1]) / (b[1] - a[1]) * (b[0] - a[0]) > x).count() % 2 == 1
}

fn border_m(ring: &[Point], p: Point) -> f64 {
    let edges = ring.iter().zip(ring.iter().cycle().skip(1));
    let near = |(a, b): (&Point, &Point)| {
        let (d, to) = ([b[0] - a[0], b[1] - a[1]], [p[0] - a[0], p[1] - a[1]]);
        let square = (d[0] * d[0] + d[1] * d[1]).max(1e-12);
        let share = ((d[0] * to[0] + d[1] * to[1]) / square).clamp(0.0, 1.0);
        (to[0] - share * d[0]).hypot(to[1] - share * d[1])
    };
    edges.map(near).fold(f64::INFINITY, f64::min)
}

/// Distance of each cell's middle to the border of the next cell that is not free (Felzenszwalb and
/// Huttenlocher 2012), meters.
fn distances(free: &[bool], columns: usize, rows: usize) -> Vec<f64> {
    let far = ((columns + rows) * (columns + rows)) as f64;
    let mut squares: Vec<f64> = free.iter().map(|free| if *free { far } else { 0.0 }).collect();
    for column in 0..columns {
        let line: Vec<f64> = (0..rows).map(|row| squares[row * columns + column]).collect();
        for (row, square) in transformed(&line).into_iter().enumerate() {
            squares[row * columns + column] = square;
        }
    }
    for row in 0..rows {
        let line = transformed(&squares[row * columns..(row + 1) * columns]);
        squares[row * columns..(row + 1) * columns].copy_from_slice(&line);
    }
    squares.iter().map(|square| square.sqrt() * CELL_M - 0.5 * CELL_M).collect()
}

/// The lower envelope of parabolas that stand on a line's values.
fn transformed(line: &[f64]) -> Vec<f64> {
    let height = |at: usize| line[at] + (at * at) as f64;
    let mut hulls: Vec<(usize, f64)> = Vec::new();
    for at in 0..line.len() {
        let mut from = f64::NEG_INFINITY;
        while let Some((top, start)) = hulls.last().copied() {
            from = (height(at) - height(top)) / (2.0 * (at - top) as f64);
            if from > start {
                break;
            }
            hulls.pop();
            from = f64::NEG_INFINITY;
        }
        hulls.push((at, from));
    }
    let mut hull = 0;
    let value = |at: usize| {
        while hulls.get(hull + 1).is_some_and(|(_, from)| *from < at as f64) {
            hull += 1;
        }
        let apart = at.abs_diff(hulls[hull].0) as f64;
        apart * apart + line[hulls[hull].0]
    };
    (0..line.len()).map(value).collect()
}

#[cfg(test)]
mod tests {
    use super::{CELL_M, distances};

    #[test]
    fn distances_are_those_of_the_slow_way() {
        let (columns, rows) = (17, 11);
        let free: Vec<bool> = (0..columns * rows).map(|cell| (cell * 37 + cell / 5) % 23 != 0).collect();
        let found = distances(&free, columns, rows);
        for (cell, distance_m) in found.iter().enumerate() {
            let apart = |other: usize| {
                let dx = (cell % columns).abs_diff(other % columns) as f64;
                dx.hypot((cell / columns).abs_diff(other / columns) as f64)
            };
            let taken = (0..free.len()).filter(|other| !free[*other]);
            let slow = taken.map(apart).fold(f64::INFINITY, f64::min) * CELL_M - 0.5 * CELL_M;
            assert!((distance_m - slow).abs() < 1e-9, "{cell}: {distance_m} {slow}");
        }
    }
}
