//! The exact edges of openings: jambs, heads and sills.
//!
//! Beside an edge rays end, beyond it they pass: the edge is where the fewest rays contradict that. Where too
//! few came, points on the reveal tell of a jamb.

use super::view::WallView;
use crate::building::elevation::Span;

/// How far from where it is expected an edge is looked for, meters.
const NEAR_M: f64 = 0.25;
/// With fewer rays on either side of an edge they do not tell where it is.
const MIN_RAYS: usize = 12;
/// Fewer points show no reveal.
const MIN_POINTS: usize = 8;
/// A jamb's points lie within this, meters: noise and poses.
const SPREAD_M: f64 = 0.06;
/// How far from where rays begin to end a reveal is looked for, meters.
const REVEAL_NEAR_M: f64 = 0.1;
/// A reveal may lie this far off the border of the rays, meters: beams that an edge splits end on the wall,
/// so that the rays have openings too narrow.
const SLACK_M: f64 = 0.03;
/// The same where one drove through: no frame stands in the way that could be taken for the reveal.
const WALKED_SLACK_M: f64 = 0.05;
/// Largest share of rays that contradict an edge.
const MAX_WRONG: f64 = 0.25;
/// Corners of openings are kept out of what is looked at, meters.
const CORNER_M: f64 = 0.08;

/// From jamb to jamb: `expected` is where rays pass, `under` the soffit over it; `is_driven` where the robot
/// drove through.
pub(crate) fn span(
    view: &WallView<'_>,
    expected: Span,
    under: Option<Span>,
    rows: Span,
    is_driven: bool,
) -> Span {
    let slack_m = if is_driven { WALKED_SLACK_M } else { SLACK_M };
    let rows = [rows[0] + CORNER_M, rows[1] - CORNER_M];
    let found = [0, 1].map(|end| {
        let sign = [-1.0, 1.0][end];
        let mut places = std::iter::once(expected[end]).chain(under.map(|span| span[end]));
        places.find_map(|at_m| edge_m(view, 0, [at_m, sign], rows, slack_m)).unwrap_or(expected[end])
    });
    if found[0] < found[1] { found } else { expected }
}

/// The lower edge of the wall over an opening.
pub(crate) fn head_m(view: &WallView<'_>, span: Span, expected_m: f64) -> f64 {
    edge_m(view, 1, [expected_m, 1.0], [span[0] + CORNER_M, span[1] - CORNER_M], SLACK_M)
        .unwrap_or(expected_m)
}

/// The upper edge of the wall under an opening.
pub(crate) fn sill_m(view: &WallView<'_>, span: Span, expected_m: f64) -> f64 {
    edge_m(view, 1, [expected_m, -1.0], [span[0] + CORNER_M, span[1] - CORNER_M], SLACK_M)
        .unwrap_or(expected_m)
}

/// The place of an edge along an axis (0 along the wall, 1 up), `sign` pointing into the wall: between the
/// last ray that passed and the first that ended, there where the reveal has its points if it has any.
fn edge_m(
    view: &WallView<'_>,
    axis: usize,
    [at_m, sign]: [f64; 2],
    across: Span,
    slack_m: f64,
) -> Option<f64> {
    let between = border_m(view, axis, [at_m, sign], across);
    let reveal = reveal_m(view, axis, between.map_or(at_m, |[a, b]| (a + b) / 2.0), across);
    match (between, reveal) {
        (Some([a, b]), Some(reveal)) if reveal > a.min(b) - slack_m && reveal < a.max(b) + slack_m => {
            Some(reveal)
        }
        (Some([a, b]), _) => Some((a + b) / 2.0),
        (None, reveal) => reveal,
    }
}

/// The places between which rays begin to end.
fn border_m(view: &WallView<'_>, axis: usize, [at_m, sign]: [f64; 2], across: Span) -> Option<Span> {
    let near = view.elevation.rays.iter().filter_map(|(place, beyond_m)| {
        let place = place.map(f64::from);
        let into_m = (place[axis] - at_m) * sign;
        let other = place[1 - axis];
        (into_m.abs() < NEAR_M && other > across[0] && other < across[1])
            .then_some((into_m, beyond_m.is_none()))
    });
    let mut rays: Vec<(f64, bool)> = near.collect();
    rays.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let hits = rays.iter().filter(|(_, is_hit)| *is_hit).count();
    if hits < MIN_RAYS || rays.len() - hits < MIN_RAYS {
        return None;
    }
    // Rays that ended before the edge, and rays that passed beyond it, contradict.
    let (mut wrong, mut min, mut best) = (rays.len() - hits, usize::MAX, (0, 0));
    for (index, (_, is_hit)) in rays.iter().enumerate() {
        if wrong < min {
            (min, best) = (wrong, (index, index));
        } else if wrong == min {
            best.1 = index;
        }
        wrong = if *is_hit { wrong + 1 } else { wrong - 1 };
    }
    let is_clear = (min as f64) < MAX_WRONG * rays.len() as f64 && best.0 > 0;
    is_clear.then(|| [rays[best.0 - 1].0, rays[best.1].0].map(|into_m| at_m + sign * into_m))
}

/// The place along an axis of the densest points between the faces of the wall.
fn reveal_m(view: &WallView<'_>, axis: usize, at_m: f64, across: Span) -> Option<f64> {
    let near = view.elevation.inside_m.iter().map(|p| p.map(f64::from)).filter(|p| {
        (p[axis] - at_m).abs() < REVEAL_NEAR_M && p[1 - axis] > across[0] && p[1 - axis] < across[1]
    });
    let mut places: Vec<f64> = near.map(|p| p[axis]).collect();
    places.sort_by(f64::total_cmp);
    let (mut best, mut from) = ((0, 0), 0);
    for to in 0..places.len() {
        while places[to] - places[from] > SPREAD_M {
            from += 1;
        }
        if to - from > best.1 - best.0 {
            best = (from, to);
        }
    }
    let inside = places.get(best.0..=best.1)?;
    (inside.len() >= MIN_POINTS).then(|| inside[inside.len() / 2])
}
