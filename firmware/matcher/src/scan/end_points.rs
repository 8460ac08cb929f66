//! The end points of a scan: de-skewed, with the direction of the surface they lie on and a weight against
//! crowding.
//!
//! Frame: the base at the scan's stamp. Units: meters. The buffer is made once; a scan with more beams than
//! it holds is thinned evenly, never refused.

use std::ops::RangeInclusive;

pub use crate::scan::end_point::{EndPoint, Kind, Mobility};

use crate::lanes::{InLanes, widest};
use crate::parameter_group::parameter_group;
use crate::scan::Scan;
use crate::scan::line_fit::{LineLimits, Lines, RunningSums, Shape};
use crate::scan::neighbors::{LANES, Neighbors};
use crate::scan::{Beam, deskew, isolated};
use biplane_geometry::vec2::{distance, dot, squared_distance};

parameter_group! { "points";
/// Which beams become end points, and what the scan itself says about the surfaces they lie on.
#[derive(Copy, Clone, PartialEq, Debug)]
pub struct PointParams {
    /// Beams that the buffers hold; a scan with more is thinned evenly. More: slower.
    pub max_beams: usize [1.0, 1e5],
    /// Shorter ranges are left out (the robot itself, dirt on the window), meters.
    pub range_min_m: f64 [0.0, 1000.0],
    /// Longer ranges are left out: sparse, and turned into large errors by small angles; meters.
    pub range_max_m: f64 [0.01, 1000.0],
    /// Beams closer together than this share one beam's weight, meters. Larger: a near wall with many beams
    /// counts less against a far one with few; zero: every beam counts the same.
    pub spacing_m: f64,
    /// Neighbors farther from the common line than this: no normal, meters. A few times the range noise.
    pub line_tolerance_m: f64,
}
}

impl Default for PointParams {
    fn default() -> Self {
        Self { max_beams: 2048, range_min_m: 0.1, range_max_m: 40.0, spacing_m: 0.02, line_tolerance_m: 0.02 }
    }
}

/// A scan with fewer usable end points counts as empty: they fix no pose. Larger: more scans go on from the
/// odometry. Error 0.0248 m also when halved or doubled.
const MIN_POINTS: usize = 5;
/// Neighbors up to this far (and 32 beams) on either side give a point its normal, meters. Smaller: noisier
/// normals; larger: corners and short walls have none. Error 0.0246 m halved, 0.0255 m doubled.
const NORMAL_REACH_M: f32 = 0.2;
/// Neighbors must span this much for a line, meters, or the normal comes from range noise. Error 0.0246 m
/// halved, 0.0247 m doubled.
const LINE_LENGTH_M: f32 = 0.06;
/// A surface that a beam strikes flatter than this (sine of the angle) gives no normal: the beam may have
/// jumped from an edge to the wall behind. Error 0.0667 m halved, 0.1091 m doubled.
const GRAZING_SINE: f32 = 0.1;

/// End points of one scan and the place they were seen from.
#[derive(Clone, Debug)]
pub struct EndPoints {
    points: Vec<EndPoint>,
    /// Sums over the points before each one, so that any run of neighbors costs the same.
    sums: Vec<RunningSums>,
    /// From the point before to each one, and one more to nobody after the last; infinite before the first.
    gaps_m: Vec<f32>,
    neighbors: Neighbors,
    /// Of points whose neighbors on both sides form no line together, those on one side that may.
    sides: Vec<Side>,
    capacity: usize,
    laser_in_base_m: [f32; 2],
    params: PointParams,
}

/// The neighbors of a point on one side.
#[derive(Copy, Clone, Debug)]
struct Side {
    index: usize,
    /// The first and the last of them.
    ends: [usize; 2],
}

impl EndPoints {
    /// An empty buffer with all the memory it will ever have.
    pub fn new(params: PointParams) -> Self {
        let capacity = params.max_beams.max(1);
        Self {
            points: Vec::with_capacity(capacity),
            sums: Vec::with_capacity(capacity + 1),
            gaps_m: Vec::with_capacity(capacity + 1),
            neighbors: Neighbors::with_capacity(capacity),
            sides: Vec::with_capacity(2 * capacity),
            capacity,
            laser_in_base_m: [0.0; 2],
            params,
        }
    }

    /// The points, in the order of their beams.
    pub fn as_slice(&self) -> &[EndPoint] {
        &self.points
    }

