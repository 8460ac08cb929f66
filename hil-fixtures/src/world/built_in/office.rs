//! An office floor whose corridor is a loop: the drive returns to where it began.
//!
//! World frame: the floor's outer walls stand on x = 0..30, y = 0..20, z = 0 the floor. The corridor, 2 m
//! wide, runs around a core of inner rooms; offices lie outside it, a lobby is open to it in the west. Doors
//! stand open, ajar or closed.

use super::builder::{Builder, Facing, Hole, Span};
use crate::rng::Rng;
use crate::world::World;
use crate::world::built_in::round::RoundKind;
use crate::world::path::Path;

const SIZE: [f64; 2] = [30.0, 20.0];
const HEIGHT: f64 = 2.8;
const WALL: f64 = 0.14;
const DOOR_HEIGHT: f64 = 2.08;
/// The corridor between these (outer edge) and [`CORE`] (inner edge).
const RING: [Span; 2] = [[5.2, 24.8], [5.2, 14.8]];
const CORE: [Span; 2] = [[7.2, 22.8], [7.2, 12.8]];
/// Of the furniture: not the noise, the world itself.
const WORLD_SEED: u64 = 0x0FF1CE;

/// Builds it.
#[must_use]
pub(crate) fn office() -> World {
    let mut b = Builder::default();
    let mut rng = Rng::new(WORLD_SEED, 0, 0);
    b.rect(Facing::Up, 0.0, [0.0, SIZE[0]], [0.0, SIZE[1]], &[]);
    b.rect(Facing::Down, HEIGHT, [0.0, SIZE[0]], [0.0, SIZE[1]], &[]);
    outer_walls(&mut b);
    ring_walls(&mut b, &mut rng);
    core(&mut b, &mut rng);
    partitions(&mut b);
    corridor_things(&mut b);
    room_things(&mut b, &mut rng);
    let (mesh, rounds) = b.finish_all();
    World {
        name: "office".to_owned(),
        mesh,
        rounds,
        objects: Vec::new(),
        plan: None,
        paths: vec![lap(), visit()],
    }
}

/// Once around and a quarter more, so that the start is seen again from the same side.
fn lap() -> Path {
    Path {
        name: "loop".to_owned(),
        waypoints_m: vec![[10.0, 6.2], [23.8, 6.2], [23.8, 13.8], [6.2, 13.8], [6.2, 6.2], [16.0, 6.2]],
        ..usual()
    }
}

/// Through the lobby and into the room in the south-west.
fn visit() -> Path {
    Path {
        name: "lobby".to_owned(),
        waypoints_m: vec![[16.0, 6.2], [6.2, 6.2], [6.2, 10.0], [2.5, 11.0]],
        ..usual()
    }
}

fn usual() -> Path {
    Path { speed_m_s: 0.4, corner_m: 0.95, weave_m: 0.06, weave_length_m: 5.0, ..Path::default() }
}

/// A side of a rectangle in its own frame: the wall is y = 0 and looks to +y (outwards, or inwards with
/// `inward`), x runs along it.
fn sides(x: Span, y: Span, inward: bool) -> [([f64; 3], f64, f64); 4] {
    let ([x0, x1], [y0, y1]) = (x, y);
    let (long, wide) = (x1 - x0, y1 - y0);
    if inward {
        [
            ([x0, y0, 0.0], 0.0, long),
            ([x1, y0, 0.0], 90.0, wide),
            ([x1, y1, 0.0], 180.0, long),
            ([x0, y1, 0.0], -90.0, wide),
        ]
    } else {
        [
            ([x1, y0, 0.0], 180.0, long),
            ([x1, y1, 0.0], -90.0, wide),
            ([x0, y1, 0.0], 0.0, long),
            ([x0, y0, 0.0], 90.0, wide),
        ]
    }
}

/// Windows all round.
fn outer_walls(b: &mut Builder) {
    for (corner, yaw_deg, long) in sides([0.0, SIZE[0]], [0.0, SIZE[1]], true) {
        b.within(corner, yaw_deg, |b| {
            let count = (long / 2.5).floor() as usize;
            let windows: Vec<Hole> = (0..count)
                .map(|n| 2.5 * n as f64 + 0.6)
                .map(|x| Hole { u: [x, x + 1.3], v: [0.9, 2.2] })
                .collect();
            b.rect(Facing::Left, 0.0, [0.0, long], [0.0, HEIGHT], &windows);
            windows.iter().for_each(|window| b.recess(*window, 0.18, true));
        });
    }
}

/// The corridor's outer walls, with doors to the offices; the lobby side has only its ends.
fn ring_walls(b: &mut Builder, rng: &mut Rng) {
    for (number, (corner, yaw_deg, long)) in sides(RING[0], RING[1], true).into_iter().enumerate() {
        b.within(corner, yaw_deg, |b| match number {
            3 => {
                b.wall([0.0, 1.6], WALL, HEIGHT, &[]);
                b.wall([long - 1.6, long], WALL, HEIGHT, &[]);
                b.rect(Facing::Front, 1.6, [-WALL, 0.0], [0.0, HEIGHT], &[]);
                b.rect(Facing::Back, long - 1.6, [-WALL, 0.0], [0.0, HEIGHT], &[]);
            }
            _ => wall_with_doors(b, long, 4.9, rng),
        });
    }
}

