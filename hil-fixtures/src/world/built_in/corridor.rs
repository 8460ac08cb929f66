//! The office corridor of the paper's first experiment (section 4): 14 m long, 2.2 m wide, 2.7 m high, 10 m
//! of it driven.
//!
//! Doors on both sides, some closed in their niches, some open into rooms; cabinets, a pillar, lamps, a beam.
//! World frame: x along the corridor, z = 0 the floor, the drive starts at the origin. Enough stands in the
//! way that a horizontal scan knows where along the corridor it is.

use super::builder::{Builder, Facing, Hole, Span};
use crate::world::World;
use crate::world::built_in::round::RoundKind;
use crate::world::path::Path;

/// The corridor's ends, sides and ceiling, meters.
const X: Span = [-1.5, 12.5];
const LEFT: f64 = 1.12;
const RIGHT: f64 = -1.08;
const HEIGHT: f64 = 2.7;
const WALL: f64 = 0.12;
const DOOR_HEIGHT: f64 = 2.05;

/// Sides of something that stands at the back of the frame's wall.
const STANDING: [Facing; 4] = [Facing::Front, Facing::Back, Facing::Left, Facing::Up];

/// A door in a side wall: from, to along the corridor; the leaf's opening angle, 0 when closed.
struct Door {
    x: Span,
    open_deg: f64,
}

const LEFT_DOORS: [Door; 4] = [
    Door { x: [0.6, 1.5], open_deg: 95.0 },
    Door { x: [3.4, 4.3], open_deg: 0.0 },
    Door { x: [6.2, 7.1], open_deg: 78.0 },
    Door { x: [8.8, 9.7], open_deg: 0.0 },
];
const RIGHT_DOORS: [Door; 4] = [
    Door { x: [1.9, 2.8], open_deg: 0.0 },
    Door { x: [4.9, 5.8], open_deg: 104.0 },
    Door { x: [7.5, 8.4], open_deg: 0.0 },
    Door { x: [10.4, 11.3], open_deg: 60.0 },
];

/// Builds it.
#[must_use]
pub(crate) fn corridor() -> World {
    let mut builder = Builder::default();
    // In a side's own frame the wall is y = 0 and looks into the corridor (+y); x runs along it.
    builder.within([X[0], RIGHT, 0.0], 0.0, |b| side(b, &RIGHT_DOORS, |x| x - X[0]));
    builder.within([X[1], LEFT, 0.0], 180.0, |b| side(b, &LEFT_DOORS, |x| X[1] - x));
    ends(&mut builder);
    ceiling(&mut builder);
    furniture(&mut builder);
    rooms(&mut builder);
    let path = Path {
        name: "along".to_owned(),
        waypoints_m: vec![[0.0, 0.0], [10.0, 0.0]],
        speed_m_s: 0.213,
        acceleration_m_s2: 0.4,
        weave_m: 0.07,
        weave_length_m: 4.0,
        ..Path::default()
    };
    let (mesh, rounds) = builder.finish_all();
    World { name: "corridor".to_owned(), mesh, rounds, objects: Vec::new(), plan: None, paths: vec![path] }
}

/// One side wall with its doors; `own` takes a place along the corridor to the wall's own x.
fn side(b: &mut Builder, doors: &[Door], own: impl Fn(f64) -> f64) {
    let spans: Vec<(Span, f64)> =
        doors.iter().map(|door| (ordered(door.x.map(&own)), door.open_deg)).collect();
    let holes: Vec<Hole> = spans.iter().map(|(u, _)| Hole { u: *u, v: [0.0, DOOR_HEIGHT] }).collect();
    b.wall([0.0, X[1] - X[0]], WALL, HEIGHT, &holes);
    for (span, open_deg) in spans {
        door_frame(b, span);
        b.rect(Facing::Up, 0.0, span, [-WALL, 0.0], &[]);
        if open_deg == 0.0 {
            b.block([span[0], span[1]], [-0.11, -0.07], [0.0, DOOR_HEIGHT]);
            // The handle.
            b.block([span[1] - 0.14, span[1] - 0.04], [-0.02, 0.0], [1.03, 1.06]);
        } else {
            // Hinged at the back edge, swung into the room.
            b.within([span[0], -WALL, 0.0], -open_deg, |b| {
                b.block([0.0, span[1] - span[0] - 0.01], [-0.02, 0.02], [0.01, DOOR_HEIGHT - 0.02]);
            });
        }
    }
}

fn ordered(span: Span) -> Span {
    [span[0].min(span[1]), span[0].max(span[1])]
}

/// Boards round a door, 7 cm wide, 2 cm proud of the wall.
fn door_frame(b: &mut Builder, door: Span) {
    let proud = [0.0, 0.02];
    let sides = [Facing::Front, Facing::Back, Facing::Left];
    let top = DOOR_HEIGHT + 0.07;
    b.block_with([door[0] - 0.07, door[0]], proud, [0.0, top], &sides);
    b.block_with([door[1], door[1] + 0.07], proud, [0.0, top], &sides);
    b.block_with(door, proud, [DOOR_HEIGHT, top], &[Facing::Left, Facing::Up, Facing::Down]);
}

