//! The part of a cylinder that was seen: its points with the places in which their beams meet it, from where
//! to where along the axis and round it, and what they say together. Meters, radians.

use super::axis::Tube;
use super::prism::Mean;
use super::runs::longest_run;
use crate::reconstruct::shapes::params::ShapeParams;
use biplane_geometry::PortableMath;
use biplane_geometry::vec3::{dot, minus, norm};

/// Directions that are told apart round an axis.
const DIRECTIONS: usize = 72;
/// Points within so many deviations of the surface are on it.
pub(crate) const ON_DEVIATIONS: f64 = 3.0;
/// Lengths along the axis are told apart by so much.
const STEP_M: f64 = 0.1;
/// Shortest length, and in radii: a disk is no column.
pub(crate) const MIN_LENGTH_M: f64 = 0.3;
const MIN_LENGTH_RADII: f64 = 2.0;
/// Things of a larger radius are walls, of which a low piece is enough.
pub(crate) const WALL_RADIUS_M: f64 = 1.0;
/// Smallest share of points seen from the same side, each weighed by the cosine at which it was seen.
const MIN_ONE_SIDED: f64 = 0.9;
/// Share of a deviation that points in one direction have in common: poses, ranges in whole centimeters.
const COMMON_SHARE: f64 = 0.25;

/// Points to judge by, and from where they were seen.
#[derive(Clone, Copy)]
pub(crate) struct Evidence<'a> {
    /// The points, on the surface and beside it.
    pub points_m: &'a [[f64; 3]],
    /// Where each was seen from; empty when that is not known.
    pub origins_m: &'a [[f64; 3]],
    /// Deviation of a range.
    pub sigma_m: f64,
}

/// Why a cylinder is none.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Rejected {
    /// Its radius is out of bounds.
    Radius,
    /// Too few points.
    Points,
    /// Too short.
    Length,
    /// Seen round too little of it.
    Arc,
    /// Its points spread like no surface.
    Spread,
    /// Seen from both sides.
    Sides,
    /// Too much beside it.
    Beside,
    /// Points on too little of it.
    Covered,
    /// Flat faces explain it better.
    Flat,
    /// The same was tried.
    Repeated,
}

impl Rejected {
    /// Whether the reason may be no more than that the axis is turned a little.
    pub(crate) fn may_be_a_lean(self) -> bool {
        matches!(self, Self::Points | Self::Spread | Self::Beside | Self::Covered | Self::Flat)
    }
}

/// A point on the surface.
pub(crate) struct On {
    /// Its index.
    pub index: usize,
    /// Along the axis.
    along_m: f64,
    /// Where its beam meets the surface, about the axis: an error of the range shifts the point along the
    /// beam, and with it its own direction.
    angle_rad: f64,
    direction: usize,
    /// How far off the surface it is, across it.
    off_m: f64,
    /// Cosine of the angle at which it was seen, positive from outside.
    cosine: Option<f64>,
}

/// The part of a cylinder that was seen.
pub(crate) struct Surface {
    /// All points, in the axis's coordinates.
    pub all: Vec<[f64; 3]>,
    /// Those on the surface.
    pub on: Vec<On>,
    /// From where to where along the axis.
    pub along_m: [f64; 2],
    /// In which directions.
    pub arc: Arc,
}

impl Surface {
    /// The part that was seen, when it is long and round enough.
    pub(crate) fn of(params: &ShapeParams, tube: &Tube, seen: &Evidence<'_>) -> Result<Self, Rejected> {
        if !(params.min_radius_m..=params.max_radius_m).contains(&tube.radius_m) {
            return Err(Rejected::Radius);
        }
        let all: Vec<[f64; 3]> = seen.points_m.iter().map(|p| tube.axis.local(*p)).collect();
        let is_on = |p: &[f64; 3]| off_m(tube, *p).abs() <= ON_DEVIATIONS * seen.sigma_m;
        let run = longest_run(all.iter().filter(|p| is_on(p)).map(|p| p[2]));
        let Some(along_m) = run else { return Err(Rejected::Points) };
        let within = |p: &[f64; 3]| (along_m[0]..=along_m[1]).contains(&p[2]);
        let points = all.iter().enumerate().filter(|(_, p)| within(p) && is_on(p));
        let mut on = Vec::with_capacity(all.len());
        on.extend(points.map(|(index, local)| On::new(tube, seen, index, *local)));
        if on.len() < params.min_points {
            return Err(Rejected::Points);
        }
        if along_m[1] - along_m[0] < min_length_m(tube.radius_m) {
            return Err(Rejected::Length);
        }
        let arc = Arc::of(&on);
        if arc.degrees() < params.min_arc_deg {
            return Err(Rejected::Arc);
        }
        Ok(Self { all, on, along_m, arc })
    }
}

