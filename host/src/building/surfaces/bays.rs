//! Bays in the upper border of upright surfaces: windows close under the eaves of a facade. So little wall is
//! over them, and so few points on it, that the outline of what was seen goes around below it.
//!
//! A lid from shoulder to shoulder makes a hole of a bay. How much of it is wall, and how much is open, tell
//! the rays: those that end on the wall over the head, and those that pass below it.

use super::border::{LINE_M, PASS_WEIGHT, tops};
use super::holes;
use super::plane_rays::PlaneRays;
use crate::building::elevation::Span;
use crate::reconstruct::polygons::outline::union::{Ring, Shape, union};

/// Lower bays are ragged borders, meters.
const MIN_DEPTH_M: f64 = 0.3;
/// Wider ones are walls of two heights, meters.
const MAX_WIDTH_M: f64 = 4.0;
/// The wall has its full height so near to a bay, meters: corners of bays are ragged.
const SHOULDER_M: f64 = 0.3;
/// How thick the lid is that closes a bay for a look, meters.
const LID_M: f64 = 0.01;
/// A rim of wall that is lower than this cannot be told from what the wall meets there, meters.
const MIN_RIM_M: f64 = 0.05;
/// The rim is wall where every piece of it of this length was hit, meters.
const HIT_EVERY_M: f64 = 0.3;
/// Fewer rays that pass tell of no opening.
const MIN_PASSES: usize = 20;

/// A bay, in the coordinates of its plane, meters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Bay {
    /// The rectangle that it stands for, up to its lid.
    pub sides: [Span; 2],
    /// From where to where it goes at its widest.
    across_m: Span,
    lid_m: f64,
}

impl Bay {
    /// The opening below the rim of wall over it, and the rim; `None` where the rays tell of none.
    pub(super) fn opening(&self, rays: &PlaneRays) -> Option<([Span; 2], [Span; 2])> {
        let head_m = self.head_m(rays)?;
        let rim = [self.across_m, [head_m, self.lid_m]];
        let is_in_rim = |place: &[f64; 2]| (0..2).all(|k| rim[k][0] < place[k] && place[k] < rim[k][1]);
        let [from, to] = self.across_m;
        let pieces = ((to - from) / HIT_EVERY_M).ceil().max(1.0) as usize;
        let mut is_hit = vec![false; pieces];
        for [at, _] in rays.hits_m.iter().filter(|place| is_in_rim(place)) {
            is_hit[(((at - from) / (to - from) * pieces as f64) as usize).min(pieces - 1)] = true;
        }
        let is_wall = is_hit.iter().all(|is_hit| *is_hit) && rays.allow(is_in_rim);
        is_wall.then_some(([self.sides[0], [self.sides[1][0], head_m]], rim))
    }

    /// Where the fewest rays contradict a head: at the lowest that ends on the wall over the highest that
    /// passes, but for noise.
    fn head_m(&self, rays: &PlaneRays) -> Option<f64> {
        let [[left, right], [sill_m, _]] = self.sides;
        let is_here = |place: &&[f64; 2]| {
            left < place[0] && place[0] < right && sill_m < place[1] && place[1] < self.lid_m
        };
        let heights = |places: &[[f64; 2]]| -> Vec<f64> {
            places.iter().filter(is_here).map(|place| place[1]).collect()
        };
        let (hits, passes) = (heights(&rays.hits_m), heights(&rays.passes_m));
        if passes.len() < MIN_PASSES {
            return None;
        }
        let mut all: Vec<(f64, f64)> = hits.iter().map(|at| (*at, 1.0)).collect();
        all.extend(passes.iter().map(|at| (*at, -PASS_WEIGHT)));
        all.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
        // Over the head passes are wrong, below it hits are: from the sill upward the balance changes by one
        // ray after the other.
        let (mut balance, mut best) = (0.0, (0.0, sill_m));
        for (place, (_, weight)) in all.iter().enumerate() {
            balance += weight;
            if balance < best.0 {
                best = (balance, all.get(place + 1).map_or(self.lid_m, |(next, _)| *next));
            }
        }
        let head_m = best.1;
        (head_m - sill_m >= MIN_DEPTH_M && self.lid_m - head_m >= MIN_RIM_M).then_some(head_m)
    }
}

/// The bays of some shapes that are rectangles but for how far apart points are.
pub(super) fn find(shapes: &[Shape]) -> Vec<Bay> {
    let lids: Vec<Ring> = lids(shapes).into_iter().map(super::rectangle::ring).collect();
    if lids.is_empty() {
        return Vec::new();
    }
    let holes = |shapes: &[Shape]| -> Vec<Ring> {
        shapes.iter().flat_map(|shape| shape.iter().skip(1)).cloned().collect()
    };
    let around = |hole: &Ring| [0, 1].map(|axis| holes::extent(hole, axis));
    let known: Vec<[Span; 2]> = holes(shapes).iter().map(around).collect();
    let closed = union(shapes.iter().flatten().chain(&lids).map(Vec::as_slice));
    let is_new = |hole: &Ring| !known.contains(&around(hole));
    let of = |hole: Ring| {
        let [across_m, [_, top_m]] = around(&hole);
        Some(Bay { sides: holes::rectangle(&hole)?, across_m, lid_m: top_m + LID_M })
    };
    holes(&closed).into_iter().filter(is_new).filter_map(of).collect()
}

