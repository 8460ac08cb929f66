//! What moves by itself: people who walk by or along are told from what stands, and kept out of map and
//! match.
//!
//! Things that stand free in a scan ([`segments`]) are followed from scan to scan. What keeps its place in
//! the map while the base moves on is static. What leaves its place is dynamic: it says nothing of the pose,
//! and the map does not learn it. What is not known yet may match what the map knows, but is not learned:
//! somebody who keeps the base company would otherwise become a landmark that says that the base stands.
//! Frame: map. Units: meters.

mod segments;

use biplane_geometry::Pose2;
use biplane_geometry::vec2::{distance, minus, norm};

use crate::moving::segments::{Seen, Segment, find_short};
use crate::placement::Placement;
use crate::scan::end_points::{EndPoints, Mobility};

/// Short runs of end points that a scan may have.
const SEGMENTS: usize = 512;
/// Things followed at a time.
const TRACKS: usize = 128;
/// Things followed are looked for first this close to where they were expected, then this close, meters.
const GATES_M: [f32; 2] = [0.1, 0.35];
/// A thing is static when it has kept its place while the place that it would have had if it went along with
/// the base moved away from it so far, meters.
const APART_M: f32 = 0.7;
/// What is farther from where it was first seen than this and its own size has moved, meters.
const MOVED_M: f32 = 0.3;
/// What is closer to where it was first seen than this and its own size has kept its place, meters.
const KEPT_M: f32 = 0.12;
/// As fast as something else is what differs by no more than this share of the way.
const AS_FAST: f32 = 0.3;
/// So often a thing is seen before it is static.
const SEEN: u32 = 3;
/// A thing that was not seen so many times in a row is forgotten.
const MISSED: u32 = 5;
/// When the base is found this far from where it was expected, meters and radians, it is not the things that
/// have moved: all are looked at anew.
const OFF_M: f64 = 0.15;
const OFF_RAD: f64 = 0.1;
/// After a longer step, meters and radians, nothing is found again.
const SHORT_M: f64 = 0.35;
const SHORT_RAD: f64 = 0.35;
/// Things are followed when so many steps in a row were short.
const SHORT_STEPS: u32 = 3;
/// Where more than this share of the end points is not known to be static, all that is not dynamic is
/// learned: a map of nothing holds no pose.
const MANY: f64 = 0.7;

fn is_short(step: &Pose2) -> bool {
    step.distance_m() < SHORT_M && step.theta_rad.abs() < SHORT_RAD
}

/// A thing that is followed.
#[derive(Copy, Clone, Debug)]
struct Track {
    mobility: Mobility,
    /// Where it was first seen: in the map, and in the base.
    first_m: [f32; 2],
    first_in_base_m: [f32; 2],
    /// Where it was last seen: in the map, and in the base.
    at_m: [f32; 2],
    in_base_m: [f32; 2],
    /// Half its length, the longest seen.
    half_m: f32,
    seen: u32,
    missed: u32,
}

impl Track {
    fn new(segment: &Segment, placement: &Placement) -> Self {
        let at_m = placement.place(segment.at_m);
        Self {
            mobility: Mobility::Unknown,
            first_m: at_m,
            first_in_base_m: segment.at_m,
            at_m,
            in_base_m: segment.at_m,
            half_m: segment.half_m,
            seen: 1,
            missed: 0,
        }
    }

    /// How far a place is from where it is expected, whether it stands or goes along with the base.
    fn off_m(&self, at_m: [f32; 2], placement: &Placement) -> f32 {
        distance(at_m, self.at_m).min(distance(at_m, placement.place(self.in_base_m)))
    }

    fn see(&mut self, segment: &Segment, placement: &Placement) {
        self.at_m = placement.place(segment.at_m);
        self.in_base_m = segment.at_m;
        self.half_m = self.half_m.max(segment.half_m);
        self.seen += 1;
        self.missed = 0;
        let along_m = minus(placement.place(self.first_in_base_m), self.first_m);
        let (moved_m, apart_m) = (distance(self.at_m, self.first_m), norm(along_m));
        // What the base comes by twice as fast as it should stands, and the odometry's sign is wrong.
        let twice_m = [0, 1].map(|axis| self.first_m[axis] + 2.0 * along_m[axis]);
        let is_passed_twice_as_fast = distance(self.at_m, twice_m) < AS_FAST * apart_m;
        if moved_m > MOVED_M + self.half_m {
            if !is_passed_twice_as_fast {
                self.mobility = Mobility::Dynamic;
            }
        } else if self.mobility == Mobility::Unknown
            && self.seen >= SEEN
            && apart_m > APART_M + self.half_m
            && moved_m < KEPT_M + self.half_m
        {
            self.mobility = Mobility::Static;
        }
    }
}

