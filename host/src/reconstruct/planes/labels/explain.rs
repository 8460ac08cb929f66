//! Why planes ended where they did: what kept the points around each one off it.
//!
//! Asked after the search, of its result, so that it costs nothing when nobody asks. The paper's four
//! conditions (section 3.1) are tried on every point near a plane: near its points (delta), near the plane
//! itself (gamma), among points that scatter no more than noise (epsilon), and on no other plane already.
//! Distances between points are right to a sixth of delta. Meters.

use crate::model::Cloud;
use crate::reconstruct::planes::fit::noise::Noise;
use crate::reconstruct::planes::labeled::Planes;
use crate::reconstruct::planes::paper::params::ReferenceParams;
use crate::reconstruct::planes::params::PlaneParams;
use crate::reconstruct::planes::search::grid::Grid;
use biplane_cli::counted;
use rayon::prelude::*;
use serde::Serialize;

/// The limits that decided.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(crate) struct Limits {
    /// Longest distance from a point to the rest of its plane, meters.
    pub delta_m: f64,
    /// Farthest that a point may lie off its plane, meters.
    pub gamma_m: f64,
    /// Largest root mean square distance of points to their plane, meters; the root of epsilon.
    pub spread_m: f64,
    /// Fewest points of a plane.
    pub min_points: usize,
}

impl Limits {
    /// Those of our search for a range noise.
    pub(crate) fn fast(params: &PlaneParams, sigma_m: f64) -> Self {
        let noise = Noise::new(sigma_m);
        Self {
            delta_m: params.delta_m,
            gamma_m: noise.point_limit_m(),
            spread_m: noise.spread_limit_m2(params.min_points as f64).sqrt(),
            min_points: params.min_points,
        }
    }

    /// Those of the paper's search.
    pub(crate) fn paper(params: &ReferenceParams) -> Self {
        Self {
            delta_m: params.delta_m,
            gamma_m: params.gamma_m,
            spread_m: params.epsilon_m2.sqrt(),
            min_points: params.min_points,
        }
    }
}

/// Points on another plane.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub(crate) struct Taken {
    /// The other plane.
    pub by: usize,
    /// How many.
    pub points: usize,
}

/// Why one plane ended: the points within delta of it that are not on it, each in the first group that fits.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub(crate) struct Ending {
    /// Near enough to the plane, but on another one; the planes with the most points first.
    pub taken: Vec<Taken>,
    /// Further off the plane than gamma.
    pub beyond_gamma: usize,
    /// Of these, on other planes: the surfaces that meet this one.
    pub beyond_gamma_on_others: usize,
    /// The least distance off the plane among those beyond gamma that are on no plane: a larger gamma would
    /// take them.
    pub next_gamma_m: Option<f64>,
    /// Near enough to the plane and on none: their surroundings scatter too much, or are mostly on no plane.
    pub scattered: usize,
    /// How much the free points around the plane scatter about it, root mean square, meters.
    pub scatter_m: Option<f64>,
    /// Free points near enough to the plane but further than delta from its points, up to four deltas.
    pub beyond_delta: usize,
    /// The nearest of these, meters, about: a larger delta would reach it.
    pub next_delta_m: Option<f64>,
}

/// Points on no plane.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub(crate) struct Free {
    /// How many.
    pub points: usize,
    /// Of these, in groups with fewer points than a plane needs, nothing else on no plane within delta.
    pub in_small_groups: usize,
    /// Of these, nowhere: not finite, or too far out.
    pub nowhere: usize,
}

/// Why the search ended as it did.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct Explanation {
    /// The limits that decided.
    pub limits: Limits,
    /// For each plane why it ended.
    pub endings: Vec<Ending>,
    /// What is on no plane.
    pub free: Free,
}

/// Representatives per delta: of the points of a plane in a cube of this share of delta one stands for all.
const SHARES: f64 = 6.0;
/// How far beyond delta is looked, in deltas.
const LOOK: f64 = 4.0;

