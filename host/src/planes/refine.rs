//! Borders between planes: every point chooses its plane by its own distance and by what its neighbours chose.
//!
//! One point cannot tell surfaces that are nearer to each other than its noise; its neighbourhood can. Metres.

use super::grid::{Grid, Neighbours};
use super::noise::{DEVIATIONS, Noise};
use super::scatter::{Fit, Scatter};
use std::collections::BTreeSet;

/// Weight of the neighbours' choice against the point's own distance, in units of half a squared deviation.
const NEIGHBOUR_WEIGHT: f64 = 6.0;
/// A point that is further than this many deviations from every plane near it is on none.
const NONE_DEVIATIONS: f64 = 3.0;
/// How much more a point's own cell counts than each of its neighbours.
const OWN_CELL_WEIGHT: f64 = 2.0;

/// Points with their cells, to be labelled.
pub struct Labelling<'a> {
    /// The points.
    pub points_m: &'a [[f32; 3]],
    /// Their cells.
    pub grid: &'a Grid,
    /// Which cells are near each other.
    pub neighbours: &'a Neighbours,
    /// What counts as noise.
    pub noise: Noise,
}

/// How many points of a cell chose each label; the label -1 is none of the planes.
type Votes = Vec<(i32, f64)>;

impl Labelling<'_> {
    /// One round: every point chooses among the labels found in and around its cell. Returns how many changed.
    pub fn choose(&self, fits: &[Option<Fit>], labels: &mut [i32]) -> usize {
        let own: Vec<Votes> = (0..self.grid.len()).map(|cell| self.votes_of(cell, labels)).collect();
        let mut changed = 0;
        let mut around = Votes::new();
        for cell in 0..self.grid.len() {
            around.clear();
            add_votes(&mut around, &own[cell], OWN_CELL_WEIGHT);
            for other in self.neighbours.of(cell) {
                add_votes(&mut around, &own[*other as usize], 1.0);
            }
            let total: f64 = around.iter().map(|vote| vote.1).sum();
            for &point in self.grid.points_of(cell) {
                let label = self.best(point, fits, &around, total);
                changed += usize::from(labels[point as usize] != label);
                labels[point as usize] = label;
            }
        }
        changed
    }

    /// Pairs of labels, smaller first, that have points in one cell or in cells near each other.
    pub fn touching(&self, labels: &[i32]) -> BTreeSet<(i32, i32)> {
        let own: Vec<Votes> = (0..self.grid.len()).map(|cell| self.votes_of(cell, labels)).collect();
        let mut pairs = BTreeSet::new();
        let mut last = (-1, -1);
        for (cell, here) in own.iter().enumerate() {
            for other in self.neighbours.of(cell).iter().map(|other| *other as usize).chain([cell]) {
                for (a, b) in here.iter().flat_map(|a| own[other].iter().map(|b| (a.0, b.0))) {
                    if 0 <= a && a < b && (a, b) != last {
                        last = (a, b);
                        pairs.insert(last);
                    }
                }
            }
        }
        pairs
    }

    fn votes_of(&self, cell: usize, labels: &[i32]) -> Votes {
        let mut votes = Votes::new();
        for &point in self.grid.points_of(cell) {
            add_votes(&mut votes, &[(labels[point as usize], 1.0)], 1.0);
        }
        votes
    }

    fn best(&self, point: u32, fits: &[Option<Fit>], around: &Votes, total: f64) -> i32 {
        let p = self.points_m[point as usize].map(f64::from);
        let none_share = around.iter().find(|vote| vote.0 < 0).map_or(0.0, |vote| vote.1 / total);
        let none_cost = 0.5 * NONE_DEVIATIONS * NONE_DEVIATIONS + NEIGHBOUR_WEIGHT * (1.0 - none_share);
        let mut best = (none_cost, -1);
        for &(label, votes) in around {
            let Some(fit) = usize::try_from(label).ok().and_then(|index| fits.get(index)?.as_ref()) else {
                continue;
            };
            let distance_m = fit.distance_m(p);
            let variance_m2 = self.noise.variance_of(fit);
            let off = distance_m * distance_m / variance_m2;
            if off > DEVIATIONS * DEVIATIONS {
                continue;
            }
            let share = variance_m2 / (self.noise.sigma_m * self.noise.sigma_m);
            let cost = 0.5 * (off + share.ln()) + NEIGHBOUR_WEIGHT * (1.0 - votes / total);
            if cost < best.0 || (cost == best.0 && label < best.1) {
                best = (cost, label);
            }
        }
        best.1
    }
}

fn add_votes(votes: &mut Votes, more: &[(i32, f64)], weight: f64) {
    for &(label, count) in more {
        match votes.iter_mut().find(|vote| vote.0 == label) {
            Some(vote) => vote.1 += weight * count,
            None => votes.push((label, weight * count)),
        }
    }
}

/// The best plane of each label's points, as free as it was before; `None` for a label with too few.
pub fn refit(points_m: &[[f32; 3]], labels: &[i32], before: &[Option<Fit>]) -> Vec<Option<Fit>> {
    let sums = scatters(points_m, labels, before.len());
    sums.iter().zip(before).map(|(sum, fit)| sum.fit_again(fit.as_ref())).collect()
}

/// The sums of each label's points.
pub fn scatters(points_m: &[[f32; 3]], labels: &[i32], count: usize) -> Vec<Scatter> {
    let mut sums = vec![Scatter::default(); count];
    for (p, label) in points_m.iter().zip(labels) {
        if let Some(sum) = usize::try_from(*label).ok().and_then(|index| sums.get_mut(index)) {
            sum.add(p.map(f64::from));
        }
    }
    sums
}
