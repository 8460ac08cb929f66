//! What is known of the borders of one plane beyond their corners: where other planes meet it, which
//! directions the building has, and how far apart the points are.
//!
//! Plane coordinates in whole steps ([`crate::reconstruct::polygons::plane_frame`]).

use super::line::Line;
use super::tolerance::{SPACING_SHARE, Spacing, Tolerance};
use super::union::Shape;
use crate::model::Plane;
use crate::model::voxels::Voxels;
use crate::reconstruct::polygons::plane_frame::{FlatPoint, Frame, STEP_M};
use crate::reconstruct::polygons::seams::plane_intersection;

/// Far points do not make a border more uncertain than this across the rows of points, meters.
const MAX_TOLERANCE_M: f64 = 0.1;
/// What is known of how far apart points are goes for corners in cells of this size, meters: straightened
/// borders have new corners.
const CELL_M: f64 = 0.25;
/// So many of the largest planes give directions.
const DIRECTIONS: usize = 12;
/// Directions closer than this (sine of the angle; 3 degrees) are one.
const SAME_SINE: f64 = 0.05;

/// Knowledge about the borders of one plane.
#[derive(Clone, Debug, Default)]
pub(crate) struct Borders {
    /// Common lines with planes that meet it.
    pub seams: Vec<Line>,
    /// Directions of the building in this plane: level, plumb, and along the largest planes.
    pub directions: Vec<[f64; 2]>,
    /// Edges of the raw triangles at corners of the shapes.
    spacing: Voxels<Spacing>,
    /// And in the cells round them.
    near: Voxels<Spacing>,
}

impl Borders {
    /// The borders of plane `own`, which meets the planes `neighbors`.
    pub(crate) fn new(planes: &[Plane], own: usize, frame: &Frame, neighbors: &[usize]) -> Self {
        let plane = &planes[own];
        let near_m = frame.lift(FlatPoint::new(0, 0));
        let line_with = |other: &usize| {
            let (at_m, along) = plane_intersection::line(plane, planes.get(*other)?, near_m)?;
            Some(Line { at: frame.steps(at_m), direction: frame.direction(along)? })
        };
        let mut directions: Vec<[f64; 2]> = Vec::new();
        let level = plane.normal[2].abs() > 0.9;
        let own_axes: &[[f64; 2]] = if level { &[] } else { &[[1.0, 0.0], [0.0, 1.0]] };
        let along_others = planes.iter().take(DIRECTIONS).filter_map(|other| {
            let (_, along) = plane_intersection::line(plane, other, near_m)?;
            frame.direction(along)
        });
        for direction in own_axes.iter().copied().chain(along_others) {
            let across = [-direction[1], direction[0]];
            for found in [direction, across] {
                let same = |known: &[f64; 2]| (known[0] * found[1] - known[1] * found[0]).abs() < SAME_SINE;
                if !directions.iter().any(same) {
                    directions.push(found);
                }
            }
        }
        Self { seams: neighbors.iter().filter_map(line_with).collect(), directions, ..Self::default() }
    }

    /// Asks for how far apart the points are at the corners of shapes.
    pub(crate) fn with_corners(mut self, shapes: &[Shape]) -> Self {
        self.spacing =
            shapes.iter().flatten().flatten().map(|corner| (key(*corner), Spacing::default())).collect();
        self
    }

    /// Notes how far apart the corners of a piece are that the shapes were made of.
    pub(crate) fn note_spacing(&mut self, frame: &Frame, piece: &[[f64; 3]]) {
        let mut edges = None;
        for corner in piece.iter().filter_map(|p| frame.flat(*p)) {
            if let Some(known) = self.spacing.get_mut(&key(corner)) {
                let edges = edges.get_or_insert_with(|| edges_of(frame, piece));
                let near = self.near.entry(key(cell(corner))).or_default();
                for edge in edges.iter() {
                    known.note(*edge);
                    near.note(*edge);
                }
            }
        }
    }

