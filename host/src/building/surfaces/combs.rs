//! Combs at the upper border of roofs: each scan met the roof up to another height, and the outline of what
//! was seen goes up and down with them. Where it does, a few level lines stand for it.
//!
//! Notches between scans are filled where no rays pass, and teeth are cut off, each about as much as the
//! other.

use super::border::{covered, tops};
use super::plane_rays::PlaneRays;
use super::rectangle;
use crate::building::elevation::{Span, extent};
use crate::reconstruct::polygons::outline::union::{Ring, Shape, difference, union};
use crate::reconstruct::polygons::plane_frame::FlatPoint;

/// Width of the columns in which the border is read, meters.
const COLUMN_M: f64 = 0.05;
/// Notches that are narrower lie between scans, meters.
const NOTCH_M: f64 = 1.0;
/// Teeth that are narrower are of one scan, meters.
const TOOTH_M: f64 = 0.5;
/// A border is ragged where it goes up and down by more within the width of a notch, meters.
const MIN_RAGGED_M: f64 = 0.15;
/// Shorter pieces of it are left as they are, meters.
const MIN_LENGTH_M: f64 = 2.0;
/// A step between two level lines takes this away of the squares of what is filled and cut, cubic meters: a
/// step of half a meter is one where it lasts for 60 cm.
const STEP_M3: f64 = 0.15;

/// A level line of a border, in the coordinates of its plane, meters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Level {
    /// From where to where it goes.
    across_m: Span,
    /// The lowest place of the ragged border.
    base_m: f64,
    /// Its height.
    top_m: f64,
    /// The highest place of the ragged border.
    end_m: f64,
}

impl Level {
    /// Where rays tell whether it may be filled.
    pub(super) fn sides(&self) -> [Span; 2] {
        [self.across_m, [self.base_m, self.top_m]]
    }

    /// The shapes with this border, less the notches that rays pass.
    pub(super) fn drawn(&self, shapes: &[Shape], rays: &PlaneRays) -> Vec<Shape> {
        // Holes go around clockwise: what they leave free of a rectangle is its union with them.
        let holes = shapes.iter().flat_map(|shape| shape.iter().skip(1));
        let kept = holes.filter(|hole| !self.is_notch(hole)).map(Vec::as_slice);
        let fill = union(std::iter::once(rectangle::ring(self.sides()).as_slice()).chain(kept));
        let mut new = difference(rings(&fill), rings(shapes));
        new.retain(|shape| !rays.blocked_m.iter().any(|place| holds(shape, *place)));
        let over = rectangle::ring([self.across_m, [self.top_m, self.end_m + COLUMN_M]]);
        let filled = union(rings(shapes).chain(rings(&new)));
        difference(rings(&filled), std::iter::once(over.as_slice()))
    }

    /// Whether a hole lies between two scans.
    fn is_notch(&self, hole: &Ring) -> bool {
        let [across, up] = [0, 1].map(|axis| super::holes::extent(hole, axis));
        across[1] - across[0] < NOTCH_M && up[0] > self.base_m
    }
}

/// The rings of shapes.
fn rings(shapes: &[Shape]) -> impl Iterator<Item = &[FlatPoint]> {
    shapes.iter().flatten().map(Vec::as_slice)
}

/// Whether a place lies in a shape.
fn holds(shape: &Shape, [at_m, up_m]: [f64; 2]) -> bool {
    covered(std::slice::from_ref(shape), 1, at_m).iter().any(|span| span[0] <= up_m && up_m <= span[1])
}

/// The level lines that stand for the ragged pieces of the upper borders of shapes.
pub(super) fn find(shapes: &[Shape]) -> Vec<Level> {
    shapes.iter().flat_map(of_shape).collect()
}

fn of_shape(shape: &Shape) -> Vec<Level> {
    let Some(outer) = shape.first() else { return Vec::new() };
    let (from_m, tops) = tops(&[vec![outer.clone()]], COLUMN_M);
    let columns = tops.len();
    let (notch, tooth) = ((NOTCH_M / 2.0 / COLUMN_M) as usize, (TOOTH_M / 2.0 / COLUMN_M) as usize);
    let closed = lowest(&highest(&tops, notch), notch);
    let smooth = highest(&lowest(&closed, tooth), tooth);
    let opened = highest(&lowest(&tops, notch), notch);
    let rough: Vec<f64> = closed.iter().zip(&opened).map(|(a, b)| a - b).collect();
    let ragged = highest(&rough, notch);
    let mut found = Vec::new();
    let mut column = 0;
    while column < columns {
        let end = (column..columns).find(|at| ragged[*at] <= MIN_RAGGED_M).unwrap_or(columns);
        if (end - column) as f64 * COLUMN_M >= MIN_LENGTH_M {
            for [from, to] in level_pieces(&smooth[column..end]) {
                let piece = column + from..column + to;
                let [base_m, end_m] = extent(tops[piece.clone()].iter().copied());
                let across_m = [piece.start, piece.end].map(|at| from_m + at as f64 * COLUMN_M);
                let top_m = mean(&smooth[piece]);
                found.push(Level { across_m, base_m, top_m, end_m });
            }
        }
        column = end + 1;
    }
    found
}

