//! Jogs: small steps between two edges of a border that run the same way.
//!
//! Lines are laid through a border piece by piece, and pieces of one straight border come out a few
//! millimeters apart. So does an edge that was put where an opening belongs, beside a border that was there
//! before. The shorter of both edges moves onto the line of the longer one. Edges that another surface meets
//! stay. Plane coordinates in whole steps ([`crate::reconstruct::polygons::plane_frame`]).

use super::border::{MIN_SINE, distance};
use super::line::Line;
use super::union::Ring;
use crate::reconstruct::polygons::plane_frame::FlatPoint;

/// Both edges run the same way: cosine of 25 degrees. A short edge is a few millimeters long, and turned.
const SAME_COSINE: f64 = 0.9;
/// What is left of an edge that another surface meets is at least so long, steps.
const MET_STEPS: f64 = 20.0;
/// Edges that are shorter are none, and those that are so near to one line are one, steps: rounding.
const SAME_STEPS: f64 = 1.0;

/// Whether another surface meets an edge, given its ends in steps.
pub(crate) type IsMet<'a> = &'a dyn Fn([[f64; 2]; 2]) -> bool;

/// An edge of the border.
#[derive(Clone, Copy)]
struct Edge {
    from: [f64; 2],
    to: [f64; 2],
    /// How far it is from where it was at most, steps.
    moved: f64,
}

impl Edge {
    fn line(&self) -> Line {
        Line::through(self.from, self.to)
    }

    fn length(&self) -> f64 {
        distance(self.from, self.to)
    }
}

/// A jog that can be evened out: edge `at` goes, and so does its neighbor that moves onto the other one.
struct Jog {
    at: usize,
    /// What stands for both neighbors.
    edge: Edge,
    /// The area that moves, square steps.
    area: f64,
}

/// A ring without jogs of up to `limit` steps. No edge ends up further than that from where it was.
pub(crate) fn without_jogs(ring: &[FlatPoint], is_met: IsMet<'_>, limit: f64) -> Ring {
    let places: Vec<[f64; 2]> = ring.iter().map(|p| [f64::from(p.x), f64::from(p.y)]).collect();
    let ends = places.iter().zip(places.iter().cycle().skip(1));
    let mut edges: Vec<Edge> = ends.map(|(from, to)| Edge { from: *from, to: *to, moved: 0.0 }).collect();
    // Five edges take part in a jog; a rectangle has none.
    while edges.len() > 4 {
        let jogs = (0..edges.len()).filter_map(|at| jog(&edges, at, is_met, limit));
        let Some(smallest) = jogs.min_by(|a, b| a.area.total_cmp(&b.area)) else { break };
        even_out(&mut edges, &smallest);
    }
    let step = |value: f64| value.round() as i32;
    edges.iter().map(|edge| FlatPoint::new(step(edge.from[0]), step(edge.from[1]))).collect()
}

/// What may be done about edge `at`, if it is a jog.
fn jog(edges: &[Edge], at: usize, is_met: IsMet<'_>, limit: f64) -> Option<Jog> {
    let count = edges.len();
    let [two_before, before, own, after, two_after] =
        [count - 2, count - 1, 0, 1, 2].map(|step| edges[(at + step) % count]);
    if own.length() > limit || !run_the_same_way(&before.line(), &after.line()) || is_met([own.from, own.to])
    {
        return None;
    }
    // The shorter one moves, together with its far end.
    let is_before = before.length() < after.length();
    let (kept, moves) = if is_before { (after, before) } else { (before, after) };
    if is_met([moves.from, moves.to]) {
        return None;
    }
    let line = kept.line();
    let off = line.off(moves.from).abs().max(line.off(moves.to).abs());
    let moved = kept.moved.max(moves.moved + off);
    let (far, beyond) = if is_before { (before.from, two_before) } else { (after.to, two_after) };
    let end = line.crossing(&beyond.line(), MIN_SINE)?;
    // Where another surface meets the edge beyond, some of it has to stay.
    let stays = if is_before { [beyond.from, end] } else { [end, beyond.to] };
    if is_met([beyond.from, beyond.to])
        && beyond.line().along(stays[1]) - beyond.line().along(stays[0]) < MET_STEPS
    {
        return None;
    }
    let edge = if is_before {
        Edge { from: end, to: after.to, moved }
    } else {
        Edge { from: before.from, to: end, moved }
    };
    let is_near = moved <= limit && distance(far, end) <= limit;
    is_near.then_some(Jog { at, edge, area: off * moves.length() })
}

fn run_the_same_way(one: &Line, other: &Line) -> bool {
    let cosine = one.direction[0] * other.direction[0] + one.direction[1] * other.direction[1];
    cosine >= SAME_COSINE
}

