//! What moves by itself: people who walk by or along are told from what stands, and kept out of map and
//! match.
//!
//! Things that stand free in a scan ([`segments`]) are followed from scan to scan. What keeps its place in
//! the map while the base moves on is static. What leaves its place is dynamic: it says nothing of the pose,
//! and the map does not learn it. What is not known yet may match what the map knows, but is not learned:
//! somebody who keeps the base company would otherwise become a landmark that says that the base stands.
//! Frame: map. Units: meters.

mod crowd;
mod newcomers;
mod places;
pub(crate) mod segments;
mod track;

use biplane_geometry::Pose2;

use crate::map::LocalMap;
use crate::moving::crowd::Crowd;
use crate::moving::newcomers::{Newcomers, Reason};
use crate::moving::places::Places;
use crate::moving::segments::{Seen, Segment, find_short};
use crate::moving::track::{PLACES, Track};
use crate::placement::Placement;
use crate::scan::end_points::{EndPoints, Mobility};

/// Short runs of end points that a scan may have.
const SEGMENTS: usize = 512;
/// Things followed at a time.
const TRACKS: usize = 128;
/// Things followed are looked for first this close to where they were expected, then this close, meters.
const GATES_M: [f32; 2] = [0.1, 0.35];
/// A thing that was not seen so many times in a row is forgotten.
const MISSED: u32 = 5;
/// End points this close to where a thing is expected that is not seen alone may lie on it, meters.
const ASIDE_M: f32 = 0.1;
/// When the base is found this far from where it was expected, meters and radians, it is not the things that
/// have moved: all are looked at anew.
const OFF_M: f64 = 0.15;
const OFF_RAD: f64 = 0.1;
/// After a longer step, meters and radians, nothing is found again.
const SHORT_M: f64 = 0.35;
const SHORT_RAD: f64 = 0.35;
/// Where scans were dropped, so many times that turn at most.
const MAX_TURNS: f64 = 2.0;
/// Things are followed when so many steps in a row were short.
const SHORT_STEPS: u32 = 3;
/// Where more than this share of the end points is not known to be static, all that is not dynamic is
/// learned: a map of nothing holds no pose.
const MANY: f64 = 0.7;

/// Whether a step is short, given how many scans usually come in its time: dropped scans make it no longer.
fn is_short(step: &Pose2, scans: f64) -> bool {
    step.distance_m() < scans * SHORT_M && step.theta_rad.abs() < scans.min(MAX_TURNS) * SHORT_RAD
}