    /// Whether there are too few of them to tell a pose.
    pub fn are_too_few(&self) -> bool {
        self.points.len() < MIN_POINTS
    }

    /// Where they were seen from, base's frame, meters.
    pub fn laser_in_base_m(&self) -> [f32; 2] {
        self.laser_in_base_m
    }

    /// Says whether what some end points lie on moves. What does has no weight.
    pub(crate) fn set_mobility(&mut self, which: RangeInclusive<usize>, mobility: Mobility) {
        self.points[which].iter_mut().for_each(|point| point.set_mobility(mobility));
    }

    /// The same of one end point, unless it is known to move.
    pub(crate) fn mark_one(&mut self, index: usize, mobility: Mobility) {
        if self.points[index].mobility != Mobility::Dynamic {
            self.points[index].set_mobility(mobility);
        }
    }

    /// The same of the end points for which something holds, unless they are known to move.
    pub(crate) fn mark(&mut self, mobility: Mobility, mut holds: impl FnMut(&EndPoint) -> bool) {
        let marked =
            self.points.iter_mut().filter(|point| point.mobility != Mobility::Dynamic && holds(point));
        marked.for_each(|point| point.set_mobility(mobility));
    }

    /// No end point lies farther from the base than this, meters.
    pub fn reach_m(&self) -> f32 {
        // Many largest ones side by side: each waits for its predecessor.
        let mut squared = [dot(self.laser_in_base_m, self.laser_in_base_m); LANES];
        for some in self.points.chunks(LANES) {
            for (largest, point) in squared.iter_mut().zip(some) {
                *largest = largest.max(dot(point.at_m, point.at_m));
            }
        }
        squared.into_iter().fold(0.0, f32::max).sqrt()
    }

    /// Takes over the usable beams of a scan and gives them normals and weights.
    pub fn fill(&mut self, scan: &Scan) {
        widest(Fill { points: self, scan });
    }

    #[inline(always)]
    fn take_ends(&mut self, scan: &Scan) {
        self.points.clear();
        self.laser_in_base_m = scan.laser_in_base_m.map(|meters| meters as f32);
        let stride = scan.beams.len().div_ceil(self.capacity).max(1);
        let in_reach = self.params.range_min_m..=self.params.range_max_m;
        for some in scan.beams.chunks(stride * deskew::MANY) {
            let beams = || some.iter().step_by(stride);
            let [x_m, y_m] = deskew::ends_in_base_m(scan, beams().copied());
            for ((Beam { range_m, .. }, x_m), y_m) in beams().zip(x_m).zip(y_m) {
                // Neither NaN nor +inf is in reach.
                if in_reach.contains(&f64::from(*range_m)) && x_m.is_finite() && y_m.is_finite() {
                    self.points.push(EndPoint { at_m: [x_m, y_m], ..EndPoint::default() });
                }
            }
        }
    }

    #[inline(always)]
    fn measure_gaps(&mut self) {
        self.gaps_m.clear();
        self.gaps_m.push(f32::INFINITY);
        self.gaps_m.extend(self.points.windows(2).map(|pair| distance(pair[0].at_m, pair[1].at_m)));
        self.gaps_m.push(f32::INFINITY);
        for (point, gaps_m) in self.points.iter_mut().zip(self.gaps_m.windows(2)) {
            point.weight = weight(&self.params, gaps_m[0], gaps_m[1]);
        }
    }

    #[inline(always)]
    fn sum_up(&mut self) {
        let mut sum = RunningSums::default();
        self.sums.clear();
        self.sums.push(sum);
        for point in &self.points {
            if !point.alone {
                sum.add(point.at_m.map(f64::from));
            }
            self.sums.push(sum);
        }
    }

