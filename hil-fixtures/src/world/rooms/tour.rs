//! Places to go to in each room, the order in which they are visited, and the way as straight legs.

use super::floor::{Floor, Point, distance, is_in};
use crate::rng::Rng;
use crate::world::path::{MAX_TURN_DEG, turn_rad};
use biplane_ifc::{Plan, Room};

/// A room of which less can be reached was not entered, cells: 0.2 square meters.
const MIN_CELLS: usize = 80;
/// How far from the walls a driver likes to be, meters; and no more than this share of what there is.
const LIKED_M: [f64; 2] = [0.5, 0.85];
const LIKED_SHARE: f64 = 0.85;
/// Stops are at least so far from each other, meters.
const APART_M: f64 = 0.8;
/// Every roomy place of a room is this near to a stop, meters, with at most so many stops.
const SPREAD_M: f64 = 1.9;
const MAX_STOPS: usize = 14;
/// Straight legs keep this distance to the sides where the way did, meters.
const LEG_CLEARANCE_M: f64 = 0.55;
/// A leg replaces at most so many steps.
const MAX_LEG: usize = 400;
/// A sharper turn is driven as two, so far apart, degrees and meters.
const SHARP_DEG: f64 = 100.0;
const TURN_ROUND_M: f64 = 0.22;
/// Sharper ones no drive can have, with a reserve for rounded coordinates, degrees; so often they are turned
/// anew.
const REFUSED_DEG: f64 = MAX_TURN_DEG - 2.0;
const MAX_PASSES: usize = 2;
/// Shorter legs are left away, meters.
const MIN_LEG_M: f64 = 0.03;

/// A planned drive.
pub(super) struct Tour {
    pub(super) waypoints_m: Vec<Point>,
    /// For each room, whether the drive leads through it.
    pub(super) entered: Vec<bool>,
}

struct Stop {
    room: usize,
    cell: usize,
}

impl Tour {
    /// Plans it; none when there are not two places to go to.
    pub(super) fn plan(floor: &Floor, plan: &Plan, rng: &mut Rng) -> Option<Self> {
        let mut stops: Vec<Stop> = Vec::new();
        for (room, outline) in plan.rooms.iter().enumerate() {
            stops.extend(stops_in(floor, outline, rng).into_iter().map(|cell| Stop { room, cell }));
        }
        if stops.len() < 2 {
            return None;
        }
        let entered = (0..plan.rooms.len()).map(|room| stops.iter().any(|stop| stop.room == room)).collect();
        let first = (rng.unit() * stops.len() as f64) as usize;
        let (way, kept) = visit(floor, &stops, first)?;
        let points = drivable(&straightened(floor, &way, &kept));
        let mut waypoints_m: Vec<Point> = Vec::new();
        for point in points {
            if waypoints_m.last().is_none_or(|last| distance(*last, point) > MIN_LEG_M) {
                waypoints_m.push(point.map(|value| (value * 1000.0).round() / 1000.0));
            }
        }
        (waypoints_m.len() >= 2).then_some(Self { waypoints_m, entered })
    }
}

/// Cells near the corners of a room and wherever else no stop is near.
fn stops_in(floor: &Floor, room: &Room, rng: &mut Rng) -> Vec<usize> {
    let is_here = |cell: &usize| {
        let point = floor.point(*cell);
        is_in(&room.outline_m, point) && !room.holes_m.iter().any(|hole| is_in(hole, point))
    };
    let cells: Vec<usize> =
        (0..floor.reached.len()).filter(|cell| floor.reached[*cell]).filter(is_here).collect();
    // Drawn for every room, so that a room more does not change the others.
    let liked = rng.between(LIKED_M[0], LIKED_M[1]);
    if cells.len() < MIN_CELLS {
        return Vec::new();
    }
    let widest = cells.iter().map(|cell| floor.clearance_m[*cell]).fold(0.0, f64::max);
    let roomy: Vec<usize> = cells
        .iter()
        .copied()
        .filter(|cell| floor.clearance_m[*cell] >= liked.min(LIKED_SHARE * widest))
        .collect();
    let nearest = |corner: &Point| {
        let apart = |cell: &usize| distance(floor.point(*cell), *corner);
        roomy.iter().copied().min_by(|a, b| apart(a).total_cmp(&apart(b)))
    };
    let mut found: Vec<usize> = room.outline_m.iter().filter_map(nearest).collect();
    found.reverse();
    let mut stops: Vec<usize> = Vec::new();
    loop {
        let far = |cell: usize| {
            let apart = stops.iter().map(|stop| distance(floor.point(*stop), floor.point(cell)));
            apart.fold(f64::INFINITY, f64::min)
        };
        let next = match found.pop() {
            Some(cell) => cell,
            None => match roomy.iter().copied().max_by(|a, b| far(*a).total_cmp(&far(*b))) {
                Some(cell) if stops.len() < MAX_STOPS && far(cell) > SPREAD_M => cell,
                _ => return stops,
            },
        };
        if far(next) > APART_M {
            stops.push(next);
        }
    }
}

