//! Whether poses with height and tilt are taken: ground that was seen ahead has to be where the robot drove.
//! Beams that took no part in finding the poses have to be explained better where they tell of slopes: ground
//! ahead, and what was seen from where it slopes. The level rest of the way tells of none, so that a ramp
//! counts the same however far the robot drives on the decks that it joins. And those of either laser may
//! not be explained worse. Else the poses stay, and a flat floor is flat to the bit.
//!
//! The horizontal laser sees where the ground bends up, and next to nothing of where it bends down. A drive
//! that ends on a slope up has therefore as well come down one before, unseen, and ended on the level: its
//! ground is taken as level, and that is said. An inertial unit settles it.

use crate::slam::refinement::spatial::adjustment::{Memory, Problem, Round, Span};
use crate::slam::refinement::spatial::growth::grow;
use crate::slam::refinement::spatial::knots::Knots;
use crate::slam::refinement::spatial::motion::inertial::Inertial;
use crate::slam::refinement::spatial::observability::{Certainty, Observed};
use crate::slam::refinement::spatial::surfaces::Search;
use biplane_geometry::PortableMath;

/// Poses that were found.
#[derive(Clone, Debug)]
pub(crate) struct Refined {
    /// The poses.
    pub knots: Knots,
    /// Whether slopes were found whose place nothing tells: the ground is taken as level.
    pub is_ambiguous: bool,
    /// How surely they are known.
    pub certainty: Certainty,
}

impl Refined {
    /// Which of height, roll and pitch the drive tells.
    pub(crate) fn observed(&self) -> Observed {
        if self.is_ambiguous { Observed::default() } else { self.certainty.observed }
    }

    /// What was done, in a sentence.
    pub(crate) fn words(&self) -> String {
        if self.is_ambiguous {
            return "the ground bends, and nothing tells whether the robot went up or came down: it is \
                    taken as level; height, roll and pitch are not observed"
                .to_owned();
        }
        let Observed { z, roll, pitch } = self.observed();
        let unseen: Vec<&str> = [(z, "height"), (roll, "roll"), (pitch, "pitch")]
            .into_iter()
            .filter_map(|(is_seen, name)| (!is_seen).then_some(name))
            .collect();
        match unseen[..] {
            [] => "poses refined in all six directions".to_owned(),
            _ => format!("poses refined in all six directions; not observed: {}", unseen.join(", ")),
        }
    }
}

/// Poses with height and tilt have to lower the cost of what tells of slopes by this share.
const PAYS: f64 = 0.04;
/// Ground slopes where the base leans by more than this, radians.
const SLOPED_RAD: f64 = 0.0175;
/// Beams of neither laser may cost more than this share of what they did: flat poses of a ramp are torn, and
/// each piece fits its own beams well.
const NOT_WORSE: f64 = 1.05;
/// Nor more than this share where the ground slopes: there flat poses are bent most, to fit what they see.
const NOT_WORSE_SLOPED: f64 = 1.2;
/// And to put so many of the returns from ground ahead onto the ground: people who walk there are not on it.
const ON_THE_GROUND: f64 = 0.6;
/// The last so many seconds tell whether a drive ends level: within this, radians.
const END_S: f64 = 2.0;
const LEVEL_END_RAD: f64 = 0.026;
/// Standard deviations of what nobody knows: a slope of so much may be anywhere; roll follows from it.
const UNKNOWN_PITCH_RAD: f64 = 0.1;
const UNKNOWN_ROLL_RAD: f64 = 0.02;
/// Steps of Gauss and Newton in a round.
const STEPS: usize = 2;
/// Beams on the planes of the others within this, meters.
const JUDGE_GATE_M: f64 = 0.08;
/// Ground seen ahead: from so far off it counts at first, less by this share each round, and at least so far,
/// meters.
const FLOOR_KERNEL_M: f64 = 0.4;
const FLOOR_KERNEL_SHARE: f64 = 0.7;
const FLOOR_KERNEL_MIN_M: f64 = 0.06;

