//! Straight borders: lines laid through the middle of what they replace, met in corners.
//!
//! A border runs in teeth as high as the points are apart, since one scan still met the surface where the
//! next one missed it. A line between two of its corners goes from tip to tip; the line of least squares goes
//! through the middle. So neighboring segments of a ring are joined, those first that cost least, as long as
//! every corner stays within the tolerance of the common line. Segments on a seam, where another plane meets
//! this one, keep the seam's line. At last the segments along a direction of the building are joined, as far
//! as points are apart there. Plane coordinates in whole steps
//! ([`crate::reconstruct::polygons::plane_frame`]). Source: segmentation from the bottom up (Keogh and others
//! 2001), on rings.

use super::line::{Line, Moments};
use super::tolerance::{SPACING_SHARE, Tolerance};
use super::union::{Ring, doubled_area};
use crate::reconstruct::polygons::plane_frame::FlatPoint;
use biplane_geometry::PortableMath;
use biplane_geometry::vec2::distance_to_segment;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// What a border may become.
#[derive(Clone, Copy)]
pub(crate) struct Rules<'a> {
    /// How far each corner of the ring may lie off the line through its segment.
    pub tolerance: &'a dyn Fn(FlatPoint) -> Tolerance,
    /// Common lines with other planes; a border on one of them stays there.
    pub seams: &'a [Line],
    /// Directions that a border takes when the tolerance allows it.
    pub directions: &'a [[f64; 2]],
}

/// A corner of the new border is at most so many tolerances from the old corner that it stands for.
pub(crate) const CORNER_REACH: f64 = 2.5;
/// An edge is on a seam when both ends are this near to it, steps: what rounding and the union move a point.
pub(crate) const ON_SEAM_STEPS: f64 = 2.5;
/// Lines at less than this (sine of the angle) have no useful corner.
pub(crate) const MIN_SINE: f64 = 0.15;
/// A ring whose width is less than this many tolerances is no surface and no opening: its border could be
/// anywhere.
const THIN: f64 = 0.5;
/// A border along a direction of the building is as uncertain as this share of the distance between points:
/// what the building has is likelier than what teeth happen to add up to, and teeth are as high as points are
/// apart. Larger: steps of a roof's edge vanish. Smaller: combs stay.
const DIRECTED_SHARE: f64 = 1.0;
/// A border follows a seam across gaps between far points where this share of it lies on the seam.
const SEAM_SHARE: f64 = 0.5;
/// A border turns to a direction of the plane within this (sine of the angle; 12 degrees).
const TURN_SINE: f64 = 0.2;

/// A ring of straight segments; empty when nothing with an area is left.
pub(crate) fn straighten(ring: &[FlatPoint], rules: &Rules<'_>) -> Ring {
    if ring.len() < 3 {
        return Ring::new();
    }
    let mut border = Border::new(ring, rules);
    border.join(&[]);
    border.join(rules.directions);
    border.settle(rules);
    let straight = border.corners();
    let (before, after) = (doubled_area(ring), doubled_area(&straight));
    let minimum = border.tolerance.iter().map(|tolerance| tolerance.around).fold(f64::INFINITY, f64::min);
    let thin = (after.abs() as f64) < THIN * minimum * length(&straight);
    if straight.len() < 3 || thin || before.signum() != after.signum() { Ring::new() } else { straight }
}

/// Length of a ring, steps.
fn length(ring: &[FlatPoint]) -> f64 {
    ring.iter().zip(ring.iter().cycle().skip(1)).map(|(a, b)| (distance2(*a, *b) as f64).sqrt()).sum()
}

/// A segment of the ring: from corner `first`, over `edges` edges.
#[derive(Clone, Copy, Debug)]
struct BorderSegment {
    first: usize,
    edges: usize,
    moments: Moments,
    line: Line,
    seam: Option<usize>,
    /// How much of the border lies on a seam, steps.
    on_seam: f64,
    next: usize,
    previous: usize,
    /// Counts changes, so that old offers to join are known as such.
    version: u32,
    alive: bool,
}

struct Border<'a> {
    points: Vec<[f64; 2]>,
    tolerance: Vec<Tolerance>,
    seams: &'a [Line],
    segments: Vec<BorderSegment>,
    alive: usize,
}

/// An offer to join a segment with the next one: cost first, then position, then the versions it is made for.
type Offer = Reverse<(u64, usize, u32, u32)>;

