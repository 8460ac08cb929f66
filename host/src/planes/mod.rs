//! Planes in a point cloud, after the paper's definition (section 3.1).
//!
//! A set of points is a plane when each lies close to another of the set, the mean squared distance to the best plane stays small
//! and no point is far from it. Frame `map`, metres.

pub mod agreement;
pub mod cells;
pub mod choice;
pub mod clutter;
pub mod coplanar;
pub mod cubes;
pub mod curtain;
mod distinct;
pub mod eigen;
pub mod explain;
mod finish;
pub mod grid;
pub mod grow;
pub mod noise;
pub mod paper;
pub mod parallel;
pub mod random;
pub mod reference;
pub mod refine;
pub mod relief;
pub mod scatter;
pub mod tilted;

use crate::model::{Cloud, Plane};
use cells::{Free, cell_sums, linked};
use grid::{Grid, Neighbours};
use grow::{Field, Seed, grow_all};
use noise::{Noise, estimate_sigma_m};
use reference::ReferenceParams;
use refine::{Labelling, refit};
use scatter::Fit;
use serde::Serialize;
use std::collections::HashSet;

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
    /// Edge of a cell of the search, metres; `None` = as the cloud's density asks. Larger: coarser borders. Smaller: too few points a
    /// cell to tell steps from noise.
    pub cell_m: Option<f64>,
}

impl Default for PlaneParams {
    fn default() -> Self {
        Self { sigma_m: None, delta_m: 0.3, min_points: 50, cell_m: None }
    }
}

/// The planes of a cloud and which point is on which.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Planes {
    /// The planes, largest first.
    pub planes: Vec<Plane>,
    /// For every point the index of its plane, or -1.
    pub labels: Vec<i32>,
    /// The range noise that was given, estimated or assumed, metres.
    pub sigma_m: f64,
    /// Where `sigma_m` comes from.
    pub sigma_source: SigmaSource,
}

/// Where the range noise comes from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum SigmaSource {
    /// The caller said it.
    Given,
    /// From the cloud itself: the median error of local planes.
    Estimated,
    /// The cloud is too small to tell: that of a typical laser.
    #[default]
    Assumed,
}

impl SigmaSource {
    /// For people.
    pub fn words(self) -> &'static str {
        match self {
            Self::Given => "as given",
            Self::Estimated => "estimated",
            Self::Assumed => "assumed: too few points to tell",
        }
    }
}

/// Noise that is assumed when it is not given and the cloud is too small to tell, metres: a laser of the LMS 2xx family.
const TYPICAL_SIGMA_M: f64 = 0.02;
/// Searches, each among the points that those before left over.
const ROUNDS: usize = 3;
/// Noise of a last search for planes that are parallel to known ones, as a share of the usual: a turning robot sees a facade through
/// the error of its heading.
const LOOSE_SHARE: f64 = 2.0;
/// Edge of the cells in which steps are looked for, as a share of the cells of the search: door frames are 8 cm wide.
const STEP_CELL_SHARE: f64 = 0.8;
/// How often points choose their plane and planes are fitted anew after a search, after uniting, and after steps were added.
const CHOICES: [usize; 3] = [20, 20, 6];

/// Finds the planes of a cloud.
pub fn extract(params: &PlaneParams, cloud: &Cloud) -> Planes {
    extract_telling(params, cloud, &mut |_| ())
}

/// [`extract`] that tells from time to time how much of the way it is, in percent of the time that a large cloud takes.
pub fn extract_telling(params: &PlaneParams, cloud: &Cloud, told: &mut dyn FnMut(u64)) -> Planes {
    let found = match distinct::distinct(cloud) {
        Some(places) => places.spread(extract_distinct(params, &places.cloud, told)),
        None => extract_distinct(params, cloud, told),
    };
    told(100);
    found
}

fn extract_distinct(params: &PlaneParams, cloud: &Cloud, told: &mut dyn FnMut(u64)) -> Planes {
    let (grid, cell_m) = cells::grid(params, cloud);
    told(10);
    let searched = search(params, cloud, &grid, told);
    drop(grid);
    let grid = Grid::new(&cloud.points_m, 0.5 * cell_m);
    told(65);
    let (sigma_m, sigma_source) = (searched.sigma_m, searched.sigma_source);
    let (labels, fits) = refine(params, cloud, &grid, searched, cell_m);
    told(95);
    let found = finish::finish(params, cloud, labels, &fits, sigma_m);
    Planes { sigma_source, ..found }
}

/// What the search found: a label for every point, and the planes of the labels.
struct Searched {
    sigma_m: f64,
    sigma_source: SigmaSource,
    labels: Vec<i32>,
    fits: Vec<Option<Fit>>,
}

/// Estimates the noise and grows planes over cells.
fn search(params: &PlaneParams, cloud: &Cloud, grid: &Grid, told: &mut dyn FnMut(u64)) -> Searched {
    let neighbours = linked(params, cloud, grid);
    told(15);
    let all = Free::new(cell_sums(&cloud.points_m, grid), &neighbours);
    let (sigma_m, sigma_source) = sigma_of(params, || estimate_sigma_m(&all.cells, &all.around));
    told(20);
    let noise = Noise::new(sigma_m);
    let labelling = Labelling::new(&cloud.points_m, (grid, &neighbours), noise, (&[], 0));
    let mut work = Work { params, noise, labelling, fits: Vec::new() };
    work.search(&neighbours, all);
    told(50);
    work.unite();
    let labels = work.labelling.labels(cloud.len());
    Searched { sigma_m, sigma_source, labels, fits: work.fits }
}