/// Follows what stands free; everything is allocated by [`MovingObjects::new`].
#[derive(Clone, Debug)]
pub(crate) struct MovingObjects {
    seen: Seen,
    segments: Vec<Segment>,
    /// The track of each segment that stands free.
    track_of: Vec<Option<usize>>,
    /// What each segment is known to be.
    mobility: Vec<Mobility>,
    tracks: Vec<Track>,
    /// How many steps in a row were short.
    short_steps: u32,
    /// Where the base was expected, and where it was found last.
    expected: Pose2,
    last: Pose2,
}

impl MovingObjects {
    /// Nothing is followed yet; memory for scans of so many end points.
    pub(crate) fn new(points: usize) -> Self {
        Self {
            seen: Seen::with_capacity(points),
            segments: Vec::with_capacity(SEGMENTS),
            track_of: Vec::with_capacity(SEGMENTS),
            mobility: Vec::with_capacity(SEGMENTS),
            tracks: Vec::with_capacity(TRACKS),
            short_steps: SHORT_STEPS,
            expected: Pose2::IDENTITY,
            last: Pose2::IDENTITY,
        }
    }

    fn follows(&self) -> bool {
        self.short_steps >= SHORT_STEPS
    }

    /// Whether a step is so long that what has been followed is not found again.
    pub(crate) fn loses_sight(&self, step: &Pose2) -> bool {
        self.follows() && !is_short(step)
    }

    /// Follows nothing until so many steps in a row were short.
    pub(crate) fn pause(&mut self) {
        self.short_steps = 0;
    }

    /// Says of each end point what it is known to lie on, given about where the base is.
    pub(crate) fn label(&mut self, points: &mut EndPoints, expected: &Pose2) {
        self.track_of.clear();
        self.segments.clear();
        if !self.follows() {
            self.tracks.clear();
            return;
        }
        self.expected = *expected;
        find_short(points, &mut self.seen, &mut self.segments);
        self.associate(&Placement::new(expected));
        self.judge();
        let unsure: usize = self.unsure().map(|(segment, _)| segment.count()).sum();
        let few = unsure as f64 <= MANY * points.as_slice().len() as f64;
        for (segment, mobility) in self.unsure() {
            if few || mobility == Mobility::Dynamic {
                points.set_mobility(segment.first..=segment.last, mobility);
            }
        }
    }

    /// Segments that are not known to be static.
    fn unsure(&self) -> impl Iterator<Item = (&Segment, Mobility)> {
        let judged = self.segments.iter().zip(self.mobility.iter().copied());
        judged.filter(|(_, mobility)| *mobility != Mobility::Static)
    }

    /// Says of each segment what it is known to be: what stands free as its track; what somebody hides is not
    /// known, what something static hides is static.
    fn judge(&mut self) {
        self.mobility.clear();
        for (segment, track_of) in self.segments.iter().zip(&self.track_of) {
            self.mobility.push(match track_of {
                Some(index) => self.tracks[*index].mobility,
                None if segment.stands_free() => Mobility::Unknown,
                None => Mobility::Static,
            });
        }
        for index in 0..self.segments.len() {
            let segment = &self.segments[index];
            let hider = |is_hidden: bool, other: Option<usize>| {
                let unsure = |other: usize| {
                    let beside = &self.segments[other];
                    let touches = beside.last + 1 == segment.first || segment.last + 1 == beside.first;
                    touches && self.mobility[other] != Mobility::Static
                };
                !is_hidden || other.filter(|other| *other < self.segments.len()).is_some_and(unsure)
            };
            let [before, after] = segment.is_hidden;
            if !segment.stands_free() && hider(before, index.checked_sub(1)) && hider(after, Some(index + 1))
            {
                self.mobility[index] = Mobility::Unknown;
            }
        }
    }

    /// Finds each segment's track: close ones first, so that nobody takes a neighbor's place.
    fn associate(&mut self, placement: &Placement) {
        self.track_of.resize(self.segments.len(), None);
        let mut is_taken = [false; TRACKS];
        for gate_m in GATES_M {
            for (segment, track_of) in self.segments.iter().zip(&mut self.track_of) {
                if track_of.is_some() || !segment.stands_free() {
                    continue;
                }
                let at_m = placement.place(segment.at_m);
                let free = self.tracks.iter().enumerate().filter(|(index, _)| !is_taken[*index]);
                let off = free.map(|(index, track)| (track.off_m(at_m, placement), index));
                if let Some((off_m, index)) = off.min_by(|a, b| a.0.total_cmp(&b.0))
                    && off_m < gate_m
                {
                    *track_of = Some(index);
                    is_taken[index] = true;
                }
            }
        }
    }

