//! Borders that points do not resolve: ends of far roofs, where the raw mesh breaks off, and edges of
//! facades, where one row of points goes on for longer than the next.
//!
//! Fewer corners say as much there, as long as a border moves by no more than rows are apart. Surface is
//! added over half of that only, and nowhere where a ray passes.

use super::notches::sides;
use super::plane_rays::PlaneRays;
use crate::building::elevation::{self, Span};
use crate::building::spaces::evidence::Evidence;
use crate::model::Plane;
use crate::reconstruct::polygons::outline::border::distance;
use crate::reconstruct::polygons::outline::jogs::IsMet;
use crate::reconstruct::polygons::outline::shortcuts::{Point, Rules, with_shortcuts};
use crate::reconstruct::polygons::outline::union::{Ring, Shape, intersection, repair};
use crate::reconstruct::polygons::plane_frame::{Frame, STEP_M};
use crate::reconstruct::polygons::seams::met_edges::PlaneSeams;
use biplane_geometry::quantile::upper_median;
use std::slice;

/// A shape with no more corners is left as it is.
const MIN_CORNERS: usize = 6;
/// A border moves by no more than this, meters, however far rows are apart. Larger: gables of far roofs get
/// lost. Smaller: their ends stay ragged.
const MAX_TOLERANCE_M: f64 = 0.2;
/// Where surface is added, a border moves by this share of the distance between rows. Larger: surface is
/// invented that nobody saw. Smaller: notches stay.
const ADDED_SHARE: f64 = 0.5;
/// Rows are looked for so far around a corner, meters: neighboring points of the raw mesh are no further
/// apart.
const AROUND_M: f64 = 0.5;
/// So many points more than are won may lose their surface at once: a tooth of one row.
const MAX_LOST: i32 = 12;

/// Shapes of a plane without corners that its points do not tell. Those that have none stay bit for bit.
pub(super) fn straightened(
    evidence: &Evidence<'_>,
    plane: &Plane,
    frame: &Frame,
    mut shapes: Vec<Shape>,
    seams: &PlaneSeams,
) -> Vec<Shape> {
    let is_met = |ends: [Point; 2]| seams.meet(ends);
    let ragged: Vec<usize> = (0..shapes.len()).filter(|at| may_be_ragged(&shapes[*at], &is_met)).collect();
    let sides: Vec<[Span; 2]> = ragged.iter().map(|at| sides(&shapes[*at])).collect();
    let mut new = Vec::new();
    for (at, rays) in ragged.into_iter().zip(PlaneRays::of(evidence, plane, frame, &sides)).rev() {
        let after = resolved(&shapes[at], rays, &is_met);
        if after != shapes[at] {
            shapes.remove(at);
            new.push(after);
        }
    }
    with_changed(shapes, new)
}

/// Shapes that stay as they are, and those that changed: these are repaired, with the others that they now
/// overlap.
fn with_changed(shapes: Vec<Shape>, mut changed: Vec<Shape>) -> Vec<Shape> {
    let is_below = |shape: &Shape, new: &Shape| {
        super::overlap(&sides(shape), &sides(new))
            && !intersection(slice::from_ref(shape), slice::from_ref(new)).is_empty()
    };
    let (below, mut kept): (Vec<Shape>, Vec<Shape>) =
        shapes.into_iter().partition(|shape| changed.iter().any(|new| is_below(shape, new)));
    changed.extend(below);
    kept.extend(repair(&changed));
    kept
}

/// Whether a shape has fewer corners where points are as far apart as they may be.
fn may_be_ragged(shape: &Shape, is_met: IsMet<'_>) -> bool {
    let corners = |shape: &Shape| shape.iter().map(Vec::len).sum::<usize>();
    let tolerance = |_: Point| MAX_TOLERANCE_M / STEP_M;
    let rules = Rules { tolerance: &tolerance, added_share: ADDED_SHARE, is_met, allows: &|_, _| true };
    corners(shape) > MIN_CORNERS && corners(&with_shortcuts(shape, &rules)) < corners(shape)
}

