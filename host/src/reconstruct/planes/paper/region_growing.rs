//! The paper's randomized region growing with a spatial index: point for point the answer of
//! [`super::reference`], in a time that real clouds allow.
//!
//! The plain one looks at every point for each that joins; here a grid finds those within delta, and a queue
//! keeps them in the order of their distance to the set. Nothing else differs, not even the order of the
//! sums. Meters. Source: the paper, section 3.1 and table 1.

use super::random::Random;
use crate::reconstruct::planes::fit::scatter::{Fit, Scatter};
use crate::reconstruct::planes::paper::params::ReferenceParams;
use crate::reconstruct::planes::search::grid::{Grid, Neighbors};
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Finds planes round by round until no start gives one. Returns each point's plane, or -1, and the planes.
/// `told` hears after each round how many points are on planes.
pub(crate) fn extract(
    params: &ReferenceParams,
    points_m: &[[f32; 3]],
    seed: u64,
    progress: &mut dyn FnMut(usize),
) -> (Vec<i32>, Vec<Fit>) {
    let mut random = Random::new(seed);
    let mut grower = Grower::new(params, points_m);
    let mut planes = Vec::new();
    let mut on_planes = 0;
    loop {
        let free: Vec<u32> = (0..points_m.len() as u32).filter(|k| grower.is_free(*k)).collect();
        let mut largest: Option<(Vec<u32>, Fit)> = None;
        for _ in 0..params.starts.min(free.len()) {
            let start = free[random.below(free.len())];
            let Some(grown) = grower.grow(start, &free) else { continue };
            if largest.as_ref().is_none_or(|best| grown.0.len() > best.0.len()) {
                largest = Some(grown);
            }
        }
        let Some((members, fit)) = largest.filter(|grown| grown.0.len() >= params.min_points) else {
            return (grower.labels, planes);
        };
        on_planes += members.len();
        members.iter().for_each(|member| grower.labels[*member as usize] = planes.len() as i32);
        planes.push(fit);
        progress(on_planes);
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum State {
    Open,
    Member,
    Refused,
}

struct Grower<'a> {
    params: &'a ReferenceParams,
    points_m: &'a [[f32; 3]],
    labels: Vec<i32>,
    grid: Grid,
    neighbors: Neighbors,
    /// The grid's cell of each point; none for points that are nowhere.
    cell_of: Vec<i32>,
    /// Of the set that grows: each point's distance to it and what became of it.
    distance_m: Vec<f64>,
    state: Vec<State>,
    /// Points whose distance is not infinite.
    touched: Vec<u32>,
    sums: Scatter,
    members: Vec<u32>,
    /// Open points by distance, then index; distances that have become shorter since are passed over.
    queue: BinaryHeap<Reverse<(u64, u32)>>,
}

const NOWHERE: i32 = -1;

impl<'a> Grower<'a> {
    fn new(params: &'a ReferenceParams, points_m: &'a [[f32; 3]]) -> Self {
        let grid = Grid::new(points_m, params.delta_m);
        let neighbors = grid.neighbors();
        let cell_of = grid.by_point(points_m.len(), NOWHERE, |cell, _| cell as i32);
        Self {
            params,
            points_m,
            labels: vec![-1; points_m.len()],
            grid,
            neighbors,
            cell_of,
            distance_m: vec![f64::INFINITY; points_m.len()],
            state: vec![State::Open; points_m.len()],
            touched: Vec::new(),
            sums: Scatter::default(),
            members: Vec::new(),
            queue: BinaryHeap::new(),
        }
    }

    fn is_free(&self, point: u32) -> bool {
        self.labels[point as usize] < 0 && self.cell_of[point as usize] != NOWHERE
    }

    /// Table 1: from a start and its nearest neighbor, points in order of their distance to the set.
    fn grow(&mut self, start: u32, free: &[u32]) -> Option<(Vec<u32>, Fit)> {
        self.forget();
        self.join(start);
        let second = self.nearest_open().or_else(|| self.nearest_of_all(start, free))?;
        self.join(second);
        let mut grew = true;
        while std::mem::take(&mut grew) {
            let mut refused = Vec::new();
            while let Some(candidate) = self.nearest_open() {
                let p = self.position(candidate);
                let mut with = self.sums;
                with.add(p);
                let joins = with.fit().is_some_and(|fit| {
                    fit.variances_m2[0] < self.params.epsilon_m2
                        && fit.distance_m(p).abs() < self.params.gamma_m
                });
                if joins {
                    self.join(candidate);
                    grew = true;
                } else {
                    self.state[candidate as usize] = State::Refused;
                    refused.push(candidate);
                }
            }
            // The plane has moved since some were refused: they are asked again as long as anyone joins.
            for point in refused {
                self.state[point as usize] = State::Open;
                self.queue.push(Reverse((self.distance_m[point as usize].to_bits(), point)));
            }
        }
        Some((self.members.clone(), self.sums.fit()?))
    }

    fn forget(&mut self) {
        for point in self.touched.drain(..) {
            self.distance_m[point as usize] = f64::INFINITY;
            self.state[point as usize] = State::Open;
        }
        self.queue.clear();
        self.members.clear();
        self.sums = Scatter::default();
    }

    fn join(&mut self, point: u32) {
        let p = self.position(point);
        self.sums.add(p);
        self.state[point as usize] = State::Member;
        self.members.push(point);
        self.touched.push(point);
        let cell = self.cell_of[point as usize] as usize;
        for near in std::iter::once(cell as u32).chain(self.neighbors.of(cell).iter().copied()) {
            for &other in self.grid.points_of(near as usize) {
                if self.labels[other as usize] >= 0 || self.state[other as usize] == State::Member {
                    continue;
                }
                let q = self.points_m[other as usize].map(f64::from);
                let apart_m = (0..3).map(|k| (p[k] - q[k]).powi(2)).sum::<f64>().sqrt();
                let known = &mut self.distance_m[other as usize];
                if apart_m < self.params.delta_m && apart_m < *known {
                    if known.is_infinite() {
                        self.touched.push(other);
                    }
                    *known = apart_m;
                    if self.state[other as usize] == State::Open {
                        // Distances are not negative: their bits are in their order.
                        self.queue.push(Reverse((apart_m.to_bits(), other)));
                    }
                }
            }
        }
    }

    /// The open point nearest to the set within delta; of several the first.
    fn nearest_open(&mut self) -> Option<u32> {
        while let Some(Reverse((bits, point))) = self.queue.pop() {
            let current = self.distance_m[point as usize].to_bits() == bits;
            if current && self.state[point as usize] == State::Open {
                return Some(point);
            }
        }
        None
    }

    /// The free point nearest to another, at any distance.
    fn nearest_of_all(&self, start: u32, free: &[u32]) -> Option<u32> {
        let p = self.position(start);
        let apart_m = |point: u32| {
            let q = self.position(point);
            (0..3).map(|k| (p[k] - q[k]).powi(2)).sum::<f64>().sqrt()
        };
        let others = free.iter().copied().filter(|point| *point != start);
        others
            .map(|point| (apart_m(point), point))
            .min_by(|a, b| a.0.total_cmp(&b.0))
            .map(|nearest| nearest.1)
    }

    fn position(&self, point: u32) -> [f64; 3] {
        self.points_m[point as usize].map(f64::from)
    }
}

#[cfg(test)]
mod tests {
    use super::extract;
    use crate::reconstruct::planes::paper::params::ReferenceParams;
    use crate::reconstruct::planes::paper::random::Random;
    use crate::reconstruct::planes::paper::reference;

    /// Points on a few crossing walls with noise, in a grid's steps so that many distances are equal, strays
    /// far off, and nonsense.
    fn cloud(seed: u64) -> Vec<[f32; 3]> {
        let mut random = Random::new(seed);
        let mut points = Vec::new();
        for k in 0..500 {
            let step = |v: f64| (v * 25.0).floor() / 25.0;
            let (u, v, off) = (step(random.unit()), step(random.unit()), 0.015 * random.normal());
            points.push(match k % 3 {
                0 => [u, off, v],
                1 => [off, u, v],
                _ => [u, v, 0.4 * u + off],
            });
        }
        points.extend([[9.0, 9.0, 9.0], [f64::NAN, 0.0, 0.0], [20.0, 0.0, 0.0]]);
        points.iter().map(|p| p.map(|v| v as f32)).collect()
    }

    #[test]
    fn it_is_the_plain_search_point_for_point() {
        for (seed, starts) in [(1, 8), (2, 3), (3, 1)] {
            let points = cloud(seed);
            let plain: Vec<[f64; 3]> = points.iter().map(|p| p.map(f64::from)).collect();
            let params = ReferenceParams { starts, min_points: 30, ..ReferenceParams::default() };
            let mut received = Vec::new();
            let found = extract(&params, &points, seed, &mut |on_planes| received.push(on_planes));
            assert!(found.1.len() > 1);
            assert_eq!(received.last(), Some(&found.0.iter().filter(|label| **label >= 0).count()));
            assert_eq!(found, reference::extract(&params, &plain, seed));
        }
    }

    #[test]
    fn no_points_and_one_point_give_no_plane() {
        let params = ReferenceParams { min_points: 1, ..ReferenceParams::default() };
        assert_eq!(extract(&params, &[], 1, &mut |_| {}), (vec![], vec![]));
        assert_eq!(extract(&params, &[[0.0; 3]], 1, &mut |_| {}), (vec![-1], vec![]));
    }
}