impl<'a> Border<'a> {
    fn new(ring: &[FlatPoint], rules: &Rules<'a>) -> Self {
        let count = ring.len();
        let points: Vec<[f64; 2]> = ring.iter().map(|p| [f64::from(p.x), f64::from(p.y)]).collect();
        let segment = |first: usize| {
            let (a, b) = (points[first], points[(first + 1) % count]);
            let on = |line: &Line| line.off(a).abs() <= ON_SEAM_STEPS && line.off(b).abs() <= ON_SEAM_STEPS;
            let seam = rules.seams.iter().position(on);
            let moments = Moments::of_edge(points[0], a, b);
            BorderSegment {
                first,
                edges: 1,
                moments,
                line: seam.map_or_else(|| Line::through(a, b), |seam| rules.seams[seam]),
                seam,
                on_seam: if seam.is_some() { distance(a, b) } else { 0.0 },
                next: (first + 1) % count,
                previous: (first + count - 1) % count,
                version: 0,
                alive: true,
            }
        };
        Self {
            tolerance: ring.iter().map(|p| (rules.tolerance)(*p)).collect(),
            segments: (0..count).map(segment).collect(),
            seams: rules.seams,
            points,
            alive: count,
        }
    }

    /// The corners of `edges` edges from `first` on, both ends included.
    fn chain(&self, first: usize, edges: usize) -> impl Iterator<Item = usize> + use<> {
        let count = self.points.len();
        (first..=first + edges).map(move |index| index % count)
    }

    /// Joins neighbors while a common line is within the tolerance of all their corners, the cheapest first.
    /// Where directions are given, the line takes one of them, and may be farther from corners.
    fn join(&mut self, directions: &[[f64; 2]]) {
        let alive = (0..self.segments.len()).filter(|index| self.segments[*index].alive);
        let mut offers: BinaryHeap<Offer> = alive.filter_map(|index| self.offer(index, directions)).collect();
        while let Some(Reverse((_, index, own, others))) = offers.pop() {
            let next = self.segments[index].next;
            let current = (self.segments[index].version, self.segments[next].version);
            if !self.segments[index].alive || current != (own, others) || self.alive <= 3 {
                continue;
            }
            let Some((_, joined)) = self.joined(index, next, directions) else { continue };
            self.segments[index] = joined;
            self.segments[next].alive = false;
            let after = joined.next;
            self.segments[after].previous = index;
            self.alive -= 1;
            offers.extend(self.offer(index, directions));
            offers.extend(self.offer(joined.previous, directions));
        }
    }

    fn offer(&self, index: usize, directions: &[[f64; 2]]) -> Option<Offer> {
        let next = self.segments[index].next;
        let (cost, _) = self.joined(index, next, directions)?;
        Some(Reverse((
            cost.max(0.0) as u64,
            index,
            self.segments[index].version,
            self.segments[next].version,
        )))
    }

    /// What two neighbors become together, and what that costs (moment about the line, cubic steps); `None`
    /// when they may not.
    fn joined(&self, index: usize, next: usize, directions: &[[f64; 2]]) -> Option<(f64, BorderSegment)> {
        let (a, b) = (&self.segments[index], &self.segments[next]);
        if index == next || (a.seam.is_some() && b.seam.is_some() && a.seam != b.seam) {
            return None;
        }
        let moments = a.moments.plus(&b.moments);
        let on_seam = a.on_seam + b.on_seam;
        let edges = a.edges + b.edges;
        let seam = a.seam.or(b.seam).map(|seam| (seam, on_seam));
        let (line, seam) = self.common_line(seam, &moments, (a.first, edges), directions)?;
        let origin = self.points[0];
        let cost = moments.about(&line, origin)
            - a.moments.about(&a.line, origin)
            - b.moments.about(&b.line, origin);
        let version = a.version + 1;
        let joined = BorderSegment { edges, moments, line, seam, on_seam, next: b.next, version, ..*a };
        Some((cost, joined))
    }

    /// The line that stands for a segment, and whether it is a seam. Given are a seam that some of it lies
    /// on, and how much. The segment follows it as far as every border may move, and as far as points are
    /// apart where most of it lies there, or no surface is added. Otherwise a line goes through its middle.
    fn common_line(
        &self,
        seam: Option<(usize, f64)>,
        moments: &Moments,
        (first, edges): (usize, usize),
        directions: &[[f64; 2]],
    ) -> Option<(Line, Option<usize>)> {
        let share = if directions.is_empty() { SPACING_SHARE } else { DIRECTED_SHARE };
        if let Some((index, on_seam)) = seam {
            let ends = [first, first + edges].map(|at| self.points[at % self.points.len()]);
            let is_seam = on_seam >= SEAM_SHARE * distance(ends[0], ends[1]);
            let line = self.seams[index];
            // The surface lies on the left of its border.
            let is_forward = line.along(ends[1]) >= line.along(ends[0]);
            let adds = (line.off(moments.middle(self.points[0])) > 0.0) == is_forward;
            if self.fits(&line, first, edges, if is_seam || !adds { share } else { 0.0 }) {
                return Some((line, Some(index)));
            }
            if is_seam {
                return None;
            }
        }
        let free = moments.line(self.points[0]);
        let turned = directions.iter().map(|direction| Line { direction: *direction, ..free });
        let near = turned.filter(|line| line.sine(&free).abs() <= TURN_SINE);
        let nearest = near.min_by(|a, b| a.sine(&free).abs().total_cmp(&b.sine(&free).abs()));
        let line = if directions.is_empty() { free } else { nearest? };
        self.fits(&line, first, edges, share).then_some((line, None))
    }

