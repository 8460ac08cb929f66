//! Searches over a lattice of poses, and what they share: how far they look, what they find, and the cells
//! that end points lie in.
//!
//! The correlative search tries every pose of a tracker's small window, and knows free space. Branch and
//! bound finds the best pose of windows of forty meters on a pyramid of the scores. Units: meters, radians.

mod branch_and_bound;
pub(crate) mod correlative;
pub(crate) mod score_pyramid;
mod shift_sums;

use crate::map::grid::cell_of;
use crate::placement::Placement;
use crate::scan::end_points::EndPoint;
use biplane_geometry::PortableMath;
use biplane_geometry::Pose2;

/// How far a search looks around its guess.
#[derive(Copy, Clone, PartialEq, Debug)]
pub struct Window {
    /// Half width in x and y, meters.
    pub half_m: f64,
    /// Half width in heading, radians.
    pub half_rad: f64,
}

/// A strip through the middle of a window: of the places in it those not farther from the guess across the
/// strip than half its width.
#[derive(Copy, Clone, PartialEq, Debug)]
pub struct Strip {
    /// The direction across the strip, a unit vector in the map's axes.
    pub across: [f64; 2],
    /// Half its width, meters.
    pub half_m: f64,
}

/// A pose and how much speaks for it.
#[derive(Copy, Clone, PartialEq, Debug, Default)]
pub struct Candidate {
    /// The pose of the points in the map, `map_from_base`.
    pub pose: Pose2,
    /// Mean likelihood of an end point: up to 1; below 0 where most end in space known to be free.
    pub score: f32,
}

/// Likelihood of an end point so far from the nearest surface, under a Gaussian of this width. The width is
/// about the lattice's step: less, and the right place falls between two steps; more, and places look alike.
fn likelihood(squared_m2: f64, blur_m: f64) -> f64 {
    (-0.5 * squared_m2 / (blur_m * blur_m)).portable_exp()
}

/// The cells that end points lie in where they are placed.
fn cells_at<'a>(
    points: impl Iterator<Item = &'a EndPoint>,
    placement: Placement,
    cells_per_m: f32,
) -> impl Iterator<Item = [i32; 2]> {
    points.map(move |point| cell_of(placement.place(point.at_m), cells_per_m))
}