/// Adds faint steps, and draws borders anew over smaller cells.
fn refine(
    params: &PlaneParams,
    cloud: &Cloud,
    grid: &Grid,
    searched: Searched,
    cell_m: f64,
) -> (Vec<i32>, Vec<Option<Fit>>) {
    let neighbours = grid.neighbours();
    let noise = Noise::new(searched.sigma_m);
    let Searched { labels, fits, .. } = searched;
    let labelling = Labelling::new(&cloud.points_m, (grid, &neighbours), noise, (&labels, fits.len()));
    drop(labels);
    let mut work = Work { params, noise, labelling, fits };
    work.add_steps(cell_m);
    work.unite();
    work.drop_curtains(cloud);
    (work.labelling.labels(cloud.len()), work.fits)
}

/// Finds the planes of a cloud by the paper's own search, with its fixed lengths: much slower, for comparison. `told` hears after each
/// plane how many points are on planes. The noise of the result is what the planes' points show.
pub fn extract_paper(
    params: &ReferenceParams,
    cloud: &Cloud,
    seed: u64,
    told: &mut dyn FnMut(usize),
) -> Planes {
    let (labels, fits) = paper::extract(params, &cloud.points_m, seed, told);
    let of_ours = PlaneParams { min_points: params.min_points, ..PlaneParams::default() };
    let fits: Vec<Option<Fit>> = fits.into_iter().map(Some).collect();
    finish::finish(&of_ours, cloud, labels, &fits, params.epsilon_m2.sqrt())
}

/// The noise to go by, metres, and where it comes from.
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
    labelling: Labelling<'a>,
    fits: Vec<Option<Fit>>,
}

impl Work<'_> {
    /// Grows regions among the points that are free, all at first, as long as there are any.
    fn search(&mut self, neighbours: &Neighbours, all: Free) {
        let mut failed = HashSet::new();
        let mut free = all;
        for _ in 0..ROUNDS {
            let field = Field { free: &free, neighbours, noise: self.noise, lenders: None };
            let any = self.search_once(&field, &mut failed);
            drop(free);
            free = Free::new(self.labelling.free(), neighbours);
            if !any {
                break;
            }
        }
        let lenders = parallel::lenders(self.labelling.sums(), self.noise);
        let first = self.fits.len();
        let noise = Noise::new(LOOSE_SHARE * self.noise.sigma_m);
        let field = Field { free: &free, neighbours, noise, lenders: Some(&lenders) };
        self.search_once(&field, &mut HashSet::new());
        self.fits = parallel::hold(self.labelling.sums(), &self.fits, self.noise);
        for fit in &mut self.fits[first..] {
            *fit = fit.filter(|fit| fit.held);
        }
    }

    /// Grows regions among the points that are free; whether there were any.
    fn search_once(&mut self, field: &Field<'_>, failed: &mut HashSet<Seed>) -> bool {
        let regions = grow_all(field, self.params.min_points, failed);
        let any = !regions.is_empty();
        self.labelling.take(&regions, field.noise.point_limit_m());
        self.fits.extend(regions.iter().map(|region| Some(region.fit)));
        self.choose(CHOICES[0]);
        any
    }

    /// Lets points choose their plane and fits planes to their points, in turn.
    fn choose(&mut self, times: usize) {
        for _ in 0..times {
            let changed = self.labelling.choose(&self.fits);
            self.fits = refit(self.labelling.sums(), &self.fits);
            if changed == 0 {
                break;
            }
        }
    }

    /// Makes planes one that are.
    fn unite(&mut self) {
        self.fits = parallel::hold(self.labelling.sums(), &self.fits, self.noise);
        self.rename(&tilted::lean(self.labelling.sums(), &self.fits, self.noise));
        self.rename(&coplanar::unite(self.labelling.sums(), &self.fits, self.noise));
        self.choose(CHOICES[1]);
    }

    fn rename(&mut self, into: &[usize]) {
        self.labelling.rename(into);
        self.fits = refit(self.labelling.sums(), &self.fits);
    }

    /// Finds faint steps within planes and keeps those that are real.
    fn add_steps(&mut self, cell_m: f64) {
        self.choose(1);
        let limits = (self.noise, self.params.min_points);
        let (points_m, labels) = self.labelling.in_cells();
        let mut steps = relief::suggest(points_m, (&self.fits, labels), limits, STEP_CELL_SHARE * cell_m);
        let first = self.fits.len();
        let walls = self.fits.clone();
        steps.iter().for_each(|step| self.labelling.put(&step.points));
        let mut real = Vec::new();
        for _ in 0..CHOICES[2] {
            let fits: Vec<Option<Fit>> =
                walls.iter().copied().chain(steps.iter().map(|step| Some(step.fit))).collect();
            self.labelling.choose(&fits);
            let (points_m, labels) = self.labelling.in_cells();
            real = relief::judge(points_m, labels, (&mut steps, first), &walls, limits);
        }
        let kept = steps.iter().zip(&real).enumerate();
        let after =
            kept.map(|(which, (step, real))| if *real { first + which } else { step.within as usize });
        let into: Vec<usize> = (0..first).chain(after).collect();
        self.fits.extend(steps.iter().map(|step| Some(step.fit)));
        self.rename(&into);
        self.choose(1);
    }

    /// Gives up planes that are curtains of mixed pixels; their points choose anew.
    fn drop_curtains(&mut self, cloud: &Cloud) {
        let curtains = curtain::find(cloud, &self.labelling.labels(cloud.len()), &self.fits);
        let clutter = clutter::find(&self.labelling, &self.fits, self.noise);
        let given_up = curtains.iter().zip(clutter).map(|(curtain, clutter)| *curtain || clutter);
        self.fits.iter_mut().zip(given_up).filter(|(_, up)| *up).for_each(|(fit, _)| *fit = None);
        self.labelling.wake_all();
        self.labelling.choose(&self.fits);
    }
}

#[cfg(test)]
mod tests;