/// The length that a thing of a radius has at least.
pub(crate) fn min_length_m(radius_m: f64) -> f64 {
    let radii_m = if radius_m < WALL_RADIUS_M { MIN_LENGTH_RADII * radius_m } else { 0.0 };
    radii_m.max(MIN_LENGTH_M)
}

/// How far a point in the axis's coordinates lies outside the surface.
pub(crate) fn off_m(tube: &Tube, [x, y, _]: [f64; 3]) -> f64 {
    x.portable_hypot(y) - tube.radius_m
}

impl On {
    fn new(tube: &Tube, seen: &Evidence<'_>, index: usize, local: [f64; 3]) -> Self {
        let [x, y, along_m] = local;
        let off_m = x.portable_hypot(y) - tube.radius_m;
        let at = |[x, y]: [f64; 2], off_m: f64, cosine: Option<f64>| {
            let angle_rad = y.portable_atan2(x);
            Self { index, along_m, angle_rad, direction: direction_at(angle_rad), off_m, cosine }
        };
        let Some(origin) = seen.origins_m.get(index) else { return at([x, y], off_m, None) };
        let beam = minus(seen.points_m[index], *origin);
        let length_m = norm(beam).max(1e-9);
        let [zero, quarter, _] = tube.axis.frame;
        let step = [dot(zero, beam) / length_m, dot(quarter, beam) / length_m];
        let facing = |[x, y]: [f64; 2]| -(x * step[0] + y * step[1]) / x.portable_hypot(y).max(1e-9);
        let Some(shift_m) = to_surface([x, y], step, tube.radius_m) else {
            return at([x, y], off_m, Some(facing([x, y]).clamp(-MISSED_COSINE, MISSED_COSINE)));
        };
        let met = [x + shift_m * step[0], y + shift_m * step[1]];
        let cosine = facing(met);
        at(met, shift_m * cosine, Some(cosine))
    }
}

/// What beams that pass beside the surface are worth.
const MISSED_COSINE: f64 = 0.05;

/// How far along a beam it is from a point to the nearer of the places in which the beam meets a circle about
/// the origin.
fn to_surface([x, y]: [f64; 2], step: [f64; 2], radius_m: f64) -> Option<f64> {
    let (a, b) = (step[0] * step[0] + step[1] * step[1], x * step[0] + y * step[1]);
    let squared = b * b - a * (x * x + y * y - radius_m * radius_m);
    if a < 1e-9 || squared < 0.0 {
        return None;
    }
    let [near, far] = [-1.0, 1.0].map(|sign: f64| (-b + sign * squared.sqrt()) / a);
    Some(if near.abs() <= far.abs() { near } else { far })
}

/// Which of the [`DIRECTIONS`] a point lies in.
pub(crate) fn direction_of([x, y, _]: [f64; 3]) -> usize {
    direction_at(y.portable_atan2(x))
}

/// Which of the [`DIRECTIONS`] an angle lies in.
fn direction_at(angle_rad: f64) -> usize {
    let turn = angle_rad.rem_euclid(std::f64::consts::TAU) / std::f64::consts::TAU;
    ((turn * DIRECTIONS as f64) as usize).min(DIRECTIONS - 1)
}

/// Whether the surface was seen from inside; `None` when from both sides. What nobody knows is outside. What
/// is grazed hardly counts: there the noise of a range puts a point on either side of a thin pipe.
pub(crate) fn side(on: &[On]) -> Option<bool> {
    let (mut outside, mut all) = (0.0, 0.0);
    for cosine in on.iter().filter_map(|p| p.cosine) {
        outside += cosine.max(0.0);
        all += cosine.abs();
    }
    if outside >= MIN_ONE_SIDED * all {
        Some(false)
    } else if all - outside >= MIN_ONE_SIDED * all {
        Some(true)
    } else {
        None
    }
}

/// The directions in which there are points: from one, so many on.
pub(crate) struct Arc {
    first: usize,
    count: usize,
}