/// The way through all stops, a room after the other, and back; and the cells of the stops.
fn visit(floor: &Floor, stops: &[Stop], first: usize) -> Option<(Vec<usize>, Vec<usize>)> {
    let mut left: Vec<&Stop> = stops.iter().collect();
    let (mut room, start) = (left[first].room, left.remove(first).cell);
    let (mut way, mut kept) = (vec![start], vec![start]);
    while !left.is_empty() {
        let here: Vec<usize> = left.iter().filter(|stop| stop.room == room).map(|stop| stop.cell).collect();
        let goals = if here.is_empty() { left.iter().map(|stop| stop.cell).collect() } else { here };
        let leg = floor.way_to_nearest(way[way.len() - 1], &goals)?;
        let cell = *leg.last()?;
        way.extend(leg);
        kept.push(cell);
        let at = left.iter().position(|stop| stop.cell == cell)?;
        room = left.remove(at).room;
    }
    if way[way.len() - 1] != start {
        way.extend(floor.way_to_nearest(way[way.len() - 1], &[start])?);
    }
    Some((way, kept))
}

/// Straight legs between the stops where these are as far from the walls as the way was.
fn straightened(floor: &Floor, way: &[usize], kept: &[usize]) -> Vec<Point> {
    let points: Vec<Point> = way.iter().map(|cell| floor.point(*cell)).collect();
    let (mut out, mut at) = (vec![points[0]], 0);
    while at + 1 < points.len() {
        let mut last = at + 1;
        let mut narrowest = floor.clearance_m[way[at]].min(floor.clearance_m[way[at + 1]]);
        for to in at + 2..points.len().min(at + MAX_LEG) {
            if kept.contains(&way[to - 1]) {
                break;
            }
            narrowest = narrowest.min(floor.clearance_m[way[to]]);
            if floor.min_clearance_m(points[at], points[to]) >= narrowest.min(LEG_CLEARANCE_M) - 1e-9 {
                last = to;
            }
        }
        at = last;
        out.push(points[at]);
    }
    out
}

/// The same way with sharp turns driven as two. Beside a leg that is as short as the two are apart one of
/// them may be sharper still: those are turned once more, nearer to each other.
fn drivable(points: &[Point]) -> Vec<Point> {
    let mut points = turned(points, SHARP_DEG, TURN_ROUND_M);
    let mut apart_m = TURN_ROUND_M;
    for _ in 0..MAX_PASSES {
        if sharpest_deg(&points) <= REFUSED_DEG {
            break;
        }
        apart_m /= 2.0;
        points = turned(&points, REFUSED_DEG, apart_m);
    }
    points
}

/// The sharpest turn of a way, degrees.
fn sharpest_deg(points: &[Point]) -> f64 {
    let turns = points.windows(3).map(|corner| turn_rad(corner[0], corner[1], corner[2]));
    turns.fold(0.0, |sharpest: f64, turn| sharpest.max(turn.abs().to_degrees()))
}

/// The same way with sharp turns driven as two: a robot that turns round on the spot, nearly.
fn turned(points: &[Point], sharp_deg: f64, apart_m: f64) -> Vec<Point> {
    let unit = |a: Point, b: Point| {
        let length = distance(a, b).max(1e-9);
        [(b[0] - a[0]) / length, (b[1] - a[1]) / length]
    };
    let mut out = vec![points[0]];
    for corner in points.windows(3) {
        let [a, b, c] = [corner[0], corner[1], corner[2]];
        let (u, v) = (unit(a, b), unit(b, c));
        let turn = turn_rad(a, b, c);
        let middle = [u[0] - v[0], u[1] - v[1]];
        let length = middle[0].hypot(middle[1]);
        if turn.abs().to_degrees() < sharp_deg || length < 1e-9 {
            out.push(b);
            continue;
        }
        let half = 0.5 * apart_m / length * if turn < 0.0 { -1.0 } else { 1.0 };
        let across = [-middle[1] * half, middle[0] * half];
        out.push([b[0] - across[0], b[1] - across[1]]);
        out.push([b[0] + across[0], b[1] + across[1]]);
    }
    out.extend(points.last());
    out
}

#[cfg(test)]
mod tests {
    use super::{REFUSED_DEG, drivable, sharpest_deg};
    use crate::rng::Rng;

    #[test]
    fn no_turn_is_too_sharp_to_drive_also_beside_short_legs() {
        let mut rng = Rng::new(1, 0, 0);
        for _ in 0..500 {
            let mut at = [0.0, 0.0];
            let mut points = vec![at];
            for _ in 0..6 {
                let (length, way) = (rng.between(0.1, 2.0), rng.between(0.0, std::f64::consts::TAU));
                at = [at[0] + length * way.cos(), at[1] + length * way.sin()];
                points.push(at);
            }
            let sharpest = sharpest_deg(&drivable(&points));
            assert!(sharpest <= REFUSED_DEG, "{sharpest} degrees: {points:?}");
        }
    }
}
