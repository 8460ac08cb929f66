//! Rooms and walls as they were found, put in order and named.

use super::{
    CLOSED_LEAF, Elements, KnownBy, Room, Storey, Use, Wall, WallCurve, WallOpening, stations_m, storey_name,
};
use crate::building::spaces::evidence::Evidence;
use crate::building::spaces::line::Line;
use crate::building::spaces::outline::signed_area_m2;
use crate::building::spaces::{Plan, Space};
use crate::building::walls::OpenWall;
use crate::building::walls::USUAL_HEIGHT_M;
use crate::building::walls::openings::{Hole, Shows};
use crate::building::walls::slabs::{Slab, ThicknessFrom};
use biplane_geometry::PortableMath;
use biplane_geometry::vec2::dot;

/// A room with a larger share of wall around it is closed.
const CLOSED_SHARE: f64 = 0.97;
/// How far beside a wall rooms are looked for, meters.
const BESIDE_M: f64 = 0.3;
/// Ends of walls this close to another wall meet it, meters.
const MEETS_M: f64 = 0.12;
/// Written coordinates are whole multiples of this, meters.
const STEP_M: f64 = 1e-4;

fn rounded(value: f64) -> f64 {
    (value / STEP_M).round() * STEP_M
}

/// A whole number of steps, written with no more digits than that needs.
fn tidy(value: f64) -> f64 {
    (value / STEP_M).round() / STEP_M.recip()
}

fn tidy_point(point: [f64; 2]) -> [f64; 2] {
    point.map(tidy)
}

/// Everything named, in the order of names: by direction, offset and beginning.
pub(crate) fn elements(evidence: &Evidence<'_>, plan: &Plan, mut walls: Vec<OpenWall>) -> Elements {
    if plan.spaces.is_empty() {
        return Elements::default();
    }
    join_corners(&mut walls);
    let storey = storey_name(evidence.storey);
    let floor_z_m = evidence.floor_m;
    let names = room_names(&plan.spaces, &storey);
    let mut out = Elements {
        storeys: vec![Storey {
            id: storey.clone(),
            floor_z_m,
            ceiling_z_m: plan.overhead.usual_m.map(tidy),
            floor_inferred: true,
        }],
        ..Elements::default()
    };
    out.rooms = plan.spaces.iter().zip(&names).map(|(space, id)| room(plan, space, id, floor_z_m)).collect();
    out.rooms.sort_by(|a, b| a.id.cmp(&b.id));
    walls.sort_by(|a, b| order(&a.slab).partial_cmp(&order(&b.slab)).unwrap_or(std::cmp::Ordering::Equal));
    let mut counts = [0usize; 3];
    for (number, open) in walls.iter().enumerate() {
        let wall = wall(open, format!("{storey}-W{:02}", number + 1), &names, floor_z_m);
        let mut holes: Vec<&Hole> = open.holes.iter().collect();
        holes.sort_by(|a, b| beginning(&open.slab, a.span).total_cmp(&beginning(&open.slab, b.span)));
        for hole in holes {
            out.openings.push(opening(&mut counts, open, hole, &wall, &out.rooms));
        }
        out.walls.push(wall);
    }
    out
}

/// Direction, offset and beginning of a wall, in whole steps, so that noise in the last digits changes no
/// order: a building that is turned by a hundredth of a degree keeps its names.
fn order(slab: &Slab) -> [f64; 3] {
    let sign = naming_sign(slab.normal());
    let [x, y] = slab.normal().map(|value| sign * value);
    let angle = y.portable_atan2(x);
    [(angle * 100.0).round(), rounded(sign * slab.middle_m()), rounded(beginning(slab, slab.span))]
}

/// Walls are named as if they faced between 45 degrees to the right and 135 to the left of x: those along the
/// axes, which most are, are far from either.
fn naming_sign([x, y]: [f64; 2]) -> f64 {
    if x + y > 0.0 { 1.0 } else { -1.0 }
}

/// Where a part of a wall begins, as names count.
fn beginning(slab: &Slab, [from_m, to_m]: [f64; 2]) -> f64 {
    if naming_sign(slab.normal()) > 0.0 { from_m } else { -to_m }
}

