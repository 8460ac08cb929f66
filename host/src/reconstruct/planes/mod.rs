//! Planes in a point cloud, after the paper's definition (section 3.1).
//!
//! A set of points is a plane when each lies close to another of the set, the mean squared distance to the
//! best plane stays small and no point is far from it. Frame `map`, meters.

mod facing;
mod finish;
pub(crate) mod fit;
pub(crate) mod labeled;
pub(crate) mod labels;
pub(crate) mod merge;
pub(crate) mod paper;
pub(crate) mod params;
pub(crate) mod reject;
pub(crate) mod search;
#[cfg(test)]
mod tests;

pub use labeled::{Planes, SigmaSource};
pub use params::PlaneParams;

use crate::model::Cloud;
use crate::reconstruct::planes::fit::noise::{Noise, estimate_sigma_m};
use crate::reconstruct::planes::fit::scatter::Fit;
use crate::reconstruct::planes::labels::refine::{Labeling, refit};
use crate::reconstruct::planes::merge::seen_by::SeenBy;
use crate::reconstruct::planes::paper::params::ReferenceParams;
use crate::reconstruct::planes::search::blocks::{Block, divide};
use crate::reconstruct::planes::search::cells::{Free, cell_sums, linked};
use crate::reconstruct::planes::search::grid::{Grid, Neighbors};
use crate::reconstruct::planes::search::grow::{Field, Seed, grow_all};
use crate::reconstruct::planes::search::searched::{Searched, Setting};
use crate::reconstruct::planes::search::stitch::combine;
use rayon::prelude::*;
use std::collections::HashSet;

/// Noise that is assumed when it is not given and the cloud is too small to tell, meters: a laser of the LMS
/// 2xx family.
const TYPICAL_SIGMA_M: f64 = 0.02;
/// Searches, each among the points that those before left over.
const ROUNDS: usize = 3;
/// Noise of a last search for planes that are parallel to known ones, as a share of the usual: a turning
/// robot sees a facade through the error of its heading.
const LOOSE_SHARE: f64 = 2.0;
/// Edge of the cells in which steps are looked for, as a share of the cells of the search: door frames are 8
/// cm wide.
const STEP_CELL_SHARE: f64 = 0.8;
/// How often points choose their plane and planes are fitted anew after a search, after uniting, and after
/// steps were added.
const CHOICES: [usize; 3] = [20, 20, 6];

/// Finds the planes of a cloud.
pub fn extract(params: &PlaneParams, cloud: &Cloud) -> Planes {
    extract_with_progress(params, cloud, &mut |_| ())
}

/// [`extract`] that tells from time to time how much of the way it is, in percent of the time that a large
/// cloud takes.
pub(crate) fn extract_with_progress(
    params: &PlaneParams,
    cloud: &Cloud,
    progress: &mut dyn FnMut(u64),
) -> Planes {
    let found = match search::distinct::distinct(cloud) {
        Some(places) => places.spread(extract_distinct(params, &places.cloud, progress)),
        None => extract_distinct(params, cloud, progress),
    };
    progress(100);
    found
}

fn extract_distinct(params: &PlaneParams, cloud: &Cloud, progress: &mut dyn FnMut(u64)) -> Planes {
    let blocks = divide(params, cloud);
    let searched = if blocks.len() < 2 {
        search(params, cloud, progress)
    } else {
        in_blocks(params, cloud, &blocks, progress)
    };
    extract_searched(params, cloud, searched, progress)
}

/// The planes of a cloud that was searched.
pub(crate) fn extract_searched(
    params: &PlaneParams,
    cloud: &Cloud,
    searched: Searched,
    progress: &mut dyn FnMut(u64),
) -> Planes {
    let grid = Grid::new(&cloud.points_m, 0.5 * searched.setting.cell_m);
    progress(65);
    let Setting { sigma_m, sigma_source, .. } = searched.setting;
    let (labels, fits) = refine(params, cloud, &grid, searched);
    progress(95);
    let found = finish::finish(params, cloud, labels, &fits, sigma_m);
    Planes { sigma_source, ..found }
}

/// Searches one block after the other, some at the same time, and puts together what was found.
fn in_blocks(
    params: &PlaneParams,
    cloud: &Cloud,
    blocks: &[Block],
    progress: &mut dyn FnMut(u64),
) -> Searched {
    let setting = setting(params, cloud, blocks);
    progress(20);
    let mut found = Vec::with_capacity(blocks.len());
    for some in blocks.chunks(rayon::current_num_threads()) {
        found.par_extend(some.par_iter().map(|block| search_block(params, &block.cloud(cloud), setting)));
        progress(20 + 45 * found.len() as u64 / blocks.len() as u64);
    }
    combine(cloud, blocks, &found, setting)
}

