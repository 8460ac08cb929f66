//! Corners that nearly turn back are no corners of a building: where a few points were missed or seen beside
//! an edge, a border runs out to a tip and back again.
//!
//! Small tips are taken off whole, those of large surfaces where they get too thin to be one. Plane
//! coordinates in whole steps ([`crate::reconstruct::polygons::plane_frame`]).

use super::line::Line;
use super::union::Ring;
use crate::reconstruct::polygons::plane_frame::{FlatPoint, STEP_M};
use biplane_geometry::PortableMath;

/// A corner is a spike when the way turns by more than 120 degrees there (cosine of the turn). A little less
/// is asked for, because welding and rounding turn edges a little.
const SPIKE_COSINE: f64 = -0.46;
/// A surface that is narrower than this is none that the points can tell, meters.
const THIN_M: f64 = 0.05;
/// A tip may go as a whole when it stands out by no more than this, meters: as uncertain borders may become
/// between far points.
const MAX_HEIGHT_M: f64 = 0.1;
/// A tip may go as a whole when it has no more area than this, square meters.
const MAX_AREA_M2: f64 = 0.02;
/// Of a tip with one side so much shorter than the other only the part beyond the shorter one goes: the
/// longer one is an edge that keeps its line.
const UNEQUAL: f64 = 0.5;
/// New corners are not made closer to old ones than this, meters.
const NEAR_M: f64 = 0.01;
/// So many changes a corner at most: each makes a ring simpler, and none goes on for ever.
const CHANGES_PER_CORNER: usize = 3;

type Point = [f64; 2];

/// A ring without spikes; empty when nothing is left.
pub(crate) fn without_spikes(ring: &[FlatPoint]) -> Ring {
    let mut points: Vec<Point> = ring.iter().map(|p| [f64::from(p.x), f64::from(p.y)]).collect();
    let mut at = 0;
    let mut unchanged = 0;
    let mut changes = CHANGES_PER_CORNER * points.len();
    while points.len() >= 3 && unchanged < points.len() && changes > 0 {
        at %= points.len();
        if take_off(&mut points, at) {
            // What is before and behind it has changed too.
            at = (at + points.len() - 1) % points.len();
            (unchanged, changes) = (0, changes - 1);
        } else {
            (at, unchanged) = (at + 1, unchanged + 1);
        }
    }
    if points.len() < 3 {
        return Ring::new();
    }
    let mut out: Ring =
        points.iter().map(|p| FlatPoint::new(p[0].round() as i32, p[1].round() as i32)).collect();
    out.dedup();
    while out.len() > 1 && out.first() == out.last() {
        out.pop();
    }
    out
}

/// Changes the corner at an index if it is a spike; says whether it did.
fn take_off(points: &mut Vec<Point>, at: usize) -> bool {
    let count = points.len();
    let (before, after) = ((at + count - 1) % count, (at + 1) % count);
    let [a, b, c] = [points[before], points[at], points[after]];
    let (first, second) = (distance(a, b), distance(b, c));
    if first < 1.0 || second < 1.0 {
        points.remove(at);
        return true;
    }
    let [u, v] =
        [[(b[0] - a[0]) / first, (b[1] - a[1]) / first], [(c[0] - b[0]) / second, (c[1] - b[1]) / second]];
    let cosine = u[0] * v[0] + u[1] * v[1];
    if cosine >= SPIKE_COSINE {
        return false;
    }
    let (short, long) = (first.min(second), first.max(second));
    let sine = (u[0] * v[1] - u[1] * v[0]).abs();
    let near = NEAR_M / STEP_M;
    if short <= UNEQUAL * long && 0.5 * short * short * sine * -cosine <= MAX_AREA_M2 / (STEP_M * STEP_M) {
        // Off with what is beyond the end of the shorter side; the longer one ends square with it.
        let foot = if first < second { Line::through(b, c).foot(a) } else { Line::through(a, b).foot(c) };
        points[at] = foot;
        return true;
    }
    let height = Line::through(a, c).off(b).abs();
    if height <= MAX_HEIGHT_M / STEP_M && 0.5 * height * distance(a, c) <= MAX_AREA_M2 / (STEP_M * STEP_M) {
        points.remove(at);
        return true;
    }
    // Half of the angle between the sides: the turn is 180 degrees less that angle.
    let half_sine = ((1.0 + cosine) / 2.0).max(0.0).sqrt();
    let reach = 0.5 * THIN_M / STEP_M / half_sine.max(1e-6);
    if reach < short - near {
        points[at] = [b[0] - reach * u[0], b[1] - reach * u[1]];
        points.insert(at + 1, [b[0] + reach * v[0], b[1] + reach * v[1]]);
    } else {
        let back = if first < second {
            [b[0] + short * v[0], b[1] + short * v[1]]
        } else {
            [b[0] - short * u[0], b[1] - short * u[1]]
        };
        points[at] = back;
    }
    true
}

