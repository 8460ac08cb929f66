//! The border of a surface along one edge of a rectangle, line by line, and where the edge belongs.

use crate::building::elevation::{Span, extent};
use crate::reconstruct::polygons::outline::union::Shape;
use crate::reconstruct::polygons::plane_frame::{FlatPoint, STEP_M};

/// Lines across an edge are this far apart, meters.
pub(super) const LINE_M: f64 = 0.01;
/// Places of an edge that are tried are this far apart, meters.
const TRY_M: f64 = 0.005;
/// Borders of the majority of lines within this are one straight border, meters.
const STRAIGHT_M: f64 = 0.012;
/// A ray that surface would block weighs as much as so many points outside of it: what is missing is honest,
/// what blocks a ray is wrong.
pub(super) const PASS_WEIGHT: f64 = 2.0;
/// Weight of moving an edge by a meter from where the building has it: decides where rays do not.
const MOVE_WEIGHT: f64 = 40.0;

/// One edge of a rectangle: places along `axis`, lines across it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Edge {
    /// 0 for a jamb, 1 for a head or sill.
    pub axis: usize,
    /// Where the building has it, meters.
    pub at_m: f64,
    /// Into the wall.
    pub sign: f64,
    /// The other coordinates, from where to where, meters.
    pub lines_m: Span,
    /// How far the edge and the border may be apart, meters.
    pub reach_m: f64,
}

/// Where the surface begins on each line across an edge, meters into the wall from where the building has the
/// edge; `None` where it does not within reach.
pub(super) type Border = Vec<Option<f64>>;

/// Where shapes are on a line, meters: `axis` runs along the line, `other_m` is where it lies.
pub(super) fn covered(shapes: &[Shape], axis: usize, other_m: f64) -> Vec<Span> {
    let place = |p: &FlatPoint| {
        let both = [f64::from(p.x) * STEP_M, f64::from(p.y) * STEP_M];
        [both[axis], both[1 - axis]]
    };
    let mut crossed: Vec<f64> = Vec::new();
    for ring in shapes.iter().flatten() {
        for (a, b) in ring.iter().zip(ring.iter().cycle().skip(1)) {
            let ([a, a_other], [b, b_other]) = (place(a), place(b));
            if (a_other <= other_m) != (b_other <= other_m) {
                crossed.push(a + (other_m - a_other) / (b_other - a_other) * (b - a));
            }
        }
    }
    crossed.sort_by(f64::total_cmp);
    crossed.as_chunks().0.to_vec()
}

/// The upper border of shapes: where its first column begins, and how high each one goes, meters.
pub(super) fn tops(shapes: &[Shape], column_m: f64) -> (f64, Vec<f64>) {
    let [from_m, to_m] = extent(shapes.iter().flatten().flatten().map(|p| f64::from(p.x) * STEP_M));
    let columns = ((to_m - from_m) / column_m).floor().max(0.0) as usize;
    let top_m = |column: usize| {
        let spans = covered(shapes, 1, from_m + (column as f64 + 0.5) * column_m);
        spans.last().map_or(f64::NEG_INFINITY, |span| span[1])
    };
    (from_m, (0..columns).map(top_m).collect())
}

impl Edge {
    fn lines(&self) -> usize {
        ((self.lines_m[1] - self.lines_m[0]) / LINE_M).floor().max(0.0) as usize
    }

    /// Where a line lies.
    pub(super) fn line_m(&self, line: usize) -> f64 {
        self.lines_m[0] + (line as f64 + 0.5) * LINE_M
    }

    /// A place in the plane as the number of its line and meters into the wall.
    fn at_line(&self, place: [f64; 2]) -> Option<(usize, f64)> {
        let line = ((place[1 - self.axis] - self.lines_m[0]) / LINE_M).floor();
        let is_there = line >= 0.0 && line < self.lines() as f64;
        is_there.then(|| (line as usize, (place[self.axis] - self.at_m) * self.sign))
    }

    /// The border of shapes along this edge.
    pub(super) fn border(&self, shapes: &[Shape]) -> Border {
        let of = |line: usize| {
            let spans = covered(shapes, self.axis, self.line_m(line)).into_iter().map(|[from, to]| {
                let into = [from, to].map(|at| (at - self.at_m) * self.sign);
                [into[0].min(into[1]), into[0].max(into[1])]
            });
            // A span that ends before the edge is something in the opening.
            let mut begins: Vec<f64> = spans.filter(|[_, to]| *to > 0.0).map(|[from, _]| from).collect();
            begins.sort_by(f64::total_cmp);
            let first = *begins.first()?;
            (first <= self.reach_m).then_some(first.max(-self.reach_m))
        };
        (0..self.lines()).map(of).collect()
    }

    /// Where the larger part of a border is straight, meters into the wall.
    pub(super) fn straight(&self, border: &Border) -> Option<f64> {
        let mut begins: Vec<f64> = border.iter().filter_map(|into| *into).collect();
        begins.sort_by(f64::total_cmp);
        let (mut best, mut from) = ((0, 0), 0);
        for to in 0..begins.len() {
            while begins[to] - begins[from] > STRAIGHT_M {
                from += 1;
            }
            if to - from > best.1 - best.0 {
                best = (from, to);
            }
        }
        let is_straight = 2 * (best.1 - best.0 + 1) > begins.len();
        let inside = begins.get(best.0..=best.1)?;
        (is_straight && inside[0] > -self.reach_m).then(|| inside[inside.len() / 2])
    }

    /// Where the edge belongs, meters into the wall: where the fewest rays contradict it, those that pass
    /// behind it and those that end before it. Among places that are as good it is where the border is
    /// straight already, or where the building has it.
    pub(super) fn best(&self, border: &Border, hits_m: &[[f64; 2]], passes_m: &[[f64; 2]]) -> f64 {
        let by_line = |places: &[[f64; 2]]| -> Vec<(f64, f64)> {
            let near = places.iter().filter_map(|place| self.at_line(*place));
            near.filter_map(|(line, into)| Some((into, border[line]?))).collect()
        };
        let (hits, passes) = (by_line(hits_m), by_line(passes_m));
        let wrong = |edge: f64| {
            let blocked = passes.iter().filter(|(into, _)| edge < *into).count();
            // Points in the opening may be a leaf's, unless they are on the surface.
            let is_wall = |into: f64, begin: f64| into > TRY_M || begin < into;
            let outside = hits.iter().filter(|(into, begin)| *into < edge && is_wall(*into, *begin)).count();
            PASS_WEIGHT * blocked as f64 + outside as f64
        };
        let straight = self.straight(border);
        let home = straight.unwrap_or(0.0);
        let steps = (self.reach_m / TRY_M).floor() as i32;
        let tried = std::iter::once(home).chain((-steps..=steps).map(|step| f64::from(step) * TRY_M));
        let cost = |edge: f64| wrong(edge) + MOVE_WEIGHT * (edge - home).abs();
        tried.min_by(|a, b| cost(*a).total_cmp(&cost(*b))).unwrap_or(home)
    }
}
