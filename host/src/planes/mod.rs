//! Planes in a point cloud, after the paper's definition (section 3.1).
//!
//! A set of points is a plane when each lies close to another of the set, the mean squared distance to the best plane stays small
//! and no point is far from it. Frame `map`, metres.

pub mod coplanar;
pub mod curtain;
pub mod eigen;
pub mod grid;
pub mod grow;
pub mod noise;
pub mod random;
pub mod reference;
pub mod refine;
pub mod scatter;

use crate::model::{Cloud, Plane};
use grid::{Grid, Neighbours};
use grow::{Field, grow_all};
use noise::{Noise, estimate_sigma_m};
use refine::{Labelling, refit, scatters};
use scatter::{Fit, Scatter};
use serde::Serialize;

/// What a plane is.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PlaneParams {
    /// Range noise of the sensor, metres, one standard deviation; `None` = estimate it from the cloud.
    /// Larger: steps between parallel surfaces disappear. Smaller: one noisy wall becomes several planes.
    pub sigma_m: Option<f64>,
    /// Longest distance from a point to the rest of its plane, metres (the paper's delta).
    pub delta_m: f64,
    /// Fewest points of a plane. Larger: small surfaces stay triangles. Smaller: noise is taken for planes.
    pub min_points: usize,
    /// Edge of a cell of the search, metres. Larger: coarser borders. Smaller: too few points a cell to tell steps from noise.
    pub cell_m: f64,
}

impl Default for PlaneParams {
    fn default() -> Self {
        Self { sigma_m: None, delta_m: 0.3, min_points: 50, cell_m: 0.1 }
    }
}

/// The planes of a cloud and which point is on which.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Planes {
    /// The planes, largest first.
    pub planes: Vec<Plane>,
    /// For every point the index of its plane, or -1.
    pub labels: Vec<i32>,
    /// The range noise that was assumed or estimated, metres.
    pub sigma_m: f64,
}

/// Noise that is assumed when it is not given and the cloud is too small to tell, metres: a laser of the LMS 2xx family.
const TYPICAL_SIGMA_M: f64 = 0.02;
const ROUNDS: usize = 3;

/// Finds the planes of a cloud.
pub fn extract(params: &PlaneParams, cloud: &Cloud) -> Planes {
    let points_m = &cloud.points_m;
    let grid = Grid::new(indexed(points_m), params.cell_m);
    let neighbours = linked(params, cloud, &grid);
    let mut labels = vec![-1i32; points_m.len()];
    let all = cell_sums(points_m, &grid, &labels);
    let sigma_m = params.sigma_m.or_else(|| estimate_sigma_m(&all, &neighbours)).unwrap_or(TYPICAL_SIGMA_M);
    let noise = Noise::new(sigma_m);
    let labelling = Labelling { points_m, grid: &grid, neighbours: &neighbours, noise };
    let mut fits: Vec<Option<Fit>> = Vec::new();
    for _ in 0..ROUNDS {
        let free = cell_sums(points_m, &grid, &labels);
        let field = Field { cells: &free, neighbours: &neighbours, noise, min_points: params.min_points };
        let regions = grow_all(&field);
        if regions.is_empty() {
            break;
        }
        for region in regions {
            let label = fits.len() as i32;
            for cell in &region.cells {
                for &point in grid.points_of(*cell as usize) {
                    let near = region.fit.distance_m(points_m[point as usize].map(f64::from)).abs()
                        <= noise.point_limit_m();
                    if labels[point as usize] < 0 && near {
                        labels[point as usize] = label;
                    }
                }
            }
            fits.push(Some(region.fit));
        }
        for _ in 0..4 {
            labelling.choose(&fits, &mut labels);
            fits = refit(points_m, &labels, fits.len());
        }
    }
    let into = coplanar::unite(&scatters(points_m, &labels, fits.len()), noise);
    for label in &mut labels {
        *label = usize::try_from(*label).map_or(-1, |old| into[old] as i32);
    }
    fits = refit(points_m, &labels, fits.len());
    for _ in 0..2 {
        labelling.choose(&fits, &mut labels);
        fits = refit(points_m, &labels, fits.len());
    }
    let curtains = curtain::find(cloud, &labels, &fits);
    fits.iter_mut().zip(curtains).filter(|(_, curtain)| *curtain).for_each(|(fit, _)| *fit = None);
    labelling.choose(&fits, &mut labels);
    finish(params, cloud, labels, fits.len(), sigma_m)
}

