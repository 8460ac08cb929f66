//! A hall with things that only look round: square and chamfered pillars, a bay, a spiral stair.
//!
//! World frame: x along the hall, z = 0 the floor. Nothing here is a cylinder: whoever finds one is wrong.

use super::builder::{Builder, Facing, Hole};
use super::hall::name_of;
use crate::rng::Rng;
use crate::world::World;
use crate::world::path::Path;

/// Length (along x), width (along y), height, meters.
const SIZE: [f64; 3] = [14.0, 9.0, 3.4];
/// Edge of the pillars, and what is cut off the corners of the chamfered ones.
const PILLAR: f64 = 0.4;
const CHAMFER: f64 = 0.1;
/// Of the plans: not the noise, the world itself.
const WORLD_SEED: u64 = 4_040;

/// Builds the hall of a plan.
#[must_use]
pub(crate) fn pillars(plan: u32) -> World {
    let mut rng = Rng::new(WORLD_SEED, u64::from(plan), 0);
    let mut b = Builder::default();
    shell(&mut b);
    for n in 0..4 {
        for row in [2.8, 6.2] {
            let x = 2.6 + 2.9 * f64::from(n) + rng.between(-0.2, 0.2);
            let chamfer = if (n % 2 == 0) == (row < 4.0) { 0.0 } else { CHAMFER };
            b.within([x, row, 0.0], rng.between(-20.0, 20.0), |b| pillar(b, chamfer));
        }
    }
    b.within([1.3, 7.7, 0.0], 0.0, stair);
    let (mesh, rounds) = b.finish_all();
    World {
        name: name_of("pillars", plan),
        mesh,
        rounds,
        objects: Vec::new(),
        plan: None,
        paths: vec![lap()],
    }
}

fn lap() -> Path {
    let waypoints_m = vec![
        [1.5, 4.5],
        [12.6, 4.5],
        [12.6, 7.5],
        [4.05, 7.5],
        [4.05, 4.8],
        [1.2, 4.8],
        [1.2, 1.5],
        [12.0, 1.5],
    ];
    Path { name: "lap".to_owned(), waypoints_m, speed_m_s: 0.25, corner_m: 0.7, ..Path::default() }
}

/// Floor, ceiling, walls with windows, a bay of three sides.
fn shell(b: &mut Builder) {
    let [long, wide, high] = SIZE;
    let (z, out) = ([0.0, high], 1.1);
    b.rect(Facing::Up, 0.0, [0.0, long], [-out, wide], &[]);
    b.rect(Facing::Down, high, [0.0, long], [-out, wide], &[]);
    let window = |from: f64| Hole { u: [from, from + 1.3], v: [1.0, 2.4] };
    let sides = [
        ([long, 0.0, 0.0], 90.0, wide, vec![window(3.8)]),
        ([long, wide, 0.0], 180.0, long, vec![window(2.0), window(7.2)]),
        ([0.0, wide, 0.0], -90.0, wide, vec![window(5.0)]),
    ];
    for (corner, yaw_deg, length, holes) in sides {
        b.within(corner, yaw_deg, |b| {
            b.rect(Facing::Left, 0.0, [0.0, length], z, &holes);
            holes.iter().for_each(|hole| b.recess(*hole, 0.15, true));
        });
    }
    let outline = [[5.0, 0.0], [5.8, -out], [8.2, -out], [9.0, 0.0]];
    for pair in outline.windows(2) {
        let [p, q] = [pair[0], pair[1]];
        b.polygon(&[[q[0], q[1], 0.0], [p[0], p[1], 0.0], [p[0], p[1], high], [q[0], q[1], high]]);
    }
    b.rect(Facing::Left, 0.0, [0.0, 5.0], z, &[]);
    b.rect(Facing::Left, 0.0, [9.0, long], z, &[]);
}

/// A square pillar about the frame's origin, its corners cut off.
fn pillar(b: &mut Builder, chamfer: f64) {
    let (half, high) = (0.5 * PILLAR, SIZE[2]);
    let inner = half - chamfer;
    let mut outline: Vec<[f64; 2]> = Vec::new();
    for [x, y] in [[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]] {
        let corners = [[half * x, inner * y], [inner * x, half * y]];
        let first = usize::from(x * y < 0.0);
        outline.extend([corners[first], corners[1 - first]]);
    }
    outline.dedup();
    for k in 0..outline.len() {
        let ([px, py], [qx, qy]) = (outline[k], outline[(k + 1) % outline.len()]);
        if [px, py] != [qx, qy] {
            b.polygon(&[[px, py, 0.0], [qx, qy, 0.0], [qx, qy, high], [px, py, high]]);
        }
    }
}

/// A spiral stair: sectors of a disk as steps about a square newel.
fn stair(b: &mut Builder) {
    b.block_with(
        [-0.06, 0.06],
        [-0.06, 0.06],
        [0.0, SIZE[2]],
        &[Facing::Front, Facing::Back, Facing::Left, Facing::Right],
    );
    for step in 0..16 {
        b.within([0.0, 0.0, 0.19 * f64::from(step)], 24.0 * f64::from(step), |b| {
            b.block([0.06, 0.85], [-0.16, 0.16], [0.15, 0.19]);
        });
    }
}