/// Explains a result.
pub(crate) fn explain(cloud: &Cloud, found: &Planes, limits: Limits) -> Explanation {
    let asker = Asker { points_m: &cloud.points_m, found, limits };
    let mut endings = vec![Gathered::default(); found.planes.len()];
    for (plane, event) in asker.around(limits.delta_m, limits.delta_m / SHARES, true) {
        asker.count(&mut endings[plane as usize], event);
    }
    for (plane, event) in asker.around(LOOK * limits.delta_m, limits.delta_m / 2.0, false) {
        let near = event.apart_m < limits.delta_m || event.off_m > limits.gamma_m;
        if !near {
            let ending = &mut endings[plane as usize].ending;
            ending.beyond_delta += 1;
            ending.next_delta_m = minimum(ending.next_delta_m, event.apart_m);
        }
    }
    let endings = endings.into_iter().map(Gathered::finish).collect();
    Explanation { limits, endings, free: asker.free() }
}

/// A point near a plane that it is not on.
#[derive(Clone, Copy, Debug)]
struct Event {
    label: i32,
    /// Distance to the plane's points, meters.
    apart_m: f64,
    /// Distance to the plane, meters.
    off_m: f64,
}

/// What is counted of one plane.
#[derive(Clone, Debug, Default)]
struct Gathered {
    ending: Ending,
    free: usize,
    squares_m2: f64,
}

impl Gathered {
    fn finish(mut self) -> Ending {
        self.ending.taken.sort_by(|a, b| b.points.cmp(&a.points).then(a.by.cmp(&b.by)));
        if self.free > 0 {
            self.ending.scatter_m = Some((self.squares_m2 / self.free as f64).sqrt());
        }
        self.ending
    }
}

struct Asker<'a> {
    points_m: &'a [[f32; 3]],
    found: &'a Planes,
    limits: Limits,
}

impl Asker<'_> {
    /// Every point with every plane that it is not on and that has a point within `reach_m`, cell by cell.
    /// Points on planes count only when `all` are asked for.
    fn around(&self, reach_m: f64, share_m: f64, all: bool) -> Vec<(u32, Event)> {
        let grid = Grid::new(self.points_m, reach_m);
        let neighbors = grid.neighbors();
        let stand_ins: Vec<Vec<u32>> = (0..grid.len())
            .into_par_iter()
            .map(|cell| self.stand_ins(grid.points_of(cell), share_m))
            .collect();
        let of_cell = |cell: usize| {
            let near: Vec<u32> = std::iter::once(cell as u32)
                .chain(neighbors.of(cell).iter().copied())
                .flat_map(|other| stand_ins[other as usize].iter().copied())
                .collect();
            let asked = grid.points_of(cell).iter().filter(|point| all || self.label(**point) < 0);
            asked.flat_map(|point| self.events(*point, &near, reach_m)).collect::<Vec<_>>()
        };
        (0..grid.len()).into_par_iter().flat_map_iter(of_cell).collect()
    }

    /// One point of every plane for each small cube.
    fn stand_ins(&self, points: &[u32], share_m: f64) -> Vec<u32> {
        let cube =
            |point: u32| self.points_m[point as usize].map(|v| (f64::from(v) / share_m).floor() as i64);
        let on_planes = points.iter().filter(|point| self.label(**point) >= 0);
        let mut keyed: Vec<(i32, [i64; 3], u32)> =
            on_planes.map(|point| (self.label(*point), cube(*point), *point)).collect();
        keyed.sort_unstable();
        keyed.dedup_by_key(|entry| (entry.0, entry.1));
        keyed.into_iter().map(|entry| entry.2).collect()
    }

    /// The planes near a point; `near` holds the points of each plane one after the other, cell by cell.
    fn events(&self, point: u32, near: &[u32], reach_m: f64) -> Vec<(u32, Event)> {
        let (own, p) = (self.label(point), self.position(point));
        let mut nearest: Vec<(i32, f64)> = Vec::new();
        for other in near {
            let label = self.label(*other);
            let q = self.position(*other);
            let apart_m2: f64 = (0..3).map(|k| (p[k] - q[k]).powi(2)).sum();
            if label == own || apart_m2 >= reach_m * reach_m {
                continue;
            }
            match nearest.iter_mut().find(|entry| entry.0 == label) {
                Some(entry) => entry.1 = entry.1.min(apart_m2),
                None => nearest.push((label, apart_m2)),
            }
        }
        let event = |(label, apart_m2): (i32, f64)| {
            let off_m = self.found.planes[label as usize].distance_m(p).abs();
            (label as u32, Event { label: own, apart_m: apart_m2.sqrt(), off_m })
        };
        nearest.into_iter().map(event).collect()
    }

    fn count(&self, gathered: &mut Gathered, event: Event) {
        let ending = &mut gathered.ending;
        let on_other = usize::try_from(event.label).ok();
        if on_other.is_none() && event.off_m <= self.limits.delta_m {
            gathered.free += 1;
            gathered.squares_m2 += event.off_m * event.off_m;
        }
        if event.off_m > self.limits.gamma_m {
            ending.beyond_gamma += 1;
            match on_other {
                Some(_) => ending.beyond_gamma_on_others += 1,
                None => ending.next_gamma_m = minimum(ending.next_gamma_m, event.off_m),
            }
        } else if let Some(by) = on_other {
            match ending.taken.iter_mut().find(|taken| taken.by == by) {
                Some(taken) => taken.points += 1,
                None => ending.taken.push(Taken { by, points: 1 }),
            }
        } else {
            ending.scattered += 1;
        }
    }

    /// What is on no plane, and how much of it lies in small groups: cells of half a delta that touch.
    fn free(&self) -> Free {
        let points = (0..self.points_m.len() as u32).filter(|point| self.label(*point) < 0);
        let free: Vec<[f32; 3]> = points.map(|point| self.points_m[point as usize]).collect();
        let grid = Grid::new(&free, 0.5 * self.limits.delta_m);
        let neighbors = grid.neighbors();
        let mut seen = vec![false; grid.len()];
        let mut in_small_groups = 0;
        for start in 0..grid.len() {
            let (mut open, mut size) = (vec![start], 0);
            while let Some(cell) = open.pop() {
                if !std::mem::replace(&mut seen[cell], true) {
                    size += grid.points_of(cell).len();
                    open.extend(neighbors.of(cell).iter().map(|other| *other as usize));
                }
            }
            in_small_groups += if size < self.limits.min_points { size } else { 0 };
        }
        Free { points: free.len(), in_small_groups, nowhere: free.len() - grid.order.len() }
    }

    fn label(&self, point: u32) -> i32 {
        self.found.labels[point as usize]
    }

    fn position(&self, point: u32) -> [f64; 3] {
        self.points_m[point as usize].map(f64::from)
    }
}

