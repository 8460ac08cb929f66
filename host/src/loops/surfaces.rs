//! End points of several scans in one frame, sorted into cells, so that the nearest one of like direction is found at once.

use biplane_matcher::Pose2;

use super::outline::Outline;
use biplane_matcher::EndPoint;

/// Side of a cell, metres: no point farther than this is found.
pub const REACH_M: f32 = 0.3;
/// Surfaces whose normals differ by more than 45 degrees are not the same: the cosine.
const SAME_DIRECTION: f32 = 0.7;

/// See the module's text.
#[derive(Clone, Debug, Default)]
pub struct Surfaces {
    origin_m: [f32; 2],
    columns: usize,
    rows: usize,
    /// Where each cell's points begin; one more than there are cells.
    starts: Vec<u32>,
    points: Vec<EndPoint>,
}

/// A point of an outline in another frame.
pub fn placed(point: &EndPoint, sin_cos: (f32, f32), shift_m: [f32; 2]) -> EndPoint {
    let (sin, cos) = sin_cos;
    let turn = |[x, y]: [f32; 2]| [cos * x - sin * y, sin * x + cos * y];
    let [x, y] = turn(point.at_m);
    EndPoint { at_m: [x + shift_m[0], y + shift_m[1]], normal: turn(point.normal), ..*point }
}

/// All points of outlines, each placed by its pose.
pub fn merged<'a>(outlines: impl Iterator<Item = (Pose2, &'a Outline)>) -> Vec<EndPoint> {
    let mut points = Vec::new();
    for (pose, outline) in outlines {
        let (sin, cos) = pose.theta_rad.sin_cos();
        let place = ((sin as f32, cos as f32), [pose.x_m as f32, pose.y_m as f32]);
        points.extend(outline.points.iter().map(|point| placed(point, place.0, place.1)));
    }
    points
}

impl Surfaces {
    /// Sorts points into cells.
    pub fn new(points: &[EndPoint]) -> Self {
        let bound = |start: f32, pick: fn(f32, f32) -> f32, axis: usize| {
            points.iter().map(|point| point.at_m[axis]).fold(start, pick)
        };
        if points.is_empty() {
            return Self::default();
        }
        let origin_m = [0, 1].map(|axis| bound(f32::INFINITY, f32::min, axis));
        let size = [0, 1]
            .map(|axis| ((bound(f32::NEG_INFINITY, f32::max, axis) - origin_m[axis]) / REACH_M) as usize + 1);
        let mut made = Self { origin_m, columns: size[0], rows: size[1], ..Self::default() };
        let cells: Vec<usize> = points.iter().map(|point| made.cell(point.at_m)).collect();
        let mut starts = vec![0_u32; size[0] * size[1] + 1];
        for &cell in &cells {
            starts[cell + 1] += 1;
        }
        for cell in 1..starts.len() {
            starts[cell] += starts[cell - 1];
        }
        let mut next = starts.clone();
        made.points = vec![EndPoint::default(); points.len()];
        for (point, &cell) in points.iter().zip(&cells) {
            made.points[next[cell] as usize] = *point;
            next[cell] += 1;
        }
        made.starts = starts;
        made
    }

    fn cell(&self, at_m: [f32; 2]) -> usize {
        let [column, row] = [0, 1].map(|axis| ((at_m[axis] - self.origin_m[axis]) / REACH_M) as usize);
        row.min(self.rows - 1) * self.columns + column.min(self.columns - 1)
    }

    /// The nearest point within `reach_m` (at most [`REACH_M`]) that looks the same way, or has no direction.
    pub fn nearest(&self, point: &EndPoint, reach_m: f32) -> Option<&EndPoint> {
        if self.points.is_empty() {
            return None;
        }
        let mut best = (reach_m * reach_m, None);
        let span = |axis: usize, count: usize| {
            let cell =
                |away_m: f32| ((point.at_m[axis] + away_m - self.origin_m[axis]) / REACH_M).floor() as i64;
            let count = count as i64;
            (cell(-reach_m).clamp(0, count) as usize, (cell(reach_m) + 1).clamp(0, count) as usize)
        };
        let (columns, rows) = (span(0, self.columns), span(1, self.rows));
        if columns.0 >= columns.1 {
            return None;
        }
        for row in rows.0..rows.1 {
            let first = row * self.columns;
            let from = self.starts[first + columns.0] as usize;
            let to = self.starts[first + columns.1] as usize;
            for other in &self.points[from..to] {
                let [x, y] = [other.at_m[0] - point.at_m[0], other.at_m[1] - point.at_m[1]];
                let squared = x * x + y * y;
                if squared < best.0 && alike(point, other) {
                    best = (squared, Some(other));
                }
            }
        }
        best.1
    }
}

fn alike(one: &EndPoint, other: &EndPoint) -> bool {
    let dot = one.normal[0] * other.normal[0] + one.normal[1] * other.normal[1];
    dot > SAME_DIRECTION || !one.has_normal() || !other.has_normal()
}