fn indexed(points_m: &[[f32; 3]]) -> impl Iterator<Item = (u32, [f32; 3])> + '_ {
    points_m.iter().enumerate().map(|(index, p)| (index as u32, *p))
}

/// Cells that touch, and cells that hold consecutive points of a scan, or of one beam, that are at most delta apart: far from the
/// laser such points lie several cells apart.
fn linked(params: &PlaneParams, cloud: &Cloud, grid: &Grid) -> Neighbours {
    let touching = grid.neighbours();
    let mut cell_of = vec![u32::MAX; cloud.len()];
    for cell in 0..grid.len() {
        grid.points_of(cell).iter().for_each(|point| cell_of[*point as usize] = cell as u32);
    }
    let mut pairs = Vec::new();
    let mut last_of_beam = vec![u32::MAX; cloud.beams_per_scan];
    for (index, (&scan, &beam)) in cloud.scan.iter().zip(&cloud.beam).enumerate() {
        let Some(last) = last_of_beam.get_mut(usize::from(beam)) else { continue };
        let same_beam = std::mem::replace(last, index as u32) as usize;
        let before = index.wrapping_sub(1);
        let same_scan = if cloud.scan.get(before) == Some(&scan) { before } else { usize::MAX };
        for other in [same_beam, same_scan] {
            let Some(q) = cloud.points_m.get(other) else { continue };
            let (from, to) = (cell_of[other], cell_of[index]);
            let apart_m2: f32 = q.iter().zip(cloud.points_m[index]).map(|(a, b)| (a - b) * (a - b)).sum();
            let near = f64::from(apart_m2) < params.delta_m * params.delta_m;
            if near
                && from != to
                && from.max(to) != u32::MAX
                && touching.of(from as usize).binary_search(&to).is_err()
            {
                pairs.push([from, to]);
            }
        }
    }
    touching.with_pairs(pairs)
}

/// The sums of the points without a label, by cell.
fn cell_sums(points_m: &[[f32; 3]], grid: &Grid, labels: &[i32]) -> Vec<Scatter> {
    let sum_of = |cell: usize| {
        let mut sum = Scatter::default();
        let free = grid.points_of(cell).iter().filter(|point| labels[**point as usize] < 0);
        free.for_each(|point| sum.add(points_m[*point as usize].map(f64::from)));
        sum
    };
    (0..grid.len()).map(sum_of).collect()
}

/// Drops labels with too few points, turns normals towards the sensor, orders planes by size.
fn finish(params: &PlaneParams, cloud: &Cloud, mut labels: Vec<i32>, count: usize, sigma_m: f64) -> Planes {
    let sums = scatters(&cloud.points_m, &labels, count);
    let mut towards = vec![0i64; count];
    let fits: Vec<Option<Fit>> =
        sums.iter().map(|s| s.fit().filter(|f| f.count >= params.min_points as f64)).collect();
    for (index, label) in labels.iter().enumerate() {
        let Some(fit) = usize::try_from(*label).ok().and_then(|l| fits[l]) else { continue };
        if let Some(origin) = cloud.origin_of(index) {
            towards[*label as usize] += if fit.distance_m(origin.map(f64::from)) >= 0.0 { 1 } else { -1 };
        }
    }
    let mut kept: Vec<(usize, Fit)> = fits.iter().enumerate().filter_map(|(l, f)| Some((l, (*f)?))).collect();
    kept.sort_by(|a, b| b.1.count.total_cmp(&a.1.count));
    let mut new_label = vec![-1; count];
    let mut planes = Vec::new();
    for (old, fit) in kept {
        let sign = if towards[old] < 0 { -1.0 } else { 1.0 };
        new_label[old] = planes.len() as i32;
        planes.push(Plane {
            normal: fit.normal.map(|v| sign * v),
            offset_m: sign * fit.offset_m,
            points: fit.count as usize,
            rms_m: fit.variances_m2[0].sqrt(),
        });
    }
    for label in &mut labels {
        *label = usize::try_from(*label).map_or(-1, |old| new_label[old]);
    }
    Planes { planes, labels, sigma_m }
}

#[cfg(test)]
mod tests;
