//! How uncertain a border is at its corners, by how far apart points are there, and in which direction.
//!
//! A laser that scans a wall sees it in rows: points are near to each other along the drive and far apart
//! along the beams' fan. A border across the fan is uncertain by the distance between rows, one along it is
//! not. Plane coordinates in steps ([`crate::reconstruct::polygons::plane_frame`]).

use biplane_geometry::PortableMath;

/// A border is as uncertain as this share of the edges of the raw triangles there. Half an edge would be
/// enough for points in rows; labels err too.
pub(crate) const SPACING_SHARE: f64 = 0.6;

/// The two edges of raw triangles at a place that tell how far apart points are in any direction: the
/// longest, and the one that goes farthest across it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Spacing {
    /// See above, steps.
    pub edges: [[f64; 2]; 2],
}

impl Spacing {
    /// Takes an edge into account.
    pub(crate) fn note(&mut self, edge: [f64; 2]) {
        let [longest, across] = self.edges;
        let wider = |one: [f64; 2], other: [f64; 2], than: [f64; 2]| {
            if cross(than, one).abs() > cross(than, other).abs() { one } else { other }
        };
        self.edges = if dot(edge, edge) > dot(longest, longest) {
            [edge, wider(longest, across, edge)]
        } else {
            [longest, wider(edge, across, longest)]
        };
    }

    /// How far apart points are at most.
    pub(crate) fn longest(&self) -> f64 {
        self.edges[0][0].portable_hypot(self.edges[0][1])
    }
}

/// How far a corner of a ring may lie off the line through its segment.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Tolerance {
    /// In each direction.
    pub around: f64,
    /// Along the edges between points more.
    pub spacing: Spacing,
}

impl Tolerance {
    /// In a direction (a unit vector); `share` is that of the distance between points.
    pub(crate) fn along(&self, direction: [f64; 2], share: f64) -> f64 {
        let reach = self.spacing.edges.iter().map(|edge| dot(*edge, direction).abs()).fold(0.0, f64::max);
        self.around.max(share * reach)
    }

    /// The same in each direction.
    pub(crate) fn without_rows(self) -> Self {
        Self { spacing: Spacing::default(), ..self }
    }
}

fn dot(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

fn cross(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

#[cfg(test)]
mod tests {
    use super::{Spacing, Tolerance};

    #[test]
    fn a_border_is_uncertain_across_rows_of_points_and_not_along_them_in_any_order_of_triangles() {
        // Rows 900 apart, points of a row 30 apart.
        let edges = [[30.0, 0.0], [0.0, 900.0], [30.0, -900.0], [-30.0, 0.0]];
        for first in 0..edges.len() {
            let mut spacing = Spacing::default();
            (0..edges.len()).for_each(|k| spacing.note(edges[(first + k) % edges.len()]));
            let tolerance = Tolerance { around: 10.0, spacing };
            assert!((tolerance.along([0.0, 1.0], 0.6) - 540.0).abs() < 1e-9);
            assert!((tolerance.along([1.0, 0.0], 0.6) - 18.0).abs() < 1e-9, "{spacing:?}");
            assert_eq!(tolerance.along([1.0, 0.0], 0.1), 10.0);
        }
    }
}
