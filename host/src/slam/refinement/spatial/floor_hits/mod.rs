//! Ground that the horizontal laser saw ahead and that the robot drove over later: the strongest absolute
//! word on slopes. On a flat floor there is none.
//!
//! Not all that stands beside the later track is ground: a robot drives through doors, close to their
//! frames. Ground is a line right across the way, and nothing is seen through it.

mod passing;

use biplane_geometry::PortableMath;
use std::collections::BTreeMap;

use crate::slam::refinement::spatial::beams::{BeamHit, Laser};
use crate::slam::refinement::spatial::floor_hits::passing::{AHEAD_M, ASIDE_M, FAR_ASIDE_M, Passed, Passing};
use crate::slam::refinement::spatial::knots::{Attitude, Knots};
use crate::slam::refinement::spatial::normal_equations::rows::Rows;
use crate::slam::refinement::spatial::normal_equations::{Layout, by_state, robust};
use biplane_geometry::vec3::{dot, minus};

/// Returns of the same scan this close along the track are the same ground, up to [`FAR_ASIDE_M`] aside,
/// meters.
const SAME_WAY_M: f64 = 0.5;
const SAME_WAY_SHARE: f64 = 0.15;
/// A scan that sees ground has so many such returns; so many scans make a ramp. Fewer are people.
const IN_A_SCAN: usize = 3;
const SCANS: usize = 8;
/// And so many by poses that the ramp has torn.
const SCANS_OF_TORN_POSES: usize = 4;
/// Poses are dragged along by what is in front where they go less far than the wheels counted by this, meters
/// and a share of the way. Wheels slip and are off by a few percent.
const DRAGGED_M: f64 = 0.2;
const DRAGGED_SHARE: f64 = 0.15;
/// Ground that bends up is a line across the way, without gaps wider than this, meters. Door frames, cabinets
/// and walls beside the way leave the way itself free.
const GAP_M: f64 = 0.3;
/// Nothing is seen through it: so many beams at most, between those that met it, met something else.
const SEE_THROUGH_SHARE: f64 = 0.1;
/// Standard deviation, meters.
const SIGMA_M: f64 = 0.02;

/// A return, and the knot at which the robot passed it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct FloorHit {
    /// Number of the beam's hit.
    pub hit: usize,
    /// The later knot.
    pub knot: usize,
}

/// See the module's text.
#[derive(Clone, Debug, Default)]
pub(crate) struct FloorHits {
    /// In the order of beams.
    pub list: Vec<FloorHit>,
    /// For each beam whether it may have met such ground, also beside the track: it is no wall.
    pub is_ground: Vec<bool>,
    /// Scans that saw ground ahead.
    pub scans: usize,
}

/// The returns of each scan over the later track that are a line across it, in the order of beams.
fn across(hits: &[BeamHit], passing: &Passing<'_>) -> BTreeMap<u32, Vec<(usize, Passed)>> {
    let mut of_scans: BTreeMap<u32, Vec<(usize, Option<Passed>)>> = BTreeMap::new();
    for (number, hit) in hits.iter().enumerate().filter(|(_, hit)| hit.laser == Laser::Horizontal) {
        of_scans.entry(hit.scan).or_default().push((number, passing.of(hit, ASIDE_M)));
    }
    of_scans.into_iter().filter_map(|(scan, all)| Some((scan, line(&all)?))).collect()
}

/// The returns of a scan that passes over the track, where they are a line across it.
fn line(all: &[(usize, Option<Passed>)]) -> Option<Vec<(usize, Passed)>> {
    let first = all.iter().position(|(_, passed)| passed.is_some())?;
    let last = all.iter().rposition(|(_, passed)| passed.is_some())?;
    let list: Vec<(usize, Passed)> =
        all[first..=last].iter().filter_map(|&(hit, passed)| Some((hit, passed?))).collect();
    let through = (last + 1 - first - list.len()) as f64;
    let is_line = list.len() >= IN_A_SCAN
        && through <= SEE_THROUGH_SHARE * (last + 1 - first) as f64
        && widest_gap_m(&list, &[]) <= GAP_M;
    is_line.then_some(list)
}