    /// Takes note of where the base was found in the end.
    pub(crate) fn update(&mut self, map_from_base: &Pose2) {
        let step = std::mem::replace(&mut self.last, *map_from_base).between(map_from_base);
        let is_short = is_short(&step);
        let followed = self.follows();
        self.short_steps = if is_short { self.short_steps.saturating_add(1) } else { 0 };
        if !followed {
            return;
        }
        let off = self.expected.between(map_from_base);
        if off.distance_m() > OFF_M || off.theta_rad.abs() > OFF_RAD || !is_short {
            self.tracks.clear();
            return;
        }
        let placement = Placement::new(map_from_base);
        self.tracks.iter_mut().for_each(|track| track.missed += 1);
        for (segment, track_of) in self.segments.iter().zip(&self.track_of) {
            match track_of {
                Some(index) => self.tracks[*index].see(segment, &placement),
                None if segment.stands_free() && self.tracks.len() < TRACKS => {
                    self.tracks.push(Track::new(segment, &placement));
                }
                None => {}
            }
        }
        self.tracks.retain(|track| track.missed <= MISSED);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scan::end_points::PointParams;
    use crate::scan::{Beam, Scan};

    /// What the middle beam lies on after so many steps of 10 cm, when a pole stands or walks ahead of the
    /// base, before a wall 6 m away. `pole_m` gives its way from the base's start.
    fn after(steps: u32, pole_m: impl Fn(f64) -> f64) -> Mobility {
        let mut moving = MovingObjects::new(181);
        let mut points = EndPoints::new(PointParams::default());
        for step in 0..=steps {
            let x_m = 0.1 * f64::from(step);
            let beams: Vec<Beam> = (-90..=90)
                .map(|degrees: i32| {
                    let angle = f64::from(degrees).to_radians();
                    let range_m = if degrees.abs() < 3 { pole_m(x_m) - x_m } else { 6.0 };
                    let direction_in_base = [angle.cos() as f32, angle.sin() as f32];
                    Beam { direction_in_base, range_m: range_m as f32, delay_s: 0.0 }
                })
                .collect();
            points.fill(&Scan {
                stamp_ns: 0,
                laser_in_base_m: [0.0; 2],
                beams: &beams,
                twist_in_base: [0.0; 3],
            });
            let map_from_base = Pose2::new(x_m, 0.0, 0.0);
            moving.label(&mut points, &map_from_base);
            moving.update(&map_from_base);
        }
        let middle = points.as_slice()[90];
        assert_eq!(middle.weight == 0.0, middle.mobility == Mobility::Dynamic);
        middle.mobility
    }

    #[test]
    fn what_keeps_its_place_while_the_base_moves_on_is_static() {
        assert_eq!([8, 20].map(|steps| after(steps, |_| 4.0)), [Mobility::Unknown, Mobility::Static]);
    }

    #[test]
    fn what_walks_along_or_comes_closer_is_dynamic() {
        assert_eq!(after(20, |x_m| x_m + 1.0), Mobility::Dynamic);
        assert_eq!(after(20, |x_m| 5.0 - 0.7 * x_m), Mobility::Dynamic);
    }

    #[test]
    fn what_comes_by_twice_as_fast_as_it_should_is_not_dynamic() {
        // As seen with odometry of the wrong sign: the base drives back from a pole and counts ahead.
        assert_eq!(after(20, |x_m| 2.0 + 2.0 * x_m), Mobility::Unknown);
    }

    #[test]
    fn when_the_base_is_found_elsewhere_than_expected_all_is_looked_at_anew() {
        let mut moving = MovingObjects { short_steps: SHORT_STEPS, ..MovingObjects::new(181) };
        moving.segments.push(Segment {
            first: 0,
            last: 3,
            at_m: [1.0, 0.0],
            half_m: 0.1,
            is_hidden: [false; 2],
        });
        moving.track_of.push(None);
        moving.update(&Pose2::IDENTITY);
        assert_eq!(moving.tracks.len(), 1);
        moving.expected = Pose2::new(0.3, 0.0, 0.0);
        moving.update(&Pose2::IDENTITY);
        assert!(moving.tracks.is_empty());
    }
}
