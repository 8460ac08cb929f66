//! Straight borders: lines laid through the middle of what they replace, met in corners.
//!
//! A border runs in teeth as high as the points are apart, since one scan still met the surface where the
//! next one missed it. A line between two of its corners goes from tip to tip; the line of least squares goes
//! through the middle. So neighboring segments of a ring are joined, those first that cost least, as long as
//! every corner stays within the tolerance of the common line. Segments on a seam, where another plane meets
//! this one, keep the seam's line. Plane coordinates in whole steps
//! ([`crate::reconstruct::polygons::plane_frame`]). Source: segmentation from the bottom up (Keogh and others
//! 2001), on rings.

use super::line::{Line, Moments};
use super::union::{Ring, doubled_area};
use crate::reconstruct::polygons::plane_frame::FlatPoint;
use biplane_geometry::PortableMath;
use biplane_geometry::vec2::distance_to_segment;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// What a border may become.
#[derive(Clone, Copy)]
pub(crate) struct Rules<'a> {
    /// How far each corner of the ring may lie off the line through its segment, in steps.
    pub tolerance: &'a dyn Fn(FlatPoint) -> f64,
    /// Common lines with other planes; a border on one of them stays there.
    pub seams: &'a [Line],
    /// Directions that a border takes when the tolerance allows it.
    pub directions: &'a [[f64; 2]],
}

/// A corner of the new border is at most so many tolerances from the old corner that it stands for.
pub(crate) const CORNER_REACH: f64 = 2.5;
/// An edge is on a seam when both ends are this near to it, steps: what rounding and the union move a point.
const ON_SEAM_STEPS: f64 = 2.5;
/// Lines at less than this (sine of the angle) have no useful corner.
const MIN_SINE: f64 = 0.15;
/// A ring whose width is less than this many tolerances is no surface and no opening: its border could be
/// anywhere.
const THIN: f64 = 0.5;
/// A border turns to a direction of the plane within this (sine of the angle; 12 degrees).
const TURN_SINE: f64 = 0.2;

/// A ring of straight segments; empty when nothing with an area is left.
pub(crate) fn straighten(ring: &[FlatPoint], rules: &Rules<'_>) -> Ring {
    if ring.len() < 3 {
        return Ring::new();
    }
    let mut border = Border::new(ring, rules);
    border.join();
    border.settle(rules);
    let straight = border.corners();
    let (before, after) = (doubled_area(ring), doubled_area(&straight));
    let minimum = border.tolerance.iter().copied().fold(f64::INFINITY, f64::min);
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
    next: usize,
    previous: usize,
    /// Counts changes, so that old offers to join are known as such.
    version: u32,
    alive: bool,
}