/// Finds and compares; `None` when the poses stay.
pub(crate) fn choose(problem: &Problem<'_>, start: &Knots) -> Option<Refined> {
    let grown = grow(problem, start)?;
    let mut knots = adjusted(problem, &grown)?;
    let judge = round(problem, JUDGE_GATE_M, 0);
    let is_sloped: Vec<bool> =
        knots.states.iter().map(|state| state[3].portable_hypot(state[4]) > SLOPED_RAD).collect();
    let [now, before] = [&knots, start].map(|knots| problem.held_out(knots, &judge, &is_sloped));
    let by = ratio(&now.of_slopes(), &before.of_slopes());
    let is_worse = (0..2).any(|laser| {
        ratio(&now.of_lasers[laser], &before.of_lasers[laser]) > NOT_WORSE
            || ratio(&now.sloped[laser], &before.sloped[laser]) > NOT_WORSE_SLOPED
    });
    // What an inertial unit says of a slope and its sign needs no more than not to be contradicted.
    let is_reported = problem.inertial.is_some_and(Inertial::reports_slope);
    let is_ground = problem.floor.share_on_ground(problem.hits, &knots) >= ON_THE_GROUND;
    let pays = if is_reported { by < 1.0 } else { by <= 1.0 - PAYS && is_ground };
    if !pays || is_worse {
        return None;
    }
    let is_ambiguous = !is_reported && ends_on_a_slope(&knots);
    if is_ambiguous {
        for state in &mut knots.states {
            (state[2], state[3], state[4]) = (0.0, 0.0, 0.0);
        }
    }
    // A ceiling is no level: see `observability`.
    let pieces = Search { in_pieces: true, ..judge.search };
    let mut certainty = Certainty::of(problem, &knots, &Round { search: pieces, ..judge })?;
    if is_ambiguous {
        certainty.forget_tilt(problem.wheels, [UNKNOWN_ROLL_RAD, UNKNOWN_PITCH_RAD]);
    }
    Some(Refined { knots, is_ambiguous, certainty })
}

fn ends_on_a_slope(knots: &Knots) -> bool {
    let count = (END_S / knots.step_s()).round() as usize;
    let last = &knots.states[knots.states.len().saturating_sub(count)..];
    let pitch_rad = last.iter().map(|state| state[4]).sum::<f64>() / last.len().max(1) as f64;
    pitch_rad.abs() > LEVEL_END_RAD
}

/// The cost of beams over that of others, over those that both explain.
fn ratio(costs: &[Option<f64>], others: &[Option<f64>]) -> f64 {
    let (mut sum, mut other_sum) = (0.0, 0.0);
    for (cost, other) in costs.iter().zip(others) {
        if let (Some(cost), Some(other)) = (cost, other) {
            sum += cost;
            other_sum += other;
        }
    }
    sum / f64::max(other_sum, f64::MIN_POSITIVE)
}

/// Rounds with ever closer gates over the whole way.
fn adjusted(problem: &Problem<'_>, start: &Knots) -> Option<Knots> {
    let (mut knots, mut memory) = (start.clone(), Memory::default());
    let span = Span { first: 0, first_free: 0, end: knots.states.len() };
    for (number, &gate_m) in problem.params.gates_m.iter().enumerate() {
        problem.round(&mut knots, span, &round(problem, gate_m, number), &mut memory)?;
    }
    Some(knots)
}

fn round(problem: &Problem<'_>, gate_m: f64, number: usize) -> Round {
    let kernel_m = FLOOR_KERNEL_M * FLOOR_KERNEL_SHARE.powi(number as i32);
    Round {
        search: Search {
            voxel_m: problem.params.voxel_m,
            thickness_m: (0.4 * gate_m).max(0.03),
            angle_rad: (20.0 * gate_m).clamp(2.5, 4.0).to_radians(),
            step_m: (0.6 * gate_m).max(0.03),
            gate_m,
            in_pieces: false,
        },
        steps: STEPS,
        thinning: 1,
        floor_kernel_m: kernel_m.max(FLOOR_KERNEL_MIN_M),
    }
}

#[cfg(test)]
mod tests {
    use super::{ends_on_a_slope, ratio};
    use crate::slam::refinement::spatial::knots::Knots;

    #[test]
    fn costs_are_compared_over_beams_that_both_explain() {
        let (one, other) = ([Some(1.0), None, Some(2.0)], [Some(2.0), Some(9.0), Some(4.0)]);
        assert!((ratio(&one, &other) - 0.5).abs() < 1e-12);
    }

    #[test]
    fn a_drive_that_ends_on_a_slope_is_not_one_that_ends_level() {
        let drive = |pitch_rad: f64| {
            let state = |knot: usize| {
                [0.03 * knot as f64, 0.0, 0.0, 0.0, if knot > 50 { pitch_rad } else { 0.0 }, 0.0]
            };
            Knots { start_ns: 0, step_ns: 100_000_000, states: (0..100).map(state).collect() }
        };
        assert!(ends_on_a_slope(&drive(-0.1)) && !ends_on_a_slope(&drive(-0.005)));
    }
}
