//! Faint steps within a plane: a door frame 3 cm off its wall is nearer to it than the noise of a point, and
//! still no part of it.
//!
//! No single point tells; small neighborhoods whose mean lies off the plane, and that hang together, do. What
//! they suggest is a parallel plane, which stays when it explains its points clearly better than the wall.
//! Meters.

use super::refine::POINTS_PER_PIECE;
use crate::reconstruct::planes::fit::eigen::orthogonal_to;
use crate::reconstruct::planes::fit::noise::{DEVIATIONS, Noise};
use crate::reconstruct::planes::fit::scatter::Fit;
use crate::reconstruct::planes::search::grid::{CELLS_PER_TASK, Grid, Neighbors};
use biplane_geometry::vec3::dot;
use rayon::prelude::*;

/// A cell suggests a step when its mean lies further off than this many deviations.
const SUGGEST_DEVIATIONS: f64 = 0.7;
/// And further than so many deviations of the mean of its points: few points lie off by chance.
const CHANCE_DEVIATIONS: f64 = 2.0;
/// A step must be at least this many deviations high.
const MIN_STEP_DEVIATIONS: f64 = 1.0;
/// Parts of a step may have this share of the fewest points of a plane.
const PART_SHARE: f64 = 0.3;
/// Steps of one plane that differ in height by no more than this many deviations are one.
const SAME_STEP_DEVIATIONS: f64 = 0.7;
/// What a step must gain over all its points, in units of half a squared deviation: far beyond what chance
/// gives.
const MIN_GAIN: f64 = 80.0;
/// The points of a step spread by at least this share of the wall's variance. Less have points of the wall
/// that chose the step each for its own error (half of a normal distribution has 0.36) or whose ranges were
/// rounded to the same number.
const MIN_SPREAD: f64 = 0.4;

/// A plane that may be a step within another.
#[derive(Clone, Debug)]
pub(crate) struct Step {
    /// The plane's label.
    pub within: i32,
    /// The parallel plane that is suggested.
    pub fit: Fit,
    /// The points that suggest it.
    pub points: Vec<u32>,
}

/// Suggests steps within the labeled planes, each plane in cells of its own: cells of space would cut the
/// noise in two halves.
pub(crate) fn suggest(
    points_m: &[[f32; 3]],
    (fits, labels): (&[Option<Fit>], &[i32]),
    (noise, min_points): (Noise, usize),
    cell_m: f64,
) -> Vec<Step> {
    let mut members: Vec<Vec<u32>> = vec![Vec::new(); fits.len()];
    for (index, label) in labels.iter().enumerate() {
        if let Some(list) = usize::try_from(*label).ok().and_then(|label| members.get_mut(label)) {
            list.push(index as u32);
        }
    }
    let of_plane = |(label, list): (usize, &Vec<u32>)| match &fits[label] {
        Some(fit) if list.len() >= 2 * min_points => {
            let raised = Raised::new(points_m, list, fit, cell_m, noise.variance_of(fit).sqrt());
            united(raised.steps(label as i32, fit, min_points), raised.sigma_m)
        }
        _ => Vec::new(),
    };
    members.par_iter().enumerate().flat_map_iter(of_plane).collect()
}

/// The points of one plane in square cells of it.
struct Raised<'a> {
    members: &'a [u32],
    grid: Grid,
    neighbors: Neighbors,
    /// Count of points and sum of their distances, by cell.
    sums: Vec<(f64, f64)>,
    sigma_m: f64,
}

impl<'a> Raised<'a> {
    fn new(points_m: &[[f32; 3]], members: &'a [u32], fit: &Fit, cell_m: f64, sigma_m: f64) -> Self {
        let (across, along) = axes(fit.normal);
        let flat = |point: &u32| {
            let p = points_m[*point as usize].map(f64::from);
            [dot(across, p) as f32, 0.0, dot(along, p) as f32]
        };
        let flat: Vec<[f32; 3]> = members.par_iter().with_min_len(POINTS_PER_PIECE / 4).map(flat).collect();
        let grid = Grid::new(&flat, 0.5 * cell_m);
        let sum_of = |cell: usize| {
            let off_m = |place: &u32| {
                let p = points_m[members[*place as usize] as usize];
                fit.distance_m(p.map(f64::from))
            };
            let points = grid.points_of(cell);
            (points.len() as f64, points.iter().map(off_m).sum())
        };
        let sums = (0..grid.len()).into_par_iter().with_min_len(CELLS_PER_TASK).map(sum_of).collect();
        let neighbors = grid.neighbors();
        Self { members, grid, neighbors, sums, sigma_m }
    }

