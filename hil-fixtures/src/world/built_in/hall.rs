//! A hall with round things: eight columns in two rows, three pipes under the ceiling, an apse.
//!
//! World frame: x along the hall towards the apse, z = 0 the floor. Radii, places and heights differ from
//! plan to plan. Doors and cabinets keep it from being bare, and are flat.

use super::builder::{Builder, Facing, Hole, Span};
use crate::rng::Rng;
use crate::world::World;
use crate::world::built_in::round::RoundKind;
use crate::world::path::Path;

/// Length (along x) and width (along y) of the hall, meters.
const SIZE: [f64; 2] = [16.0, 10.0];
/// Radius of the apse in the wall at the end.
const APSE: f64 = 3.0;
/// Radii of columns and of pipes.
const COLUMN_RADII: Span = [0.15, 0.45];
const PIPE_RADII: Span = [0.08, 0.16];
/// Depth of the doors and windows in the walls.
const RECESS: f64 = 0.2;
/// Of the plans: not the noise, the world itself.
const WORLD_SEED: u64 = 8_311;

/// Builds the hall of a plan.
#[must_use]
pub(crate) fn hall(plan: u32) -> World {
    let mut rng = Rng::new(WORLD_SEED, u64::from(plan), 0);
    let mut b = Builder::default();
    let height = rng.between(3.2, 4.0);
    shell(&mut b, height);
    columns(&mut b, height, &mut rng);
    pipes(&mut b, height, &mut rng);
    things(&mut b, &mut rng);
    let (mesh, rounds) = b.finish_all();
    World { name: name_of("hall", plan), mesh, rounds, objects: Vec::new(), plan: None, paths: vec![lap()] }
}

/// The name of a plan.
pub(super) fn name_of(world: &str, plan: u32) -> String {
    if plan == 0 { world.to_owned() } else { format!("{world}-{plan}") }
}

/// Between the rows into the apse, and back through both aisles.
fn lap() -> Path {
    let waypoints_m = vec![
        [2.0, 5.0],
        [16.8, 5.0],
        [16.8, 6.4],
        [14.4, 8.3],
        [2.0, 8.3],
        [1.3, 5.0],
        [2.0, 1.7],
        [14.0, 1.7],
    ];
    Path { name: "lap".to_owned(), waypoints_m, speed_m_s: 0.25, corner_m: 0.7, ..Path::default() }
}

/// Floor, ceiling, walls, the apse.
fn shell(b: &mut Builder, height: f64) {
    let [long, wide] = SIZE;
    let (z, end) = ([0.0, height], long + APSE);
    b.rect(Facing::Up, 0.0, [0.0, end], [0.0, wide], &[]);
    b.rect(Facing::Down, height, [0.0, end], [0.0, wide], &[]);
    let opening = [0.5 * wide - APSE, 0.5 * wide + APSE];
    b.rect(Facing::Back, long, [0.0, opening[0]], z, &[]);
    b.rect(Facing::Back, long, [opening[1], wide], z, &[]);
    b.niche([long, 0.5 * wide], APSE, z, [-90.0, 90.0]);
    let door = |from: f64| Hole { u: [from, from + 1.1], v: [0.0, 2.1] };
    let window = |from: f64| Hole { u: [from, from + 1.4], v: [1.0, 2.6] };
    let sides = [
        ([0.0, 0.0, 0.0], 0.0, long, vec![window(1.2), door(4.1), window(8.0), window(12.3)]),
        ([long, wide, 0.0], 180.0, long, vec![door(1.3), window(5.0), window(9.4), door(13.2)]),
        ([0.0, wide, 0.0], -90.0, wide, vec![door(2.0), window(6.4)]),
    ];
    for (corner, yaw_deg, length, holes) in sides {
        b.within(corner, yaw_deg, |b| {
            b.rect(Facing::Left, 0.0, [0.0, length], z, &holes);
            holes.iter().for_each(|hole| b.recess(*hole, RECESS, true));
        });
    }
}

/// Two rows of four.
fn columns(b: &mut Builder, height: f64, rng: &mut Rng) {
    for row in [3.1, 6.9] {
        for n in 0..4 {
            let [low, high] = COLUMN_RADII;
            // One in each eighth of the range, so that every hall has slender and stout ones.
            let radius = rng.between(low, high);
            let x = 3.3 + 3.1 * f64::from(n) + rng.between(-0.3, 0.3);
            b.standing(RoundKind::Column, [x, row + rng.between(-0.08, 0.08)], radius, [0.0, height]);
        }
    }
}

/// Three along the hall or across a part of it, each a hand's breadth under the ceiling.
fn pipes(b: &mut Builder, height: f64, rng: &mut Rng) {
    let [low, high] = PIPE_RADII;
    for y in [1.3, 5.0, 8.7] {
        let radius = rng.between(low, high);
        let z = height - radius - rng.between(0.06, 0.2);
        let y = y + rng.between(-0.35, 0.35);
        let (from, to) = (rng.between(0.0, 2.0), rng.between(11.0, 15.5));
        b.tube(RoundKind::Pipe, [[from, y, z], [to, y, z]], radius);
    }
}

/// Cabinets at the walls: flat things.
fn things(b: &mut Builder, rng: &mut Rng) {
    let standing = [Facing::Front, Facing::Back, Facing::Left, Facing::Right, Facing::Up];
    for (x, y) in [(2.9, 0.0), (6.2, 0.0), (10.3, 0.0), (3.2, SIZE[1] - 0.45), (9.0, SIZE[1] - 0.45)] {
        let (wide, high) = (rng.between(0.6, 1.0), rng.between(0.7, 1.9));
        b.block_with([x, x + wide], [y, y + 0.45], [0.0, high], &standing);
    }
}