    /// Gives the points normals by the lines through their neighbors on both sides.
    #[inline(always)]
    fn fit_lines(&mut self) {
        let alone_or_not = |point: &EndPoint| (!point.alone).then_some(point.at_m);
        self.neighbors.fill(self.points.iter().map(alone_or_not));
        self.sides.clear();
        let (limits, mut lines) = (self.limits(), Lines::default());
        for from in (0..self.points.len()).step_by(Lines::MANY) {
            let until = self.points.len().min(from + Lines::MANY);
            let mut ends = [[0; 2]; Lines::MANY];
            lines.clear();
            for some in (from..until).step_by(LANES) {
                let [before, after] = self.neighbors.reaches(some, NORMAL_REACH_M);
                for ((index, before), after) in (some..until).zip(before).zip(after) {
                    let [first, last] = [index - before, index + after];
                    ends[index - from] = [first, last];
                    self.push(&mut lines, [first, last], index);
                }
            }
            lines.fit(&limits);
            for (index, ends) in (from..until).zip(ends) {
                let point = &mut self.points[index];
                let (shape, normal) = lines.get(index - from);
                if point.alone {
                    point.kind = Kind::Point;
                } else if shape == Shape::Line {
                    (point.kind, point.normal) = (Kind::Line, normal);
                } else {
                    point.kind = if shape == Shape::Scattered { Kind::Point } else { Kind::Unsure };
                    let [first, last] = ends;
                    for ends in [[first, index], [index, last]] {
                        if self.may_be_line(ends) {
                            self.sides.push(Side { index, ends });
                        }
                    }
                }
            }
        }
    }

    /// Whether there is enough of a run of points for a line.
    #[inline(always)]
    fn may_be_line(&self, [first, last]: [usize; 2]) -> bool {
        let length_squared = squared_distance(self.points[first].at_m, self.points[last].at_m);
        let is_short = length_squared < LINE_LENGTH_M * LINE_LENGTH_M;
        self.sums[last + 1].count() - self.sums[first].count() >= 3.0 && !is_short
    }

    /// What lies at a corner has the normal of the neighbors on one side.
    #[inline(always)]
    fn fit_corners(&mut self) {
        let (limits, mut lines) = (self.limits(), Lines::default());
        for some in self.sides.chunks(Lines::MANY) {
            lines.clear();
            some.iter().for_each(|Side { index, ends }| self.push(&mut lines, *ends, *index));
            lines.fit(&limits);
            for (place, Side { index, .. }) in some.iter().enumerate() {
                let point = &mut self.points[*index];
                match lines.get(place) {
                    _ if point.kind == Kind::Line => {}
                    (Shape::Line, normal) => (point.kind, point.normal) = (Kind::Line, normal),
                    (Shape::Scattered, _) => point.kind = Kind::Point,
                    (Shape::Unsure, _) => {}
                }
            }
        }
    }

    /// Adds the run of points between two, for a point of it.
    #[inline(always)]
    fn push(&self, lines: &mut Lines, [first, last]: [usize; 2], index: usize) {
        let ends_m = [first, last, index].map(|end| self.points[end].at_m);
        lines.push(&self.sums[last + 1].minus(&self.sums[first]), ends_m);
    }

    #[inline(always)]
    fn limits(&self) -> LineLimits {
        LineLimits {
            length_squared: LINE_LENGTH_M * LINE_LENGTH_M,
            spread_squared: self.params.line_tolerance_m * self.params.line_tolerance_m,
            sine_squared: GRAZING_SINE * GRAZING_SINE,
            laser_m: self.laser_in_base_m,
        }
    }
}

/// End points that take over a scan.
struct Fill<'a> {
    points: &'a mut EndPoints,
    scan: &'a Scan<'a>,
}

impl InLanes for Fill<'_> {
    type Output = ();

    #[inline(always)]
    fn work(self) {
        let Self { points, scan } = self;
        points.take_ends(scan);
        points.measure_gaps();
        isolated::mark(&mut points.points, &points.gaps_m, NORMAL_REACH_M);
        points.sum_up();
        points.fit_lines();
        points.fit_corners();
    }
}

