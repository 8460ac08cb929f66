//! The fast search: regions grow over the cells of a voxel grid, best seed first.
//!
//! The same definition as the paper's (section 3.1): a region takes what is near it, keeps its mean squared
//! error small and no member far from its best plane. Instead of one point, a step adds the points of one
//! cell, whose sums are known; instead of fixed lengths the limits follow the noise
//! ([`crate::reconstruct::planes::fit::noise`]). Meters.

use super::cells::Free;
use super::grid::{CELLS_PER_TASK, Neighbors};
use crate::reconstruct::planes::fit::noise::Noise;
use crate::reconstruct::planes::fit::scatter::{Fit, Scatter};
use biplane_geometry::vec3::dot;
use rayon::prelude::*;
use std::collections::HashSet;

/// A grown region.
#[derive(Clone, Debug)]
pub(crate) struct Region {
    /// Its cells in the order in which they joined.
    pub cells: Vec<u32>,
    /// Its best plane.
    pub fit: Fit,
}

/// What regions grow over.
pub(crate) struct Field<'a> {
    /// The points of each cell that are free.
    pub free: &'a Free,
    /// Which cells are near each other.
    pub neighbors: &'a Neighbors,
    /// What counts as noise.
    pub noise: Noise,
    /// Directions that regions may have; all when `None`.
    pub reference_directions: Option<&'a [[f64; 3]]>,
}

/// A region refits its plane whenever it has grown by this share.
const REFIT_GROWTH: f64 = 1.1;
/// A region of fewer points keeps the plane that it started with.
const MIN_TO_REFIT: f64 = 20.0;
/// A normal known worse than this, radians, is no plane but a line or a blob.
const MAX_NORMAL_DEVIATION_RAD: f64 = 0.1;
/// A seed has a given direction when its own is no further off (cosine; 11 degrees).
const SEED_COSINE: f64 = 0.98;
/// How often the members of a finished region are tested again with its final plane.
const REVISIONS: usize = 3;
/// A region whose number of cells changes by no more than one in so many is finished.
const SETTLED_SHARE: usize = 200;

/// Grows regions from the flattest neighborhoods first; each takes its cells away from those after it. Seeds
/// that `failed` before are passed over as long as nothing around them has changed; those that fail now join
/// them.
pub(crate) fn grow_all(field: &Field<'_>, min_points: usize, failed: &mut HashSet<Seed>) -> Vec<Region> {
    let seen = field.free.cells.iter().map(|cell| if cell.count() > 0.0 { 0 } else { TAKEN }).collect();
    let mut search = Search { field, seen, round: 0 };
    let mut regions = Vec::new();
    let seeds = seeds(field);
    for seed in seeds.into_iter().filter(|seed| !failed.contains(seed)).collect::<Vec<_>>() {
        if !search.is_free(seed.cell) {
            continue;
        }
        let Some(region) = search.grow(seed.cell, min_points) else {
            failed.insert(seed);
            continue;
        };
        for cell in &region.cells {
            search.seen[*cell as usize] = TAKEN;
        }
        regions.push(region);
    }
    regions
}

/// Where a region may start.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(crate) struct Seed {
    /// How far the normal of the cell and those around it may be off: the bits of a number that is not
    /// negative, in its order.
    deviation: u64,
    cell: u32,
}

/// Cells whose neighborhood is flat, the best known normal first.
fn seeds(field: &Field<'_>) -> Vec<Seed> {
    let has = |normal| {
        field.reference_directions.is_none_or(|all| all.iter().any(|n| dot(*n, normal).abs() > SEED_COSINE))
    };
    let seed_of = |(cell, fit): (usize, &Option<Fit>)| {
        let fit = fit.as_ref()?;
        let deviation_rad = fit.normal_deviation_rad(field.noise.min_error_m());
        let flat = fit.variances_m2[0] <= field.noise.spread_limit_m2(fit.count);
        (flat && deviation_rad < MAX_NORMAL_DEVIATION_RAD && has(fit.normal))
            .then_some(Seed { deviation: deviation_rad.to_bits(), cell: cell as u32 })
    };
    let fits = field.free.around.par_iter().enumerate().with_min_len(CELLS_PER_TASK);
    let mut seeds: Vec<Seed> = fits.filter_map(seed_of).collect();
    seeds.par_sort_unstable();
    seeds
}

