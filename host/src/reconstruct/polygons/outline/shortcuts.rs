//! Shortcuts: fewer edges in place of several, where points are too far apart to tell one border from the
//! other.
//!
//! A few edges in a row give way to a straight one between their ends, or the edges beside them go on until
//! they meet. The shortcut that moves the border least for each corner that it saves is taken first. Edges
//! that another surface meets stay. Plane coordinates in steps
//! ([`crate::reconstruct::polygons::plane_frame`]). Source: Visvalingam and Whyatt 1993, with more than one
//! corner at a time.

use super::border::{MIN_SINE, distance};
use super::jogs::IsMet;
use super::line::Line;
use super::union::{Ring, Shape};
use crate::reconstruct::polygons::plane_frame::FlatPoint;
use biplane_geometry::vec2::distance_to_segment;
use std::collections::BTreeSet;

/// So many edges give way at once at most: a tooth has three, a notch with a cut corner four.
const MAX_EDGES: usize = 4;
/// What is left of an edge that goes on, or ends sooner, is at least so long, steps.
const LEFT_STEPS: f64 = 20.0;
/// A straight edge counts as so many where it runs along none of those beside it: what is there already is
/// likelier than a new direction.
const TURNED: f64 = 3.0;
/// Edges run along each other within this (sine of the angle; 3 degrees).
const SAME_SINE: f64 = 0.05;
/// A border that moves by no more than this has not moved, steps: rounding.
const SAME_STEPS: f64 = 2.0;

/// A place in the plane.
pub(crate) type Point = [f64; 2];

/// What a border may become.
#[derive(Clone, Copy)]
pub(crate) struct Rules<'a> {
    /// How far it may move at a corner where surface is taken away, steps.
    pub tolerance: &'a dyn Fn(Point) -> f64,
    /// And the share of that by which it may where surface is added.
    pub added_share: f64,
    /// Edges that another surface meets.
    pub is_met: IsMet<'a>,
    /// Whether corners may give way to others that begin and end in the same ones.
    pub allows: &'a dyn Fn(&[Point], &[Point]) -> bool,
}

/// An edge of the border, up to where the next one begins.
#[derive(Clone, Copy)]
struct Edge {
    from: Point,
    /// How far the border may move at its first corner, steps.
    tolerance: f64,
    is_met: bool,
    /// How far it is from where it was at most, steps.
    moved: Moved,
}

/// How far a border has moved at most, steps.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Moved {
    /// To where no surface was.
    outwards: f64,
    /// To where some was.
    inwards: f64,
}

impl Moved {
    fn max(self, other: Self) -> Self {
        Self { outwards: self.outwards.max(other.outwards), inwards: self.inwards.max(other.inwards) }
    }

    /// Takes a signed distance into account, positive inwards.
    fn with(self, off: f64) -> Self {
        Self { outwards: self.outwards.max(-off), inwards: self.inwards.max(off) }
    }

    fn plus(self, other: Self) -> Self {
        Self { outwards: self.outwards + other.outwards, inwards: self.inwards + other.inwards }
    }

    fn furthest(self) -> f64 {
        self.outwards.max(self.inwards)
    }
}

/// Edges that may give way.
#[derive(Clone, Copy)]
struct Shortcut {
    /// The first of them.
    at: usize,
    edges: usize,
    /// Where the edges beside them meet; `None` where a straight one takes their place.
    corner: Option<Point>,
    moved: Moved,
    /// How far the border moves over which length, for each corner that it saves, square steps.
    cost: f64,
}

impl Shortcut {
    /// The corners that go, and those in their place; both begin and end in the same ones.
    fn chains(&self, ring: &[Edge]) -> (Vec<Point>, Vec<Point>) {
        let (first, last) = match self.corner {
            Some(_) => (self.at + ring.len() - 1, self.at + ring.len() + self.edges + 1),
            None => (self.at + ring.len(), self.at + ring.len() + self.edges),
        };
        let old: Vec<Point> = (first..=last).map(|at| ring[at % ring.len()].from).collect();
        let new = std::iter::once(old[0]).chain(self.corner).chain(old.last().copied()).collect();
        (old, new)
    }
}