/// A shape without corners and pinholes that the rays near it do not tell.
fn resolved(shape: &Shape, rays: PlaneRays, is_met: IsMet<'_>) -> Shape {
    let places = Places::new(rays);
    let rules = Rules {
        tolerance: &|corner| places.row(corner),
        added_share: ADDED_SHARE,
        is_met,
        allows: &|old, new| places.allow(old, new),
    };
    let mut shape = with_shortcuts(shape, &rules);
    let mut is_outer = true;
    shape.retain(|ring| std::mem::take(&mut is_outer) || !places.is_pinhole(ring, is_met));
    shape
}

/// Where rays met and passed a plane, from left to right, steps.
struct Places {
    /// With the distance to the row before.
    hits: Vec<(Point, f64)>,
    passes: Vec<Point>,
}

impl Places {
    fn new(rays: PlaneRays) -> Self {
        let steps = |place: Point| place.map(|value| value / STEP_M);
        let rows = rays.rows_m.into_iter().map(|row_m| row_m / STEP_M);
        let mut hits: Vec<(Point, f64)> = rays.hits_m.into_iter().map(steps).zip(rows).collect();
        let mut passes: Vec<Point> = rays.passes_m.into_iter().map(steps).collect();
        hits.sort_by(|a, b| a.0[0].total_cmp(&b.0[0]));
        passes.sort_by(|a, b| a[0].total_cmp(&b[0]));
        Self { hits, passes }
    }

    /// The points between two places from left to right, with the distance to the row before.
    fn hits_in(&self, [from, to]: Span) -> impl Iterator<Item = &(Point, f64)> {
        let first = self.hits.partition_point(|(at, _)| at[0] < from);
        self.hits[first..].iter().take_while(move |(at, _)| at[0] <= to)
    }

    /// How far rows are apart near a corner, steps: 0 where there are no two.
    fn row(&self, corner: Point) -> f64 {
        let around = AROUND_M / STEP_M;
        let near = self.hits_in([corner[0] - around, corner[0] + around]);
        let near = near.filter(|(at, row)| row.is_finite() && distance(*at, corner) <= around);
        let mut rows: Vec<f64> = near.map(|(_, row)| *row).collect();
        rows.sort_by(f64::total_cmp);
        upper_median(&rows).unwrap_or(0.0).min(MAX_TOLERANCE_M / STEP_M)
    }

    /// Whether corners may give way to others: no ray passes where surface is added, and few points are where
    /// it is taken away.
    fn allow(&self, old: &[Point], new: &[Point]) -> bool {
        let around: Vec<Point> = new.iter().chain(old.iter().rev()).copied().collect();
        let [from, to] = elevation::extent(around.iter().map(|p| p[0]));
        let first = self.passes.partition_point(|at| at[0] < from);
        let mut passes = self.passes[first..].iter().take_while(|at| at[0] <= to);
        let lost = || self.hits_in([from, to]).map(|(at, _)| -turns(&around, *at)).sum::<i32>();
        !passes.any(|at| turns(&around, *at) > 0) && lost() <= MAX_LOST
    }

    /// Whether a hole is no wider than borders that move from both sides may close, no ray passes it, and
    /// nothing stands in it.
    fn is_pinhole(&self, hole: &Ring, is_met: IsMet<'_>) -> bool {
        let mut corners: Vec<Point> = hole.iter().map(|p| [f64::from(p.x), f64::from(p.y)]).collect();
        let sides = [0, 1].map(|axis| elevation::extent(corners.iter().map(|p| p[axis])));
        let width = sides.iter().map(|[from, to]| to - from).fold(f64::INFINITY, f64::min);
        let row = corners.iter().map(|corner| self.row(*corner)).fold(f64::INFINITY, f64::min);
        corners.extend(corners.first().copied());
        width <= 2.0 * row
            && !corners.windows(2).any(|ends| is_met([ends[0], ends[1]]))
            && self.allow(&corners, &[])
    }
}

/// How often a way around goes round a place, counter-clockwise.
fn turns(around: &[Point], at: Point) -> i32 {
    let turn = |(a, b): (&Point, &Point)| {
        let is_left = (b[0] - a[0]) * (at[1] - a[1]) - (at[0] - a[0]) * (b[1] - a[1]) > 0.0;
        match (a[1] <= at[1], b[1] <= at[1]) {
            (true, false) if is_left => 1,
            (false, true) if !is_left => -1,
            _ => 0,
        }
    };
    around.iter().zip(around.iter().cycle().skip(1)).map(turn).sum()
}