/// Leaves of a line what lies near ahead; whether that is ground, from one side of the track to the other.
fn is_near(list: &mut Vec<(usize, Passed)>, ahead_m: impl Fn(usize, usize) -> f64) -> bool {
    list.retain(|(hit, passed)| ahead_m(*hit, passed.knot) <= AHEAD_M[1]);
    list.len() >= IN_A_SCAN && widest_gap_m(list, &[-ASIDE_M, ASIDE_M]) <= GAP_M
}

/// The widest stretch across the way that no return lies in, between returns and some edges, meters.
fn widest_gap_m(list: &[(usize, Passed)], edges_m: &[f64]) -> f64 {
    let mut left_m: Vec<f64> =
        list.iter().map(|(_, passed)| passed.left_m).chain(edges_m.iter().copied()).collect();
    left_m.sort_by(f64::total_cmp);
    left_m.windows(2).map(|pair| pair[1] - pair[0]).fold(0.0, f64::max)
}

impl FloorHits {
    /// Sought with a track: that of the wheels alone, or that of the poses so far.
    pub(crate) fn find(hits: &[BeamHit], track: &Knots, way_m: &[f64]) -> Self {
        let passing = Passing::new(track, way_m);
        let of_scans = across(hits, &passing);
        let ahead_m = |hit: usize, knot: usize| way_m[knot] - way_m[hits[hit].knot as usize];
        let mut found = Self { is_ground: vec![false; hits.len()], ..Self::default() };
        for (number, hit) in hits.iter().enumerate().filter(|(_, hit)| hit.laser == Laser::Horizontal) {
            let Some(list) = of_scans.get(&hit.scan) else { continue };
            let Some(passed) = passing.of(hit, FAR_ASIDE_M) else { continue };
            let same_m = SAME_WAY_M.max(SAME_WAY_SHARE * ahead_m(number, passed.knot));
            let same = |other: &(usize, Passed)| (way_m[other.1.knot] - way_m[passed.knot]).abs() < same_m;
            found.is_ground[number] = list.iter().any(same);
        }
        for mut list in of_scans.into_values() {
            if is_near(&mut list, ahead_m) {
                found.scans += 1;
                found.list.extend(list.into_iter().map(|(hit, Passed { knot, .. })| FloorHit { hit, knot }));
            }
        }
        found.list.sort_unstable_by_key(|found| found.hit);
        found
    }

    /// What [`FloorHits::are_many`] tells of what [`FloorHits::find`] finds, from the horizontal
    /// laser's scans one after the other.
    pub(crate) fn are_in_many(
        scans: impl Iterator<Item = Vec<BeamHit>>,
        track: &Knots,
        way_m: &[f64],
    ) -> bool {
        let passing = Passing::new(track, way_m);
        let sees_ground = |mut hits: Vec<BeamHit>| {
            hits.sort_by_key(|hit| hit.knot);
            let passed = hits.iter().map(|hit| passing.of(hit, ASIDE_M)).enumerate();
            let list = line(&passed.collect::<Vec<_>>());
            let ahead_m = |hit: usize, knot: usize| way_m[knot] - way_m[hits[hit].knot as usize];
            list.is_some_and(|mut list| is_near(&mut list, ahead_m))
        };
        scans.filter_map(|hits| sees_ground(hits).then_some(())).nth(SCANS - 1).is_some()
    }

    /// None.
    pub(crate) fn none(hits: &[BeamHit]) -> Self {
        Self { is_ground: vec![false; hits.len()], ..Self::default() }
    }

    /// Whether they are enough to think of a ramp.
    pub(crate) fn are_many(&self) -> bool {
        self.scans >= SCANS
    }