    /// How far a corner may lie off the straight border.
    pub(crate) fn tolerance(&self, corner: FlatPoint, min_steps: f64) -> Tolerance {
        match self.spacing.get(&key(corner)) {
            Some(spacing) => {
                let around = (SPACING_SHARE * spacing.longest()).min(MAX_TOLERANCE_M / STEP_M);
                Tolerance { around: min_steps.max(around), spacing: *spacing }
            }
            None => Tolerance { around: min_steps, spacing: self.spacing_near(corner) },
        }
    }

    /// How far apart points are round a corner.
    fn spacing_near(&self, corner: FlatPoint) -> Spacing {
        let FlatPoint { x, y } = cell(corner);
        let cells = (0..9).map(|k| FlatPoint::new(x + k % 3 - 1, y + k / 3 - 1));
        let mut all = Spacing::default();
        for spacing in cells.filter_map(|cell| self.near.get(&key(cell))) {
            spacing.edges.iter().for_each(|edge| all.note(*edge));
        }
        all
    }
}

/// The cell of a corner.
fn cell(corner: FlatPoint) -> FlatPoint {
    let cell = |steps: i32| (f64::from(steps) * STEP_M / CELL_M).floor() as i32;
    FlatPoint::new(cell(corner.x), cell(corner.y))
}

/// A corner as one number.
fn key(corner: FlatPoint) -> u64 {
    u64::from(corner.x as u32) << 32 | u64::from(corner.y as u32)
}

/// The edges of a ring, steps.
fn edges_of(frame: &Frame, ring: &[[f64; 3]]) -> Vec<[f64; 2]> {
    let corners: Vec<[f64; 2]> = ring.iter().map(|p| frame.steps(*p)).collect();
    let ends = corners.iter().zip(corners.iter().cycle().skip(1));
    ends.map(|(a, b)| [b[0] - a[0], b[1] - a[1]]).collect()
}

#[cfg(test)]
mod tests {
    use super::{Borders, Frame, MAX_TOLERANCE_M, STEP_M};
    use crate::model::sample::plane;
    use crate::reconstruct::polygons::plane_frame::FlatPoint;

    #[test]
    fn a_wall_knows_where_the_ceiling_meets_it_and_which_directions_are_level_and_plumb() {
        let planes =
            [plane([0.0, -1.0, 0.0], -1.0), plane([0.0, 0.0, -1.0], -2.5), plane([0.0, 1.0, 0.0], -1.0)];
        let frame = Frame::new(&planes[0], [3.0, 1.0, 0.0]);
        let borders = Borders::new(&planes, 0, &frame, &[1, 2]);
        // The wall opposite is parallel: no seam.
        assert_eq!(borders.seams.len(), 1);
        let on_seam = frame.steps([7.0, 1.0, 2.5]);
        assert!(borders.seams[0].off(on_seam).abs() < 1e-6);
        assert_eq!(borders.directions.len(), 2, "{:?}", borders.directions);
    }

    #[test]
    fn borders_between_far_points_are_less_certain_up_to_a_limit() {
        let wall = plane([0.0, -1.0, 0.0], -1.0);
        let frame = Frame::new(&wall, [0.0, 1.0, 0.0]);
        let piece = |size: f64| vec![[0.0, 1.0, 0.0], [size, 1.0, 0.0], [0.0, 1.0, 0.5 * size]];
        let tolerance = |size: f64| {
            let corner = frame.flat([size, 1.0, 0.0]).unwrap();
            let mut borders = Borders::new(&[wall], 0, &frame, &[]).with_corners(&[vec![vec![corner]]]);
            borders.note_spacing(&frame, &piece(0.5 * size));
            borders.note_spacing(&frame, &piece(size));
            borders.tolerance(corner, 300.0).around
        };
        assert_eq!(tolerance(0.03), 300.0);
        assert!((500.0..1000.0).contains(&tolerance(0.1)), "{}", tolerance(0.1));
        assert_eq!(tolerance(1.0), MAX_TOLERANCE_M / STEP_M);
        assert_eq!(Borders::default().tolerance(FlatPoint::new(0, 0), 7.0).around, 7.0);
    }
}