/// The highest of each value and its neighbors up to `reach` away.
fn highest(values: &[f64], reach: usize) -> Vec<f64> {
    let around = |at: usize| &values[at.saturating_sub(reach)..(at + reach + 1).min(values.len())];
    (0..values.len()).map(|at| around(at).iter().copied().fold(f64::NEG_INFINITY, f64::max)).collect()
}

/// The lowest of each value and its neighbors up to `reach` away.
fn lowest(values: &[f64], reach: usize) -> Vec<f64> {
    let around = |at: usize| &values[at.saturating_sub(reach)..(at + reach + 1).min(values.len())];
    (0..values.len()).map(|at| around(at).iter().copied().fold(f64::INFINITY, f64::min)).collect()
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// The pieces of a border that level lines explain best, each from one column to before another: dynamic
/// programming over where the steps are.
fn level_pieces(values: &[f64]) -> Vec<[usize; 2]> {
    let (mut sums, mut squares) = (vec![0.0], vec![0.0]);
    for value in values {
        // Less the first, so that squares keep their digits.
        let off = value - values[0];
        sums.push(sums[sums.len() - 1] + off);
        squares.push(squares[squares.len() - 1] + off * off);
    }
    let spread = |from: usize, to: usize| {
        let (sum, all) = (sums[to] - sums[from], squares[to] - squares[from]);
        COLUMN_M * (all - sum * sum / (to - from) as f64)
    };
    let mut best = vec![(0.0, 0)];
    for to in 1..=values.len() {
        let costs = (0..to).map(|from| (best[from].0 + STEP_M3 + spread(from, to), from));
        best.push(costs.min_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or((0.0, 0)));
    }
    let (mut pieces, mut to) = (Vec::new(), values.len());
    while to > 0 {
        let from = best[to].1;
        pieces.push([from, to]);
        to = from;
    }
    pieces.reverse();
    pieces
}

#[cfg(test)]
mod tests {
    use super::{Level, Shape, find, holds, union};
    use crate::building::elevation::Span;
    use crate::building::surfaces::plane_rays::PlaneRays;
    use crate::building::surfaces::rectangle::ring;

    fn shapes(rectangles: &[[Span; 2]]) -> Vec<Shape> {
        let rings: Vec<_> = rectangles.iter().map(|sides| ring(*sides)).collect();
        union(rings.iter().map(Vec::as_slice))
    }

    /// A roof of 10 m by 2 m with a tooth 30 cm wide every 60 cm, 80 cm high; one in the middle is higher.
    fn comb() -> Vec<[Span; 2]> {
        let teeth = (0..17).map(|tooth| {
            let from = 0.6 * f64::from(tooth);
            [[from, from + 0.3], [1.9, if tooth == 8 { 3.6 } else { 2.8 }]]
        });
        std::iter::once([[0.0, 10.0], [0.0, 2.0]]).chain(teeth).collect()
    }

    fn corners(shapes: &[Shape]) -> usize {
        shapes.iter().flatten().map(Vec::len).sum()
    }

    fn drawn(shapes: &[Shape], levels: &[Level], rays: &PlaneRays) -> Vec<Shape> {
        levels.iter().fold(shapes.to_vec(), |shapes, level| level.drawn(&shapes, rays))
    }

    #[test]
    fn a_comb_becomes_one_level_line() {
        let before = shapes(&comb());
        let after = drawn(&before, &find(&before), &PlaneRays::default());
        assert!(corners(&before) > 60 && corners(&after) <= 8, "{} {after:?}", corners(&before));
        let top = after.iter().flatten().flatten().map(|p| p.y).max().unwrap();
        assert!((f64::from(top) * 1e-4 - 2.8).abs() < 0.1, "{top}");
    }

    #[test]
    fn notches_that_rays_pass_stay() {
        let before = shapes(&comb());
        let passes_m: Vec<[f64; 2]> = (0..16).map(|notch| [0.45 + 0.6 * f64::from(notch), 2.4]).collect();
        let rays = PlaneRays { blocked_m: passes_m.clone(), passes_m, ..PlaneRays::default() };
        let after = drawn(&before, &find(&before), &rays);
        assert!(!rays.passes_m.iter().any(|place| after.iter().any(|shape| holds(shape, *place))));
    }

    #[test]
    fn gables_steps_and_straight_borders_are_no_combs() {
        let gable: Vec<[Span; 2]> = (0..40)
            .map(|at| 0.25 * f64::from(at))
            .map(|at| [[at, at + 0.25], [0.0, 5.0 - at / 2.0]])
            .collect();
        for sides in
            [vec![[[0.0, 9.0], [0.0, 2.0]]], vec![[[0.0, 4.0], [0.0, 2.0]], [[4.0, 9.0], [0.0, 3.0]]], gable]
        {
            assert_eq!(find(&shapes(&sides)), Vec::new());
        }
    }
}
