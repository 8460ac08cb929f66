//! Where the robot drives past a place after it was seen.

use biplane_geometry::PortableMath;

use crate::slam::keyframes::cell_index::CellIndex;
use crate::slam::refinement::spatial::beams::BeamHit;
use crate::slam::refinement::spatial::knots::{Knots, placed};

/// So near the track a return is over ground that the robot drives over, meters.
pub(super) const ASIDE_M: f64 = 0.5;
/// The robot passes there after so much way, meters: nearer returns are the robot's own, and over a longer
/// way the odometry drifts off.
pub(super) const AHEAD_M: [f64; 2] = [0.4, 10.0];
/// Returns over the later track are no walls up to so far ahead, meters: what is seen along a slope lies far.
const FAR_AHEAD_M: f64 = 40.0;
/// Farther aside of the track nothing is looked for, meters.
pub(super) const FAR_ASIDE_M: f64 = 2.5;
/// Of the track a place every so often is looked at, meters: where the robot stands or turns, one is enough.
const TRACK_STEP_M: f64 = 0.02;

/// Where the robot passed a return.
#[derive(Clone, Copy, Debug)]
pub(super) struct Passed {
    pub knot: usize,
    /// How far to the left of the track the return is, meters.
    pub left_m: f64,
}

/// Which part of a track passes a place later.
///
/// However long the robot stands somewhere and however often it comes back, a place is compared with few
/// knots: those a step apart on the way that the robot has before it.
pub(super) struct Passing<'a> {
    track: &'a Knots,
    way_m: &'a [f64],
    /// Cell by cell, ascending in each.
    places: Vec<Place>,
    cells: CellIndex,
    /// Cells around one, nearest first.
    steps: Vec<[i32; 2]>,
}

/// A place of the track, with what is asked of it for every beam: the track itself is spread over memory.
#[derive(Clone, Copy)]
struct Place {
    /// The way to it, meters.
    way_m: f64,
    at_m: [f64; 2],
    knot: usize,
}

impl<'a> Passing<'a> {
    pub(super) fn new(track: &'a Knots, way_m: &'a [f64]) -> Self {
        let mut places = Vec::new();
        let mut last_m = f64::NEG_INFINITY;
        for (knot, state) in track.states.iter().enumerate() {
            if way_m[knot] - last_m < TRACK_STEP_M {
                continue;
            }
            last_m = way_m[knot];
            places.push(Place { way_m: last_m, at_m: [state[0], state[1]], knot });
        }
        let cells = CellIndex::new(places.iter().map(|place| place.at_m.map(Self::cell)));
        let places = cells.numbers().iter().map(|&number| places[number as usize]).collect();
        Self { track, way_m, places, cells, steps: steps((FAR_ASIDE_M / ASIDE_M).ceil() as i32) }
    }

    fn cell(at_m: f64) -> i32 {
        (at_m / ASIDE_M).floor_to_i32()
    }

    /// The places of a cell that the robot reaches within the way that counts.
    fn later(&self, cell: [i32; 2], from_m: f64) -> &[Place] {
        let places = &self.places[self.cells.find(cell)];
        let before = |limit_m: f64| places.partition_point(|place| place.way_m - from_m < limit_m);
        &places[before(AHEAD_M[0])..before(FAR_AHEAD_M)]
    }

    /// The knot of the track that is nearest to a hit and reached later, within `reach_m`, at most
    /// [`FAR_ASIDE_M`].
    pub(super) fn of(&self, hit: &BeamHit, reach_m: f64) -> Option<Passed> {
        let [x, y, _] = placed(&hit.state(self.track), hit.at());
        let from_m = self.way_m[hit.knot as usize];
        let (reach, home) = ((reach_m / ASIDE_M).ceil() as i32, [x, y].map(Self::cell));
        let mut limit_m2 = reach_m * reach_m;
        let mut best: Option<([i32; 2], usize)> = None;
        for &step in self.steps.iter().take_while(|step| square(**step) <= 2 * reach * reach) {
            if step.iter().any(|step| step.abs() > reach) || cell_off_m2([x, y], home, step) > limit_m2 {
                continue;
            }
            let cell = [0, 1].map(|axis| home[axis].saturating_add(step[axis]));
            for Place { at_m: [px, py], knot, .. } in self.later(cell, from_m) {
                let away_m2 = (px - x).powi(2) + (py - y).powi(2);
                // Of those as far, it is the first in the order of cells.
                let is_before = || best.is_some_and(|(known, _)| step < known);
                if away_m2 < limit_m2 || (away_m2 == limit_m2 && is_before()) {
                    limit_m2 = away_m2;
                    best = Some((step, *knot));
                }
            }
        }
        let (_, knot) = best?;
        let [kx, ky, .., yaw] = self.track.states[knot];
        let (sin, cos) = yaw.portable_sin_cos();
        Some(Passed { knot, left_m: cos * (y - ky) - sin * (x - kx) })
    }
}

/// Steps from a cell to those around it, up to so many each way, nearest first.
fn steps(reach: i32) -> Vec<[i32; 2]> {
    let mut steps: Vec<[i32; 2]> =
        (-reach..=reach).flat_map(|i| (-reach..=reach).map(move |j| [i, j])).collect();
    steps.sort_by_key(|step| square(*step));
    steps
}

fn square([i, j]: [i32; 2]) -> i32 {
    i * i + j * j
}

/// The squared distance of a place from a cell so many cells on from its own, at least.
fn cell_off_m2(at_m: [f64; 2], home: [i32; 2], step: [i32; 2]) -> f64 {
    /// Cells are as exact as this, meters.
    const ROUNDED_M: f64 = 1e-6;
    let off_m = |axis: usize| {
        let cell_m = f64::from(home[axis].saturating_add(step[axis])) * ASIDE_M;
        let off_m = match step[axis] {
            0 => 0.0,
            1.. => cell_m - at_m[axis],
            _ => at_m[axis] - cell_m - ASIDE_M,
        };
        f64::max(off_m - ROUNDED_M, 0.0)
    };
    off_m(0).powi(2) + off_m(1).powi(2)
}

#[cfg(test)]
mod tests {
    use super::Passing;
    use crate::slam::refinement::spatial::knots::Knots;

    #[test]
    fn a_place_is_compared_with_few_knots_however_long_the_robot_stays_or_comes_back() {
        // Ten seconds there, an hour of standing, and a hundred laps of 8 m.
        let there = (0..100).map(|knot| 0.02 * f64::from(knot));
        let laps = (0..100 * 400).map(|knot| 2.0 + 0.02 * f64::from(knot));
        let way_m: Vec<f64> = there.chain(std::iter::repeat_n(2.0, 36_000)).chain(laps).collect();
        let state = |way_m: &f64| [(way_m % 8.0 - 4.0).abs(), 0.0, 0.0, 0.0, 0.0, 0.0];
        let states = way_m.iter().map(state).collect();
        let track = Knots { start_ns: 0, step_ns: 100_000_000, states };
        let passing = Passing::new(&track, &way_m);
        let max = (0..9).map(|x| passing.later([x, 0], 0.0).len()).max();
        assert!(max.is_some_and(|max| max > 10 && max < 300), "{max:?}");
    }
}
