//! What a body covers, seen from above. Meters.

use i_overlay::core::fill_rule::FillRule;
use i_overlay::core::overlay::{IntOverlayOptions, Overlay, ShapeType};
use i_overlay::core::overlay_rule::OverlayRule;
use i_overlay::core::solver::Solver;
use i_overlay::i_float::int::point::IntPoint;

use crate::geometry::mesh::Triangle;

/// x and y.
pub(crate) type Point = [f64; 2];

/// Steps of coordinates, meters.
const STEP_M: f64 = 1e-4;
/// Corners nearer than this to the line between their neighbors are none, meters.
const STRAIGHT_M: f64 = 1e-3;

/// An outline and the holes in it.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Footprint {
    /// Outline, counter-clockwise.
    pub outline_m: Vec<Point>,
    /// Holes.
    pub holes_m: Vec<Vec<Point>>,
}

impl Footprint {
    /// The largest piece of what a body covers.
    pub(crate) fn of(body: &[Triangle]) -> Option<Self> {
        let origin = body.first()?[0];
        let mut overlay = Overlay::<i32>::new_custom(1024, IntOverlayOptions::default(), Solver::default());
        for triangle in body {
            let point = |corner: &[f64; 3]| {
                let [x, y] = [0, 1].map(|axis| ((corner[axis] - origin[axis]) / STEP_M).round());
                (x.abs().max(y.abs()) < f64::from(1 << 26)).then(|| IntPoint::new(x as i32, y as i32))
            };
            let corners: Option<Vec<IntPoint<i32>>> = triangle.iter().map(point).collect();
            let Some(mut corners) = corners else { continue };
            let [a, b, c] = [corners[0], corners[1], corners[2]];
            let wide = |p: IntPoint<i32>| (i64::from(p.x - a.x), i64::from(p.y - a.y));
            let doubled = wide(b).0 * wide(c).1 - wide(b).1 * wide(c).0;
            if doubled < 0 {
                corners.reverse();
            }
            if doubled != 0 {
                overlay.add_contour(&corners, ShapeType::Subject);
            }
        }
        let shapes = overlay.overlay(OverlayRule::Subject, FillRule::NonZero);
        let lift = |ring: &Vec<IntPoint<i32>>| -> Vec<Point> {
            let at = |p: &IntPoint<i32>| {
                [origin[0] + f64::from(p.x) * STEP_M, origin[1] + f64::from(p.y) * STEP_M]
            };
            straight(ring.iter().map(at).collect())
        };
        let rings = shapes.iter().map(|shape| shape.iter().map(lift).collect::<Vec<_>>());
        let area = |rings: &Vec<Vec<Point>>| rings.first().map_or(0.0, |ring| area_m2(ring).abs());
        let mut rings = rings.max_by(|a, b| area(a).total_cmp(&area(b)))?;
        let mut outline_m = rings.first().filter(|ring| ring.len() > 2)?.clone();
        if area_m2(&outline_m) < 0.0 {
            outline_m.reverse();
        }
        let holes_m = rings.split_off(1).into_iter().filter(|ring| area_m2(ring).abs() > 1e-3).collect();
        Some(Self { outline_m, holes_m })
    }

    /// Area without the holes, square meters.
    pub(crate) fn area_m2(&self) -> f64 {
        area_m2(&self.outline_m).abs() - self.holes_m.iter().map(|hole| area_m2(hole).abs()).sum::<f64>()
    }

    /// Whether a point is inside.
    pub(crate) fn contains(&self, point: Point) -> bool {
        is_in(&self.outline_m, point) && !self.holes_m.iter().any(|hole| is_in(hole, point))
    }

    /// Distance of a point to the outline.
    pub(crate) fn border_distance_m(&self, point: Point) -> f64 {
        let rings = std::iter::once(&self.outline_m).chain(&self.holes_m);
        let edges = rings.flat_map(|ring| ring.iter().zip(ring.iter().cycle().skip(1)));
        edges.map(|(a, b)| segment_distance_m(point, *a, *b)).fold(f64::INFINITY, f64::min)
    }

    /// Axis and width of the least rectangle around it, the axis along its longer side.
    pub(crate) fn strip(&self) -> Option<([Point; 2], f64)> {
        let ring = &self.outline_m;
        let edges = ring.iter().zip(ring.iter().cycle().skip(1));
        let rectangle = |(a, b): (&Point, &Point)| {
            let length = (b[0] - a[0]).hypot(b[1] - a[1]);
            let u = [(b[0] - a[0]) / length, (b[1] - a[1]) / length];
            let bounds = |along: Point| {
                let places = ring.iter().map(|p| p[0] * along[0] + p[1] * along[1]);
                places.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| [low.min(v), high.max(v)])
            };
            (length > STRAIGHT_M).then(|| (u, bounds(u), bounds([-u[1], u[0]])))
        };
        let area = |(_, s, t): &(Point, [f64; 2], [f64; 2])| (s[1] - s[0]) * (t[1] - t[0]);
        let best = edges.filter_map(rectangle).min_by(|a, b| area(a).total_cmp(&area(b)))?;
        let (u, s, t) = best;
        let at = |along: f64, aside: f64| [u[0] * along - u[1] * aside, u[1] * along + u[0] * aside];
        let (middle_s, middle_t) = ((s[0] + s[1]) / 2.0, (t[0] + t[1]) / 2.0);
        let (length, width) = (s[1] - s[0], t[1] - t[0]);
        if length >= width {
            Some(([at(s[0], middle_t), at(s[1], middle_t)], width))
        } else {
            Some(([at(middle_s, t[0]), at(middle_s, t[1])], length))
        }
    }
}

pub(crate) fn area_m2(ring: &[Point]) -> f64 {
    let edges = ring.iter().zip(ring.iter().cycle().skip(1));
    let origin = ring.first().copied().unwrap_or_default();
    let part = |(a, b): (&Point, &Point)| {
        (a[0] - origin[0]) * (b[1] - origin[1]) - (b[0] - origin[0]) * (a[1] - origin[1])
    };
    edges.map(part).sum::<f64>() / 2.0
}

fn is_in(ring: &[Point], [x, y]: Point) -> bool {
    let edges = ring.iter().zip(ring.iter().cycle().skip(1));
    let passed = edges.filter(|(a, b)| (a[1] <= y) != (b[1] <= y));
    let right = passed.filter(|(a, b)| a[0] + (y - a[1]) / (b[1] - a[1]) * (b[0] - a[0]) > x);
    right.count() % 2 == 1
}

pub(crate) fn segment_distance_m(p: Point, a: Point, b: Point) -> f64 {
    let (d, to) = ([b[0] - a[0], b[1] - a[1]], [p[0] - a[0], p[1] - a[1]]);
    let square = d[0] * d[0] + d[1] * d[1];
    let share = if square > 0.0 { ((d[0] * to[0] + d[1] * to[1]) / square).clamp(0.0, 1.0) } else { 0.0 };
    (to[0] - share * d[0]).hypot(to[1] - share * d[1])
}

/// Without corners on straight edges.
fn straight(mut ring: Vec<Point>) -> Vec<Point> {
    let mut at = 0;
    while ring.len() > 3 && at < ring.len() {
        let (before, after) = (ring[(at + ring.len() - 1) % ring.len()], ring[(at + 1) % ring.len()]);
        if segment_distance_m(ring[at], before, after) < STRAIGHT_M {
            ring.remove(at);
            at = at.saturating_sub(1);
        } else {
            at += 1;
        }
    }
    ring
}