/// A shape with the shortcuts that rules allow.
pub(crate) fn with_shortcuts(shape: &Shape, rules: &Rules<'_>) -> Shape {
    let mut rings: Vec<Vec<Edge>> = shape.iter().map(|ring| edges_of(ring, rules)).collect();
    for index in 0..rings.len() {
        let mut refused = BTreeSet::new();
        while let Some(found) = cheapest(&rings, index, rules, &mut refused) {
            take(&mut rings[index], &found, rules);
        }
    }
    let corner = |edge: &Edge| FlatPoint::new(edge.from[0] as i32, edge.from[1] as i32);
    rings.iter().map(|ring| ring.iter().map(corner).collect()).collect()
}

fn edges_of(ring: &Ring, rules: &Rules<'_>) -> Vec<Edge> {
    let corners: Vec<Point> = ring.iter().map(|p| [f64::from(p.x), f64::from(p.y)]).collect();
    let ends = corners.iter().zip(corners.iter().cycle().skip(1));
    ends.map(|(from, to)| Edge {
        from: *from,
        tolerance: (rules.tolerance)(*from),
        is_met: (rules.is_met)([*from, *to]),
        moved: Moved::default(),
    })
    .collect()
}

/// The cheapest shortcut of a ring that is allowed; those that are not are remembered.
fn cheapest(
    rings: &[Vec<Edge>],
    index: usize,
    rules: &Rules<'_>,
    refused: &mut BTreeSet<Vec<[i64; 2]>>,
) -> Option<Shortcut> {
    let ring = &rings[index];
    let mut found: Vec<Shortcut> = (0..ring.len())
        .flat_map(|at| (1..=MAX_EDGES).map(move |edges| (at, edges)))
        .flat_map(|(at, edges)| [meeting(ring, at, edges, rules), straight(ring, at, edges, rules)])
        .flatten()
        .collect();
    found.sort_by(|a, b| a.cost.total_cmp(&b.cost).then(a.at.cmp(&b.at)));
    found.into_iter().find(|shortcut| {
        let (old, new) = shortcut.chains(ring);
        let key: Vec<[i64; 2]> = old.iter().chain(&new).map(|p| p.map(|value| value as i64)).collect();
        if refused.contains(&key) {
            return false;
        }
        let is_allowed = is_clear(rings, index, shortcut, &new) && (rules.allows)(&old, &new);
        if !is_allowed {
            refused.insert(key);
        }
        is_allowed
    })
}

/// The shortcut by which the edges beside some of a ring meet.
fn meeting(ring: &[Edge], at: usize, edges: usize, rules: &Rules<'_>) -> Option<Shortcut> {
    let count = ring.len();
    if count < edges + 4 {
        return None;
    }
    let place = |step: usize| ring[(at + count + step - 1) % count].from;
    let (before, first, last, after) = (place(0), place(1), place(edges + 1), place(edges + 2));
    let lines = [Line::through(before, first), Line::through(last, after)];
    let corner = lines[0].crossing(&lines[1], MIN_SINE)?.map(f64::round);
    let is_ahead =
        lines[0].along(corner) >= LEFT_STEPS && lines[1].along(after) - lines[1].along(corner) >= LEFT_STEPS;
    if !is_ahead {
        return None;
    }
    shortcut(
        ring,
        rules,
        Shortcut { at, edges, corner: Some(corner), moved: Moved::default(), cost: edges as f64 },
    )
}

/// The shortcut by which a straight edge takes the place of some of a ring.
fn straight(ring: &[Edge], at: usize, edges: usize, rules: &Rules<'_>) -> Option<Shortcut> {
    let count = ring.len();
    if edges < 2 || count < edges + 3 {
        return None;
    }
    let place = |step: usize| ring[(at + count + step - 1) % count].from;
    let [before, own, after] = [[0, 1], [1, edges + 1], [edges + 1, edges + 2]]
        .map(|ends| Line::through(place(ends[0]), place(ends[1])));
    let is_turned = own.sine(&before).abs().min(own.sine(&after).abs()) > SAME_SINE;
    let saves = (edges - 1) as f64 / if is_turned { TURNED } else { 1.0 };
    shortcut(ring, rules, Shortcut { at, edges, corner: None, moved: Moved::default(), cost: saves })
}