struct Border<'a> {
    points: Vec<[f64; 2]>,
    tolerance: Vec<f64>,
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
    fn join(&mut self) {
        let mut offers: BinaryHeap<Offer> =
            (0..self.segments.len()).filter_map(|index| self.offer(index)).collect();
        while let Some(Reverse((_, index, own, others))) = offers.pop() {
            let next = self.segments[index].next;
            let current = (self.segments[index].version, self.segments[next].version);
            if !self.segments[index].alive || current != (own, others) || self.alive <= 3 {
                continue;
            }
            let Some((_, joined)) = self.joined(index, next) else { continue };
            self.segments[index] = joined;
            self.segments[next].alive = false;
            let after = joined.next;
            self.segments[after].previous = index;
            self.alive -= 1;
            offers.extend(self.offer(index));
            offers.extend(self.offer(joined.previous));
        }
    }

    fn offer(&self, index: usize) -> Option<Offer> {
        let next = self.segments[index].next;
        let (cost, _) = self.joined(index, next)?;
        Some(Reverse((
            cost.max(0.0) as u64,
            index,
            self.segments[index].version,
            self.segments[next].version,
        )))
    }

    /// What two neighbors become together, and what that costs (moment about the line, cubic steps); `None`
    /// when they may not.
    fn joined(&self, index: usize, next: usize) -> Option<(f64, BorderSegment)> {
        let (a, b) = (&self.segments[index], &self.segments[next]);
        if index == next || (a.seam.is_some() && b.seam.is_some() && a.seam != b.seam) {
            return None;
        }
        let moments = a.moments.plus(&b.moments);
        let seam = a.seam.or(b.seam);
        let line = seam.map_or_else(|| moments.line(self.points[0]), |seam| self.seams[seam]);
        let edges = a.edges + b.edges;
        if !self.fits(&line, a.first, edges) {
            return None;
        }
        let origin = self.points[0];
        let cost = moments.about(&line, origin)
            - a.moments.about(&a.line, origin)
            - b.moments.about(&b.line, origin);
        let joined = BorderSegment { edges, moments, line, seam, next: b.next, version: a.version + 1, ..*a };
        Some((cost, joined))
    }

    /// Whether a line stands for a segment: all corners are near it, and they follow it in one direction.
    fn fits(&self, line: &Line, first: usize, edges: usize) -> bool {
        let last = self.points[(first + edges) % self.points.len()];
        let sign = if line.along(last) >= line.along(self.points[first]) { 1.0 } else { -1.0 };
        let mut furthest = f64::NEG_INFINITY;
        self.chain(first, edges).all(|index| {
            let (p, tolerance) = (self.points[index], self.tolerance[index]);
            let along = sign * line.along(p);
            furthest = furthest.max(along);
            line.off(p).abs() <= tolerance && along >= furthest - 2.0 * tolerance
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
                .filter(|line| self.fits(line, segment.first, segment.edges))
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
                before.off(p).abs().min(after.off(p).abs()) <= tolerance
                    && distance(corner, p) <= CORNER_REACH * tolerance
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
            let near = |corner: &[f64; 2]| distance(*corner, old) <= CORNER_REACH * tolerance;
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

fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
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

#[cfg(test)]
mod tests {
    use super::{CORNER_REACH, Line, Rules, segment_distance, straighten};
    use crate::reconstruct::planes::paper::random::Random;
    use crate::reconstruct::polygons::plane_frame::FlatPoint;

    const ACROSS: [[f64; 2]; 2] = [[1.0, 0.0], [0.0, 1.0]];

    fn free(ring: &[FlatPoint], tolerance: f64) -> Vec<FlatPoint> {
        straighten(ring, &Rules { tolerance: &|_| tolerance, seams: &[], directions: &[] })
    }

    /// A square of 10,000 steps whose border wanders by up to `wander` steps.
    fn ragged(wander: f64) -> Vec<FlatPoint> {
        let mut random = Random::new(5);
        let corners = [(0, 0), (10_000, 0), (10_000, 10_000), (0, 10_000)];
        let mut ring = Vec::new();
        for (from, to) in corners.iter().zip(corners.iter().cycle().skip(1)) {
            ring.push(FlatPoint::new(from.0, from.1));
            for k in 1..20 {
                let at =
                    |a: i32, b: i32| a + (b - a) / 20 * k + (wander * (2.0 * random.unit() - 1.0)) as i32;
                let mut at = at;
                ring.push(FlatPoint::new(at(from.0, to.0), at(from.1, to.1)));
            }
        }
        ring
    }

    #[test]
    fn a_ragged_square_becomes_its_four_corners() {
        let straight = free(&ragged(200.0), 300.0);
        assert_eq!(straight.len(), 4, "{straight:?}");
        // Lines through the middle are far nearer to the truth than the teeth are long; with the plane's
        // directions the more.
        let off = |ring: &[FlatPoint]| {
            ring.iter().map(|p| p.x.min(10_000 - p.x).abs().max(p.y.min(10_000 - p.y).abs())).max()
        };
        assert!(off(&straight) < Some(150), "{straight:?}");
        let rules = Rules { tolerance: &|_| 300.0, seams: &[], directions: &ACROSS };
        let turned = straighten(&ragged(200.0), &rules);
        assert_eq!(turned.len(), 4);
        assert!(turned.iter().zip(turned.iter().cycle().skip(1)).all(|(a, b)| a.x == b.x || a.y == b.y));
    }

    #[test]
    fn no_old_corner_is_further_from_the_new_border_than_said() {
        let ring = ragged(300.0);
        let straight = free(&ring, 200.0);
        assert!(straight.len() < ring.len());
        for p in ring {
            let near = straight.iter().zip(straight.iter().cycle().skip(1));
            let nearest = near.map(|(a, b)| segment_distance(*a, *b, p)).fold(f64::INFINITY, f64::min);
            assert!(nearest <= CORNER_REACH * 200.0, "{nearest}");
        }
    }

    #[test]
    fn a_border_on_a_seam_stays_exactly_there_and_teeth_beside_it_join_it() {
        // The lower side lies on the seam but for one tooth; the line of least squares would be higher.
        let ring = [(0, 0), (4000, 0), (4200, 180), (4400, 0), (10_000, 0), (10_000, 9000), (0, 9000)];
        let ring = ring.map(|(x, y)| FlatPoint::new(x, y));
        let seam = Line { at: [0.0, 0.0], direction: [1.0, 0.0] };
        let straight = straighten(&ring, &Rules { tolerance: &|_| 300.0, seams: &[seam], directions: &[] });
        assert_eq!(straight.len(), 4, "{straight:?}");
        assert_eq!(straight.iter().filter(|p| p.y == 0).count(), 2, "{straight:?}");
        assert!(free(&ring, 300.0).iter().all(|p| p.y != 0), "without the seam the tooth pulls at the line");
    }

    #[test]
    fn a_frame_twice_as_wide_as_the_tolerance_stays_and_what_is_thinner_vanishes() {
        let strip = |width: i32| {
            [(0, 0), (10_000, 0), (10_000, width), (0, width)].map(|(x, y)| FlatPoint::new(x, y))
        };
        assert_eq!(free(&strip(700), 300.0).len(), 4);
        let sliver = [(0, 0), (5000, 20), (10_000, 0), (5000, -20)].map(|(x, y)| FlatPoint::new(x, y));
        assert!(free(&sliver, 300.0).is_empty());
        assert!(free(&[], 300.0).is_empty());
    }
}
