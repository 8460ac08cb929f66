//! The plan cut into convex cells along the lines of its walls.

use super::evidence::Area;
use super::faces::Face;
use crate::building::elevation::Span;
use biplane_geometry::PortableMath;
use biplane_geometry::vec2::{dot, minus};

/// How far a line cuts on beyond the wall that was seen, meters: corners behind furniture and doors.
const BEYOND_M: f64 = 4.0;
/// A skew line cuts on by no more than this many times the length that was seen: leaves of doors, columns.
const SKEW_BEYOND: f64 = 0.5;
/// Faces with less wall over furniture and doors cut nothing, meters.
const MIN_UPPER_M: f64 = 0.3;
/// Most lines that cut through everything they reach; of the others only what is near their wall.
const MAX_LINES: usize = 400;
/// Corners this close to a line are on it, meters.
const ON_LINE_M: f64 = 1e-6;

/// The line of an edge: index into the faces.
pub(crate) type LineOf = Option<usize>;

/// A convex cell, counter-clockwise.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Cell {
    /// Its corners.
    pub corners_m: Vec<[f64; 2]>,
    /// The line of the edge that begins at each corner; `None` on the border of everything.
    pub lines: Vec<LineOf>,
}

impl Cell {
    /// Its edges with their lines.
    pub(crate) fn edges(&self) -> impl Iterator<Item = ([[f64; 2]; 2], LineOf)> + '_ {
        let ends = self.corners_m.iter().zip(self.corners_m.iter().cycle().skip(1));
        ends.zip(&self.lines).map(|((a, b), line)| ([*a, *b], *line))
    }

    /// Whether a segment comes into it.
    fn meets(&self, face: &Face, from_m: f64, to_m: f64) -> bool {
        // A convex cell is met by a line between the outermost places at which its edges pass it.
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for ([a, b], _) in self.edges() {
            let (da, db) = (face.before_m(a), face.before_m(b));
            if (da > 0.0) != (db > 0.0) {
                let share = da / (da - db);
                let at = dot(face.along(), [0, 1].map(|axis| a[axis] + share * (b[axis] - a[axis])));
                (low, high) = (low.min(at), high.max(at));
            }
        }
        low < to_m && high > from_m
    }

    /// Cuts along a line; `None` when it is all on one side.
    fn cut(&self, face: &Face, line: usize) -> Option<[Self; 2]> {
        let away: Vec<f64> = self.corners_m.iter().map(|corner| face.before_m(*corner)).collect();
        let before = away.iter().any(|d| *d > ON_LINE_M);
        let behind = away.iter().any(|d| *d < -ON_LINE_M);
        if !before || !behind {
            return None;
        }
        let empty = || Self { corners_m: Vec::new(), lines: Vec::new() };
        let mut sides = [empty(), empty()];
        for (at, ([a, b], own)) in self.edges().enumerate() {
            let (da, db) = (away[at], away[(at + 1) % away.len()]);
            for (side, sign) in sides.iter_mut().zip([1.0, -1.0]) {
                let (da, db) = (sign * da, sign * db);
                if da >= -ON_LINE_M {
                    side.corners_m.push(a);
                    // From a corner on the line away to the other side: the edge is the line itself.
                    side.lines.push(if da <= ON_LINE_M && db < -ON_LINE_M { Some(line) } else { own });
                }
                if (da > ON_LINE_M && db < -ON_LINE_M) || (da < -ON_LINE_M && db > ON_LINE_M) {
                    let share = da / (da - db);
                    side.corners_m.push([0, 1].map(|axis| a[axis] + share * (b[axis] - a[axis])));
                    side.lines.push(if db < 0.0 { Some(line) } else { own });
                }
            }
        }
        Some(sides)
    }
}

/// All cells of an area.
pub(crate) fn cells(area: &Area, faces: &[Face]) -> Vec<Cell> {
    let mut cells = vec![Cell { corners_m: area.corners_m.to_vec(), lines: vec![None; 4] }];
    let cutting = faces.iter().enumerate().filter(|(_, face)| face.upper_length_m() >= MIN_UPPER_M);
    for (index, face) in cutting.take(MAX_LINES) {
        let is_main = area.directions.has(face.normal);
        let beyond_m = |[from, to]: &Span| if is_main { BEYOND_M } else { SKEW_BEYOND * (to - from) };
        let mut next = Vec::with_capacity(cells.len() + 8);
        for cell in cells {
            let is_met = face.upper_m.iter().any(|span| {
                let beyond_m = beyond_m(span);
                cell.meets(face, span[0] - beyond_m, span[1] + beyond_m)
            });
            match is_met.then(|| cell.cut(face, index)).flatten() {
                Some(parts) => next.extend(parts),
                None => next.push(cell),
            }
        }
        cells = next;
    }
    cells
}

/// Cells that share part of an edge, with where it is.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Border {
    /// The two cells: that before the line's face, and that behind it.
    pub cells: [usize; 2],
    /// The line.
    pub line: usize,
    /// The shared part.
    pub ends_m: [[f64; 2]; 2],
}

/// All borders between cells.
pub(crate) fn borders(cells: &[Cell], faces: &[Face]) -> Vec<Border> {
    let mut on_line: Vec<Vec<(usize, f64, f64)>> = vec![Vec::new(); faces.len()];
    for (index, cell) in cells.iter().enumerate() {
        for ([a, b], line) in cell.edges() {
            if let Some(line) = line {
                let along = faces[line].along();
                on_line[line].push((index, dot(along, a), dot(along, b)));
            }
        }
    }
    let mut found = Vec::new();
    for (line, (face, edges)) in faces.iter().zip(on_line).enumerate() {
        // An edge runs one way in the cell on one side of the line, the other way in that on the other.
        let forward: Vec<_> = edges.iter().filter(|(_, from, to)| to > from).collect();
        let backward: Vec<_> = edges.iter().filter(|(_, from, to)| to < from).collect();
        for (one, from, to) in &forward {
            for (other, high, low) in &backward {
                let shared = [from.max(*low), to.min(*high)];
                if shared[1] - shared[0] > 1e-4 {
                    let ends_m = shared.map(|at| face.point(at));
                    found.push(Border { cells: [*other, *one], line, ends_m });
                }
            }
        }
    }
    found
}

/// Length of a border, meters.
pub(crate) fn length_m([a, b]: [[f64; 2]; 2]) -> f64 {
    let [x, y] = minus(b, a);
    x.portable_hypot(y)
}