/// A shortcut with how far it moves the border and what it costs, given how many corners it saves; `None`
/// when that is too far.
fn shortcut(ring: &[Edge], rules: &Rules<'_>, shortcut: Shortcut) -> Option<Shortcut> {
    let (old, new) = shortcut.chains(ring);
    let inner = |chain: &[Point]| 1..chain.len() - 1;
    // The surface lies on the left of its border.
    let gone = old[inner(&old)].iter().map(|p| -off(*p, &new));
    let moves =
        gone.chain(new[inner(&new)].iter().map(|p| off(*p, &old))).fold(Moved::default(), Moved::with);
    let own = || (shortcut.at..shortcut.at + shortcut.edges).map(|at| ring[at % ring.len()]);
    let is_same = moves.furthest() <= SAME_STEPS;
    if !is_same && own().any(|edge| edge.is_met) {
        return None;
    }
    let ends = usize::from(shortcut.corner.is_none());
    let inside = shortcut.at + ends..=shortcut.at + shortcut.edges - ends;
    let tolerance = inside.map(|at| ring[at % ring.len()].tolerance).fold(f64::INFINITY, f64::min);
    let moved = own().map(|edge| edge.moved).fold(Moved::default(), Moved::max).plus(moves);
    if !is_same && (moved.inwards > tolerance || moved.outwards > rules.added_share * tolerance) {
        return None;
    }
    let length: f64 = old.windows(2).map(|ends| distance(ends[0], ends[1])).sum();
    Some(Shortcut { moved, cost: moves.furthest() * length / shortcut.cost, ..shortcut })
}

/// Distance of a point to edges in a row, positive on the left of the nearest one.
fn off(p: Point, chain: &[Point]) -> f64 {
    let sides = chain
        .windows(2)
        .map(|ends| (distance_to_segment(p, ends[0], ends[1]), Line::through(ends[0], ends[1]).off(p)));
    let nearest = sides.min_by(|a, b| a.0.total_cmp(&b.0));
    nearest.map_or(f64::INFINITY, |(far, side)| far.copysign(side))
}

/// Whether the new edges cross none that stay.
fn is_clear(rings: &[Vec<Edge>], index: usize, shortcut: &Shortcut, new: &[Point]) -> bool {
    let count = rings[index].len();
    // With a corner the edges beside change, too; those beside the new ones share their ends.
    let reach = if shortcut.corner.is_some() { 2 } else { 1 };
    let first = shortcut.at + count - reach;
    let is_near = |at: usize| (at + 2 * count - first) % count < shortcut.edges + 2 * reach;
    rings.iter().enumerate().all(|(other, ring)| {
        (0..ring.len()).filter(|at| other != index || !is_near(*at)).all(|at| {
            let ends = [ring[at].from, ring[(at + 1) % ring.len()].from];
            !new.windows(2).any(|edge| crosses([edge[0], edge[1]], ends))
        })
    })
}

/// Whether two edges touch.
fn crosses(one: [Point; 2], other: [Point; 2]) -> bool {
    let side = |edge: [Point; 2], p: Point| {
        (edge[1][0] - edge[0][0]) * (p[1] - edge[0][1]) - (edge[1][1] - edge[0][1]) * (p[0] - edge[0][0])
    };
    let parts = |edge: [Point; 2], ends: [Point; 2]| {
        let [a, b] = ends.map(|p| side(edge, p));
        (a <= 0.0 && b >= 0.0) || (a >= 0.0 && b <= 0.0)
    };
    parts(one, other) && parts(other, one)
}

/// Takes a shortcut.
fn take(ring: &mut Vec<Edge>, shortcut: &Shortcut, rules: &Rules<'_>) {
    let count = ring.len();
    ring.rotate_left(shortcut.at % count);
    let own = ring[..=shortcut.edges].iter().map(|edge| edge.tolerance);
    let tolerance = own.fold(f64::INFINITY, f64::min);
    match shortcut.corner {
        Some(corner) => {
            let next = ring[shortcut.edges];
            let moved = next.moved.max(shortcut.moved);
            ring.splice(..=shortcut.edges, [Edge { from: corner, tolerance, moved, ..next }]);
            if let Some(before) = ring.last_mut() {
                before.moved = before.moved.max(shortcut.moved);
            }
        }
        None => {
            let from = ring[0].from;
            let to = ring[shortcut.edges % ring.len()].from;
            let is_met = (rules.is_met)([from, to]);
            let edge = Edge { is_met, moved: shortcut.moved, ..ring[0] };
            ring.splice(..shortcut.edges, [edge]);
        }
    }
    let back = shortcut.at % ring.len();
    ring.rotate_right(back);
}