    /// Whether those found with matched poses agree.
    pub(crate) fn agree(&self) -> bool {
        self.scans >= SCANS_OF_TORN_POSES
    }

    /// Whether poses were dragged along by most of them: from where ground was seen to where the robot stood
    /// on it they go less far than the wheels' track does. A ramp ahead is a line that keeps its distance.
    /// Poses that it drags for meters know nothing of ground that was driven over.
    pub(crate) fn have_dragged(&self, hits: &[BeamHit], poses: &Knots, wheels: &Knots) -> bool {
        let far_m = |knots: &Knots, from: usize, to: usize| {
            let (from, to) = (&knots.states[from], &knots.states[to]);
            (to[0] - from[0]).portable_hypot(to[1] - from[1])
        };
        let is_dragged = |floor: &&FloorHit| {
            let seen = hits[floor.hit].knot as usize;
            let counted_m = far_m(wheels, seen, floor.knot);
            far_m(poses, seen, floor.knot) < (1.0 - DRAGGED_SHARE) * counted_m - DRAGGED_M
        };
        2 * self.list.iter().filter(is_dragged).count() > self.list.len()
    }

    /// How far the hits that were held out are off the ground, squared, in standard deviations.
    pub(crate) fn held_out(&self, hits: &[BeamHit], knots: &Knots) -> impl Iterator<Item = f64> {
        self.list.iter().filter(|floor| hits[floor.hit].is_held_out).map(|floor| {
            let place = hits[floor.hit].placed(knots);
            let base = &knots.states[floor.knot];
            let matrix = Attitude::of(base).matrix;
            let up = std::array::from_fn(|axis| matrix[axis][2]);
            (dot(up, minus(place, [base[0], base[1], base[2]])) / SIGMA_M).powi(2)
        })
    }

    /// The share of them that is on the ground, for poses as they are.
    pub(crate) fn share_on_ground(&self, hits: &[BeamHit], knots: &Knots) -> f64 {
        let squared: Vec<f64> = self.held_out(hits, knots).collect();
        squared.iter().filter(|squared| **squared < 9.0).count() as f64 / squared.len().max(1) as f64
    }