    /// How far, meters, a cell lies clearly off the plane: the one of the four squares of two by two cells
    /// around it that lies furthest off. A strip that is as wide as such a square fills one of them, wherever
    /// it lies.
    fn heights(&self) -> Vec<Option<(f64, bool)>> {
        let height_of = |cell: usize| {
            let mut squares = [self.sums[cell]; 4];
            for &other in self.neighbors.of(cell) {
                let other = other as usize;
                let (x, y) = self.grid.apart(cell, other);
                for (square, (right, up)) in squares.iter_mut().zip([(1, 1), (1, -1), (-1, 1), (-1, -1)]) {
                    if x * right >= 0 && y * up >= 0 {
                        square.0 += self.sums[other].0;
                        square.1 += self.sums[other].1;
                    }
                }
            }
            let off_m = |square: &(f64, f64)| square.1 / square.0;
            let furthest = |a: &&(f64, f64), b: &&(f64, f64)| off_m(a).abs().total_cmp(&off_m(b).abs());
            let square = squares.iter().max_by(furthest)?;
            let off = off_m(square) / self.sigma_m;
            let clear = off * off
                > SUGGEST_DEVIATIONS * SUGGEST_DEVIATIONS + CHANCE_DEVIATIONS * CHANCE_DEVIATIONS / square.0;
            (off.abs() > SUGGEST_DEVIATIONS).then_some((off_m(square), clear))
        };
        (0..self.grid.len()).into_par_iter().with_min_len(CELLS_PER_TASK).map(height_of).collect()
    }

    fn steps(&self, within: i32, fit: &Fit, min_points: usize) -> Vec<Step> {
        let heights = self.heights();
        let mut taken = vec![false; self.grid.len()];
        let mut steps = Vec::new();
        for start in 0..self.grid.len() {
            let Some((height_m, true)) = heights[start].filter(|_| !taken[start]) else { continue };
            taken[start] = true;
            let (mut count, mut sum, mut points) = (0.0, 0.0, Vec::new());
            let mut open = vec![(start, height_m)];
            while let Some((cell, height_m)) = open.pop() {
                (count, sum) = (count + self.sums[cell].0, sum + self.sums[cell].0 * height_m);
                points.extend(self.grid.points_of(cell).iter().map(|place| self.members[*place as usize]));
                for &next in self.neighbors.of(cell) {
                    let next = next as usize;
                    let same = |height: &(f64, bool)| (height.0 > 0.0) == (height_m > 0.0);
                    if let Some((height_m, _)) = heights[next].filter(same)
                        && !std::mem::replace(&mut taken[next], true)
                    {
                        open.push((next, height_m));
                    }
                }
            }
            let off_m = sum / count;
            if off_m.abs() >= MIN_STEP_DEVIATIONS * self.sigma_m && count >= PART_SHARE * min_points as f64 {
                let fit = Fit { offset_m: fit.offset_m + off_m, count, held: true, ..*fit };
                steps.push(Step { within, fit, points });
            }
        }
        steps
    }
}

/// Makes steps of one plane that are equally high one step: the two sides of a door frame.
fn united(mut parts: Vec<Step>, sigma_m: f64) -> Vec<Step> {
    parts.sort_by(|a, b| b.points.len().cmp(&a.points.len()).then(a.points.cmp(&b.points)));
    let mut steps: Vec<Step> = Vec::new();
    for part in parts {
        let near = |step: &&mut Step| {
            (step.fit.offset_m - part.fit.offset_m).abs() <= SAME_STEP_DEVIATIONS * sigma_m
        };
        let Some(step) = steps.iter_mut().find(near) else {
            steps.push(part);
            continue;
        };
        let count = step.fit.count + part.fit.count;
        step.fit.offset_m = (step.fit.offset_m * step.fit.count + part.fit.offset_m * part.fit.count) / count;
        step.fit.count = count;
        step.points.extend(part.points);
    }
    steps
}