#[cfg(test)]
mod tests {
    use super::{Point, Rules, with_shortcuts};
    use crate::reconstruct::polygons::outline::union::{Ring, Shape, doubled_area};
    use crate::reconstruct::polygons::plane_frame::FlatPoint;

    fn ring(points: &[(i32, i32)]) -> Ring {
        points.iter().map(|(x, y)| FlatPoint::new(*x, *y)).collect()
    }

    /// What becomes of a ring whose border may move by 10 cm, and by half of that where surface is added.
    fn after(ring: &Ring, is_met: &dyn Fn([Point; 2]) -> bool) -> Ring {
        let rules = Rules { tolerance: &|_| 1000.0, added_share: 0.5, is_met, allows: &|_, _| true };
        with_shortcuts(&vec![ring.clone()], &rules).remove(0)
    }

    fn sorted(ring: &Ring) -> Vec<(i32, i32)> {
        let mut corners: Vec<(i32, i32)> = ring.iter().map(|p| (p.x, p.y)).collect();
        corners.sort_unstable();
        corners
    }

    /// A wall of 4 m by 2 m; its lower edge steps aside by so much from 1 to 2 m along, downwards where it is
    /// positive.
    fn wall(step: i32) -> Ring {
        let foot = [(0, 0), (10_000, 0), (10_000, -step), (20_000, -step), (20_000, 0), (40_000, 0)];
        ring(&[&foot[..], &[(40_000, 20_000), (0, 20_000)]].concat())
    }

    const RECTANGLE: [(i32, i32); 4] = [(0, 0), (0, 20_000), (40_000, 0), (40_000, 20_000)];

    #[test]
    fn teeth_within_the_tolerance_and_notches_within_half_of_it_go() {
        assert_eq!(sorted(&after(&wall(900), &|_| false)), RECTANGLE);
        assert_eq!(after(&wall(1100), &|_| false), wall(1100));
        assert_eq!(sorted(&after(&wall(-450), &|_| false)), RECTANGLE);
        assert!(doubled_area(&after(&wall(-900), &|_| false)) <= doubled_area(&wall(-900)));
    }

    #[test]
    fn edges_that_another_surface_meets_stay_and_those_in_line_become_one() {
        let is_foot = |[a, b]: [Point; 2]| a[1] == -900.0 && b[1] == -900.0;
        assert_eq!(after(&wall(900), &is_foot), wall(900));
        let long = ring(&[(0, 0), (10_000, 0), (30_000, 0), (40_000, 0), (40_000, 20_000), (0, 20_000)]);
        assert_eq!(sorted(&after(&long, &|_| true)), RECTANGLE);
    }

    #[test]
    fn a_border_moves_by_no_more_than_its_tolerance_however_many_steps_there_are() {
        // Each step alone is small enough; all together are not.
        let steps = (0..12).flat_map(|step| [(3000 * step, -300 * step), (3000 * (step + 1), -300 * step)]);
        let mut corners: Vec<(i32, i32)> = steps.collect();
        corners.extend([(36_000, 20_000), (0, 20_000)]);
        let stair = ring(&corners);
        let is_near = |p: &FlatPoint| {
            let line = f64::from(p.y) + 0.1 * f64::from(p.x);
            p.y > 0 || line.abs() <= 1301.0
        };
        let straight: Shape = vec![after(&stair, &|_| false)];
        assert!(straight[0].len() < 12, "{straight:?}");
        assert!(straight[0].iter().all(is_near), "{straight:?}");
    }

    #[test]
    fn no_shortcut_crosses_another_border() {
        let mut shape = vec![wall(900)];
        shape.push(ring(&[(12_000, -700), (12_000, 9000), (14_000, 9000), (14_000, -700)]));
        let rules =
            Rules { tolerance: &|_| 1000.0, added_share: 0.5, is_met: &|_| false, allows: &|_, _| true };
        let after = with_shortcuts(&shape, &rules);
        assert!(after[0].iter().any(|p| p.y == -900), "{after:?}");
    }
}
