//! The fast search: regions grow over the cells of a voxel grid, best seed first.
//!
//! The same definition as the paper's (section 3.1): a region takes what is near it, keeps its mean squared error small and no member
//! far from its best plane. Instead of one point, a step adds the points of one cell, whose sums are known; instead of fixed lengths
//! the limits follow the noise ([`super::noise`]). Metres.

use super::grid::{CELLS_A_TASK, Neighbours};
use super::noise::Noise;
use super::scatter::{Fit, Scatter, dot};
use rayon::prelude::*;
use std::collections::VecDeque;

/// A grown region.
#[derive(Clone, Debug)]
pub struct Region {
    /// Its cells in the order in which they joined.
    pub cells: Vec<u32>,
    /// Its best plane.
    pub fit: Fit,
}

/// What regions grow over.
pub struct Field<'a> {
    /// The sums of the points of each cell; count 0 where no point is free.
    pub cells: &'a [Scatter],
    /// Which cells are near each other.
    pub neighbours: &'a Neighbours,
    /// What counts as noise.
    pub noise: Noise,
    /// Fewest points of a region.
    pub min_points: usize,
    /// Directions that regions may have; all when `None`.
    pub lenders: Option<&'a [[f64; 3]]>,
}

/// A region refits its plane whenever it has grown by this share.
const REFIT_GROWTH: f64 = 1.1;
/// A normal known worse than this, radians, is no plane but a line or a blob.
const MAX_NORMAL_DEVIATION_RAD: f64 = 0.1;
/// A seed has a given direction when its own is no further off (cosine; 11 degrees).
const SEED_COSINE: f64 = 0.98;
/// How often the members of a finished region are tested again with its final plane.
const REVISIONS: usize = 3;

/// Grows regions from the flattest neighbourhoods first; each takes its cells away from those after it.
pub fn grow_all(field: &Field<'_>) -> Vec<Region> {
    let mut search =
        Search { field, taken: vec![false; field.cells.len()], seen: vec![0; field.cells.len()], round: 0 };
    let mut regions = Vec::new();
    for seed in seeds(field) {
        if search.taken[seed as usize] {
            continue;
        }
        let Some(region) = search.grow(seed) else { continue };
        for cell in &region.cells {
            search.taken[*cell as usize] = true;
        }
        regions.push(region);
    }
    regions
}

/// Cells whose neighbourhood is flat, the best known normal first.
fn seeds(field: &Field<'_>) -> Vec<u32> {
    let has =
        |normal| field.lenders.is_none_or(|all| all.iter().any(|n| dot(*n, normal).abs() > SEED_COSINE));
    let seed_of = |cell: usize| {
        if field.cells[cell].count() == 0.0 {
            return None;
        }
        let mut around = field.cells[cell];
        field.neighbours.of(cell).iter().for_each(|other| around.merge(&field.cells[*other as usize]));
        let fit = around.fit()?;
        let deviation_rad = fit.normal_deviation_rad(field.noise.least_error_m());
        let flat = fit.variances_m2[0] <= field.noise.spread_limit_m2(fit.count);
        (flat && deviation_rad < MAX_NORMAL_DEVIATION_RAD && has(fit.normal))
            .then_some((deviation_rad, cell as u32))
    };
    let cells = (0..field.cells.len()).into_par_iter().with_min_len(CELLS_A_TASK);
    let mut seeds: Vec<(f64, u32)> = cells.filter_map(seed_of).collect();
    seeds.par_sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    seeds.into_iter().map(|seed| seed.1).collect()
}

struct Search<'a> {
    field: &'a Field<'a>,
    taken: Vec<bool>,
    /// The round in which a cell was last tested.
    seen: Vec<u32>,
    round: u32,
}

impl Search<'_> {
    fn grow(&mut self, seed: u32) -> Option<Region> {
        let around = self.free_around(seed);
        let mut sums = Scatter::default();
        around.iter().for_each(|cell| sums.merge(&self.field.cells[*cell as usize]));
        let mut fit = sums.fit()?;
        let mut members = vec![seed];
        for _ in 0..=REVISIONS {
            let before = members.len();
            (members, fit) = self.spread(&members, fit)?;
            if members.len() == before {
                break;
            }
        }
        let enough = fit.count >= self.field.min_points as f64;
        let broad = fit.variances_m2[1] >= self.field.noise.least_width_m2();
        (enough
            && broad
            && fit.normal_deviation_rad(self.field.noise.least_error_m()) < MAX_NORMAL_DEVIATION_RAD)
            .then_some(Region { cells: members, fit })
    }

    fn free_around(&self, seed: u32) -> Vec<u32> {
        let others = self.field.neighbours.of(seed as usize).iter().copied();
        std::iter::once(seed).chain(others).filter(|cell| self.is_free(*cell)).collect()
    }

    fn is_free(&self, cell: u32) -> bool {
        !self.taken[cell as usize] && self.field.cells[cell as usize].count() > 0.0
    }

    fn agrees(&self, cell: u32, fit: &Fit) -> bool {
        self.field.noise.agrees(&self.field.cells[cell as usize], fit.normal, fit.offset_m)
    }

    /// One pass in order of distance: the members that still agree, then all that can be reached over agreeing cells.
    fn spread(&mut self, members: &[u32], start: Fit) -> Option<(Vec<u32>, Fit)> {
        self.round += 1;
        let mut fit = start;
        let mut sums = Scatter::default();
        let mut reached = Vec::with_capacity(members.len());
        let mut queue = VecDeque::new();
        for &cell in members {
            self.seen[cell as usize] = self.round;
            if self.agrees(cell, &fit) {
                sums.merge(&self.field.cells[cell as usize]);
                reached.push(cell);
                queue.push_back(cell);
            }
        }
        let mut refit_at = if members.len() < 2 { 0.0 } else { sums.count() * REFIT_GROWTH };
        while let Some(cell) = queue.pop_front() {
            for &next in self.field.neighbours.of(cell as usize) {
                if self.seen[next as usize] == self.round || !self.is_free(next) {
                    continue;
                }
                self.seen[next as usize] = self.round;
                if !self.agrees(next, &fit) {
                    continue;
                }
                sums.merge(&self.field.cells[next as usize]);
                reached.push(next);
                queue.push_back(next);
                let known = sums.count() >= 20.0 && sums.count() >= refit_at;
                if let Some(better) = sums.fit().filter(|f| {
                    known
                        && f.normal_deviation_rad(self.field.noise.least_error_m()) < MAX_NORMAL_DEVIATION_RAD
                }) {
                    fit = better;
                    refit_at = sums.count() * REFIT_GROWTH;
                }
            }
        }
        Some((reached, sums.fit()?))
    }
}