/// Lids from shoulder to shoulder, where the upper border is lower than on both sides.
fn lids(shapes: &[Shape]) -> Vec<[Span; 2]> {
    let (from_m, tops) = tops(shapes, LINE_M);
    let lines = tops.len();
    let is_deep = deep(&tops);
    let mut found = Vec::new();
    let mut line = 0;
    while line < lines {
        if !is_deep[line] {
            line += 1;
            continue;
        }
        let end = (line..lines).find(|at| !is_deep[*at]).unwrap_or(lines);
        let reach = (SHOULDER_M / LINE_M) as usize;
        let left = (line.saturating_sub(reach)..line).max_by(|a, b| tops[*a].total_cmp(&tops[*b]));
        let right = (end..(end + reach).min(lines)).rev().max_by(|a, b| tops[*a].total_cmp(&tops[*b]));
        if let (Some(left), Some(right)) = (left, right) {
            let lid_m = tops[left].min(tops[right]);
            let place = |line: usize| from_m + line as f64 * LINE_M;
            found.push([[place(left), place(right + 1)], [lid_m - LID_M, lid_m]]);
        }
        line = end;
    }
    found
}

/// Lines on which the border is lower than somewhere near on both sides.
fn deep(tops: &[f64]) -> Vec<bool> {
    let reach = (MAX_WIDTH_M / LINE_M) as usize;
    let highest = |lines: &[f64]| lines.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let is_deep = |line: usize| {
        let left = highest(&tops[line.saturating_sub(reach)..line]);
        let right = highest(&tops[line + 1..(line + 1 + reach).min(tops.len())]);
        tops[line] < left.min(right) - MIN_DEPTH_M
    };
    (0..tops.len()).map(is_deep).collect()
}

#[cfg(test)]
mod tests {
    use super::{Shape, find, union};
    use crate::building::surfaces::plane_rays::PlaneRays;
    use crate::building::surfaces::rectangle::ring;

    /// A wall of 9 m by 6 m with a bay of 1.2 m from 4.3 m up to its upper border.
    fn facade() -> Vec<Shape> {
        let sides = [[[0.0, 3.0], [0.0, 6.0]], [[3.0, 4.2], [0.0, 4.3]], [[4.2, 9.0], [0.0, 6.0]]];
        let rings = sides.map(ring);
        union(rings.iter().map(Vec::as_slice))
    }

    /// Rays 10 cm apart that pass the bay up to a height, and end on the wall over it.
    fn rays(head_m: f64) -> PlaneRays {
        let at = |start: f64, step: i32| start + 0.1 * f64::from(step);
        let all = (0..12).flat_map(|x| (0..17).map(move |y| [at(3.05, x), at(4.35, y)]));
        let (passes_m, hits_m): (Vec<[f64; 2]>, Vec<[f64; 2]>) = all.partition(|place| place[1] < head_m);
        PlaneRays { blocked_m: passes_m.clone(), hits_m, passes_m, ..PlaneRays::default() }
    }

    #[test]
    fn a_bay_with_wall_over_it_is_an_opening_and_one_without_is_none() {
        let bays = find(&facade());
        let [bay] = bays[..] else { panic!("{bays:?}") };
        let ([[left, right], [sill_m, head_m]], [rim_across, rim]) = bay.opening(&rays(5.8)).unwrap();
        for (found, true_m) in [(left, 3.0), (right, 4.2), (sill_m, 4.3), (head_m, 5.85)] {
            assert!((found - true_m).abs() < 0.02, "{found} {true_m}");
        }
        assert!(rim_across[0] <= left && right <= rim_across[1]);
        assert!((rim[0] - head_m).abs() < 1e-9 && (rim[1] - 6.0).abs() < 0.02, "{rim:?}");
        // Up to the border nothing but passing rays: open at the top, like a passage between two walls.
        assert_eq!(bay.opening(&rays(6.0)), None);
        assert_eq!(bay.opening(&PlaneRays::default()), None);
        // Wall over one half of it alone is no rim.
        let mut half = rays(5.8);
        half.hits_m.retain(|place| place[0] < 3.6);
        assert_eq!(bay.opening(&half), None);
    }

    #[test]
    fn walls_of_two_heights_and_low_dips_are_no_bays() {
        let stepped = [[[0.0, 3.0], [0.0, 6.0]], [[3.0, 9.0], [0.0, 4.3]]].map(ring);
        let dip = [[[0.0, 3.0], [0.0, 6.0]], [[3.0, 4.2], [0.0, 5.8]], [[4.2, 9.0], [0.0, 6.0]]].map(ring);
        for rings in [stepped.to_vec(), dip.to_vec()] {
            let shapes = union(rings.iter().map(Vec::as_slice));
            assert!(find(&shapes).is_empty());
        }
    }
}
