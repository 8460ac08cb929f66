//! Ground that the horizontal laser saw ahead and that the robot drove over later: the strongest absolute
//! word on slopes. On a flat floor there is none.

use std::collections::BTreeMap;

use crate::slam::refinement::spatial::beams::{BeamHit, Laser};
use crate::slam::refinement::spatial::knots::{Attitude, Knots, placed};
use crate::slam::refinement::spatial::normal_equations::{Layout, Row, by_state, robust};
use biplane_geometry::vec3::{dot, minus};

/// So near the track a return is over ground that the robot drives over, meters.
const ASIDE_M: f64 = 0.5;
/// The robot passes there after so much way, meters: nearer returns are the robot's own, and over a longer
/// way the odometry drifts off.
const AHEAD_M: [f64; 2] = [0.4, 10.0];
/// Returns over the later track are no walls up to so far ahead, meters: what is seen along a slope lies far.
const FAR_AHEAD_M: f64 = 40.0;
/// Returns of the same scan this close along the track are the same ground, up to so far aside, meters.
const SAME_WAY_M: f64 = 0.5;
const SAME_WAY_SHARE: f64 = 0.15;
const FAR_ASIDE_M: f64 = 2.5;
/// A scan that sees ground has so many such returns; so many scans make a ramp. Fewer are people.
const IN_A_SCAN: usize = 3;
const SCANS: usize = 8;
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

impl FloorHits {
    /// Sought with the track that the wheels alone tell.
    pub(crate) fn find(hits: &[BeamHit], track: &Knots, way_m: &[f64]) -> Self {
        let cell = |v: f64| (v / ASIDE_M).floor() as i32;
        let mut cells: BTreeMap<[i32; 2], Vec<usize>> = BTreeMap::new();
        for (knot, state) in track.states.iter().enumerate() {
            cells.entry([cell(state[0]), cell(state[1])]).or_default().push(knot);
        }
        // The knot of the track that is nearest to a hit and reached later, within `reach_m`.
        let passed = |hit: &BeamHit, reach_m: f64| {
            let [x, y, _] = placed(&hit.state(track), hit.at());
            let from_m = way_m[hit.knot as usize];
            let reach = (reach_m / ASIDE_M).ceil() as i32;
            let mut best: Option<(f64, usize)> = None;
            for (i, j) in (-reach..=reach).flat_map(|i| (-reach..=reach).map(move |j| (i, j))) {
                for &knot in cells.get(&[cell(x) + i, cell(y) + j]).into_iter().flatten() {
                    let ahead_m = way_m[knot] - from_m;
                    let [kx, ky, ..] = track.states[knot];
                    let away_m = (kx - x).hypot(ky - y);
                    let nearer = best.is_none_or(|(min_m, _)| away_m < min_m);
                    if (AHEAD_M[0]..=FAR_AHEAD_M).contains(&ahead_m) && away_m < reach_m && nearer {
                        best = Some((away_m, knot));
                    }
                }
            }
            best.map(|(_, knot)| knot)
        };
        let mut found = Self { is_ground: vec![false; hits.len()], ..Self::default() };
        let mut of_scans: BTreeMap<u32, Vec<(usize, usize)>> = BTreeMap::new();
        for (number, hit) in hits.iter().enumerate().filter(|(_, hit)| hit.laser == Laser::Horizontal) {
            if let Some(knot) = passed(hit, ASIDE_M) {
                of_scans.entry(hit.scan).or_default().push((number, knot));
            }
        }
        of_scans.retain(|_, list| list.len() >= IN_A_SCAN);
        for (number, hit) in hits.iter().enumerate().filter(|(_, hit)| hit.laser == Laser::Horizontal) {
            let Some(list) = of_scans.get(&hit.scan) else { continue };
            let Some(knot) = passed(hit, FAR_ASIDE_M) else { continue };
            let ahead_m = way_m[knot] - way_m[hit.knot as usize];
            let same_m = SAME_WAY_M.max(SAME_WAY_SHARE * ahead_m);
            let same = |(_, other): &(usize, usize)| (way_m[*other] - way_m[knot]).abs() < same_m;
            found.is_ground[number] = list.iter().any(same);
        }
        let near =
            |(hit, knot): &(usize, usize)| way_m[*knot] - way_m[hits[*hit].knot as usize] <= AHEAD_M[1];
        of_scans.values_mut().for_each(|list| list.retain(near));
        of_scans.retain(|_, list| list.len() >= IN_A_SCAN);
        found.scans = of_scans.len();
        found.list = of_scans.into_values().flatten().map(|(hit, knot)| FloorHit { hit, knot }).collect();
        found.list.sort_unstable_by_key(|found| found.hit);
        found
    }

    /// Whether they are enough to think of a ramp.
    pub(crate) fn are_many(&self) -> bool {
        self.scans >= SCANS
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
        rows: &mut Vec<Row>,
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
            rows.push(Row {
                parts: vec![
                    (layout.flat(seen), flat.map(|v| (1.0 - share) * v)),
                    (layout.tilt(seen), tilt.map(|v| (1.0 - share) * v)),
                    (layout.flat(seen + 1), flat.map(|v| share * v)),
                    (layout.tilt(seen + 1), tilt.map(|v| share * v)),
                    (layout.flat(stood), [-up[0], -up[1], yaw]),
                    (layout.tilt(stood), [-up[2], roll, pitch]),
                ],
                residual,
                weight: robust(residual, kernel_m) / (SIGMA_M * SIGMA_M),
            });
        }
    }
}
