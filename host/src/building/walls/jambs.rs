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
/// Points this far beside a reveal and more are on what stands in the opening, meters.
const FRAME_BESIDE_M: f64 = 0.05;
/// Points this much before a frame are its noise, meters.
const FRAME_NOISE_M: f64 = 0.03;
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

/// The upper edge of the wall under an opening. The lasers look up to it: no beam ends on top of a sill, and
/// points behind it are of the frame.
pub(crate) fn sill_m(view: &WallView<'_>, span: Span, expected_m: f64) -> f64 {
    edge_m(view, 1, [expected_m, -1.0], [span[0] + CORNER_M, span[1] - CORNER_M], 0.0).unwrap_or(expected_m)
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
    let near_m = between.map_or(at_m, |[a, b]| (a + b) / 2.0);
    let reveal = reveal_m(&view.elevation.inside_m, axis, [near_m, sign], across);
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

/// The place along an axis of the densest points between the faces of the wall, `sign` pointing into it.
/// What stands deeper in the opening, a frame or a pane, goes up to the reveal: it is left out.
fn reveal_m(inside_m: &[[f32; 3]], axis: usize, [at_m, sign]: [f64; 2], across: Span) -> Option<f64> {
    let near = inside_m.iter().map(|p| p.map(f64::from)).filter_map(|p| {
        let into_m = (p[axis] - at_m) * sign;
        let is_near = into_m.abs() < REVEAL_NEAR_M && p[1 - axis] > across[0] && p[1 - axis] < across[1];
        is_near.then_some((into_m, p[2]))
    });
    let mut near: Vec<(f64, f64)> = near.collect();
    near.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let frame_m = frame_depth_m(&near);
    let places: Vec<f64> = near.iter().filter(|(_, depth_m)| *depth_m < frame_m).map(|p| p.0).collect();
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
    (inside.len() >= MIN_POINTS).then(|| at_m + sign * inside[inside.len() / 2])
}

/// How deep in the wall something closes the opening beside a reveal, less what noise takes: of places into
/// the wall and depths.
fn frame_depth_m(near: &[(f64, f64)]) -> f64 {
    let beside = near.iter().filter(|(into_m, _)| *into_m < -FRAME_BESIDE_M);
    let mut depths: Vec<f64> = beside.map(|(_, depth_m)| *depth_m).collect();
    depths.sort_by(f64::total_cmp);
    if depths.len() < MIN_POINTS { f64::INFINITY } else { depths[depths.len() / 10] - FRAME_NOISE_M }
}

#[cfg(test)]
mod tests {
    use super::reveal_m;

    /// A wall from 2 m on, whose reveal of 16 cm ends at a frame of 8 cm, with a pane beside it.
    fn inside() -> Vec<[f32; 3]> {
        let reveal = (0..12).map(|deep| [2.0, 1.5, 0.02 + 0.01 * deep as f32]);
        let frame = (0..80).map(|at| [1.999 - 0.001 * at as f32, 1.5, 0.16]);
        let pane = (0..60).map(|at| [1.92 - 0.002 * at as f32, 1.5, 0.2]);
        reveal.chain(frame).chain(pane).collect()
    }

    #[test]
    fn a_frame_in_the_opening_is_not_its_reveal() {
        let found = reveal_m(&inside(), 0, [1.98, 1.0], [1.0, 2.0]).unwrap();
        assert!((found - 2.0).abs() < 0.005, "{found}");
        let frame_alone: Vec<[f32; 3]> = inside().split_off(12);
        assert_eq!(reveal_m(&frame_alone, 0, [1.98, 1.0], [1.0, 2.0]), None);
    }
}
