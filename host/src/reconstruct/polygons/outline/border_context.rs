//! What is known of the borders of one plane beyond their corners: where other planes meet it, which
//! directions the building has, and how far apart the points are.
//!
//! Plane coordinates in whole steps ([`crate::reconstruct::polygons::plane_frame`]).

use super::line::Line;
use super::union::Shape;
use crate::model::Plane;
use crate::reconstruct::polygons::plane_frame::{FlatPoint, Frame, STEP_M};
use crate::reconstruct::polygons::seams::plane_intersection;
use crate::reconstruct::voxels::Voxels;

/// A border is as uncertain as this share of the longest edge of the raw triangles there. Half an edge would
/// be enough for points in rows; labels err too.
const SPACING_SHARE: f64 = 0.6;
/// Far points do not make a border more uncertain than this, meters.
const MAX_TOLERANCE_M: f64 = 0.1;
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
    /// Longest edge of the raw triangles at corners of the shapes, steps.
    spacing: Voxels<f64>,
}

impl Borders {
    /// The borders of plane `own`, which meets the planes `neighbours`.
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
        Self {
            seams: neighbors.iter().filter_map(line_with).collect(),
            directions,
            spacing: Voxels::default(),
        }
    }

    /// Asks for how far apart the points are at the corners of shapes.
    pub(crate) fn with_corners(mut self, shapes: &[Shape]) -> Self {
        self.spacing = shapes.iter().flatten().flatten().map(|corner| (key(*corner), 0.0)).collect();
        self
    }

    /// Notes how far apart the corners of a piece are that the shapes were made of.
    pub(crate) fn note_spacing(&mut self, frame: &Frame, piece: &[[f64; 3]]) {
        let mut longest_steps = None;
        for corner in piece.iter().filter_map(|p| frame.flat(*p)) {
            if let Some(known) = self.spacing.get_mut(&key(corner)) {
                let steps = longest_steps.get_or_insert_with(|| longest_m(piece) / STEP_M);
                *known = known.max(*steps);
            }
        }
    }

    /// How far a corner may lie off the straight border, steps.
    pub(crate) fn tolerance_steps(&self, corner: FlatPoint, min_steps: f64) -> f64 {
        let spacing = self.spacing.get(&key(corner)).copied().unwrap_or(0.0);
        min_steps.max((SPACING_SHARE * spacing).min(MAX_TOLERANCE_M / STEP_M))
    }
}

/// A corner as one number.
fn key(corner: FlatPoint) -> u64 {
    u64::from(corner.x as u32) << 32 | u64::from(corner.y as u32)
}

/// The longest edge of a ring.
fn longest_m(ring: &[[f64; 3]]) -> f64 {
    let edges = ring.iter().zip(ring.iter().cycle().skip(1));
    edges.map(|(a, b)| biplane_geometry::vec3::distance(*a, *b)).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::{Borders, Frame, MAX_TOLERANCE_M, STEP_M};
    use crate::model::Plane;
    use crate::reconstruct::polygons::plane_frame::FlatPoint;

    fn plane(normal: [f64; 3], offset_m: f64) -> Plane {
        Plane { normal, offset_m, points: 3, rms_m: 0.0 }
    }

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
            borders.tolerance_steps(corner, 300.0)
        };
        assert_eq!(tolerance(0.03), 300.0);
        assert!((500.0..1000.0).contains(&tolerance(0.1)), "{}", tolerance(0.1));
        assert_eq!(tolerance(1.0), MAX_TOLERANCE_M / STEP_M);
        assert_eq!(Borders::default().tolerance_steps(FlatPoint::new(0, 0), 7.0), 7.0);
    }
}
