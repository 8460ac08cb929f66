//! What a drive knows of a building: surfaces, points with the place they were seen from, the floor map, the
//! path.

use super::raster::Grid;
use crate::model::{Cloud, Model};
use crate::slam::occupancy::OccupancyGrid;

/// Cells with a lower probability are free.
const FREE: f64 = 0.35;
/// Cells with a higher probability are walls and things.
const OCCUPIED: f64 = 0.6;

/// What the horizontal laser knows of a cell, at its height.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Seen {
    /// Never seen.
    #[default]
    Unknown,
    /// Beams passed.
    Free,
    /// Beams ended.
    Occupied,
}

/// Everything that a building is read from. Frame `map`, meters.
#[derive(Clone, Copy)]
pub(crate) struct Evidence<'a> {
    /// The surfaces.
    pub model: &'a Model,
    /// The points.
    pub cloud: &'a Cloud,
    /// The plane of each point, or -1.
    pub labels: &'a [i32],
    /// The cells of the floor map.
    pub grid: &'a Grid,
    /// What is known of each.
    pub seen: &'a [Seen],
    /// Where the robot was.
    pub path_m: &'a [[f64; 2]],
    /// Height of the floor on which it drove.
    pub floor_m: f64,
    /// Range noise.
    pub sigma_m: f64,
    /// Number of the storey, from 1 at the lowest one.
    pub storey: usize,
}

/// Smallest distance behind a surface at which a ray has passed it, meters; larger with more noise.
const MIN_PASS_M: f64 = 0.05;
/// How many standard deviations of the noise a passed ray ends behind it.
const PASS_SIGMAS: f64 = 3.5;

impl Evidence<'_> {
    /// The distance behind a surface, meters, from which on a ray has passed it. What ends nearer lies on it.
    pub(crate) fn pass_m(&self) -> f64 {
        MIN_PASS_M.max(PASS_SIGMAS * self.sigma_m)
    }

    /// Mean height from which points were seen. Scans of other storeys have none.
    pub(crate) fn laser_m(&self) -> f64 {
        let Cloud { scan, origins_m, .. } = self.cloud;
        let heights = scan.iter().filter_map(|scan| origins_m.get(*scan as usize));
        let sum: f64 = heights.map(|origin| f64::from(origin[2])).sum();
        sum / scan.len().max(1) as f64
    }
}

/// How far around path and ceilings the floor map is looked at, meters.
const MARGIN_M: f64 = 1.0;

/// The cells around a drive: its path, and what hangs over it.
pub(crate) fn grid_around(model: &Model, path_m: &[[f64; 2]]) -> Grid {
    let overhead = model
        .polygons
        .iter()
        .filter(|p| model.planes.get(p.plane).is_some_and(|plane| plane.normal[2] < -0.3));
    let corners = overhead.flat_map(|polygon| polygon.outer_m.iter().map(|p| [p[0], p[1]]));
    let (mut min, mut max) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    for point in corners.chain(path_m.iter().copied()) {
        for axis in 0..2 {
            min[axis] = min[axis].min(point[axis] - MARGIN_M);
            max[axis] = max[axis].max(point[axis] + MARGIN_M);
        }
    }
    if min[0] > max[0] { Grid::default() } else { Grid::around(min, max) }
}

/// The floor map in cells of a grid.
pub(crate) fn seen_in(grid: &Grid, map: &OccupancyGrid) -> Vec<Seen> {
    let mut seen = vec![Seen::Unknown; grid.len()];
    let resolution_m = map.params().resolution_m;
    map.for_each_seen(|at, probability| {
        let place = at.map(|value| (f64::from(value) + 0.5) * resolution_m);
        if let Some(cell) = grid.cell(place) {
            seen[cell] = match probability {
                p if p < FREE => Seen::Free,
                p if p > OCCUPIED => Seen::Occupied,
                _ => seen[cell],
            };
        }
    });
    seen
}
