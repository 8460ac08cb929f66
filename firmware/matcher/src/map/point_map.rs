//! End points of several scans in one frame, sorted into cells, so that the nearest one that faces the same
//! way is found at once.
//!
//! Each end point is a surface of its own: nothing is averaged, and what running means would blur while the
//! poses of the scans are not yet known stays sharp. Frame: that of the points. Units: meters.

use crate::scan::end_points::EndPoint;
use biplane_geometry::vec2::{dot, squared_distance};

/// Side of a cell, meters: no point farther than this is found. Larger: slower; smaller: poses farther off
/// are not brought together.
const REACH_M: f32 = 0.3;
/// The nearest point is looked for among those whose normal is within 45 degrees: the cosine. At 60 degrees,
/// where an alignment begins to tell faces apart, points of the wall around the corner are taken: 2 % more
/// error on the thin Edmonton drive.
const SAME_DIRECTION: f32 = 0.7;

/// End points of several scans as a map: see [`PointMap::align`], which finds other end points in it.
#[derive(Clone, Debug, Default)]
pub struct PointMap {
    origin_m: [f32; 2],
    columns: usize,
    rows: usize,
    /// Where each cell's points begin; one more than there are cells.
    starts: Vec<u32>,
    points: Vec<MappedPoint>,
}

/// What is kept of an end point.
#[derive(Copy, Clone, Debug, Default)]
pub(crate) struct MappedPoint {
    /// Its place, meters.
    pub at_m: [f32; 2],
    /// The normal of its surface; zero where it is not known.
    pub normal: [f32; 2],
}

impl PointMap {
    /// Sorts points into cells.
    #[must_use]
    pub fn new(points: &[EndPoint]) -> Self {
        if points.is_empty() {
            return Self::default();
        }
        let bound = |start: f32, pick: fn(f32, f32) -> f32, axis: usize| {
            points.iter().map(|point| point.at_m[axis]).fold(start, pick)
        };
        let origin_m = [0, 1].map(|axis| bound(f32::INFINITY, f32::min, axis));
        let [columns, rows] = [0, 1]
            .map(|axis| ((bound(f32::NEG_INFINITY, f32::max, axis) - origin_m[axis]) / REACH_M) as usize + 1);
        let mut map = Self { origin_m, columns, rows, ..Self::default() };
        map.sort(points);
        map
    }

    /// Puts points into the order of their cells, those of one cell in the order they came.
    fn sort(&mut self, points: &[EndPoint]) {
        let cells: Vec<usize> = points.iter().map(|point| self.cell(point.at_m)).collect();
        self.starts = vec![0; self.columns * self.rows + 1];
        for &cell in &cells {
            self.starts[cell + 1] += 1;
        }
        for cell in 1..self.starts.len() {
            self.starts[cell] += self.starts[cell - 1];
        }
        let mut next = self.starts.clone();
        self.points = vec![MappedPoint::default(); points.len()];
        for (point, &cell) in points.iter().zip(&cells) {
            self.points[next[cell] as usize] = MappedPoint { at_m: point.at_m, normal: point.normal };
            next[cell] += 1;
        }
    }

    fn cell(&self, at_m: [f32; 2]) -> usize {
        let [column, row] = [0, 1].map(|axis| ((at_m[axis] - self.origin_m[axis]) / REACH_M) as usize);
        row.min(self.rows - 1) * self.columns + column.min(self.columns - 1)
    }

    /// Whether a point of this map lies within `reach_m` of an end point, 0.3 m at most, and faces the same
    /// way or has no direction.
    #[must_use]
    pub fn explains(&self, point: &EndPoint, reach_m: f32) -> bool {
        self.nearest(point.at_m, point.normal, reach_m).is_some()
    }

    /// The nearest point within `reach_m`, 0.3 m at most, that faces the same way or has no direction.
    pub(crate) fn nearest(&self, at_m: [f32; 2], normal: [f32; 2], reach_m: f32) -> Option<&MappedPoint> {
        let reach_m = reach_m.min(REACH_M);
        let mut best = (reach_m * reach_m, None);
        for other in self.around(at_m, reach_m) {
            let squared = squared_distance(other.at_m, at_m);
            if squared < best.0 && is_alike(normal, other.normal) {
                best = (squared, Some(other));
            }
        }
        best.1
    }

    /// The points of all cells that a square of this half width touches.
    fn around(&self, at_m: [f32; 2], reach_m: f32) -> impl Iterator<Item = &MappedPoint> {
        let span = |axis: usize, count: usize| {
            let cell = |away_m: f32| ((at_m[axis] + away_m - self.origin_m[axis]) / REACH_M).floor() as i64;
            let count = count as i64;
            (cell(-reach_m).clamp(0, count) as usize, (cell(reach_m) + 1).clamp(0, count) as usize)
        };
        let (columns, rows) = (span(0, self.columns), span(1, self.rows));
        let rows = if columns.0 < columns.1 { rows.0..rows.1 } else { 0..0 };
        rows.flat_map(move |row| {
            let first = row * self.columns;
            let [from, to] = [columns.0, columns.1].map(|column| self.starts[first + column] as usize);
            &self.points[from..to]
        })
    }
}

/// A direction that is not known is like any other.
fn is_alike(one: [f32; 2], other: [f32; 2]) -> bool {
    dot(one, other) > SAME_DIRECTION || one == [0.0; 2] || other == [0.0; 2]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_point_within_reach_that_faces_the_same_way_explains_an_end_point() {
        let point = |x: f32, y: f32, normal| EndPoint { at_m: [x, y], normal, ..EndPoint::default() };
        let (up, down, unknown) = ([0.0, 1.0], [0.0, -1.0], [0.0; 2]);
        let map = PointMap::new(&[point(0.0, 0.0, up), point(2.0, 0.0, unknown)]);
        for (end, reach_m, is_explained) in [
            (point(0.0, 0.1, up), 0.2, true),
            (point(0.0, 0.1, down), 0.2, false),
            (point(0.0, 0.1, unknown), 0.2, true),
            (point(2.0, -0.1, down), 0.2, true),
            (point(0.0, 0.1, up), 0.05, false),
            (point(-0.29, 0.0, up), 0.3, true),
            (point(-50.0, 90.0, up), 0.3, false),
        ] {
            assert_eq!(map.explains(&end, reach_m), is_explained, "{end:?} {reach_m}");
        }
        assert!(!PointMap::default().explains(&point(0.0, 0.0, up), 0.3));
    }
}
