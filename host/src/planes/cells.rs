//! The cells that the search grows over: how large they are, which are near each other, what is in them. Metres.

use super::PlaneParams;
use super::grid::{CELLS_A_TASK, Grid, Neighbours};
use super::scatter::Scatter;
use crate::model::Cloud;
use rayon::prelude::*;

/// Points in a cell on average, when the size follows from the cloud: fewer tell nothing of a step, more blur borders.
const POINTS_A_CELL: f64 = 5.5;
/// Sizes that are tried, metres; each has about one and a half times the points of the one before.
const SIZES_M: [f64; 10] = [0.05, 0.065, 0.08, 0.1, 0.125, 0.15, 0.19, 0.23, 0.29, 0.35];
/// The size that is tried first: right for a corridor scanned once at walking pace.
const FIRST_SIZE: usize = 3;

/// The cloud in cells of the given size, or of one that suits its density. Also returns that size, metres.
pub fn grid(params: &PlaneParams, cloud: &Cloud) -> (Grid, f64) {
    if let Some(cell_m) = params.cell_m {
        return (Grid::new(indexed(&cloud.points_m), cell_m), cell_m);
    }
    let of_size = |size: usize| {
        let grid = Grid::new(indexed(&cloud.points_m), SIZES_M[size]);
        let density = grid.order.len() as f64 / grid.len().max(1) as f64;
        (grid, density)
    };
    let mut size = FIRST_SIZE;
    let (mut grid, mut density) = of_size(size);
    let too_full = density > 3.0 * POINTS_A_CELL;
    while too_full && density > 1.5 * POINTS_A_CELL && size > 0 {
        size -= 1;
        (grid, density) = of_size(size);
    }
    while !too_full && density < POINTS_A_CELL && size + 1 < SIZES_M.len() {
        // The points of a cell grow with the square of its size: larger steps when much is missing.
        size = (size + if density < 0.5 * POINTS_A_CELL { 2 } else { 1 }).min(SIZES_M.len() - 1);
        (grid, density) = of_size(size);
    }
    (grid, SIZES_M[size])
}

/// Points with their indices, as a grid takes them.
pub fn indexed(points_m: &[[f32; 3]]) -> impl Iterator<Item = (u32, [f32; 3])> + '_ {
    points_m.iter().enumerate().map(|(index, p)| (index as u32, *p))
}

/// Cells that touch, and cells that hold consecutive points of a scan, or of one beam, that are at most delta apart: far from the
/// laser such points lie several cells apart.
pub fn linked(params: &PlaneParams, cloud: &Cloud, grid: &Grid) -> Neighbours {
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

/// The sums of the points of each cell.
pub fn cell_sums(points_m: &[[f32; 3]], grid: &Grid) -> Vec<Scatter> {
    let sum_of = |cell: usize| {
        let mut sum = Scatter::default();
        grid.points_of(cell).iter().for_each(|point| sum.add(points_m[*point as usize].map(f64::from)));
        sum
    };
    (0..grid.len()).into_par_iter().with_min_len(CELLS_A_TASK).map(sum_of).collect()
}