    /// What those whose both knots are among `first..first + layout.knots` say: a return lies on the ground
    /// that the robot stood on when it passed. Those farther off than `kernel_m` say little.
    pub(crate) fn rows(
        &self,
        hits: &[BeamHit],
        knots: &Knots,
        first: usize,
        layout: Layout,
        kernel_m: f64,
        rows: &mut Rows,
    ) {
        for floor in &self.list {
            let hit = &hits[floor.hit];
            let (seen, stood) = (hit.knot as usize, floor.knot);
            if seen < first || stood >= first + layout.knots || hit.is_held_out {
                continue;
            }
            let state = hit.state(knots);
            let (attitude, ground) = (Attitude::of(&state), Attitude::of(&knots.states[stood]));
            let turned = attitude.rotate(hit.at());
            let base = &knots.states[stood];
            let place: [f64; 3] = std::array::from_fn(|axis| turned[axis] + state[axis]);
            let away = minus(place, [base[0], base[1], base[2]]);
            let up = std::array::from_fn(|axis| ground.matrix[axis][2]);
            let residual = dot(up, away);
            let [flat, tilt] = by_state(&attitude, turned, up);
            let [roll, pitch, yaw] = ground.derivatives(up).map(|moved| dot(moved, away));
            let share = f64::from(hit.share);
            let (seen, stood) = (seen - first, stood - first);
            let parts = [
                (layout.flat(seen), flat.map(|v| (1.0 - share) * v)),
                (layout.tilt(seen), tilt.map(|v| (1.0 - share) * v)),
                (layout.flat(seen + 1), flat.map(|v| share * v)),
                (layout.tilt(seen + 1), tilt.map(|v| share * v)),
                (layout.flat(stood), [-up[0], -up[1], yaw]),
                (layout.tilt(stood), [-up[2], roll, pitch]),
            ];
            rows.push(&parts, residual, robust(residual, kernel_m) / (SIGMA_M * SIGMA_M));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::FloorHits;
    use crate::slam::refinement::spatial::beams::{BeamHit, Laser};
    use crate::slam::refinement::spatial::knots::Knots;

    /// A drive straight ahead, so far from knot to knot.
    fn straight(step_m: f64) -> Knots {
        let states = (0..100).map(|knot| [step_m * f64::from(knot), 0.0, 0.0, 0.0, 0.0, 0.0]).collect();
        Knots { start_ns: 0, step_ns: 100_000_000, states }
    }

    /// What is seen of a place from a knot of a drive with 10 cm from knot to knot.
    fn hit(knot: u32, [x, y]: [f64; 2]) -> BeamHit {
        let at_m = [(x - 0.1 * f64::from(knot)) as f32, y as f32, 0.2];
        let (along, laser) = ([1.0, 0.0, 0.0], Laser::Horizontal);
        BeamHit { at_m, along, knot, share: 0.0, scan: knot, laser, is_held_out: false }
    }

    /// A drive straight ahead, 10 cm from knot to knot, that sees places (x, y) from each of ten knots.
    fn found(places_m: &[[f64; 2]]) -> FloorHits {
        let track = straight(0.1);
        let way_m: Vec<f64> = (0..100).map(|knot| 0.1 * f64::from(knot)).collect();
        let hits: Vec<BeamHit> =
            (0..10).flat_map(|knot| places_m.iter().map(move |&at| hit(knot, at))).collect();
        let found = FloorHits::find(&hits, &track, &way_m);
        let scans = hits.chunks(places_m.len()).map(<[BeamHit]>::to_vec);
        assert_eq!(FloorHits::are_in_many(scans, &track, &way_m), found.are_many(), "scan by scan");
        found
    }

    /// Places on a line across the way at x, from right to left.
    fn line(x: f64, y: std::ops::RangeInclusive<i32>) -> Vec<[f64; 2]> {
        y.map(|tenth| [x, 0.1 * f64::from(tenth)]).collect()
    }

    #[test]
    fn a_line_across_the_way_is_ground() {
        let found = found(&line(5.0, -10..=10));
        assert!(found.are_many() && found.scans == 10, "{}", found.scans);
        assert!(found.is_ground.iter().all(|is_ground| *is_ground));
    }

    #[test]
    fn frames_of_a_door_and_what_stands_aside_are_no_ground() {
        // Through the door a wall beyond the end of the way is seen.
        let frames = [line(5.0, -10..=-4), line(14.0, -3..=3), line(5.0, 4..=10)].concat();
        let nothing_behind = [line(5.0, -10..=-4), line(5.0, 4..=10)].concat();
        let wall = (30..60).map(|tenth| [0.1 * f64::from(tenth), 0.4]).collect();
        for places_m in [frames, nothing_behind, line(5.0, 2..=9), wall] {
            let found = found(&places_m);
            assert!(found.list.is_empty() && found.scans == 0, "{places_m:?}");
        }
    }

    #[test]
    fn poses_that_stay_back_by_meters_were_dragged_and_odometry_that_counts_too_much_drags_none() {
        let floor = FloorHits { list: vec![super::FloorHit { hit: 0, knot: 50 }], ..FloorHits::default() };
        let is_dragged =
            |step_m| floor.have_dragged(&[hit(0, [5.0, 0.0])], &straight(step_m), &straight(0.1));
        assert_eq!([0.0, 0.05, 0.085, 0.1, 0.15].map(is_dragged), [true, true, false, false, false]);
    }

    #[test]
    fn legs_before_a_wall_that_is_seen_between_them_are_no_ground() {
        let legs = [[4.0, -0.2], [8.0, -0.9], [8.0, -0.8], [4.0, 0.0], [8.0, 0.8], [8.0, 0.9], [4.0, 0.2]];
        assert_eq!(found(&legs).scans, 0);
    }
}