/// The names of rooms, by where they are.
fn room_names(spaces: &[Space], storey: &str) -> Vec<String> {
    let middle = |space: &Space| {
        let ring = &space.rings[0];
        let sum = ring.iter().fold([0.0; 2], |sum, edge| [sum[0] + edge.from_m[0], sum[1] + edge.from_m[1]]);
        sum.map(|value| value / ring.len() as f64)
    };
    let mut order: Vec<usize> = (0..spaces.len()).collect();
    order.sort_by(|a, b| {
        let [p, q] = [middle(&spaces[*a]), middle(&spaces[*b])];
        p[0].total_cmp(&q[0]).then(p[1].total_cmp(&q[1]))
    });
    let mut names = vec![String::new(); spaces.len()];
    for (number, space) in order.into_iter().enumerate() {
        names[space] = format!("{storey}-R{:02}", number + 1);
    }
    names
}

fn room(plan: &Plan, space: &Space, id: &str, floor_z_m: f64) -> Room {
    let area_m2: f64 = space.rings.iter().map(signed_area_m2).sum();
    let mut rings =
        space.rings.iter().map(|ring| ring.iter().map(|edge| tidy_point(edge.from_m)).collect::<Vec<_>>());
    let outline_m = rings.next().unwrap_or_default();
    let walled_share = space.walled_m / space.around_m.max(1e-9);
    let ceiling_m = space.ceiling_m.or(plan.overhead.usual_m);
    let closed = walled_share >= CLOSED_SHARE;
    Room {
        id: id.to_owned(),
        storey: id.split('-').next().unwrap_or_default().to_owned(),
        outline_m,
        holes_m: rings.collect(),
        floor_z_m,
        ceiling_z_m: tidy(ceiling_m.unwrap_or(floor_z_m + USUAL_HEIGHT_M)),
        area_m2: tidy(area_m2),
        seen_area_m2: Some(tidy(space.seen_m2.min(area_m2))),
        closed,
        walled_share: tidy(walled_share),
        inferred: !closed || space.ceiling_m.is_none(),
    }
}

fn wall(open: &OpenWall, id: String, names: &[String], floor_z_m: f64) -> Wall {
    let slab = &open.slab;
    let mut rooms: Vec<String> = slab.spaces.iter().filter_map(|space| names.get(*space).cloned()).collect();
    rooms.sort();
    let thickness_from = match slab.from {
        ThicknessFrom::Faces => KnownBy::Faces,
        ThicknessFrom::SameLine => KnownBy::SameLine,
        ThicknessFrom::Unknown => KnownBy::Unknown,
    };
    let mut wall = Wall {
        storey: id.split('-').next().unwrap_or_default().to_owned(),
        id,
        axis_m: slab.span.map(|at| tidy_point(slab.point(at, slab.middle_m()))),
        outline_m: outline(slab).into_iter().map(tidy_point).collect(),
        curve: slab
            .line
            .curve()
            .map(|curve| WallCurve { center_m: tidy_point(curve.center_m), radius_m: tidy(slab.middle_m()) }),
        thickness_m: slab.thickness_m().map(tidy),
        thickness_from,
        drawn_thickness_m: tidy(slab.faces_m[1] - slab.faces_m[0]),
        // To the left of the way along a wall its lower face is.
        seen_left: slab.is_seen[0],
        height_m: tidy(open.top_m - floor_z_m),
        rooms,
        seen_share: tidy(open.seen_share),
        inferred: slab.from == ThicknessFrom::Unknown,
    };
    wall.inferred |= wall.is_hardly_seen();
    wall
}

/// The corners of a wall, counter-clockwise; of a curved one those of chords along its faces.
fn outline(slab: &Slab) -> Vec<[f64; 2]> {
    let [low, high] = slab.faces_m;
    let stations = stations_m(slab.span, slab.line.curve().map(|curve| curve.radius_m));
    // The way along a wall is to the left of its normal.
    let there = stations.iter().map(|at| slab.point(*at, high));
    there.chain(stations.iter().rev().map(|at| slab.point(*at, low))).collect()
}