/// Where a scan is expected to have been taken, and what that is worth.
#[derive(Copy, Clone, Debug)]
pub(crate) struct Outlook {
    /// The base at the scan's stamp.
    pub map_from_base: Pose2,
    /// So many scans usually come in the time since the last one, 1 or more.
    pub scans: f64,
    /// Whether odometry has been right lately.
    pub is_reliable: bool,
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
    /// So many scans usually come in the time since the last one.
    scans: f64,
    crowd: Crowd,
    newcomers: Newcomers,
    places: Places,
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
            scans: 1.0,
            crowd: Crowd::default(),
            newcomers: Newcomers::new(),
            places: Places::with_capacity(points.max(PLACES * TRACKS)),
        }
    }

    fn follows(&self) -> bool {
        self.short_steps >= SHORT_STEPS
    }

    /// Whether somebody has been about lately.
    pub(crate) fn is_somebody_about(&self) -> bool {
        self.crowd.is_somebody_about()
    }

    /// Whether a step, in the time of so many scans, is so long that what has been followed is not found
    /// again.
    pub(crate) fn loses_sight(&self, step: &Pose2, scans: f64) -> bool {
        self.follows() && !is_short(step, scans)
    }

    /// Follows nothing until so many steps in a row were short.
    pub(crate) fn pause(&mut self) {
        self.short_steps = 0;
    }

    /// Says of each end point what it is known to lie on, given about where the base is.
    pub(crate) fn label(&mut self, points: &mut EndPoints, outlook: &Outlook) {
        self.track_of.clear();
        self.segments.clear();
        self.scans = outlook.scans;
        if !self.follows() {
            self.tracks.clear();
            return;
        }
        self.expected = outlook.map_from_base;
        self.tracks.iter_mut().for_each(|track| track.wait(outlook.scans as f32));
        find_short(points, &mut self.seen, &mut self.segments);
        self.associate(&Placement::new(&self.expected));
        let is_watchful = outlook.is_reliable && self.is_somebody_about();
        self.judge(is_watchful && self.crowd.is_dense());
        let unsure: usize = self.unsure().map(|(segment, _)| segment.count()).sum();
        let few = unsure as f64 <= MANY * points.as_slice().len() as f64;
        for (segment, mobility) in self.unsure() {
            if few || mobility == Mobility::Dynamic {
                points.set_mobility(segment.first..=segment.last, mobility);
            }
        }
        let dynamic = self.unsure().filter(|(_, mobility)| *mobility == Mobility::Dynamic);
        self.crowd.update(dynamic.map(|(segment, _)| segment.count()).sum(), points.as_slice().len());
        if is_watchful {
            self.label_hidden(points, few);
        }
    }

    /// Who is followed and not seen alone in this scan may be hidden in part, or stand before something: what
    /// lies where they are expected is taken for them.
    fn label_hidden(&mut self, points: &mut EndPoints, few: bool) {
        let placement = Placement::new(&self.expected);
        self.places.fill(points.as_slice().iter().map(|point| placement.place(point.at_m)));
        for (index, track) in self.tracks.iter().enumerate() {
            let may_move =
                track.mobility == Mobility::Dynamic || (few && track.mobility == Mobility::Unknown);
            if !may_move || !track.is_known() || self.track_of.contains(&Some(index)) {
                continue;
            }
            let (ahead_m, reach_m) = (track.ahead_m(), track.half_m + ASIDE_M);
            self.places.within(ahead_m, reach_m, |place, _| points.mark_one(place, track.mobility));
        }
    }

    /// Says which end points of a scan, taken at a pose, the map is not to learn yet because somebody may
    /// have come there, or because the scan contradicts the map and what it sees may not be there.
    pub(crate) fn label_newcomers(
        &mut self,
        map: &LocalMap,
        map_from_base: &Pose2,
        points: &mut EndPoints,
        contradicts: bool,
    ) {
        if self.follows() && (contradicts || self.crowd.is_dense()) {
            let reason = if contradicts { Reason::Contradiction } else { Reason::Crowd };
            self.newcomers.label(map, map_from_base, points, reason);
        }
    }

    /// Segments that are not known to be static.
    fn unsure(&self) -> impl Iterator<Item = (&Segment, Mobility)> {
        let judged = self.segments.iter().zip(self.mobility.iter().copied());
        judged.filter(|(_, mobility)| *mobility != Mobility::Static)
    }

    /// Says of each segment what it is known to be: what stands free as its track; what somebody hides is not
    /// known, what something static hides is static. In a crowd who hides somebody may be hidden too: it is
    /// asked once from each end.
    fn judge(&mut self, from_each_end: bool) {
        self.mobility.clear();
        for (segment, track_of) in self.segments.iter().zip(&self.track_of) {
            self.mobility.push(match track_of {
                Some(index) => self.tracks[*index].mobility,
                None if segment.stands_free() => Mobility::Unknown,
                None => Mobility::Static,
            });
        }
        let all = 0..self.segments.len();
        let once_more = if from_each_end { all.clone() } else { 0..0 };
        for index in all.chain(once_more.rev()) {
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
        self.places.fill(self.tracks.iter().flat_map(|track| track.places_m(placement)));
        let mut is_taken = [false; TRACKS];
        for gate_m in GATES_M {
            for (segment, track_of) in self.segments.iter().zip(&mut self.track_of) {
                if track_of.is_some() || !segment.stands_free() {
                    continue;
                }
                let mut nearest_m = gate_m;
                self.places.within(placement.place(segment.at_m), gate_m, |place, away_m| {
                    if away_m < nearest_m && !is_taken[place / PLACES] {
                        (nearest_m, *track_of) = (away_m, Some(place / PLACES));
                    }
                });
                track_of.iter().for_each(|index| is_taken[*index] = true);
            }
        }
    }

    /// Takes note of where the base was found in the end.
    pub(crate) fn update(&mut self, map_from_base: &Pose2) {
        let step = std::mem::replace(&mut self.last, *map_from_base).between(map_from_base);
        let is_short = is_short(&step, self.scans);
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
    use crate::scan::end_points::tests::seen;

    /// What the middle beam lies on after so many steps of 10 cm, when a pole stands or walks ahead of the
    /// base, before a wall 6 m away. `pole_m` gives its way from the base's start.
    fn after(steps: u32, pole_m: impl Fn(f64) -> f64) -> Mobility {
        let mut moving = MovingObjects::new(181);
        let mut points = EndPoints::new(PointParams::default());
        for step in 0..=steps {
            let x_m = 0.1 * f64::from(step);
            points = seen(90, |degree| if degree.abs() < 3 { pole_m(x_m) - x_m } else { 6.0 });
            let map_from_base = Pose2::new(x_m, 0.0, 0.0);
            moving.label(&mut points, &Outlook { map_from_base, scans: 1.0, is_reliable: true });
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
        moving.segments.push(segment(0, [false; 2]));
        moving.track_of.push(None);
        moving.update(&Pose2::IDENTITY);
        assert_eq!(moving.tracks.len(), 1);
        moving.expected = Pose2::new(0.3, 0.0, 0.0);
        moving.update(&Pose2::IDENTITY);
        assert!(moving.tracks.is_empty());
    }

    fn segment(first: usize, is_hidden: [bool; 2]) -> Segment {
        Segment { first, last: first + 3, at_m: [1.0, 0.0], half_m: 0.1, is_hidden }
    }

    #[test]
    fn dropped_scans_make_no_step_too_long_to_follow_things() {
        let moving = MovingObjects::new(181);
        let step = Pose2::new(0.42, 0.0, 0.0);
        assert_eq!([1.0, 3.0].map(|scans| moving.loses_sight(&step, scans)), [true, false]);
    }

    #[test]
    fn in_a_crowd_who_is_hidden_by_somebody_hidden_may_move_too() {
        let judged = |from_each_end| {
            let mut moving = MovingObjects::new(181);
            // The third one stands free and hides the second one, which hides the first one.
            let row = [segment(0, [false, true]), segment(4, [false, true]), segment(8, [false; 2])];
            moving.segments.extend(row);
            moving.track_of.resize(3, None);
            moving.judge(from_each_end);
            moving.mobility
        };
        assert_eq!(judged(false)[0], Mobility::Static);
        assert_eq!(judged(true), [Mobility::Unknown; 3]);
    }

    #[test]
    fn what_lies_where_somebody_is_expected_who_is_not_seen_alone_is_taken_for_them() {
        let labeled = |is_reliable| {
            let mut moving = MovingObjects::new(181);
            let placement = Placement::new(&Pose2::IDENTITY);
            let mut walker = Track::new(&segment(0, [false; 2]), &placement);
            for scan in 1..=15 {
                walker.wait(1.0);
                let at_m = [1.0 + 0.2 * scan as f32, 0.0];
                walker.see(&Segment { at_m, ..segment(0, [false; 2]) }, &placement);
            }
            moving.tracks.push(walker);
            (0..20).for_each(|_| moving.crowd.update(20, 181));
            let mut points = seen(90, |_| 4.2);
            let outlook = Outlook { map_from_base: Pose2::IDENTITY, scans: 1.0, is_reliable };
            moving.label(&mut points, &outlook);
            [60, 90].map(|beam: usize| points.as_slice()[beam].mobility)
        };
        assert_eq!(labeled(true), [Mobility::Static, Mobility::Dynamic]);
        assert_eq!(labeled(false), [Mobility::Static; 2]);
    }
}
