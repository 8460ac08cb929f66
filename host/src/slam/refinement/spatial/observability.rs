//! How surely each pose is known, and which directions the drive tells at all.
//!
//! A ceiling says nothing of height unless it is known to be level: for these figures near-level planes are
//! cut into pieces of the way. A direction counts as observed where the beams make it clearly surer than
//! wheels and a level start alone.

use serde::Serialize;

use crate::slam::refinement::spatial::adjustment::{Problem, Round, Span};
use crate::slam::refinement::spatial::knots::Knots;
use crate::slam::refinement::spatial::motion::wheels::Wheels;

/// Poses whose covariances are computed, evenly over the way: they change slowly, and between two of them
/// they are interpolated.
const SAMPLES: usize = 48;
/// Beams halve the standard deviation that wheels alone leave.
const CLEARLY: f64 = 0.5;
/// Of so many of the poses.
const SHARE: f64 = 0.9;

/// Change of pitch from knot to knot, and pitch of grounds in general, radians: any floor, nothing assumed.
const FREE_BEND_RAD: f64 = 0.004;
const FREE_LEVEL_RAD: f64 = 0.2;

/// What beams that share an error (frames that stand out of their wall, seen again and again) add to the
/// standard deviations of x, y, z, roll, pitch and heading: found on 21 simulated drives over ramps, with and
/// without an inertial unit (`docs/sixdof.md`).
const SHARED_ERRORS: [f64; 6] = [2.1, 1.9, 1.6, 1.5, 1.5, 2.2];

/// Covariance of (x, y, z, roll, pitch, heading), meters and radians.
pub(crate) type Covariance = [[f64; 6]; 6];

/// Which directions the drive tells beside x, y and heading.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub(crate) struct Observed {
    /// Height.
    pub z: bool,
    /// Tilt to the side.
    pub roll: bool,
    /// Tilt ahead.
    pub pitch: bool,
}

/// Covariances along the way.
#[derive(Clone, Debug, Default)]
pub(crate) struct Certainty {
    /// Stamps, nanoseconds, ascending, with the covariance there.
    pub samples: Vec<(i64, Covariance)>,
    pub observed: Observed,
}

impl Certainty {
    /// Of poses that were found; `None` when the system tells nothing.
    pub(crate) fn of(problem: &Problem<'_>, knots: &Knots, round: &Round) -> Option<Self> {
        let last = knots.states.len() - 1;
        let at: Vec<usize> = (0..=SAMPLES).map(|number| number * last / SAMPLES).collect();
        let span = Span { first: 0, first_free: 0, end: knots.states.len() };
        // That floors are level and bend rarely is an assumption that no sigma may rest on.
        let mut params = problem.params.clone();
        (params.motion.bend_rad, params.motion.level_rad) = (FREE_BEND_RAD, FREE_LEVEL_RAD);
        let problem = &problem.with_params(&params);
        let known = problem.covariances(knots, span, round, &at)?;
        let alone = problem.without_beams().covariances(knots, span, round, &at)?;
        let is_clear = |part: usize| {
            let clear = known.iter().zip(&alone).skip(1);
            let count = clear
                .filter(|(known, alone)| known[part][part].sqrt() < CLEARLY * alone[part][part].sqrt())
                .count();
            count as f64 >= SHARE * SAMPLES as f64
        };
        let observed = Observed { z: is_clear(2), roll: is_clear(3), pitch: is_clear(4) };
        let widened = |covariance: &Covariance| -> Covariance {
            std::array::from_fn(|row| {
                std::array::from_fn(|column| {
                    covariance[row][column] * SHARED_ERRORS[row] * SHARED_ERRORS[column]
                })
            })
        };
        let known = known.iter().map(widened);
        let stamp_ns = |knot: &usize| knots.start_ns + *knot as i64 * knots.step_ns;
        Some(Self { samples: at.iter().map(stamp_ns).zip(known).collect(), observed })
    }

    /// Makes height, roll and pitch unknown: nothing is observed of them.
    pub(crate) fn forget_tilt(&mut self, wheels: &Wheels, [roll_rad, pitch_rad]: [f64; 2]) {
        self.observed = Observed::default();
        let way_m = wheels.way_m();
        let last = self.samples.len().max(2) - 1;
        for (number, (_, covariance)) in self.samples.iter_mut().enumerate() {
            let height_m = pitch_rad * way_m[number * (way_m.len() - 1) / last];
            for (part, sigma) in [(2, height_m), (3, roll_rad), (4, pitch_rad)] {
                covariance[part] = [0.0; 6];
                (0..6).for_each(|other| covariance[other][part] = 0.0);
                covariance[part][part] = sigma * sigma;
            }
        }
    }

    /// The covariance at a time, linear between samples.
    pub(crate) fn at(&self, stamp_ns: i64) -> Option<Covariance> {
        let after = self.samples.partition_point(|(at_ns, _)| *at_ns < stamp_ns);
        let before = after.checked_sub(1).map(|at| &self.samples[at]);
        match (before, self.samples.get(after)) {
            (Some((from_ns, from)), Some((to_ns, to))) => {
                let share = (stamp_ns - from_ns) as f64 / (to_ns - from_ns) as f64;
                let mix =
                    |row: usize, column: usize| (1.0 - share) * from[row][column] + share * to[row][column];
                Some(std::array::from_fn(|row| std::array::from_fn(|column| mix(row, column))))
            }
            (Some((_, only)), None) | (None, Some((_, only))) => Some(*only),
            (None, None) => None,
        }
    }
}