/// Beams that lie closer together than `spacing_m` share the weight of one; so far to the beams before and
/// after.
#[inline(always)]
fn weight(params: &PointParams, before_m: f32, after_m: f32) -> f32 {
    let spacing_m = params.spacing_m as f32;
    (before_m.min(spacing_m) + after_m.min(spacing_m)) / (2.0 * spacing_m).max(1e-6)
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::scan::Beam;

    /// The end points of a beam a degree, so many to each side.
    pub(crate) fn seen(degrees: i32, mut range_m: impl FnMut(i32) -> f64) -> EndPoints {
        let beams: Vec<Beam> = (-degrees..=degrees)
            .map(|degree| {
                let angle = f64::from(degree).to_radians();
                let direction_in_base = [angle.cos() as f32, angle.sin() as f32];
                Beam { direction_in_base, range_m: range_m(degree) as f32, delay_s: 0.0 }
            })
            .collect();
        let mut points = EndPoints::new(PointParams::default());
        points.fill(&Scan { stamp_ns: 0, laser_in_base_m: [0.0; 2], beams: &beams, twist_in_base: [0.0; 3] });
        points
    }

    fn points(mut ranges_m: impl FnMut(f64) -> f64) -> EndPoints {
        seen(90, |degree| ranges_m(f64::from(degree).to_radians()))
    }

    /// The end point of the beam at this angle, all beams having returned.
    fn at(points: &EndPoints, degrees: usize) -> EndPoint {
        points.as_slice()[degrees + 90]
    }

    #[test]
    fn a_wall_ahead_has_normals_back_to_the_laser() {
        let points = points(|angle| if angle.abs() < 1.2 { 2.0 / angle.cos() } else { f64::INFINITY });
        for point in points.as_slice().iter().skip(1).rev().skip(1) {
            assert_eq!(point.kind, Kind::Line, "{point:?}");
            assert!((point.normal[0] + 1.0).abs() < 1e-3 && point.normal[1].abs() < 1e-3, "{point:?}");
        }
    }

    #[test]
    fn next_to_an_edge_the_normal_comes_from_the_nearer_side_alone() {
        // A wall 2 m ahead to the left of the middle, another at 3 m to the right of it.
        let points = points(|angle| if angle >= 0.0 { 2.0 } else { 3.0 } / angle.cos().max(0.1));
        let edge = at(&points, 0);
        assert_eq!(edge.kind, Kind::Line);
        assert!((edge.normal[0] + 1.0).abs() < 1e-3, "{edge:?}");
    }

    #[test]
    fn a_leg_before_a_wall_is_a_point_and_a_lone_return_is_unsure() {
        let leg = points(|angle| if angle == 0.0 { 1.0 } else { 3.0 / angle.cos().max(0.1) });
        assert_eq!((at(&leg, 0).kind, at(&leg, 0).normal), (Kind::Point, [0.0; 2]));
        let lone = points(|angle| if angle == 0.0 { 1.0 } else { f64::INFINITY });
        assert_eq!(lone.as_slice().len(), 1);
        assert_eq!(lone.as_slice()[0].kind, Kind::Unsure);
    }

    #[test]
    fn a_wall_keeps_its_normals_when_every_fourth_beam_falls_short() {
        let mut beam = 0;
        let points = points(|angle| {
            beam += 1;
            let wall_m = if angle.abs() < 1.0 { 2.0 / angle.cos() } else { f64::INFINITY };
            if beam % 4 == 0 { wall_m * (0.2 + f64::from(beam * 37 % 60) / 100.0) } else { wall_m }
        });
        let (short, wall): (Vec<&EndPoint>, Vec<&EndPoint>) =
            points.as_slice().iter().partition(|point| point.at_m[0] < 1.7);
        assert!(short.len() > 20 && wall.len() > 80, "{} {}", short.len(), wall.len());
        assert!(short.iter().all(|point| point.kind != Kind::Line));
        let facing = |point: &&&EndPoint| point.normal[0] < -0.999;
        assert_eq!(wall.iter().filter(facing).count(), wall.len());
    }

    #[test]
    fn beams_closer_together_than_the_spacing_share_its_weight() {
        // On a circle of 0.5 m the beams end 8.7 mm apart, on one of 5 m 87 mm.
        let (near, far) = (points(|_| 0.5), points(|_| 5.0));
        assert!((at(&near, 0).weight - 0.0087 / 0.02).abs() < 0.01, "{:?}", at(&near, 0));
        assert_eq!(at(&far, 0).weight, 1.0);
    }

    #[test]
    fn invalid_absent_too_near_and_too_far_beams_give_no_points() {
        for range_m in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, -1.0, 0.0, 0.05, 41.0] {
            assert!(points(|_| range_m).as_slice().is_empty(), "{range_m}");
        }
    }

    #[test]
    fn a_scan_with_too_many_beams_is_thinned_evenly() {
        let beam = Beam { direction_in_base: [1.0, 0.0], range_m: 1.0, delay_s: 0.0 };
        let beams = vec![beam; 1000];
        let mut points = EndPoints::new(PointParams { max_beams: 300, ..PointParams::default() });
        points.fill(&Scan { stamp_ns: 0, laser_in_base_m: [0.0; 2], beams: &beams, twist_in_base: [0.0; 3] });
        assert_eq!(points.as_slice().len(), 250);
    }
}
