//! Short runs of end points in a scan: what stands free, and what is seen between nearer things.
//!
//! Legs, poles, chairs, people; a piece of wall between two people. Frame: the base at the scan's stamp.
//! Units: meters.

use crate::lanes::{InLanes, widest};
use crate::scan::end_points::{EndPoint, EndPoints};
use biplane_geometry::vec2::distance;

/// Neighboring ranges that differ by more than this belong to different things, meters. Larger: somebody
/// before a wall is part of the wall; smaller: a wall struck flatly falls apart.
const JUMP_M: f32 = 0.2;
/// Longer runs are walls or furniture that nobody carries away, meters.
const LONGEST_M: f32 = 0.8;
/// Beams so many times as far apart as the closest ones have others between them that met nothing.
const OPEN: f32 = 2.5;

/// Numbers side by side.
const LANES: usize = 8;

/// A short run of end points.
#[derive(Copy, Clone, PartialEq, Debug)]
pub(crate) struct Segment {
    /// Its first end point.
    pub first: usize,
    /// Its last end point.
    pub last: usize,
    /// Its middle, meters.
    pub at_m: [f32; 2],
    /// Half its length, meters.
    pub half_m: f32,
    /// Whether something nearer hides what goes on before and after it.
    pub is_hidden: [bool; 2],
}

impl Segment {
    /// Whether what is behind it is farther on both sides.
    pub(crate) fn stands_free(&self) -> bool {
        self.is_hidden == [false; 2]
    }

    /// So many end points.
    pub(crate) fn count(&self) -> usize {
        self.last - self.first + 1
    }
}

/// End points as the laser sees them, a column a quantity.
#[derive(Clone, Debug)]
pub(crate) struct Seen {
    offset_m: [Vec<f32>; 2],
    range_m: Vec<f32>,
    /// About the sine of the angle between the beams of an end point and of the next one.
    apart: Vec<f32>,
}

impl Seen {
    /// Memory for so many end points.
    pub(crate) fn with_capacity(points: usize) -> Self {
        let column = || Vec::with_capacity(points);
        Self { offset_m: [column(), column()], range_m: column(), apart: column() }
    }

    #[inline(always)]
    fn fill(&mut self, points: &EndPoints) {
        let laser_m = points.laser_in_base_m();
        let Self { offset_m: [x_m, y_m], range_m, apart } = self;
        for (axis, column) in [&mut *x_m, &mut *y_m].into_iter().enumerate() {
            column.clear();
            column.extend(points.as_slice().iter().map(|point| point.at_m[axis] - laser_m[axis]));
        }
        range_m.clear();
        range_m.extend(x_m.iter().zip(&*y_m).map(|(x, y)| (x * x + y * y).sqrt()));
        apart.clear();
        let next = |column: &[f32], index: usize| (column[index], column[index + 1]);
        apart.extend((0..range_m.len().saturating_sub(1)).map(|index| {
            let ((x, next_x), (y, next_y)) = (next(x_m, index), next(y_m, index));
            let (range, next_range) = next(range_m, index);
            ((x * next_y - y * next_x) / (range * next_range).max(1e-6)).abs()
        }));
    }

    /// The angle between the beams that are closest to each other.
    #[inline(always)]
    fn closest(&self) -> f32 {
        // Many smallest ones side by side: each waits for its predecessor.
        let mut smallest = [f32::INFINITY; LANES];
        for some in self.apart.chunks(LANES) {
            for (smallest, apart) in smallest.iter_mut().zip(some) {
                *smallest = smallest.min(if *apart > 1e-4 { *apart } else { f32::INFINITY });
            }
        }
        smallest.into_iter().fold(f32::INFINITY, f32::min)
    }

    /// What lies between an end point and the next one.
    fn border(&self, index: usize, closest: f32) -> Border {
        if self.apart[index] > OPEN * closest {
            return Border::Open;
        }
        let jump_m = self.range_m[index + 1] - self.range_m[index];
        if jump_m > JUMP_M {
            Border::Farther
        } else if jump_m < -JUMP_M {
            Border::Nearer
        } else {
            Border::None
        }
    }
}

/// What lies between two neighboring end points.
#[derive(Copy, Clone, PartialEq, Eq)]
enum Border {
    /// Nothing: they may lie on one thing.
    None,
    /// The second one is nearer.
    Nearer,
    /// The second one is farther.
    Farther,
    /// Nothing was seen between them: what lies there is farther than both.
    Open,
}