#[cfg(test)]
mod tests {
    use super::{PlaneRays, Point, Shape, resolved, with_changed};
    use crate::building::surfaces::rectangle::{holds, ring};
    use crate::reconstruct::polygons::outline::union::union;

    const ROW_M: f64 = 0.3;

    /// A roof of 6 m by 3 m; each scan met its upper end at another height within half a row. From 4 to 4.2 m
    /// along, its lower end is a notch.
    fn roof() -> Shape {
        let columns = (0..12).map(|column| {
            let from = 0.5 * f64::from(column);
            let foot = if column == 8 { 0.1 } else { 0.0 };
            ring([[from, from + 0.5], [foot, 3.0 + [0.0, 0.08, 0.14, 0.05][column as usize % 4]]])
        });
        union(columns.collect::<Vec<_>>().iter().map(Vec::as_slice)).remove(0)
    }

    /// Points on it in rows so far apart.
    fn rays(row_m: f64) -> PlaneRays {
        let rows = (0..=(2.9 / row_m) as usize).map(|row| row_m * row as f64);
        let hits_m: Vec<Point> =
            rows.flat_map(|up| (0..60).map(move |scan| [0.05 + 0.1 * f64::from(scan), up])).collect();
        PlaneRays { rows_m: vec![row_m; hits_m.len()], hits_m, ..PlaneRays::default() }
    }

    fn corners(shape: &Shape) -> usize {
        shape.iter().map(Vec::len).sum()
    }

    #[test]
    fn a_ragged_end_within_a_row_is_straight_and_one_that_points_resolve_stays() {
        let before = roof();
        assert!(corners(&before) > 25, "{before:?}");
        let after = resolved(&before, rays(ROW_M), &|_| false);
        assert!(corners(&after) <= 5, "{after:?}");
        assert_eq!(resolved(&before, rays(0.02), &|_| false), before);
    }

    #[test]
    fn a_notch_that_a_ray_passes_stays_open() {
        let notch = [4.25, 0.05];
        let is_open = |passes_m: Vec<Point>| {
            let rays = PlaneRays { passes_m, ..rays(ROW_M) };
            !holds(&[resolved(&roof(), rays, &|_| false)], notch)
        };
        assert!(!is_open(Vec::new()));
        assert!(is_open(vec![notch]));
    }

    #[test]
    fn a_border_that_another_surface_meets_stays() {
        let before = roof();
        let is_ragged = |[a, b]: [Point; 2]| a[1].min(b[1]) > 29_000.0;
        let after = resolved(&before, rays(ROW_M), &is_ragged);
        let upper = |shape: &Shape| shape.iter().flatten().filter(|p| p.y > 29_000).count();
        assert_eq!(upper(&after), upper(&before));
        assert!(corners(&after) < corners(&before));
    }

    #[test]
    fn only_what_changed_is_repaired_with_what_it_overlaps() {
        // A door that reaches the foot of its wall as a hole: repair would make a notch of it.
        let mut wall = vec![ring([[0.0, 5.0], [0.0, 3.0]])];
        wall.push(ring([[1.0, 2.0], [0.0, 2.0]]).into_iter().rev().collect());
        let beside = |from: f64| vec![ring([[from, from + 2.0], [0.0, 3.0]])];
        assert_eq!(with_changed(vec![wall.clone()], Vec::new()), [wall.clone()]);
        let apart = with_changed(vec![wall.clone()], vec![beside(6.0)]);
        assert_eq!((apart.len(), &apart[0]), (2, &wall));
        let one = with_changed(vec![wall.clone(), beside(9.0)], vec![beside(4.0)]);
        assert_eq!(one.iter().map(Vec::len).collect::<Vec<_>>(), [1, 1], "{one:?}");
    }

    #[test]
    fn a_pinhole_is_closed_where_no_ray_passes() {
        let mut wall = vec![ring([[0.0, 6.0], [0.0, 3.0]])];
        wall.push(ring([[2.0, 2.3], [1.0, 1.3]]).into_iter().rev().collect());
        let passes_m = vec![[2.1, 1.1]];
        assert_eq!(resolved(&wall, rays(ROW_M), &|_| false).len(), 1);
        assert_eq!(resolved(&wall, PlaneRays { passes_m, ..rays(ROW_M) }, &|_| false).len(), 2);
    }
}