fn opening(
    counts: &mut [usize; 3],
    open: &OpenWall,
    hole: &Hole,
    wall: &Wall,
    rooms: &[Room],
) -> WallOpening {
    let slab = &open.slab;
    let kind = match (hole.is_door, hole.is_passage()) {
        (true, true) => Use::Passage,
        (true, false) => Use::Door,
        (false, _) => Use::Window,
    };
    let number = &mut counts[kind as usize];
    *number += 1;
    let at = (hole.span[0] + hole.span[1]) / 2.0;
    let [x, y] = slab.point(at, slab.middle_m());
    let floor_z_m = rooms.first().map_or(0.0, |room| room.floor_z_m);
    let beside = [slab.faces_m[0] - BESIDE_M, slab.faces_m[1] + BESIDE_M];
    let found = beside.iter().filter_map(|across| {
        let place = slab.point(at, *across);
        rooms.iter().find(|room| is_inside(&room.outline_m, place)).map(|room| room.id.clone())
    });
    let mut found: Vec<String> = found.collect();
    found.sort();
    found.dedup();
    let evidence = match hole.shows {
        Shows::DrivenThrough => "driven through",
        Shows::ClosedLeaf => CLOSED_LEAF,
        Shows::SeenThrough => "seen through",
        Shows::Frame => "frame",
    };
    let mut opening = WallOpening {
        id: kind.name(&wall.storey, *number),
        kind,
        wall: wall.id.clone(),
        center_m: [tidy(x), tidy(y), tidy((hole.bottom_m + hole.top_m) / 2.0)],
        width_m: tidy(hole.width_m()),
        height_m: tidy(hole.top_m - hole.bottom_m),
        sill_m: tidy(hole.bottom_m - floor_z_m),
        rooms: found,
        evidence: evidence.to_owned(),
        inferred: hole.shows == Shows::Frame || !hole.is_bottom_seen,
    };
    // What the robot drove through is as wide as the robot, and its width was seen.
    opening.inferred |= opening.is_narrow() && hole.shows != Shows::DrivenThrough;
    opening
}

/// Whether a place is in a ring.
pub(crate) fn is_inside(ring: &[[f64; 2]], [x, y]: [f64; 2]) -> bool {
    let ends = ring.iter().zip(ring.iter().cycle().skip(1));
    let passed = ends
        .filter(|(a, b)| (a[1] > y) != (b[1] > y) && a[0] + (y - a[1]) / (b[1] - a[1]) * (b[0] - a[0]) > x);
    passed.count() % 2 == 1
}

/// Lets walls that end on each other fill their common corner: the first of the two runs through.
fn join_corners(walls: &mut [OpenWall]) {
    for first in 0..walls.len() {
        for second in first + 1..walls.len() {
            let (a, b) = (walls[first].slab.clone(), walls[second].slab.clone());
            let (Line::Straight { normal }, Line::Straight { normal: other }) = (a.line, b.line) else {
                continue;
            };
            if dot(normal, other).abs() > 0.9 {
                continue;
            }
            let (Some((end, reach)), Some((other_end, other_near))) = (meets(&a, &b), meets(&b, &a)) else {
                continue;
            };
            let fold = |values: [f64; 2], end: usize| {
                if end == 0 { values[0].min(values[1]) } else { values[0].max(values[1]) }
            };
            walls[first].slab.span[end] = fold(reach, end);
            walls[second].slab.span[other_end] = fold(other_near, 1 - other_end);
        }
    }
}

/// The end of a wall that lies at another wall, and where along it the faces of the other are.
fn meets(wall: &Slab, other: &Slab) -> Option<(usize, [f64; 2])> {
    let [nx, ny] = wall.normal();
    let rise = dot([-ny, nx], other.normal());
    let from = dot(wall.point(0.0, wall.middle_m()), other.normal());
    let at = other.faces_m.map(|face_m| (face_m - from) / rise);
    let (low, high) = (at[0].min(at[1]) - MEETS_M, at[0].max(at[1]) + MEETS_M);
    (0..2).find(|end| (low..=high).contains(&wall.span[*end])).map(|end| (end, at))
}

#[cfg(test)]
mod tests {
    use super::{beginning, order};
    use crate::building::spaces::line::Line;
    use crate::building::walls::slabs::{Slab, ThicknessFrom};

    #[test]
    fn a_building_that_is_turned_by_next_to_nothing_keeps_the_order_of_its_walls() {
        let slab = |normal: [f64; 2], faces_m: [f64; 2], span: [f64; 2]| Slab {
            line: Line::Straight { normal },
            faces_m,
            span,
            is_seen: [true; 2],
            spaces: Vec::new(),
            from: ThicknessFrom::Faces,
        };
        // A wall along x, and one along y; turned to the other side the normal of the first is the opposite.
        let along_y = order(&slab([1.0, 0.0], [2.0, 2.2], [0.0, 4.0]));
        let one = slab([1e-4, 1.0], [3.0, 3.2], [-5.0, -1.0]);
        let other = slab([1e-4, -1.0], [-3.2, -3.0], [1.0, 5.0]);
        assert_eq!(order(&one), order(&other));
        assert!(along_y < order(&one), "{along_y:?}");
        // A door at 2 m of 4, and one at 3: the same one is the first.
        assert_eq!(beginning(&one, [-3.5, -2.5]), beginning(&other, [2.5, 3.5]));
        assert!(beginning(&other, [2.5, 3.5]) < beginning(&other, [1.5, 2.0]));
    }
}