/// The walls at both ends: a closed double door, and a window.
fn ends(b: &mut Builder) {
    let width = LEFT - RIGHT;
    b.within([X[0], LEFT, 0.0], -90.0, |b| {
        let door = Hole { u: [0.35, width - 0.35], v: [0.0, 2.1] };
        b.rect(Facing::Left, 0.0, [0.0, width], [0.0, HEIGHT], &[door]);
        b.recess(door, 0.1, true);
    });
    b.within([X[1], RIGHT, 0.0], 90.0, |b| {
        let window = Hole { u: [0.4, width - 0.5], v: [0.9, 2.3] };
        b.rect(Facing::Left, 0.0, [0.0, width], [0.0, HEIGHT], &[window]);
        b.recess(window, 0.2, true);
        b.block_with(
            [0.5, width - 0.6],
            [0.0, 0.12],
            [0.15, 0.75],
            &[Facing::Front, Facing::Back, Facing::Left, Facing::Up],
        );
    });
}

/// Floor, ceiling and what hangs from it.
fn ceiling(b: &mut Builder) {
    b.rect(Facing::Up, 0.0, X, [RIGHT, LEFT], &[]);
    b.rect(Facing::Down, HEIGHT, X, [RIGHT, LEFT], &[]);
    let hanging = [Facing::Front, Facing::Back, Facing::Down];
    b.block_with([2.95, 3.2], [RIGHT, LEFT], [2.42, HEIGHT], &hanging);
    b.block_with([9.9, 10.15], [RIGHT, LEFT], [2.42, HEIGHT], &hanging);
    for x in [0.4, 2.0, 4.6, 6.9, 8.8, 11.4] {
        let sides = [Facing::Front, Facing::Back, Facing::Left, Facing::Right, Facing::Down];
        b.block_with([x - 0.6, x + 0.6], [-0.1, 0.1], [2.61, HEIGHT], &sides);
    }
    // A cable tray under the ceiling.
    b.block_with(X, [0.72, 0.92], [2.46, 2.52], &[Facing::Left, Facing::Right, Facing::Up, Facing::Down]);
}

/// What stands and hangs in the corridor.
fn furniture(b: &mut Builder) {
    b.within([0.0, RIGHT, 0.0], 0.0, |b| {
        b.block_with([3.3, 4.25], [0.0, 0.42], [0.0, 1.95], &STANDING);
        b.block_with([8.95, 9.45], [0.0, 0.38], [0.0, 0.85], &STANDING);
        b.block_with([6.5, 6.8], [0.0, 0.2], [0.0, HEIGHT], &[Facing::Front, Facing::Back, Facing::Left]);
        b.cylinder([6.15, 0.12], 0.08, [0.6, 1.15]);
        b.block_with(
            [0.2, 1.4],
            [0.0, 0.03],
            [1.05, 1.95],
            &[Facing::Front, Facing::Back, Facing::Left, Facing::Up, Facing::Down],
        );
        b.block_with([-1.0, -0.3], [0.0, 0.5], [0.0, 1.4], &STANDING);
    });
    b.within([0.0, LEFT, 0.0], 180.0, |b| {
        // Here x runs backwards.
        b.block_with([-2.75, -1.95], [0.0, 0.36], [0.0, 1.2], &STANDING);
        b.block_with([-5.9, -4.6], [0.0, 0.35], [0.0, 0.46], &STANDING);
        b.block_with(
            [-5.8, -4.7],
            [0.0, 0.03],
            [1.1, 1.9],
            &[Facing::Front, Facing::Back, Facing::Left, Facing::Up, Facing::Down],
        );
        b.standing(RoundKind::Column, [-7.95, 0.27], 0.17, [0.0, HEIGHT]);
        b.block_with([-11.6, -10.3], [0.0, 0.4], [0.0, 1.8], &STANDING);
    });
}

/// A room behind a side wall: far wall with a window, two side walls, floor, ceiling, something to stand in
/// it.
fn room(b: &mut Builder, x: Span, depth: f64) {
    let window = Hole { u: [x[0] + 0.8, x[1] - 0.9], v: [0.85, 2.2] };
    b.within([0.0, -depth, 0.0], 0.0, |b| {
        b.rect(Facing::Left, 0.0, x, [0.0, HEIGHT], &[window]);
        b.recess(window, 0.15, true);
    });
    b.rect(Facing::Front, x[0], [-depth, -WALL], [0.0, HEIGHT], &[]);
    b.rect(Facing::Back, x[1], [-depth, -WALL], [0.0, HEIGHT], &[]);
    b.rect(Facing::Up, 0.0, x, [-depth, -WALL], &[]);
    b.rect(Facing::Down, HEIGHT, x, [-depth, -WALL], &[]);
    b.within([x[0], -depth, 0.0], 0.0, |b| {
        b.block([0.7, 2.1], [0.35, 1.05], [0.7, 0.74]);
        b.block_with(
            [0.0, 0.45],
            [1.6, 2.6],
            [0.0, 1.9],
            &[Facing::Front, Facing::Left, Facing::Right, Facing::Up],
        );
    });
}

fn rooms(b: &mut Builder) {
    b.within([X[0], RIGHT, 0.0], 0.0, |b| {
        room(b, [5.0, 8.6], 3.6);
        room(b, [10.9, 13.9], 3.2);
    });
    b.within([X[1], LEFT, 0.0], 180.0, |b| {
        room(b, [3.9, 7.6], 4.2);
        room(b, [9.6, 13.6], 3.4);
    });
}