/// Inner rooms: storage and copying, doors to the corridor.
fn core(b: &mut Builder, rng: &mut Rng) {
    for (corner, yaw_deg, long) in sides(CORE[0], CORE[1], false) {
        b.within(corner, yaw_deg, |b| wall_with_doors(b, long, 5.2, rng));
    }
    // Two walls divide the core.
    for x in [12.4, 17.6] {
        b.within([x, CORE[1][0] + WALL, 0.0], 90.0, |b| {
            b.wall([0.0, CORE[1][1] - CORE[1][0] - 2.0 * WALL], WALL, HEIGHT, &[]);
        });
    }
}

/// A wall with a door every `step` meters, each in one of three states.
fn wall_with_doors(b: &mut Builder, long: f64, step: f64, rng: &mut Rng) {
    let count = (long / step).floor().max(1.0) as usize;
    let spacing = long / count as f64;
    let doors: Vec<Span> = (0..count)
        .map(|n| (n as f64 + 0.5) * spacing + rng.between(-0.8, 0.8))
        .map(|middle| [middle - 0.45, middle + 0.45])
        .collect();
    let holes: Vec<Hole> = doors.iter().map(|u| Hole { u: *u, v: [0.0, DOOR_HEIGHT] }).collect();
    b.wall([0.0, long], WALL, HEIGHT, &holes);
    for door in doors {
        match (rng.unit() * 3.0) as u8 {
            0 => b.block(door, [-0.1, -0.06], [0.0, DOOR_HEIGHT]),
            state => {
                let open_deg = if state == 1 { rng.between(70.0, 110.0) } else { rng.between(15.0, 50.0) };
                b.within([door[0] + 0.02, -WALL - 0.02, 0.0], -open_deg, |b| {
                    b.block([0.0, 0.86], [-0.02, 0.02], [0.01, DOOR_HEIGHT - 0.02]);
                });
            }
        }
    }
}

/// Walls between the offices.
fn partitions(b: &mut Builder) {
    let depth = RING[1][0] - WALL;
    for x in [5.0, 9.6, 14.4, 19.5, 24.6] {
        b.within([x, 0.0, 0.0], 90.0, |b| b.wall([0.0, depth], WALL, HEIGHT, &[]));
        b.within([x, RING[1][1] + WALL, 0.0], 90.0, |b| b.wall([0.0, depth], WALL, HEIGHT, &[]));
    }
    for y in [5.2, 9.9, 14.6] {
        b.within([RING[0][1] + WALL, y, 0.0], 0.0, |b| b.wall([0.0, depth], WALL, HEIGHT, &[]));
    }
}

const STANDING: [Facing; 5] = [Facing::Front, Facing::Back, Facing::Left, Facing::Right, Facing::Up];

/// Cabinets, a copier, plants, pillars, lamps along the corridor.
fn corridor_things(b: &mut Builder) {
    let ([left, right], [low, high]) = (RING[0], RING[1]);
    for (x, y, z) in [
        ([12.9, 14.0], [low, low + 0.4], [0.0, 1.9]),
        ([20.6, 21.3], [CORE[1][0] - 0.35, CORE[1][0]], [0.0, 1.2]),
        ([right - 0.45, right], [9.0, 10.1], [0.0, 2.0]),
        ([CORE[0][1], CORE[0][1] + 0.35], [11.6, 12.5], [0.0, 0.8]),
        ([18.4, 19.6], [high - 0.42, high], [0.0, 1.1]),
        ([11.2, 11.9], [high - 0.5, high], [0.0, 1.95]),
        ([8.6, 10.0], [CORE[1][1], CORE[1][1] + 0.3], [0.0, 0.45]),
        ([left - 1.2, left - 0.6], [8.2, 8.9], [0.0, 1.1]),
    ] {
        b.block_with(x, y, z, &STANDING);
    }
    for at in [[7.6, 14.5], [24.4, 5.6], [4.4, 7.4], [3.4, 12.4]] {
        b.cylinder(at, 0.17, [0.0, 0.4]);
    }
    for at in [[3.0, 7.4], [3.0, 12.6]] {
        b.standing(RoundKind::Column, at, 0.2, [0.0, HEIGHT]);
    }
    let lamp = [Facing::Front, Facing::Back, Facing::Left, Facing::Right, Facing::Down];
    for n in 0..7 {
        let x = 7.0 + 2.6 * f64::from(n);
        b.block_with([x - 0.6, x + 0.6], [6.1, 6.3], [2.7, HEIGHT], &lamp);
        b.block_with([x - 0.6, x + 0.6], [13.7, 13.9], [2.7, HEIGHT], &lamp);
    }
}

/// A desk, a cabinet and a shelf in each office.
fn room_things(b: &mut Builder, rng: &mut Rng) {
    let rooms = [5.2, 9.8, 14.6, 19.7].map(|x| [x, x + 4.2]);
    for [from, to] in rooms {
        for south in [true, false] {
            let (corner, yaw_deg) = if south { ([from, 0.0, 0.0], 0.0) } else { ([to, SIZE[1], 0.0], 180.0) };
            b.within(corner, yaw_deg, |b| {
                let x = rng.between(0.8, 1.8);
                b.block([x, x + 1.6], [0.9, 1.7], [0.7, 0.74]);
                b.block_with([x + 0.1, x + 0.5], [1.0, 1.6], [0.0, 0.7], &STANDING);
                let y = rng.between(1.5, 2.8);
                b.block_with([0.05, 0.5], [y, y + 1.2], [0.0, rng.between(1.2, 2.1)], &STANDING);
            });
        }
    }
}