/// Two directions in a plane, orthogonal to each other.
fn axes(normal: [f64; 3]) -> ([f64; 3], [f64; 3]) {
    let across = orthogonal_to(normal);
    let [a, b, c] = normal;
    let [x, y, z] = across;
    (across, [b * z - c * y, c * x - a * z, a * y - b * x])
}

/// Which of the steps, labeled from `first` on, are real; moves each one's plane to the mean of its points.
pub(crate) fn judge(
    points_m: &[[f32; 3]],
    labels: &[i32],
    (steps, first): (&mut [Step], usize),
    fits: &[Option<Fit>],
    (noise, min_points): (Noise, usize),
) -> Vec<bool> {
    let gathered = gather((points_m, labels), (steps, first), fits, noise);
    let judged = steps.iter_mut().zip(gathered).map(|(step, own)| {
        let mean_m = own.sum_m / own.count.max(1.0);
        step.fit.offset_m += mean_m;
        let Some(wall) = fit_of(fits, step.within) else { return false };
        let variance_m2 = noise.variance_of(wall);
        let off_m = step.fit.offset_m - wall.offset_m;
        own.count >= min_points as f64
            && own.gain >= MIN_GAIN
            && off_m * off_m >= MIN_STEP_DEVIATIONS * MIN_STEP_DEVIATIONS * variance_m2
            && own.squares_m2 / own.count - mean_m * mean_m >= MIN_SPREAD * variance_m2
    });
    judged.collect()
}

/// What the points of a step add up to: their distances to its plane, and what they gain over the wall.
#[derive(Clone, Copy, Default)]
struct Gathered {
    count: f64,
    sum_m: f64,
    squares_m2: f64,
    gain: f64,
}

/// Adds up what the points of each step say, in pieces of a fixed size, so that threads make no difference.
fn gather(
    (points_m, labels): (&[[f32; 3]], &[i32]),
    (steps, first): (&[Step], usize),
    fits: &[Option<Fit>],
    noise: Noise,
) -> Vec<Gathered> {
    let limit = 0.5 * DEVIATIONS * DEVIATIONS;
    let cost = |off_m: f64, wall: &Fit| (0.5 * off_m * off_m / noise.variance_of(wall)).min(limit);
    let of_piece = |(points_m, labels): (&[[f32; 3]], &[i32])| {
        let mut gathered = vec![Gathered::default(); steps.len()];
        for (p, label) in points_m.iter().zip(labels) {
            let which = usize::try_from(*label).ok().and_then(|label| label.checked_sub(first));
            let Some((which, step)) = which.and_then(|which| Some((which, steps.get(which)?))) else {
                continue;
            };
            let Some(wall) = fit_of(fits, step.within) else { continue };
            let p = p.map(f64::from);
            let off_m = dot(step.fit.normal, p) - step.fit.offset_m;
            let own = &mut gathered[which];
            own.count += 1.0;
            own.sum_m += off_m;
            own.squares_m2 += off_m * off_m;
            own.gain += cost(wall.distance_m(p), wall) - cost(off_m, wall);
        }
        gathered
    };
    let pieces = points_m.par_chunks(POINTS_PER_PIECE).zip(labels.par_chunks(POINTS_PER_PIECE));
    let parts: Vec<Vec<Gathered>> = pieces.map(of_piece).collect();
    let mut gathered = vec![Gathered::default(); steps.len()];
    for (own, part) in parts.iter().flat_map(|parts| parts.iter().enumerate()) {
        gathered[own].count += part.count;
        gathered[own].sum_m += part.sum_m;
        gathered[own].squares_m2 += part.squares_m2;
        gathered[own].gain += part.gain;
    }
    gathered
}

fn fit_of(fits: &[Option<Fit>], label: i32) -> Option<&Fit> {
    fits.get(usize::try_from(label).ok()?)?.as_ref()
}
