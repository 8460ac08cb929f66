//! What hangs over the robot: ceilings, and the narrow undersides (soffits) of door and window heads.

use biplane_geometry::PortableMath;
use biplane_geometry::polygon_area::ring_area_m2;

use super::evidence::Evidence;
use super::raster::Grid;
use crate::building::elevation::extent;
use crate::model::PlanarPolygon;

/// Normals that rise less face down, slanted ceilings too: 17 degrees beyond level and more.
const DOWN: f64 = -0.3;
/// A ceiling is at least this high over the floor, meters.
const MIN_CEILING_M: f64 = 1.9;
/// A soffit is at least this high over the floor, meters: lower ones are of tables and shelves.
const MIN_SOFFIT_M: f64 = 1.6;
/// The short side of a ceiling is at least this long, meters; walls are thinner.
const MIN_SIDE_M: f64 = 0.65;
/// A soffit lies at least this far under the ceiling beside it, meters.
const UNDER_M: f64 = 0.05;
/// How far beside a soffit its ceiling is looked for, meters.
const BESIDE_M: f64 = 0.6;

/// A level strip over an opening.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Soffit {
    /// Index of its polygon.
    pub polygon: usize,
    /// Its mean height, meters.
    pub height_m: f64,
}

/// What hangs over each cell.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Overhead {
    /// Height of the lowest ceiling over each cell, meters.
    pub ceiling_m: Vec<Option<f32>>,
    /// Cells under soffits.
    pub is_soffit: Vec<bool>,
    /// The soffits.
    pub soffits: Vec<Soffit>,
    /// The height that most of the ceilings have, by area, meters.
    pub usual_m: Option<f64>,
}

/// The short side of the smallest of the rectangles around a polygon that stand along its edges or at steps
/// of five degrees, meters.
fn short_side_m(polygon: &PlanarPolygon) -> f64 {
    let ends = polygon.outer_m.iter().zip(polygon.outer_m.iter().cycle().skip(1));
    let edges = ends.map(|(a, b)| (b[1] - a[1]).portable_atan2(b[0] - a[0]));
    // Few edges of a ragged polygon run along it.
    let all_around = (0..36).map(|step| (f64::from(step) * 5.0).to_radians());
    let widths = edges.chain(all_around).map(|along_rad| {
        let (sin, cos) = along_rad.portable_sin_cos();
        let [low, high] = extent(polygon.outer_m.iter().map(|p| p[1] * cos - p[0] * sin));
        high - low
    });
    widths.fold(f64::INFINITY, f64::min)
}

fn rings(polygon: &PlanarPolygon) -> Vec<Vec<[f64; 2]>> {
    let all = std::iter::once(&polygon.outer_m).chain(&polygon.holes_m);
    all.map(|ring| ring.iter().map(|p| [p[0], p[1]]).collect()).collect()
}

/// Visits the cells under a polygon.
pub(crate) fn cells_under(grid: &Grid, polygon: &PlanarPolygon, visit: impl FnMut(usize)) {
    let rings = rings(polygon);
    grid.fill(&rings.iter().map(Vec::as_slice), visit);
}

fn mean_height_m(polygon: &PlanarPolygon) -> f64 {
    polygon.outer_m.iter().map(|p| p[2]).sum::<f64>() / polygon.outer_m.len().max(1) as f64
}

impl Overhead {
    /// Of what faces down over the floor.
    pub(crate) fn of(evidence: &Evidence<'_>) -> Self {
        let Evidence { model, area, floor_m, .. } = *evidence;
        let grid = &area.grid;
        let mut out =
            Self { ceiling_m: vec![None; grid.len()], is_soffit: vec![false; grid.len()], ..Self::default() };
        let (mut strips, mut heights) = (Vec::new(), Vec::new());
        for (index, polygon) in model.polygons.iter().enumerate() {
            let Some(plane) = model.planes.get(polygon.plane) else { continue };
            let height_m = mean_height_m(polygon);
            if plane.normal[2] > DOWN || height_m < floor_m + MIN_SOFFIT_M {
                continue;
            }
            if short_side_m(polygon) < MIN_SIDE_M {
                strips.push(Soffit { polygon: index, height_m });
            } else if height_m >= floor_m + MIN_CEILING_M {
                heights.push((height_m, ring_area_m2(&polygon.outer_m)));
                out.add_ceiling(grid, polygon, plane);
            }
        }
        out.usual_m = weighted_median(&mut heights);
        for strip in strips {
            out.add_strip(grid, &model.polygons[strip.polygon], strip);
        }
        out
    }

    fn add_ceiling(&mut self, grid: &Grid, polygon: &PlanarPolygon, plane: &crate::model::Plane) {
        cells_under(grid, polygon, |cell| {
            let [x, y] = grid.center_m(cell);
            let [nx, ny, nz] = plane.normal;
            let height_m = ((plane.offset_m - nx * x - ny * y) / nz) as f32;
            let slot = &mut self.ceiling_m[cell];
            *slot = Some(slot.map_or(height_m, |known| known.min(height_m)));
        });
    }

    /// A narrow surface is a soffit where the ceiling beside it is higher; else it is a piece of the ceiling.
    fn add_strip(&mut self, grid: &Grid, polygon: &PlanarPolygon, strip: Soffit) {
        let beside_m = self.beside_m(grid, polygon).or(self.usual_m);
        let is_lower = beside_m.is_none_or(|ceiling_m| strip.height_m < ceiling_m - UNDER_M);
        cells_under(grid, polygon, |cell| {
            if is_lower {
                self.is_soffit[cell] = true;
            } else if self.ceiling_m[cell].is_none() {
                self.ceiling_m[cell] = Some(strip.height_m as f32);
            }
        });
        if is_lower {
            self.soffits.push(strip);
        }
    }

    /// Height of the ceiling around a strip, meters.
    fn beside_m(&self, grid: &Grid, polygon: &PlanarPolygon) -> Option<f64> {
        let around = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0].map(|k: f64| {
            let (sin, cos) = (k * 45.0).to_radians().portable_sin_cos();
            [BESIDE_M * cos, BESIDE_M * sin]
        });
        let mut heights: Vec<(f64, f64)> = polygon
            .outer_m
            .iter()
            .flat_map(|p| around.map(|[x, y]| [p[0] + x, p[1] + y]))
            .filter_map(|place| Some((f64::from(self.ceiling_m[grid.cell(place)?]?), 1.0)))
            .collect();
        weighted_median(&mut heights)
    }
}

/// The value up to which half of the weight lies.
pub(crate) fn weighted_median(values: &mut [(f64, f64)]) -> Option<f64> {
    values.sort_by(|a, b| a.0.total_cmp(&b.0));
    let half = values.iter().map(|(_, weight)| weight).sum::<f64>() / 2.0;
    let mut sum = 0.0;
    let found = values.iter().find(|(_, weight)| {
        sum += weight;
        sum >= half
    });
    found.map(|(value, _)| *value)
}
