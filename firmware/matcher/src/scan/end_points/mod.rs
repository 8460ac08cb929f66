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

    /// What lies at a corner has the normal of the neighbors on one side: of those that lie closer to a line.
    /// If the side were always the same one, walls would turn to it.
    #[inline(always)]
    fn fit_corners(&mut self) {
        let (limits, mut lines) = (self.limits(), Lines::default());
        let (mut chosen, mut chosen_spread) = (usize::MAX, 0.0);
        for some in self.sides.chunks(Lines::MANY) {
            lines.clear();
            some.iter().for_each(|Side { index, ends }| self.push(&mut lines, *ends, *index));
            lines.fit(&limits);
            for (place, Side { index, .. }) in some.iter().enumerate() {
                let (shape, normal) = lines.get(place);
                let point = &mut self.points[*index];
                if shape == Shape::Line {
                    let spread = lines.spread(place);
                    if *index != chosen || spread < chosen_spread {
                        (point.kind, point.normal) = (Kind::Line, normal);
                        (chosen, chosen_spread) = (*index, spread);
                    }
                } else if shape == Shape::Scattered && point.kind != Kind::Line {
                    point.kind = Kind::Point;
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
pub(crate) mod tests;
