//! What a drive knows of a building: surfaces, points with the place they were seen from, the floor map, the
//! path.

use super::directions::{Directions, unit};
use super::raster::{CELL_M, Grid};
use crate::building::elevation::extent;
use crate::model::{Cloud, Model, PlanarPolygon};
use crate::slam::occupancy::OccupancyGrid;
use biplane_geometry::vec2::{cross, dot, minus};

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
    /// What of the floor is looked at.
    pub area: &'a Area,
    /// What is known of each of its cells.
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

/// What of a floor is looked at: a rectangle along the walls. Rooms without a wall at an end are cut off at
/// its sides, in the same place however the building stands in the map.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Area {
    /// The directions of the walls.
    pub directions: Directions,
    /// Corners of the rectangle, counter-clockwise.
    pub corners_m: [[f64; 2]; 4],
    /// Cells that hold it.
    pub grid: Grid,
}

impl Area {
    /// Around a drive: its path, and what hangs over it.
    pub(crate) fn around(model: &Model, path_m: &[[f64; 2]]) -> Self {
        let directions = Directions::of_model(model);
        let along = unit(directions.main_rad());
        let axes = [along, [-along[1], along[0]]];
        let is_overhead =
            |p: &PlanarPolygon| model.planes.get(p.plane).is_some_and(|plane| plane.normal[2] < -0.3);
        let overhead = model.polygons.iter().filter(|polygon| is_overhead(polygon));
        let corners = overhead.flat_map(|polygon| polygon.outer_m.iter().map(|p| [p[0], p[1]]));
        let places = || corners.clone().chain(path_m.iter().copied());
        let around = |axis| {
            let [min, max] = extent(places().map(|place| dot(axis, place)));
            [((min - MARGIN_M) / CELL_M).floor() * CELL_M, ((max + MARGIN_M) / CELL_M).ceil() * CELL_M]
        };
        let [[left, right], [low, high]] = axes.map(around);
        if left > right {
            return Self { directions, ..Self::default() };
        }
        let corners_m = [[left, low], [right, low], [right, high], [left, high]]
            .map(|[u, v]| [0, 1].map(|axis| u * axes[0][axis] + v * axes[1][axis]));
        let [[min_x, max_x], [min_y, max_y]] = [0, 1].map(|axis| extent(corners_m.iter().map(|p| p[axis])));
        let grid = Grid::around([min_x, min_y], [max_x, max_y]);
        Self { directions, corners_m, grid }
    }

    /// Whether a place is in the rectangle.
    fn holds(&self, place: [f64; 2]) -> bool {
        let ends = self.corners_m.iter().zip(self.corners_m.iter().cycle().skip(1));
        ends.into_iter().all(|(a, b)| cross(minus(*b, *a), minus(place, *a)) >= 0.0)
    }
}

/// The floor map in the cells of an area.
pub(crate) fn seen_in(area: &Area, map: &OccupancyGrid) -> Vec<Seen> {
    let grid = &area.grid;
    let mut seen = vec![Seen::Unknown; grid.len()];
    let resolution_m = map.params().resolution_m;
    map.for_each_seen(|at, probability| {
        let place = at.map(|value| (f64::from(value) + 0.5) * resolution_m);
        if let Some(cell) = grid.cell(place).filter(|_| area.holds(place)) {
            seen[cell] = match probability {
                p if p < FREE => Seen::Free,
                p if p > OCCUPIED => Seen::Occupied,
                _ => seen[cell],
            };
        }
    });
    seen
}