fn minimum(known: Option<f64>, new: f64) -> Option<f64> {
    Some(known.map_or(new, |known| known.min(new)))
}

impl Limits {
    /// The limits in words.
    pub(crate) fn words(&self) -> String {
        format!(
            "limits: delta {:.0} cm between points, gamma {:.1} cm off the plane, scatter {:.1} cm, at least {} points",
            100.0 * self.delta_m,
            100.0 * self.gamma_m,
            100.0 * self.spread_m,
            self.min_points
        )
    }
}

impl Ending {
    /// In words, the most common reason first.
    pub(crate) fn words(&self) -> String {
        let cm = |length_m: Option<f64>| {
            length_m.map_or_else(|| "-".to_owned(), |m| format!("{:.1} cm", 100.0 * m))
        };
        let taken: usize = self.taken.iter().map(|taken| taken.points).sum();
        let free_beyond = self.beyond_gamma - self.beyond_gamma_on_others;
        let by: Vec<String> =
            self.taken.iter().take(3).map(|t| format!("{} by plane {}", t.points, t.by)).collect();
        let mut reasons = vec![
            (
                self.beyond_gamma_on_others,
                format!(
                    "other surfaces meet it: {} off it by more than gamma",
                    counted(self.beyond_gamma_on_others, "point")
                ),
            ),
            (taken, format!("taken by other planes: {} ({})", counted(taken, "point"), by.join(", "))),
            (
                free_beyond,
                format!(
                    "gamma: {} near it but farther off, the nearest {}",
                    counted(free_beyond, "free point"),
                    cm(self.next_gamma_m)
                ),
            ),
            (
                self.scattered,
                format!(
                    "scatter: {} on it, but those around it scatter by {}",
                    counted(self.scattered, "free point"),
                    cm(self.scatter_m)
                ),
            ),
            (
                self.beyond_delta,
                format!(
                    "delta: {} that would fit it, the nearest {} away",
                    counted(self.beyond_delta, "free point"),
                    cm(self.next_delta_m)
                ),
            ),
        ];
        reasons.retain(|reason| reason.0 > 0);
        reasons.sort_by_key(|reason| std::cmp::Reverse(reason.0));
        if reasons.is_empty() {
            return "nothing else near it".to_owned();
        }
        reasons.into_iter().map(|reason| reason.1).collect::<Vec<_>>().join("; ")
    }
}