fn distance(a: Point, b: Point) -> f64 {
    (a[0] - b[0]).portable_hypot(a[1] - b[1])
}

#[cfg(test)]
mod tests {
    use super::without_spikes;
    use crate::reconstruct::polygons::outline::union::{area_m2, doubled_area};
    use crate::reconstruct::polygons::plane_frame::FlatPoint;

    fn ring(points: &[(i32, i32)]) -> Vec<FlatPoint> {
        points.iter().map(|(x, y)| FlatPoint::new(*x, *y)).collect()
    }

    /// How many corners turn by more than 120 degrees.
    fn spikes(ring: &[FlatPoint]) -> usize {
        let count = ring.len();
        let turns = (0..count).filter(|at| {
            let [a, b, c] = [ring[(at + count - 1) % count], ring[*at], ring[(at + 1) % count]];
            let [u, v] = [(a, b), (b, c)].map(|(p, q)| [f64::from(q.x - p.x), f64::from(q.y - p.y)]);
            (u[0] * v[0] + u[1] * v[1]) / (u[0].hypot(u[1]) * v[0].hypot(v[1])) < -0.5
        });
        turns.count()
    }

    #[test]
    fn a_tip_beside_an_edge_and_a_notch_in_one_go_and_the_edges_keep_their_lines() {
        // A square meter; a tip 8 cm long at its upper edge, a notch as deep in the lower one.
        let wall = ring(&[
            (0, 0),
            (4000, 0),
            (4100, 800),
            (4200, 0),
            (10_000, 0),
            (10_000, 10_000),
            (6000, 10_000),
            (5900, 10_800),
            (5800, 10_000),
            (0, 10_000),
        ]);
        assert_eq!(spikes(&wall), 2);
        let clean = without_spikes(&wall);
        assert_eq!(spikes(&clean), 0, "{clean:?}");
        assert_eq!(doubled_area(&clean), 200_000_000);
    }

    #[test]
    fn an_edge_that_runs_too_far_ends_where_the_surface_does() {
        // The lower edge goes on for 30 cm beyond the right side, and comes back on nearly the same way.
        let wall = ring(&[(0, 0), (13_000, 0), (10_000, 300), (10_000, 10_000), (0, 10_000)]);
        let clean = without_spikes(&wall);
        assert_eq!(spikes(&clean), 0, "{clean:?}");
        assert!(clean.iter().filter(|p| p.y == 0).count() == 2, "the lower edge keeps its line: {clean:?}");
        assert!(clean.iter().all(|p| p.x <= 10_000), "{clean:?}");
    }

    #[test]
    fn a_gable_that_is_a_large_wedge_is_blunt_and_keeps_its_area() {
        let wedge = ring(&[(0, 0), (40_000, 0), (0, 5000)]);
        let clean = without_spikes(&wedge);
        assert_eq!(spikes(&clean), 0, "{clean:?}");
        assert_eq!(clean.len(), 4);
        assert!(area_m2(&wedge) - area_m2(&clean) < 0.02);
    }

    #[test]
    fn what_has_no_spike_stays_and_what_is_nothing_but_one_vanishes() {
        let square = ring(&[(0, 0), (900, 0), (900, 900), (0, 900)]);
        assert_eq!(without_spikes(&square), square);
        assert!(without_spikes(&ring(&[(0, 0), (900, 10), (1800, 0), (900, 5)])).len() < 3);
        assert!(without_spikes(&[]).is_empty());
    }
}
