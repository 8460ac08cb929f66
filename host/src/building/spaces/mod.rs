//! Rooms: what hangs over the robot and the walls above doors and furniture tell what belongs together, the
//! lines of the walls cut the plan into cells, and each room is the union of cells.
//!
//! After Mura et al. 2014 and Ochmann et al. 2016 (cells of a line arrangement, labeled). Frame `map`,
//! meters.

pub(crate) mod arrangement;
mod curved_faces;
pub(crate) mod directions;
pub(crate) mod evidence;
pub(crate) mod faces;
mod labels;
pub(crate) mod levels;
pub(crate) mod line;
pub(crate) mod outline;
pub(crate) mod raster;
mod regions;

use self::evidence::{Evidence, Seen};
use self::faces::Face;
use self::labels::Ground;
use self::levels::{Overhead, weighted_median};
use self::outline::Ring;
use self::regions::Regions;

/// A room as it was found.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Space {
    /// Its outer ring, then its holes.
    pub rings: Vec<Ring>,
    /// Height of its ceiling, meters; `None` when no ceiling was seen.
    pub ceiling_m: Option<f64>,
    /// Length of its outline on which wall was seen, meters.
    pub walled_m: f64,
    /// Length of its outline, meters.
    pub around_m: f64,
    /// Area inside of it over which a ceiling was seen, or at the height of the lower laser the floor; the
    /// rest is a guess, square meters.
    pub seen_m2: f64,
}

/// Everything about the plan that walls and openings are found with.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Plan {
    /// Upright faces.
    pub faces: Vec<Face>,
    /// What hangs over each cell.
    pub overhead: Overhead,
    /// The rooms that the robot entered.
    pub spaces: Vec<Space>,
}

impl Plan {
    /// Of a drive on one floor.
    pub(crate) fn find(evidence: &Evidence<'_>) -> Self {
        let grid = &evidence.area.grid;
        let overhead = Overhead::of(evidence);
        let curved = curved_faces::find(evidence, &overhead);
        let faces = faces::find(evidence, &overhead, curved);
        let regions = Regions::find(evidence, &overhead, &faces);
        let ground = Ground { grid, regions: &regions, is_soffit: &overhead.is_soffit };
        let cells = arrangement::cells(evidence.area, &faces);
        let borders = arrangement::borders(&cells, &faces);
        let labels = labels::assign(&ground, &faces, &cells, &borders);
        let entered = regions.entered.iter().enumerate().filter(|(_, entered)| **entered);
        let spaces = entered.filter_map(|(piece, _)| {
            let own = cells.iter().zip(&labels).filter(|(_, label)| **label == piece + 1);
            let rings = outline::of(grid, &faces, own.map(|(cell, _)| cell));
            (!rings.is_empty()).then(|| space(evidence, &overhead, &regions, rings))
        });
        let spaces = spaces.collect();
        Self { faces, overhead, spaces }
    }
}

fn space(evidence: &Evidence<'_>, overhead: &Overhead, regions: &Regions, rings: Vec<Ring>) -> Space {
    let grid = &evidence.area.grid;
    let flat: Vec<Vec<[f64; 2]>> =
        rings.iter().map(|ring| ring.iter().map(|edge| edge.from_m).collect()).collect();
    let (mut heights, mut seen) = (Vec::new(), 0_u32);
    grid.fill(&flat.iter().map(Vec::as_slice), |cell| {
        seen += u32::from(overhead.ceiling_m[cell].is_some() || evidence.seen[cell] != Seen::Unknown);
        heights.extend(overhead.ceiling_m[cell].map(|height| (f64::from(height), 1.0)));
    });
    let (mut walled_m, mut around_m) = (0.0, 0.0);
    for ([a, b], _) in rings.iter().flat_map(outline::ends) {
        let length = arrangement::length_m([a, b]);
        let steps = (length / raster::CELL_M).ceil().max(1.0) as usize;
        let is_walled = |step: &usize| {
            let share = (*step as f64 + 0.5) / steps as f64;
            let place = [0, 1].map(|axis| a[axis] + share * (b[axis] - a[axis]));
            labels::has_wall(grid, regions, &overhead.is_soffit, place)
        };
        walled_m += length * (0..steps).filter(is_walled).count() as f64 / steps as f64;
        around_m += length;
    }
    let seen_m2 = f64::from(seen) * raster::CELL_M * raster::CELL_M;
    Space { rings, ceiling_m: weighted_median(&mut heights), walled_m, around_m, seen_m2 }
}