/// Puts one edge for three, and lets the edges beside it begin and end there.
fn even_out(edges: &mut Vec<Edge>, jog: &Jog) {
    let count = edges.len();
    edges.rotate_left((jog.at + count - 1) % count);
    edges.splice(..3, [jog.edge]);
    let last = edges.len() - 1;
    edges[1].from = jog.edge.to;
    edges[last].to = jog.edge.from;
    // The other side of a notch is gone, and what went on behind it is the same edge.
    if edges[last].length() < SAME_STEPS {
        edges.pop();
        join_to_next(edges, edges.len() - 1);
    } else if edges[1].length() < SAME_STEPS {
        edges.remove(1);
        join_to_next(edges, 0);
    }
}

/// Joins an edge with the next one where they are one.
fn join_to_next(edges: &mut Vec<Edge>, at: usize) {
    let next = (at + 1) % edges.len();
    let (one, other) = (edges[at], edges[next]);
    let whole = Edge { from: one.from, to: other.to, moved: one.moved.max(other.moved) };
    if run_the_same_way(&one.line(), &other.line()) && whole.line().off(one.to).abs() <= SAME_STEPS {
        edges[at] = whole;
        edges.remove(next);
    } else {
        edges[next].from = one.to;
    }
}

#[cfg(test)]
mod tests {
    use super::{Line, Ring, without_jogs};
    use crate::reconstruct::polygons::plane_frame::FlatPoint;

    fn ring(points: &[(i32, i32)]) -> Ring {
        points.iter().map(|(x, y)| FlatPoint::new(*x, *y)).collect()
    }

    fn sorted(ring: &Ring) -> Vec<(i32, i32)> {
        let mut corners: Vec<(i32, i32)> = ring.iter().map(|p| (p.x, p.y)).collect();
        corners.sort_unstable();
        corners
    }

    fn free(_: [[f64; 2]; 2]) -> bool {
        false
    }

    const LEFT: i32 = 0;
    const RIGHT: i32 = 40_000;

    /// A wall 4 m by 2 m; from 1 to 2 m along its foot is `step` lower.
    fn wall(step: i32) -> Ring {
        ring(&[
            (LEFT, 0),
            (10_000, 0),
            (10_000, -step),
            (20_000, -step),
            (20_000, 0),
            (RIGHT, 0),
            (RIGHT, 20_000),
            (LEFT, 20_000),
        ])
    }

    #[test]
    fn small_steps_go_and_large_ones_stay() {
        let rectangle = sorted(&ring(&[(LEFT, 0), (RIGHT, 0), (RIGHT, 20_000), (LEFT, 20_000)]));
        // Nothing is left of either side of the step, and the foot is one edge.
        assert_eq!(sorted(&without_jogs(&wall(200), &free, 300.0)), rectangle);
        assert_eq!(without_jogs(&wall(400), &free, 300.0), wall(400));
    }

    #[test]
    fn a_step_at_a_corner_goes_from_either_side() {
        let rectangle = sorted(&ring(&[(LEFT, 0), (RIGHT, 0), (RIGHT, 20_000), (LEFT, 20_000)]));
        let first = ring(&[(LEFT, 30), (50, 30), (50, 0), (RIGHT, 0), (RIGHT, 20_000), (LEFT, 20_000)]);
        let last =
            ring(&[(LEFT, 0), (39_950, 0), (39_950, 30), (RIGHT, 30), (RIGHT, 20_000), (LEFT, 20_000)]);
        for ring in [first, last] {
            assert_eq!(sorted(&without_jogs(&ring, &free, 300.0)), rectangle);
        }
    }

    #[test]
    fn an_edge_that_another_surface_meets_stays() {
        let meets = |line: Line| move |ends: [[f64; 2]; 2]| ends.iter().all(|p| line.off(*p).abs() < 1.0);
        let foot = meets(Line { at: [0.0, -200.0], direction: [1.0, 0.0] });
        assert_eq!(without_jogs(&wall(200), &foot, 300.0), wall(200));
        let side = meets(Line { at: [10_000.0, 0.0], direction: [0.0, 1.0] });
        assert_eq!(without_jogs(&wall(200), &side, 300.0), wall(200));
    }

    #[test]
    fn steps_of_a_stair_do_not_add_up() {
        // The last step moves up by 2.5 cm first: what is left of both cannot go on to the longest.
        let foot = [(LEFT, 0), (20_000, 0), (20_000, -250), (30_000, -250), (30_000, -500), (35_000, -500)];
        let stair = ring(&[&foot[..], &[(35_000, 20_000), (LEFT, 20_000)]].concat());
        let after = ring(&[&foot[..3], &[(35_000, -250), (35_000, 20_000), (LEFT, 20_000)]].concat());
        assert_eq!(sorted(&without_jogs(&stair, &free, 300.0)), sorted(&after));
    }

    #[test]
    fn tips_and_slits_are_no_jogs() {
        // Their sides run against each other.
        let tip = ring(&[
            (LEFT, 0),
            (20_000, 0),
            (20_000, -10_000),
            (20_200, -10_000),
            (20_200, 0),
            (RIGHT, 0),
            (RIGHT, 20_000),
            (LEFT, 20_000),
        ]);
        assert_eq!(without_jogs(&tip, &free, 300.0), tip);
    }
}