impl Arc {
    /// All but the longest gap. Directions with a handful of points among many have none.
    fn of(on: &[On]) -> Self {
        let mut counts = [0usize; DIRECTIONS];
        on.iter().for_each(|p| counts[p.direction] += 1);
        let used = counts.iter().filter(|count| **count > 0).count().max(1);
        let enough = (on.len() / used / 8).max(1);
        let empty = |direction: usize| counts[direction % DIRECTIONS] < enough;
        let gap =
            |first: usize| (first..first + DIRECTIONS).take_while(|direction| empty(*direction)).count();
        let (first, longest) = (0..DIRECTIONS)
            .map(|first| (first, gap(first)))
            .max_by_key(|(first, gap)| (*gap, usize::MAX - first))
            .unwrap_or((0, 0));
        Self { first: (first + longest) % DIRECTIONS, count: DIRECTIONS - longest }
    }

    fn degrees(&self) -> f64 {
        self.count as f64 * 360.0 / DIRECTIONS as f64
    }

    fn is_whole(&self) -> bool {
        // A gap of 15 degrees hides nothing.
        self.count + 3 >= DIRECTIONS
    }

    pub(crate) fn radians(&self) -> [f64; 2] {
        let step = std::f64::consts::TAU / DIRECTIONS as f64;
        if self.is_whole() {
            return [0.0, std::f64::consts::TAU];
        }
        let from = self.first as f64 * step;
        [from, from + self.count as f64 * step]
    }

    /// The place of a direction in the arc.
    fn place(&self, direction: usize) -> usize {
        (direction + DIRECTIONS - self.first) % DIRECTIONS
    }

    /// Whether a direction is in the arc and not at its ends, where mixed pixels are.
    pub(crate) fn is_inner(&self, direction: usize) -> bool {
        let margin = if self.is_whole() { 0 } else { self.count / 8 };
        let place = self.place(direction);
        place >= margin && place + margin < self.count
    }
}

/// Points of a cell, on the mean, where there are few.
const POINTS_PER_CELL: usize = 4;

/// Share of the cells between the ends that have points.
pub(crate) fn covered(on: &[On], arc: &Arc, [from_m, to_m]: [f64; 2]) -> f64 {
    // Two directions and a few steps a cell: beams of one degree are 7 cm apart at 4 m.
    let rows = ((to_m - from_m) / (3.0 * STEP_M)).ceil().clamp(1.0, 40.0) as usize;
    let columns = arc.count.div_ceil(2).min(on.len() / (POINTS_PER_CELL * rows)).max(3);
    let mut has = vec![false; rows * columns];
    for p in on {
        let row = ((p.along_m - from_m) / (to_m - from_m) * rows as f64) as usize;
        let place = arc.place(p.direction);
        if place < arc.count {
            has[row.min(rows - 1) * columns + place * columns / arc.count] = true;
        }
    }
    has.iter().filter(|has| **has).count() as f64 / has.len() as f64
}

/// The means of the points in each direction, in the order of the arc.
pub(crate) fn means(on: &[On], arc: &Arc, (radius_m, sigma_m): (f64, f64)) -> Vec<Mean> {
    let mut sums = vec![[0.0; 4]; arc.count];
    let step = std::f64::consts::TAU / DIRECTIONS as f64;
    for p in on {
        if let Some(sum) = sums.get_mut(arc.place(p.direction)) {
            // What is grazed is measured badly, and its beams meet what is behind as well.
            let weight = p.cosine.map_or(1.0, |cosine| cosine * cosine);
            let turn = (p.angle_rad - p.direction as f64 * step).rem_euclid(std::f64::consts::TAU);
            let added = [1.0, weight, weight * p.off_m, weight * turn];
            sum.iter_mut().zip(added).for_each(|(sum, value)| *sum += value);
        }
    }
    let mean = |(place, [n, w, off, turn]): (usize, [f64; 4])| {
        let count = w / n * (1.0 / n + COMMON_SHARE * COMMON_SHARE).recip();
        let (sin, cos) = ((arc.first + place) as f64 * step + turn / w).portable_sin_cos();
        let distance_m = radius_m + off / w;
        Mean { at_m: [distance_m * cos, distance_m * sin], weight_per_m2: count / (sigma_m * sigma_m), count }
    };
    sums.into_iter().enumerate().filter(|(_, sum)| sum[0] > 0.0 && sum[1] > 1e-6).map(mean).collect()
}
