//! Faint steps within a plane: a door frame 3 cm off its wall is nearer to it than the noise of a point, and still no part of it.
//!
//! No single point tells; small neighbourhoods whose mean lies off the plane, and that hang together, do. What they suggest is a
//! parallel plane, which stays when it explains its points clearly better than the wall. Metres.

use super::grid::{Grid, Neighbours};
use super::noise::Noise;
use super::scatter::{Fit, dot};

/// A cell suggests a step when its mean lies further off than this many deviations.
const SUGGEST_DEVIATIONS: f64 = 0.8;
/// A step must be at least this many deviations high.
const LEAST_STEP_DEVIATIONS: f64 = 1.0;
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

/// Suggests steps within the labelled planes.
pub fn suggest(
    points_m: &[[f32; 3]],
    grid: &Grid,
    neighbours: &Neighbours,
    (fits, labels): (&[Option<Fit>], &[i32]),
    (noise, min_points): (Noise, usize),
) -> Vec<Step> {
    // For every cell and plane in it the mean distance, as (label, count, sum).
    let cell_means: Vec<Vec<(i32, f64, f64)>> = (0..grid.len())
        .map(|cell| {
            let mut means: Vec<(i32, f64, f64)> = Vec::new();
            for &point in grid.points_of(cell) {
                let label = labels[point as usize];
                let Some(fit) = fit_of(fits, label) else { continue };
                let off_m = fit.distance_m(points_m[point as usize].map(f64::from));
                match means.iter_mut().find(|mean| mean.0 == label) {
                    Some(mean) => (mean.1, mean.2) = (mean.1 + 1.0, mean.2 + off_m),
                    None => means.push((label, 1.0, off_m)),
                }
            }
            means
        })
        .collect();
    let side_of = |cell: usize, label: i32| {
        let (_, count, sum) = cell_means[cell].iter().find(|mean| mean.0 == label)?;
        let off = sum / count / noise.sigma_m;
        (off.abs() > SUGGEST_DEVIATIONS).then_some((off > 0.0, *count, *sum))
    };
    let mut taken: Vec<Vec<i32>> = vec![Vec::new(); grid.len()];
    let mut steps = Vec::new();
    for start in 0..grid.len() {
        for &(label, ..) in &cell_means[start] {
            let Some((side, ..)) = side_of(start, label).filter(|_| !taken[start].contains(&label)) else {
                continue;
            };
            let (mut count, mut sum, mut points) = (0.0, 0.0, Vec::new());
            let mut open = vec![start];
            taken[start].push(label);
            while let Some(cell) = open.pop() {
                let Some((_, n, s)) = side_of(cell, label) else { continue };
                (count, sum) = (count + n, sum + s);
                points.extend(grid.points_of(cell).iter().filter(|point| labels[**point as usize] == label));
                for &next in neighbours.of(cell) {
                    let next = next as usize;
                    let joins = side_of(next, label).is_some_and(|(other, ..)| other == side);
                    if joins && !taken[next].contains(&label) {
                        taken[next].push(label);
                        open.push(next);
                    }
                }
            }
            let off_m = sum / count;
            let clear = off_m.abs() >= LEAST_STEP_DEVIATIONS * noise.sigma_m && count >= min_points as f64;
            if let Some(fit) = fit_of(fits, label).filter(|_| clear) {
                let fit = Fit { offset_m: fit.offset_m + off_m, count, ..*fit };
                steps.push(Step { within: label, fit, points });
            }
        }
    }
    steps
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
    let limit = 0.5 * (noise.point_limit_m() / noise.sigma_m).powi(2);
    let cost = |off_m: f64| (0.5 * (off_m / noise.sigma_m).powi(2)).min(limit);
    for (p, label) in points_m.iter().zip(labels) {
        let Some(which) = usize::try_from(*label).ok().and_then(|label| label.checked_sub(first)) else {
            continue;
        };
        let Some(step) = steps.get(which) else { continue };
        let p = p.map(f64::from);
        let wall = fit_of(fits, step.within).map_or(limit, |fit| cost(fit.distance_m(p)));
        let (count, sum, gain) = &mut gathered[which];
        *count += 1.0;
        *sum += dot(step.fit.normal, p);
        *gain += wall - cost(step.fit.distance_m(p));
    }
    let judged = steps.iter_mut().zip(gathered).map(|(step, (count, sum, gain))| {
        if count > 0.0 {
            step.fit.offset_m = sum / count;
        }
        let off_m = fit_of(fits, step.within).map_or(0.0, |wall| step.fit.offset_m - wall.offset_m);
        count >= min_points as f64
            && gain >= LEAST_GAIN
            && off_m.abs() >= LEAST_STEP_DEVIATIONS * noise.sigma_m
    });
    judged.collect()
}

fn fit_of(fits: &[Option<Fit>], label: i32) -> Option<&Fit> {
    fits.get(usize::try_from(label).ok()?)?.as_ref()
}
