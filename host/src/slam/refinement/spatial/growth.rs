//! Poses grown from the start, second by second: what was found so far is kept, the new second is reckoned by
//! the wheels with the last tilt, or what an inertial unit makes of it, and the last seconds are adjusted.
//!
//! From flat poses all at once a ramp under a parallel ceiling stays flat: the ceiling fits as well so.

use crate::slam::refinement::spatial::adjustment::{Memory, Problem, Round, Span};
use crate::slam::refinement::spatial::knots::Knots;
use crate::slam::refinement::spatial::surfaces::Search;

/// So much is new in each round, so much moves, and so much before it only tells where its planes are,
/// seconds.
const NEW_S: f64 = 1.0;
const MOVING_S: f64 = 15.0;
const FIXED_S: f64 = 10.0;
/// One of so many beams.
const THINNING: usize = 3;
/// Ground seen ahead may be so far off, meters: the new second's error of height, and of what it saw ahead.
const FLOOR_KERNEL_M: f64 = 0.5;

/// Grows the poses; `None` when some system tells nothing.
pub(crate) fn grow(problem: &Problem<'_>, start: &Knots) -> Option<Knots> {
    let mut knots = start.clone();
    let count = |seconds: f64| (seconds / knots.step_s()).round() as usize;
    let (new, moving, fixed) = (count(NEW_S).max(1), count(MOVING_S), count(FIXED_S));
    let all = knots.states.len();
    let mut memory = Memory::default();
    let mut end = 1;
    while end < all {
        let next = (end + new).min(all);
        for knot in end..next {
            knots.states[knot] = problem.reckoned(&knots.states[knot - 1], knot - 1);
        }
        end = next;
        let first_free = end.saturating_sub(moving);
        let span = Span { first: first_free.saturating_sub(fixed), first_free, end };
        if end < 2 * new {
            continue;
        }
        problem.round(&mut knots, span, &round(problem), &mut memory)?;
    }
    Some(knots)
}

fn round(problem: &Problem<'_>) -> Round {
    Round {
        search: Search {
            voxel_m: problem.params.voxel_m,
            thickness_m: 0.05,
            angle_rad: 4.0_f64.to_radians(),
            step_m: 0.06,
            gate_m: 0.12,
            in_pieces: true,
        },
        steps: 2,
        thinning: THINNING,
        floor_kernel_m: FLOOR_KERNEL_M,
    }
}