    /// Whether a line stands for a segment: all corners are near it, and they follow it in one direction.
    fn fits(&self, line: &Line, first: usize, edges: usize, share: f64) -> bool {
        let [x, y] = line.direction;
        let last = self.points[(first + edges) % self.points.len()];
        let sign = if line.along(last) >= line.along(self.points[first]) { 1.0 } else { -1.0 };
        let mut furthest = f64::NEG_INFINITY;
        self.chain(first, edges).all(|index| {
            let (p, tolerance) = (self.points[index], self.tolerance[index]);
            let along = sign * line.along(p);
            furthest = furthest.max(along);
            line.off(p).abs() <= tolerance.along([-y, x], share)
                && along >= furthest - 2.0 * tolerance.along([x, y], share)
        })
    }

    /// Turns lines to the directions of the plane, and lets the cut-off tips of corners grow back.
    fn settle(&mut self, rules: &Rules<'_>) {
        for index in 0..self.segments.len() {
            let segment = self.segments[index];
            if !segment.alive || segment.seam.is_some() {
                continue;
            }
            let middle = segment.moments.middle(self.points[0]);
            let turned = rules
                .directions
                .iter()
                .map(|direction| Line { at: middle, direction: *direction })
                .filter(|line| line.sine(&segment.line).abs() <= TURN_SINE)
                .filter(|line| self.fits(line, segment.first, segment.edges, SPACING_SHARE))
                .min_by(|a, b| a.sine(&segment.line).abs().total_cmp(&b.sine(&segment.line).abs()));
            if let Some(line) = turned {
                self.segments[index].line = line;
            }
        }
        for index in 0..self.segments.len() {
            if self.alive > 3 && self.segments[index].alive && self.is_cut_corner(index) {
                let BorderSegment { previous, next, edges, .. } = self.segments[index];
                self.segments[index].alive = false;
                self.segments[previous].next = next;
                self.segments[previous].edges += edges;
                self.segments[next].previous = previous;
                self.alive -= 1;
            }
        }
    }

    /// Whether a short segment only cuts the corner of its neighbors' lines.
    fn is_cut_corner(&self, index: usize) -> bool {
        let segment = &self.segments[index];
        let (before, after) = (&self.segments[segment.previous].line, &self.segments[segment.next].line);
        let Some(corner) = before.crossing(after, MIN_SINE) else { return false };
        segment.seam.is_none()
            && self.chain(segment.first, segment.edges).all(|index| {
                let (p, tolerance) = (self.points[index], self.tolerance[index]);
                let is_on = |line: &Line| {
                    let [x, y] = line.direction;
                    line.off(p).abs() <= tolerance.along([-y, x], SPACING_SHARE)
                };
                (is_on(before) || is_on(after)) && is_near(corner, p, &tolerance)
            })
    }

    /// The ring through the crossings of neighboring lines.
    fn corners(&self) -> Ring {
        let mut ring = Ring::new();
        let mut push = |p: [f64; 2]| {
            let p = FlatPoint::new(p[0].round() as i32, p[1].round() as i32);
            if ring.last() != Some(&p) {
                ring.push(p);
            }
        };
        for segment in self.segments.iter().filter(|segment| segment.alive) {
            let before = &self.segments[segment.previous].line;
            let (old, tolerance) = (self.points[segment.first], self.tolerance[segment.first]);
            let near = |corner: &[f64; 2]| is_near(*corner, old, &tolerance);
            match before.crossing(&segment.line, MIN_SINE).filter(near) {
                Some(corner) => push(corner),
                None => {
                    push(before.foot(old));
                    push(segment.line.foot(old));
                }
            }
        }
        while ring.len() > 1 && ring.first() == ring.last() {
            ring.pop();
        }
        ring
    }
}

/// Whether a new corner may stand for an old one.
fn is_near(corner: [f64; 2], old: [f64; 2], tolerance: &Tolerance) -> bool {
    let far = distance(corner, old);
    let direction = [corner[0] - old[0], corner[1] - old[1]].map(|value| value / far.max(1.0));
    far <= (CORNER_REACH * tolerance.around).max(tolerance.along(direction, SPACING_SHARE))
}

/// Distance of two places, steps.
pub(crate) fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).portable_hypot(a[1] - b[1])
}

/// Distance of a point to a segment, steps.
pub(crate) fn segment_distance(a: FlatPoint, b: FlatPoint, p: FlatPoint) -> f64 {
    let [p, a, b] = [p, a, b].map(|p| [f64::from(p.x), f64::from(p.y)]);
    distance_to_segment(p, a, b)
}

/// Squared distance of two points, square steps.
pub(crate) fn distance2(a: FlatPoint, b: FlatPoint) -> i64 {
    let (x, y) = (i64::from(a.x) - i64::from(b.x), i64::from(a.y) - i64::from(b.y));
    x * x + y * y
}
