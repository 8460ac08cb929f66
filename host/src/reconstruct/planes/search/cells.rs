//! The cells that the search grows over: how large they are, which are near each other, what is in them.
//! Meters.

use super::cubes;
use super::grid::{CELLS_PER_TASK, Grid, Neighbors};
use crate::model::Cloud;
use crate::reconstruct::planes::fit::scatter::{Fit, Scatter};
use crate::reconstruct::planes::params::PlaneParams;
use rayon::prelude::*;
use std::ops::Range;

/// Points in a cell on average, when the size follows from the cloud: fewer tell nothing of a step, more blur
/// borders.
const POINTS_PER_CELL: f64 = 5.5;
/// Sizes that are tried, meters; each has about one and a half times the points of the one before.
const SIZES_M: [f64; 10] = [0.05, 0.065, 0.08, 0.1, 0.125, 0.15, 0.19, 0.23, 0.29, 0.35];
/// The size that is tried first: right for a corridor scanned once at walking pace.
const FIRST_SIZE: usize = 3;

/// Points of an organized cloud that one task looks at.
const POINTS_PER_TASK: usize = 1 << 16;
/// How many scans back the last point of a beam is looked for at the start of a task.
const SCANS_BACK: usize = 4;

/// The cloud in cells of the given size, or of one that suits its density. Also returns that size, meters.
pub(crate) fn grid(params: &PlaneParams, cloud: &Cloud) -> (Grid, f64) {
    let cell_m = size(params, &cloud.points_m);
    (Grid::new(&cloud.points_m, cell_m), cell_m)
}

/// The given size of cells, or one that suits the density of points, meters.
pub(crate) fn size(params: &PlaneParams, points_m: &[[f32; 3]]) -> f64 {
    params.cell_m.unwrap_or_else(|| size_for(points_m))
}

/// The size of cells that suits the density of a cloud, meters.
fn size_for(points_m: &[[f32; 3]]) -> f64 {
    let density_of = |size: usize| cubes::density(points_m, SIZES_M[size]);
    let mut size = FIRST_SIZE;
    let mut density = density_of(size);
    let too_full = density > 3.0 * POINTS_PER_CELL;
    while too_full && density > 1.5 * POINTS_PER_CELL && size > 0 {
        size -= 1;
        density = density_of(size);
    }
    while !too_full && density < POINTS_PER_CELL && size + 1 < SIZES_M.len() {
        // The points of a cell grow with the square of its size: larger steps when much is missing.
        size = (size + if density < 0.5 * POINTS_PER_CELL { 2 } else { 1 }).min(SIZES_M.len() - 1);
        density = density_of(size);
    }
    SIZES_M[size]
}

/// Cells that touch, and cells that hold consecutive points of a scan, or of one beam, that are at most delta
/// apart: far from the laser such points lie several cells apart.
pub(crate) fn linked(params: &PlaneParams, cloud: &Cloud, grid: &Grid) -> Neighbors {
    let touching = grid.neighbors();
    if cloud.beams_per_scan == 0 || cloud.scan.is_empty() {
        return touching;
    }
    let links = Links {
        delta_m: params.delta_m,
        cloud,
        touching: &touching,
        cell_of: grid.by_point(cloud.len(), -1, |cell, _| cell as i32),
    };
    let firsts: Vec<usize> = (0..cloud.len()).step_by(POINTS_PER_TASK).collect();
    let pairs: Vec<Vec<[u32; 2]>> = firsts
        .into_par_iter()
        .map(|first| links.among(first..(first + POINTS_PER_TASK).min(cloud.len())))
        .collect();
    let pairs = pairs.concat();
    touching.with_pairs(pairs)
}

/// What tells which cells hold consecutive points.
struct Links<'a> {
    delta_m: f64,
    cloud: &'a Cloud,
    touching: &'a Neighbors,
    /// The cell of each point, -1 for points that are nowhere.
    cell_of: Vec<i32>,
}

impl Links<'_> {
    /// Pairs of cells that do not touch and that points of a run and those before them connect.
    fn among(&self, run: Range<usize>) -> Vec<[u32; 2]> {
        let Cloud { scan, beam, beams_per_scan, .. } = self.cloud;
        let mut last_of_beam = vec![usize::MAX; *beams_per_scan];
        // The beam may have seen nothing for a few scans: what is further back is further away than delta.
        for before in run.start.saturating_sub(SCANS_BACK * beams_per_scan)..run.start {
            beam.get(before)
                .and_then(|beam| last_of_beam.get_mut(usize::from(*beam)))
                .into_iter()
                .for_each(|last| *last = before);
        }
        let mut pairs = Vec::new();
        for index in run {
            let (Some(own_scan), Some(own_beam)) = (scan.get(index), beam.get(index)) else { break };
            let Some(last) = last_of_beam.get_mut(usize::from(*own_beam)) else { continue };
            let same_beam = std::mem::replace(last, index);
            let before = index.wrapping_sub(1);
            let same_scan = if scan.get(before) == Some(own_scan) { before } else { usize::MAX };
            pairs.extend([same_beam, same_scan].into_iter().filter_map(|other| self.pair(other, index)));
        }
        pairs
    }

    /// The cells of two points, if the points are near and the cells do not touch.
    fn pair(&self, other: usize, index: usize) -> Option<[u32; 2]> {
        let (p, q) = (self.cloud.points_m[index], self.cloud.points_m.get(other)?);
        let from = u32::try_from(self.cell_of[other]).ok()?;
        let to = u32::try_from(self.cell_of[index]).ok().filter(|to| *to != from)?;
        let apart_m2: f32 = q.iter().zip(p).map(|(a, b)| (a - b) * (a - b)).sum();
        let near = f64::from(apart_m2) < self.delta_m * self.delta_m;
        (near && self.touching.of(from as usize).binary_search(&to).is_err()).then_some([from, to])
    }
}

/// The sums of the points of each cell.
pub(crate) fn cell_sums(points_m: &[[f32; 3]], grid: &Grid) -> Vec<Scatter> {
    let sum_of = |cell: usize| {
        let mut sum = Scatter::default();
        grid.points_of(cell).iter().for_each(|point| sum.add(points_m[*point as usize].map(f64::from)));
        sum
    };
    (0..grid.len()).into_par_iter().with_min_len(CELLS_PER_TASK).map(sum_of).collect()
}

/// What is free in each cell and around it.
pub(crate) struct Free {
    /// The sums of the free points of each cell.
    pub cells: Vec<Scatter>,
    /// Where there are any: the best plane of them together with those of the cells near it.
    pub around: Vec<Option<Fit>>,
}

impl Free {
    /// Looks around each cell.
    pub(crate) fn new(cells: Vec<Scatter>, neighbors: &Neighbors) -> Self {
        let fit_of = |(cell, own): (usize, &Scatter)| {
            if own.count() == 0.0 {
                return None;
            }
            let mut around = *own;
            neighbors.of(cell).iter().for_each(|other| around.merge(&cells[*other as usize]));
            around.fit()
        };
        let around = cells.par_iter().enumerate().with_min_len(CELLS_PER_TASK).map(fit_of).collect();
        Self { cells, around }
    }
}
