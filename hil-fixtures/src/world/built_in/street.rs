//! A street: facades on both sides, lamp posts, tree trunks under foliage, bollards, hedges.
//!
//! World frame: x along the street, z = 0 the ground. Places and radii differ from plan to plan.

use super::builder::{Builder, Facing, Hole};
use super::hall::name_of;
use crate::rng::Rng;
use crate::world::World;
use crate::world::built_in::round::RoundKind;
use crate::world::path::Path;

/// Length of the street, meters.
const LONG: f64 = 36.0;
/// Distance of the facades from the middle of the street.
const HALF: f64 = 6.0;
/// Height of the facades.
const EAVES: f64 = 6.0;
/// Of the plans: not the noise, the world itself.
const WORLD_SEED: u64 = 5_602;

/// Builds the street of a plan.
#[must_use]
pub(crate) fn street(plan: u32) -> World {
    let mut rng = Rng::new(WORLD_SEED, u64::from(plan), 0);
    let mut b = Builder::default();
    b.rect(Facing::Up, 0.0, [-60.0, LONG + 60.0], [-60.0, 60.0], &[]);
    b.within([-6.0, -HALF, 0.0], 0.0, facade);
    b.within([LONG + 6.0, HALF, 0.0], 180.0, facade);
    for side in [-1.0, 1.0] {
        beside(&mut b, side, &mut rng);
    }
    let (mesh, rounds) = b.finish_all();
    World {
        name: name_of("street", plan),
        mesh,
        rounds,
        objects: Vec::new(),
        plan: None,
        paths: vec![along()],
    }
}

fn along() -> Path {
    Path {
        name: "along".to_owned(),
        waypoints_m: vec![[0.0, 0.0], [LONG, 0.0]],
        speed_m_s: 0.15,
        weave_m: 0.1,
        weave_length_m: 8.0,
        shake_deg: 0.1,
        ..Path::default()
    }
}

/// A facade with doors, windows and pilasters; it looks to +y.
fn facade(b: &mut Builder) {
    let long = LONG + 12.0;
    let windows = (0..14).map(|n| 2.0 + 3.3 * f64::from(n));
    let hole =
        |x: f64| Hole { u: [x, x + 1.2], v: if x > 20.0 && x < 23.0 { [0.0, 2.3] } else { [1.0, 2.5] } };
    let holes: Vec<Hole> = windows.map(hole).collect();
    b.rect(Facing::Left, 0.0, [0.0, long], [0.0, EAVES], &holes);
    holes.iter().for_each(|hole| b.recess(*hole, 0.25, true));
    for n in 0..5 {
        let x = 4.4 + 9.9 * f64::from(n);
        let sides = [Facing::Front, Facing::Back, Facing::Left, Facing::Up];
        b.block_with([x, x + 0.4], [0.0, 0.2], [0.0, EAVES - 0.5], &sides);
    }
}

/// What stands along one side.
fn beside(b: &mut Builder, side: f64, rng: &mut Rng) {
    let mut x = rng.between(1.5, 3.0);
    let mut number = 0;
    while x < LONG - 1.0 {
        let y = side * rng.between(2.6, 3.6);
        match number % 3 {
            0 => b.standing(RoundKind::Pole, [x, y], rng.between(0.05, 0.09), [0.0, rng.between(3.5, 5.0)]),
            1 => b.tree([x, y], rng.between(4.5, 6.5), rng.between(0.9, 1.4), rng),
            _ => b.standing(
                RoundKind::Pole,
                [x, side * 2.2],
                rng.between(0.08, 0.12),
                [0.0, rng.between(0.8, 1.0)],
            ),
        }
        number += 1;
        x += rng.between(2.0, 3.2);
    }
    // A hedge: leaves on no plane, and nothing round.
    let x = rng.between(5.0, 20.0);
    b.foliage([x, side * 4.6, 0.6], [3.0, 0.4, 0.7], 500, rng);
}