impl Free {
    /// In words.
    pub(crate) fn words(&self) -> String {
        format!(
            "on no plane: {}, {} of them in groups with too few points, {} nowhere",
            counted(self.points, "point"),
            self.in_small_groups,
            self.nowhere
        )
    }
}

#[cfg(test)]
mod tests {
    use super::{Limits, explain};
    use crate::model::{Cloud, Plane};
    use crate::reconstruct::planes::labeled::Planes;

    const LIMITS: Limits = Limits { delta_m: 0.3, gamma_m: 0.06, spread_m: 0.03, min_points: 50 };

    /// A floor of 1 m by 1 m with a point every 5 cm, and what stands on or beside it, with the labels that
    /// these points have.
    fn explained(others: &[([f32; 3], i32)]) -> super::Explanation {
        let mut cloud = Cloud::default();
        let mut labels = Vec::new();
        for k in 0..400u16 {
            cloud.points_m.push([0.05 * f32::from(k % 20), 0.05 * f32::from(k / 20), 0.0]);
            labels.push(0);
        }
        cloud.points_m.extend(others.iter().map(|other| other.0));
        labels.extend(others.iter().map(|other| other.1));
        let floor = Plane { normal: [0.0, 0.0, 1.0], offset_m: 0.0, points: 400, rms_m: 0.0 };
        let wall = Plane { normal: [1.0, 0.0, 0.0], offset_m: 1.0, points: 3, rms_m: 0.0 };
        let found = Planes { planes: vec![floor, wall], labels, ..Planes::default() };
        explain(&cloud, &found, LIMITS)
    }

    #[test]
    fn every_point_around_a_plane_counts_for_what_kept_it_off() {
        let found = explained(&[
            ([1.0, 0.5, 0.03], 1),  // on the wall, but near enough to the floor
            ([1.0, 0.5, 0.2], 1),   // the wall further up
            ([0.5, 0.5, 0.1], -1),  // beyond gamma
            ([0.5, 0.5, 0.04], -1), // near enough and free
            ([0.5, 2.0, 0.05], -1), // in the floor's plane, 1.05 m beside its last point
            ([0.5, 0.5, 2.0], -1),  // far from everything
            ([f32::NAN; 3], -1),
        ]);
        let floor = &found.endings[0];
        assert_eq!((floor.taken.len(), floor.taken[0].by, floor.taken[0].points), (1, 1, 1));
        assert_eq!((floor.beyond_gamma, floor.beyond_gamma_on_others, floor.scattered), (2, 1, 1));
        assert!((floor.next_gamma_m.unwrap() - 0.1).abs() < 1e-6);
        // sqrt((0.1^2 + 0.04^2) / 2)
        assert!((floor.scatter_m.unwrap() - 0.076_157_7).abs() < 1e-6);
        assert_eq!(floor.beyond_delta, 1);
        assert!((floor.next_delta_m.unwrap() - 1.05).abs() < 0.06, "{floor:?}");
        assert_eq!((found.free.points, found.free.in_small_groups, found.free.nowhere), (5, 4, 1));
        let words = floor.words();
        for part in ["1 by plane 1", "the nearest 10.0 cm", "scatter by 7.6 cm", "delta: 1 free point"] {
            assert!(words.contains(part), "no {part:?} in {words}");
        }
    }

    #[test]
    fn a_plane_alone_ends_because_nothing_else_is_there() {
        let found = explained(&[]);
        assert_eq!(found.endings[0].words(), "nothing else near it");
        assert_eq!(found.free.points, 0);
    }
}