/// The end points on what is short and stands free, by number: what may be somebody who walks.
#[must_use]
pub fn free_standing(points: &EndPoints) -> Vec<usize> {
    let count = points.as_slice().len();
    let (mut seen, mut segments) = (Seen::with_capacity(count), Vec::with_capacity(count));
    find_short(points, &mut seen, &mut segments);
    let free = segments.iter().filter(|segment| segment.stands_free());
    free.flat_map(|segment| segment.first..=segment.last).collect()
}

/// Finds what is short, in the order of the beams; no more than fits into `segments` without allocating.
pub(crate) fn find_short(points: &EndPoints, seen: &mut Seen, segments: &mut Vec<Segment>) {
    segments.clear();
    let all = points.as_slice();
    let closest = widest(See { seen, points });
    let (mut first, mut opened) = (0, Border::Open);
    for index in 0..all.len() {
        let is_last = index + 1 == all.len();
        let border = if is_last { Border::Open } else { seen.border(index, closest) };
        if border == Border::None {
            continue;
        }
        let long_m = distance(all[first].at_m, all[index].at_m);
        if long_m <= LONGEST_M && segments.len() < segments.capacity() {
            let is_hidden = [opened == Border::Farther, border == Border::Nearer];
            segments.push(Segment { is_hidden, ..segment(all, first, index) });
        }
        (first, opened) = (index + 1, border);
    }
}

/// End points that are to be seen as the laser does.
struct See<'a> {
    seen: &'a mut Seen,
    points: &'a EndPoints,
}

impl InLanes for See<'_> {
    /// The angle between the beams that are closest to each other.
    type Output = f32;

    #[inline(always)]
    fn work(self) -> f32 {
        self.seen.fill(self.points);
        self.seen.closest()
    }
}

fn segment(all: &[EndPoint], first: usize, last: usize) -> Segment {
    let count = (last - first + 1) as f32;
    let sum = all[first..=last]
        .iter()
        .fold([0.0_f32; 2], |sum, point| [sum[0] + point.at_m[0], sum[1] + point.at_m[1]]);
    let half_m = distance(all[first].at_m, all[last].at_m) / 2.0;
    Segment { first, last, at_m: sum.map(|sum| sum / count), half_m, is_hidden: [false; 2] }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scan::end_points::tests::seen;

    /// What stands free in a scan of 181 beams, their first and last beam.
    fn found(range_m: impl Fn(i32) -> f64) -> Vec<(usize, usize)> {
        let points = seen(90, range_m);
        let mut segments = Vec::with_capacity(16);
        find_short(&points, &mut Seen::with_capacity(181), &mut segments);
        let free = segments.iter().filter(|segment| segment.stands_free());
        let free: Vec<(usize, usize)> = free.map(|segment| (segment.first, segment.last)).collect();
        let numbers: Vec<usize> = free.iter().flat_map(|(first, last)| *first..=*last).collect();
        assert_eq!(free_standing(&points), numbers);
        free
    }

    #[test]
    fn somebody_before_a_wall_stands_free_and_a_pillar_at_a_step_of_the_wall_does_not() {
        assert_eq!(found(|degrees| if (10..=15).contains(&degrees) { 2.0 } else { 4.0 }), [(100, 105)]);
        let step = |degrees| match degrees {
            ..10 => 3.0,
            10..=15 => 3.5,
            _ => 4.0,
        };
        assert_eq!(found(step), []);
    }

    #[test]
    fn a_pole_before_nothing_stands_free_and_a_wall_does_not() {
        // No returns but from the pole and, behind a gap, from a long wall.
        let range_m = |degrees: i32| match degrees {
            -3..=0 => 3.0,
            20..=60 => 5.0,
            _ => f64::INFINITY,
        };
        assert_eq!(found(range_m), [(0, 3)]);
    }

    #[test]
    fn no_more_is_kept_than_fits() {
        let mut segments: Vec<Segment> = Vec::with_capacity(2);
        let points = seen(90, |degrees| if degrees % 4 == 0 { 1.0 } else { 5.0 });
        find_short(&points, &mut Seen::with_capacity(181), &mut segments);
        assert_eq!((segments.len(), segments.capacity()), (2, 2));
    }
}