/// What all blocks of a cloud go by.
pub(crate) fn setting(params: &PlaneParams, cloud: &Cloud, blocks: &[Block]) -> Setting {
    let cell_m = search::cells::size(params, &cloud.points_m);
    let (sigma_m, sigma_source) = sigma_of(params, || {
        let (mut cells, mut around) = (Vec::new(), Vec::new());
        for block in blocks {
            let of_block = block.cloud(cloud);
            let grid = Grid::new(&of_block.points_m, cell_m);
            let all = Free::new(cell_sums(&of_block.points_m, &grid), &linked(params, &of_block, &grid));
            // A cell that lies in two blocks counts in one.
            let is_own = |cell: &usize| block.is_own[grid.points_of(*cell)[0] as usize];
            let own: Vec<usize> = (0..grid.len()).filter(is_own).collect();
            cells.extend(own.iter().map(|cell| all.cells[*cell]));
            around.extend(own.iter().map(|cell| all.around[*cell]));
        }
        estimate_sigma_m(&cells, &around)
    });
    Setting { cell_m, sigma_m, sigma_source }
}

/// Searches the points of a block.
pub(crate) fn search_block(params: &PlaneParams, of_block: &Cloud, setting: Setting) -> Searched {
    let Setting { cell_m, sigma_m, .. } = setting;
    let params = PlaneParams { cell_m: Some(cell_m), sigma_m: Some(sigma_m), ..params.clone() };
    search(&params, of_block, &mut |_| ())
}

/// Estimates the noise and grows planes over cells.
pub(crate) fn search(params: &PlaneParams, cloud: &Cloud, progress: &mut dyn FnMut(u64)) -> Searched {
    let (grid, cell_m) = search::cells::grid(params, cloud);
    progress(10);
    let neighbors = linked(params, cloud, &grid);
    progress(15);
    let all = Free::new(cell_sums(&cloud.points_m, &grid), &neighbors);
    let (sigma_m, sigma_source) = sigma_of(params, || estimate_sigma_m(&all.cells, &all.around));
    progress(20);
    let noise = Noise::new(sigma_m);
    let labeling = Labeling::new(&cloud.points_m, (&grid, &neighbors), noise, (&[], 0));
    let mut work = Work { params, noise, labeling, fits: Vec::new() };
    work.search(&neighbors, all);
    progress(50);
    work.unite();
    let labels = work.labeling.labels(cloud.len());
    Searched { setting: Setting { cell_m, sigma_m, sigma_source }, labels, fits: work.fits, blocks: 1 }
}

/// Adds faint steps, and draws borders anew over smaller cells.
fn refine(
    params: &PlaneParams,
    cloud: &Cloud,
    grid: &Grid,
    searched: Searched,
) -> (Vec<i32>, Vec<Option<Fit>>) {
    let neighbors = grid.neighbors();
    let Searched { setting: Setting { sigma_m, cell_m, .. }, labels, fits, blocks } = searched;
    let noise = Noise::new(sigma_m);
    let labeling = Labeling::new(&cloud.points_m, (grid, &neighbors), noise, (&labels, fits.len()));
    drop(labels);
    let mut work = Work { params, noise, labeling, fits };
    if blocks > 1 {
        work.unite();
    }
    work.add_steps(cell_m);
    work.unite();
    work.drop_mixed_pixel_planes(cloud);
    work.unite_seen_apart(cloud);
    (work.labeling.labels(cloud.len()), work.fits)
}

/// Finds the planes of a cloud by the paper's own search, with its fixed lengths: much slower, for
/// comparison. `told` hears after each plane how many points are on planes. The noise of the result is what
/// the planes' points show.
pub(crate) fn extract_paper(
    params: &ReferenceParams,
    cloud: &Cloud,
    seed: u64,
    progress: &mut dyn FnMut(usize),
) -> Planes {
    let (labels, fits) = paper::region_growing::extract(params, &cloud.points_m, seed, progress);
    let of_ours = PlaneParams { min_points: params.min_points, ..PlaneParams::default() };
    let fits: Vec<Option<Fit>> = fits.into_iter().map(Some).collect();
    finish::finish(&of_ours, cloud, labels, &fits, params.epsilon_m2.sqrt())
}

/// The noise to go by, meters, and where it comes from.
fn sigma_of(params: &PlaneParams, estimate: impl FnOnce() -> Option<f64>) -> (f64, SigmaSource) {
    match params.sigma_m {
        Some(given_m) => (given_m, SigmaSource::Given),
        None => estimate().map_or((TYPICAL_SIGMA_M, SigmaSource::Assumed), |m| (m, SigmaSource::Estimated)),
    }
}

/// The labels of the points and the planes of the labels, as they become better.
struct Work<'a> {
    params: &'a PlaneParams,
    noise: Noise,
    labeling: Labeling<'a>,
    fits: Vec<Option<Fit>>,
}

