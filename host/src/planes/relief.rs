//! Faint steps within a plane: a door frame 3 cm off its wall is nearer to it than the noise of a point, and still no part of it.
//!
//! No single point tells; small neighbourhoods whose mean lies off the plane, and that hang together, do. What they suggest is a
//! parallel plane, which stays when it explains its points clearly better than the wall. Metres.

use super::eigen::orthogonal_to;
use super::grid::{Grid, Neighbours};
use super::noise::{DEVIATIONS, Noise};
use super::scatter::{Fit, dot};
use rayon::prelude::*;

/// A cell suggests a step when its mean lies further off than this many deviations.
const SUGGEST_DEVIATIONS: f64 = 0.7;
/// A step must be at least this many deviations high.
const LEAST_STEP_DEVIATIONS: f64 = 1.0;
/// Parts of a step may have this share of the fewest points of a plane.
const PART_SHARE: f64 = 0.3;
/// Steps of one plane that differ in height by no more than this many deviations are one.
const SAME_STEP_DEVIATIONS: f64 = 0.7;
/// What a step must gain over all its points, in units of half a squared deviation: far beyond what chance gives.
const LEAST_GAIN: f64 = 40.0;

/// A plane that may be a step within another.
#[derive(Clone, Debug)]
pub struct Step {
    /// The plane's label.
    pub within: i32,
    /// The parallel plane that is suggested.
    pub fit: Fit,
    /// The points that suggest it.
    pub points: Vec<u32>,
}

/// Suggests steps within the labelled planes, each plane in cells of its own: cells of space would cut the noise in two halves.
pub fn suggest(
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
    neighbours: Neighbours,
    /// Count of points and sum of their distances, by cell.
    sums: Vec<(f64, f64)>,
    sigma_m: f64,
}

impl<'a> Raised<'a> {
    fn new(points_m: &[[f32; 3]], members: &'a [u32], fit: &Fit, cell_m: f64, sigma_m: f64) -> Self {
        let (across, along) = axes(fit.normal);
        let flat = |point: &u32| {
            let p = points_m[*point as usize].map(f64::from);
            [dot(across, p) as f32, dot(along, p) as f32, 0.0]
        };
        let flat: Vec<[f32; 3]> = members.iter().map(flat).collect();
        let grid = Grid::new(&flat, cell_m);
        let sum_of = |cell: usize| {
            let off_m = |place: &u32| {
                let p = points_m[members[*place as usize] as usize];
                fit.distance_m(p.map(f64::from))
            };
            let points = grid.points_of(cell);
            (points.len() as f64, points.iter().map(off_m).sum())
        };
        let sums = (0..grid.len()).map(sum_of).collect();
        let neighbours = grid.neighbours();
        Self { members, grid, neighbours, sums, sigma_m }
    }

    /// Whether a cell lies clearly above (true) or below the plane.
    fn side_of(&self, cell: usize) -> Option<bool> {
        let (count, sum) = self.sums[cell];
        let off = sum / count / self.sigma_m;
        (off.abs() > SUGGEST_DEVIATIONS).then_some(off > 0.0)
    }

    fn steps(&self, within: i32, fit: &Fit, min_points: usize) -> Vec<Step> {
        let mut taken = vec![false; self.grid.len()];
        let mut steps = Vec::new();
        for start in 0..self.grid.len() {
            let Some(side) = self.side_of(start).filter(|_| !std::mem::replace(&mut taken[start], true))
            else {
                continue;
            };
            let (mut count, mut sum, mut points) = (0.0, 0.0, Vec::new());
            let mut open = vec![start];
            while let Some(cell) = open.pop() {
                (count, sum) = (count + self.sums[cell].0, sum + self.sums[cell].1);
                points.extend(self.grid.points_of(cell).iter().map(|place| self.members[*place as usize]));
                for &next in self.neighbours.of(cell) {
                    let next = next as usize;
                    if self.side_of(next) == Some(side) && !std::mem::replace(&mut taken[next], true) {
                        open.push(next);
                    }
                }
            }
            let off_m = sum / count;
            if off_m.abs() >= LEAST_STEP_DEVIATIONS * self.sigma_m && count >= PART_SHARE * min_points as f64
            {
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

/// Which of the steps, labelled from `first` on, are real; moves each one's plane to the mean of its points.
pub fn judge(
    points_m: &[[f32; 3]],
    labels: &[i32],
    (steps, first): (&mut [Step], usize),
    fits: &[Option<Fit>],
    (noise, min_points): (Noise, usize),
) -> Vec<bool> {
    let mut gathered = vec![(0.0, 0.0, 0.0); steps.len()];
    let limit = 0.5 * DEVIATIONS * DEVIATIONS;
    let cost = |off_m: f64, wall: &Fit| (0.5 * off_m * off_m / noise.variance_of(wall)).min(limit);
    for (p, label) in points_m.iter().zip(labels) {
        let Some(which) = usize::try_from(*label).ok().and_then(|label| label.checked_sub(first)) else {
            continue;
        };
        let Some(step) = steps.get(which) else { continue };
        let p = p.map(f64::from);
        let Some(wall) = fit_of(fits, step.within) else { continue };
        let (count, sum, gain) = &mut gathered[which];
        *count += 1.0;
        *sum += dot(step.fit.normal, p);
        *gain += cost(wall.distance_m(p), wall) - cost(step.fit.distance_m(p), wall);
    }
    let judged = steps.iter_mut().zip(gathered).map(|(step, (count, sum, gain))| {
        if count > 0.0 {
            step.fit.offset_m = sum / count;
        }
        let Some(wall) = fit_of(fits, step.within) else { return false };
        let off_m = step.fit.offset_m - wall.offset_m;
        count >= min_points as f64
            && gain >= LEAST_GAIN
            && off_m * off_m >= LEAST_STEP_DEVIATIONS * LEAST_STEP_DEVIATIONS * noise.variance_of(wall)
    });
    judged.collect()
}

fn fit_of(fits: &[Option<Fit>], label: i32) -> Option<&Fit> {
    fits.get(usize::try_from(label).ok()?)?.as_ref()
}