/// In place of a round: the cell belongs to a region, or has no free points.
const TAKEN: u32 = u32::MAX;

struct Search<'a> {
    field: &'a Field<'a>,
    /// The round in which a cell was last tested, or [`TAKEN`].
    seen: Vec<u32>,
    round: u32,
}

impl Search<'_> {
    fn grow(&mut self, seed: u32, min_points: usize) -> Option<Region> {
        let around = self.free_around(seed);
        let mut sums = Scatter::default();
        around.iter().for_each(|cell| sums.merge(&self.field.free.cells[*cell as usize]));
        let mut fit = sums.fit()?;
        let mut members = vec![seed];
        for _ in 0..=REVISIONS {
            let before = members.len();
            (members, fit) = self.spread(&members, fit)?;
            // What a few cells more change is left to the points' own choice.
            if members.len().abs_diff(before) * SETTLED_SHARE <= before {
                break;
            }
        }
        let enough = fit.count >= min_points as f64;
        let broad = fit.variances_m2[1] >= self.field.noise.min_width_m2();
        (enough
            && broad
            && fit.normal_deviation_rad(self.field.noise.min_error_m()) < MAX_NORMAL_DEVIATION_RAD)
            .then_some(Region { cells: members, fit })
    }

    fn free_around(&self, seed: u32) -> Vec<u32> {
        let others = self.field.neighbors.of(seed as usize).iter().copied();
        std::iter::once(seed).chain(others).filter(|cell| self.is_free(*cell)).collect()
    }

    fn is_free(&self, cell: u32) -> bool {
        self.seen[cell as usize] != TAKEN
    }

    fn agrees(&self, cell: u32, fit: &Fit) -> bool {
        self.field.noise.agrees(&self.field.free.cells[cell as usize], fit.normal, fit.offset_m)
    }

    /// One pass in order of distance: the members that still agree, then all that can be reached over
    /// agreeing cells.
    fn spread(&mut self, members: &[u32], start: Fit) -> Option<(Vec<u32>, Fit)> {
        self.round += 1;
        let min_error_m = self.field.noise.min_error_m();
        let mut fit = start;
        let mut sums = Scatter::default();
        let mut reached = Vec::with_capacity(members.len());
        for &cell in members {
            self.seen[cell as usize] = self.round;
            if self.agrees(cell, &fit) {
                sums.merge(&self.field.free.cells[cell as usize]);
                reached.push(cell);
            }
        }
        let mut refit_at = if members.len() < 2 { 0.0 } else { sums.count() * REFIT_GROWTH };
        let mut asked = 0;
        while let Some(&cell) = reached.get(asked) {
            asked += 1;
            for &next in self.field.neighbors.of(cell as usize) {
                let seen = self.seen[next as usize];
                if seen == self.round || seen == TAKEN {
                    continue;
                }
                self.seen[next as usize] = self.round;
                if !self.agrees(next, &fit) {
                    continue;
                }
                sums.merge(&self.field.free.cells[next as usize]);
                reached.push(next);
                if sums.count() < refit_at.max(MIN_TO_REFIT) {
                    continue;
                }
                let known = |f: &Fit| f.normal_deviation_rad(min_error_m) < MAX_NORMAL_DEVIATION_RAD;
                if let Some(better) = sums.fit().filter(known) {
                    fit = better;
                    refit_at = sums.count() * REFIT_GROWTH;
                }
            }
        }
        Some((reached, sums.fit()?))
    }
}