impl Work<'_> {
    /// Grows regions among the points that are free, all at first, as long as there are any.
    fn search(&mut self, neighbors: &Neighbors, all: Free) {
        let mut failed = HashSet::new();
        let mut free = all;
        for _ in 0..ROUNDS {
            let field = Field { free: &free, neighbors, noise: self.noise, reference_directions: None };
            let any = self.search_once(&field, &mut failed);
            drop(free);
            free = Free::new(self.labeling.free(), neighbors);
            if !any {
                break;
            }
        }
        let reference_directions = merge::parallel::reference_directions(self.labeling.sums(), self.noise);
        let first = self.fits.len();
        let noise = Noise::new(LOOSE_SHARE * self.noise.sigma_m);
        let field =
            Field { free: &free, neighbors, noise, reference_directions: Some(&reference_directions) };
        self.search_once(&field, &mut HashSet::new());
        self.fits = merge::parallel::hold(self.labeling.sums(), &self.fits, self.noise);
        for fit in &mut self.fits[first..] {
            *fit = fit.filter(|fit| fit.held);
        }
    }

    /// Grows regions among the points that are free; whether there were any.
    fn search_once(&mut self, field: &Field<'_>, failed: &mut HashSet<Seed>) -> bool {
        let regions = grow_all(field, self.params.min_points, failed);
        let any = !regions.is_empty();
        self.labeling.take(&regions, field.noise.point_limit_m());
        self.fits.extend(regions.iter().map(|region| Some(region.fit)));
        self.choose(CHOICES[0]);
        any
    }

    /// Lets points choose their plane and fits planes to their points, in turn.
    fn choose(&mut self, times: usize) {
        for _ in 0..times {
            let changed = self.labeling.choose(&self.fits);
            self.fits = refit(self.labeling.sums(), &self.fits);
            if changed == 0 {
                break;
            }
        }
    }

    /// Makes planes one that are.
    fn unite(&mut self) {
        self.fits = merge::parallel::hold(self.labeling.sums(), &self.fits, self.noise);
        self.rename(&merge::tilted::lean(self.labeling.sums(), &self.fits, self.noise));
        self.rename(&merge::coplanar::unite(self.labeling.sums(), &self.fits, self.noise, None));
        self.choose(CHOICES[1]);
    }

    /// Makes planes one that lie beside each other only because poses err from scan to scan. Points keep
    /// their choice: what else lies near them would take those that are off the common plane.
    fn unite_seen_apart(&mut self, cloud: &Cloud) {
        let labels = self.labeling.labels(cloud.len());
        let seen = SeenBy::of_labels(&labels, &cloud.scan, self.fits.len());
        self.rename(&merge::coplanar::unite(self.labeling.sums(), &self.fits, self.noise, seen));
    }

    fn rename(&mut self, into: &[usize]) {
        self.labeling.rename(into);
        self.fits = refit(self.labeling.sums(), &self.fits);
    }

    /// Finds faint steps within planes and keeps those that are real.
    fn add_steps(&mut self, cell_m: f64) {
        self.choose(1);
        let limits = (self.noise, self.params.min_points);
        let (points_m, labels) = self.labeling.in_cells();
        let mut steps =
            labels::step_detection::suggest(points_m, (&self.fits, labels), limits, STEP_CELL_SHARE * cell_m);
        let first = self.fits.len();
        let walls = self.fits.clone();
        steps.iter().for_each(|step| self.labeling.put(&step.points));
        let mut real = Vec::new();
        for _ in 0..CHOICES[2] {
            let fits: Vec<Option<Fit>> =
                walls.iter().copied().chain(steps.iter().map(|step| Some(step.fit))).collect();
            self.labeling.choose(&fits);
            let (points_m, labels) = self.labeling.in_cells();
            real = labels::step_detection::judge(points_m, labels, (&mut steps, first), &walls, limits);
        }
        let kept = steps.iter().zip(&real).enumerate();
        let after =
            kept.map(|(which, (step, real))| if *real { first + which } else { step.within as usize });
        let into: Vec<usize> = (0..first).chain(after).collect();
        self.fits.extend(steps.iter().map(|step| Some(step.fit)));
        self.rename(&into);
        self.choose(1);
    }

    /// Gives up planes that are mixed-pixel planes of mixed pixels; their points choose anew.
    fn drop_mixed_pixel_planes(&mut self, cloud: &Cloud) {
        let mixed_pixel_planes =
            reject::mixed_pixel_planes::find(cloud, &self.labeling.labels(cloud.len()), &self.fits);
        let foliage = reject::foliage_planes::find(&self.labeling, &self.fits, self.noise);
        let given_up = mixed_pixel_planes
            .iter()
            .zip(foliage)
            .map(|(mixed_pixel_plane, foliage)| *mixed_pixel_plane || foliage);
        self.fits.iter_mut().zip(given_up).filter(|(_, up)| *up).for_each(|(fit, _)| *fit = None);
        self.labeling.wake_all();
        self.labeling.choose(&self.fits);
    }
}
