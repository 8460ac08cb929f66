//! Two decks of a car park, one above the other, joined by a straight ramp beside them.
//!
//! World frame: the lower deck's floor is z = 0, its walls stand on x = 0..26 and y = 0..12; the upper deck
//! lies 2.75 m above it. The ramp's lane is y = 12..16: it climbs from x = 22 back to x = 4. The drive starts
//! on the lower deck, leaves it in the east, climbs, and enters the upper deck in the west.

use super::builder::{Builder, Facing, Hole, Span};
use crate::world::World;
use crate::world::path::Path;

const DECK: [Span; 2] = [[0.0, 26.0], [0.0, 12.0]];
const LANE: Span = [12.2, 16.0];
/// Where the ramp begins and ends.
const FOOT: f64 = 22.0;
const TOP: f64 = 4.0;
/// From floor to floor, and the clear height below the slab.
const STOREY: f64 = 2.75;
const CLEAR: f64 = 2.45;
/// The ceiling above everything.
const ROOF: f64 = STOREY + CLEAR;
/// The openings between lane and decks.
const EAST: Span = [22.4, 25.8];
const WEST: Span = [0.2, 3.8];

/// Builds it.
pub(crate) fn decks() -> World {
    let mut b = Builder::default();
    let [x, y] = DECK;
    deck(&mut b, 0.0, CLEAR, EAST);
    deck(&mut b, STOREY, ROOF, WEST);
    lane(&mut b);
    let [_, far] = y;
    let middle = 0.5 * (LANE[0] + LANE[1]);
    let path = Path {
        name: "up".to_owned(),
        waypoints_m: vec![
            [4.0, 4.5],
            [x[1] - 1.9, 4.5],
            [x[1] - 1.9, middle],
            [1.9, middle],
            [1.9, far - 6.5],
            [16.0, far - 6.5],
        ],
        follow_ground: true,
        speed_m_s: 0.5,
        acceleration_m_s2: 0.4,
        corner_m: 1.6,
        weave_m: 0.1,
        weave_length_m: 6.0,
        ..Path::default()
    };
    let (mesh, rounds) = b.finish_all();
    World { name: "decks".to_owned(), mesh, rounds, objects: Vec::new(), plan: None, paths: vec![path] }
}

/// One deck: floor, ceiling, walls, pillars; open to the lane at `open` along x.
fn deck(b: &mut Builder, floor: f64, ceiling: f64, open: Span) {
    let [x, y] = DECK;
    let z = [floor, ceiling];
    b.rect(Facing::Up, floor, x, y, &[]);
    b.rect(Facing::Down, ceiling, x, y, &[]);
    b.rect(Facing::Front, x[0], y, z, &[]);
    b.rect(Facing::Back, x[1], y, z, &[]);
    b.rect(Facing::Left, y[0], x, z, &[]);
    let door = Hole { u: open, v: z };
    b.rect(Facing::Right, y[1], x, z, &[door]);
    // The opening's cheeks, sill and lintel through the wall.
    let through = [y[1], LANE[0]];
    b.rect(Facing::Front, open[0], through, z, &[]);
    b.rect(Facing::Back, open[1], through, z, &[]);
    b.rect(Facing::Up, floor, open, through, &[]);
    b.rect(Facing::Down, ceiling, open, through, &[]);
    for pillar_x in [5.0, 10.5, 16.0, 21.5] {
        for pillar_y in [2.5, 8.0] {
            b.block_with(
                [pillar_x, pillar_x + 0.4],
                [pillar_y, pillar_y + 0.4],
                z,
                &[Facing::Front, Facing::Back, Facing::Left, Facing::Right],
            );
        }
    }
    for (low, long) in [(1.0, 1.2), (7.5, 0.9), (13.5, 1.6)] {
        b.block_with(
            [low, low + long],
            [y[0], 0.45],
            [floor, floor + 1.3],
            &[Facing::Front, Facing::Back, Facing::Left, Facing::Up],
        );
    }
}

/// The lane with its ramp: a landing at either end, level in front of each opening.
fn lane(b: &mut Builder) {
    let [x, _] = DECK;
    b.rect(Facing::Up, 0.0, [FOOT, x[1]], LANE, &[]);
    b.rect(Facing::Up, STOREY, [x[0], TOP], LANE, &[]);
    let [low, high] = LANE;
    b.polygon(&[[FOOT, low, 0.0], [FOOT, high, 0.0], [TOP, high, STOREY], [TOP, low, STOREY]]);
    b.rect(Facing::Down, ROOF, x, LANE, &[]);
    let z = [0.0, ROOF];
    b.rect(Facing::Front, x[0], LANE, z, &[]);
    b.rect(Facing::Back, x[1], LANE, z, &[]);
    b.rect(Facing::Right, high, x, z, &[]);
    let holes = [Hole { u: EAST, v: [0.0, CLEAR] }, Hole { u: WEST, v: [STOREY, ROOF] }];
    b.rect(Facing::Left, low, x, z, &holes);
    // Ribs on the outer wall tell how far up the ramp the robot is.
    for rib_x in [2.0, 6.5, 9.0, 12.5, 15.0, 18.5, 21.0, 24.5] {
        b.block_with(
            [rib_x, rib_x + 0.3],
            [high - 0.12, high],
            z,
            &[Facing::Front, Facing::Back, Facing::Right],
        );
    }
}
