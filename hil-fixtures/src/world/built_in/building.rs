//! A building seen from outside (the paper's second experiment): 70 m x 40 m, two storeys and a steep roof,
//! driven around.
//!
//! World frame: the outer walls stand on x = 0..70, y = 0..40, the ground is z = 0. The robot drives around
//! it once, counter-clockwise at 9 m from the walls, over ground that shakes it. Cellar windows, doors and
//! pilasters give a horizontal scan at knee height something to hold on to; trees, hedges, walls and cars
//! stand about.

use super::builder::{Builder, Facing, Hole, Span};
use crate::rng::Rng;
use crate::world::World;
use crate::world::built_in::round::RoundKind;
use crate::world::path::Path;

/// Length (along x) and width (along y) of the outer walls, meters.
const SIZE: [f64; 2] = [70.0, 40.0];
/// Height of the eaves.
const EAVES: f64 = 6.8;
/// How far the roof's ridge is behind the wall, and how high above the eaves: 50 degrees.
const RIDGE_IN: f64 = 6.0;
const RIDGE_UP: f64 = 7.15;
/// How far the roof reaches out over the wall.
const OVERHANG: f64 = 0.45;
/// Distance of the drive from the walls.
const AWAY: f64 = 9.0;
/// Of the trees: not the noise, the world itself.
const WORLD_SEED: u64 = 40_70;

const ALL_BUT_BACK: [Facing; 5] = [Facing::Front, Facing::Back, Facing::Left, Facing::Up, Facing::Down];
const STANDING: [Facing; 5] = [Facing::Front, Facing::Back, Facing::Left, Facing::Right, Facing::Up];

/// Builds it.
#[must_use]
pub(crate) fn building() -> World {
    let mut builder = Builder::default();
    let [length, width] = SIZE;
    // Each side in its own frame: the facade is y = 0 and looks to +y, x runs along it from its left end as
    // seen from outside.
    let sides = [
        ([length, 0.0, 0.0], 180.0, length),
        ([length, width, 0.0], -90.0, width),
        ([0.0, width, 0.0], 0.0, length),
        ([0.0, 0.0, 0.0], 90.0, width),
    ];
    for (number, (corner, yaw_deg, long)) in sides.into_iter().enumerate() {
        builder.within(corner, yaw_deg, |b| {
            facade(b, long, number);
            roof(b, long, number);
        });
    }
    builder.within([0.0, 0.0, 0.0], 0.0, court);
    builder.rect(Facing::Up, 0.0, [-60.0, length + 60.0], [-60.0, width + 60.0], &[]);
    surroundings(&mut builder);
    let (mesh, rounds) = builder.finish_all();
    World {
        name: "building".to_owned(),
        mesh,
        rounds,
        objects: Vec::new(),
        plan: None,
        paths: vec![around()],
    }
}

/// Once around, and a little farther than the start.
fn around() -> Path {
    let ([left, right], [low, high]) = ([-AWAY, SIZE[0] + AWAY], [-AWAY, SIZE[1] + AWAY]);
    let corners = [[10.0, low], [right, low], [right, high], [left, high], [left, low], [16.0, low]];
    Path {
        name: "around".to_owned(),
        waypoints_m: corners.to_vec(),
        speed_m_s: 0.15,
        corner_m: 4.0,
        weave_m: 0.12,
        weave_length_m: 9.0,
        shake_deg: 0.15,
        ..Path::default()
    }
}

/// One outer wall with its windows, doors and what stands out from it.
fn facade(b: &mut Builder, long: f64, number: usize) {
    let doors: &[f64] = match number {
        0 => &[33.0],
        1 => &[12.0],
        2 => &[20.0, 50.5],
        _ => &[],
    };
    let bays = (long / 3.0).floor();
    let first = 0.5 * (long - 3.0 * bays);
    let mut windows = Vec::new();
    let mut cellar = Vec::new();
    for bay in 0..bays as usize {
        let middle = first + 3.0 * bay as f64 + 1.5;
        let door = doors.iter().any(|door| (door + 1.0 - middle).abs() < 2.2);
        windows.push(Hole { u: [middle - 0.6, middle + 0.6], v: [4.3, 5.9] });
        if !door {
            windows.push(Hole { u: [middle - 0.6, middle + 0.6], v: [1.2, 2.9] });
            if bay % 2 == 0 {
                cellar.push(Hole { u: [middle - 0.45, middle + 0.45], v: [0.1, 0.6] });
            }
        }
    }
    let entries: Vec<Hole> =
        doors.iter().map(|door| Hole { u: [*door, door + 2.0], v: [0.0, 2.5] }).collect();
    let holes: Vec<Hole> = windows.iter().chain(&cellar).chain(&entries).copied().collect();
    b.rect(Facing::Left, 0.0, [0.0, long], [0.0, EAVES], &holes);
    windows.iter().for_each(|hole| b.recess(*hole, 0.2, true));
    cellar.iter().for_each(|hole| b.recess(*hole, 0.3, true));
    entries.iter().for_each(|hole| entry(b, *hole));
    for x in [first + 9.0, long - first - 9.0] {
        b.block_with([x - 0.2, x + 0.2], [0.0, 0.25], [0.0, EAVES - 0.3], &ALL_BUT_BACK);
    }
    // A ledge between the storeys, and a downpipe at the corner.
    let ledge = [Facing::Left, Facing::Up, Facing::Down];
    b.block_with([0.0, long], [0.0, 0.1], [3.5, 3.7], &ledge);
    b.cylinder([0.4, 0.12], 0.06, [0.0, EAVES]);
    if number % 2 == 1 {
        bay_windows(b, long);
    }
}

/// A recessed door, a canopy on two columns, two steps.
fn entry(b: &mut Builder, door: Hole) {
    b.recess(door, 0.4, true);
    let [from, to] = door.u;
    b.block_with([from - 0.8, to + 0.8], [0.0, 1.8], [2.8, 3.05], &ALL_BUT_BACK);
    b.standing(RoundKind::Column, [from - 0.5, 1.5], 0.14, [0.0, 2.8]);
    b.standing(RoundKind::Column, [to + 0.5, 1.5], 0.14, [0.0, 2.8]);
    b.block_with([from - 0.4, to + 0.4], [0.0, 1.2], [0.0, 0.16], &STANDING);
    b.block_with([from - 0.2, to + 0.2], [0.0, 0.7], [0.16, 0.32], &STANDING);
}

/// Two bays with slanted sides on the upper storey.
fn bay_windows(b: &mut Builder, long: f64) {
    for x in [0.27 * long, 0.73 * long] {
        let (low, high, out) = (3.9, 6.3, 0.9);
        let outline = [[x - 1.8, 0.0], [x - 0.9, out], [x + 0.9, out], [x + 1.8, 0.0]];
        for pair in outline.windows(2) {
            let [p, q] = [pair[0], pair[1]];
            b.polygon(&[[q[0], q[1], low], [p[0], p[1], low], [p[0], p[1], high], [q[0], q[1], high]]);
        }
        b.polygon(&outline.map(|p| [p[0], p[1], low]));
        let mut top = outline.map(|p| [p[0], p[1], high]);
        top.reverse();
        b.polygon(&top);
    }
}

/// One side of the hipped roof, its eaves and its dormers.
fn roof(b: &mut Builder, long: f64, number: usize) {
    let rise = RIDGE_UP / RIDGE_IN;
    let (low, out) = (EAVES - OVERHANG * rise, OVERHANG);
    let (ridge, top) = (RIDGE_IN, EAVES + RIDGE_UP);
    b.polygon(&[[long + out, out, low], [-out, out, low], [ridge, -ridge, top], [long - ridge, -ridge, top]]);
    // Down to the court.
    let court = 2.0 * RIDGE_IN;
    b.polygon(&[
        [ridge, -ridge, top],
        [court, -court, EAVES],
        [long - court, -court, EAVES],
        [long - ridge, -ridge, top],
    ]);
    // Fascia and soffit.
    b.polygon(&[
        [long + out, out, low - 0.2],
        [-out, out, low - 0.2],
        [-out, out, low],
        [long + out, out, low],
    ]);
    b.polygon(&[
        [-out, out, low - 0.2],
        [long + out, out, low - 0.2],
        [long, 0.0, low - 0.2],
        [0.0, 0.0, low - 0.2],
    ]);
    let dormers: usize = if number.is_multiple_of(2) { 5 } else { 3 };
    for n in 0..dormers {
        let x = long * (n as f64 + 1.0) / (dormers as f64 + 1.0);
        dormer(b, x);
    }
    // A chimney that sits astride the ridge.
    let x = 0.4 * long;
    b.block_with([x, x + 0.9], [-ridge - 0.4, -ridge + 0.4], [top - 1.0, top + 1.3], &STANDING);
}

fn dormer(b: &mut Builder, x: f64) {
    let front = -0.5;
    let span: Span = [x - 0.9, x + 0.9];
    let z = [EAVES - 0.5, EAVES + 2.3];
    let window = Hole { u: [x - 0.55, x + 0.55], v: [EAVES + 1.0, EAVES + 2.0] };
    b.within([0.0, front, 0.0], 0.0, |b| {
        b.rect(Facing::Left, 0.0, span, z, &[window]);
        b.recess(window, 0.12, true);
        b.block_with(span, [-2.5, 0.0], z, &[Facing::Front, Facing::Back]);
        b.block_with([span[0] - 0.15, span[1] + 0.15], [-2.5, 0.2], [z[1], z[1] + 0.18], &ALL_BUT_BACK);
    });
}

/// The walls round the court, so that nothing is hollow.
fn court(b: &mut Builder) {
    let inner = 2.0 * RIDGE_IN;
    let ([long, wide], z) = (SIZE, [0.0, EAVES]);
    b.rect(Facing::Front, inner, [inner, wide - inner], z, &[]);
    b.rect(Facing::Back, long - inner, [inner, wide - inner], z, &[]);
    b.rect(Facing::Left, inner, [inner, long - inner], z, &[]);
    b.rect(Facing::Right, wide - inner, [inner, long - inner], z, &[]);
}

/// Trees on both sides of the way, hedges, garden walls, cars, lamps.
fn surroundings(b: &mut Builder) {
    let mut rng = Rng::new(WORLD_SEED, 0, 0);
    let [long, wide] = SIZE;
    let around = [
        ([long, 0.0, 0.0], 180.0, long),
        ([long, wide, 0.0], -90.0, wide),
        ([0.0, wide, 0.0], 0.0, long),
        ([0.0, 0.0, 0.0], 90.0, wide),
    ];
    for (number, (corner, yaw_deg, side)) in around.into_iter().enumerate() {
        b.within(corner, yaw_deg, |b| {
            let mut x = 3.0;
            while x < side - 2.0 {
                // Between the wall and the way, but not in front of the bays and not on the way itself.
                if rng.unit() < 0.45 {
                    b.tree(
                        [x, rng.between(3.6, 5.4)],
                        rng.between(4.5, 6.5),
                        rng.between(1.0, 1.5),
                        &mut rng,
                    );
                }
                if rng.unit() < 0.7 {
                    b.tree(
                        [x, rng.between(14.0, 19.0)],
                        rng.between(6.0, 10.0),
                        rng.between(1.5, 2.6),
                        &mut rng,
                    );
                }
                x += rng.between(4.0, 8.0);
            }
            beyond(b, side, number);
        });
    }
}

/// What stands on the far side of the way.
fn beyond(b: &mut Builder, side: f64, number: usize) {
    b.block_with([-4.0, 0.35 * side], [15.5, 16.3], [0.0, 1.3], &STANDING);
    b.block_with([0.5 * side, 0.5 * side + 12.0], [13.6, 13.85], [0.0, 1.9], &STANDING);
    for n in 0..3 {
        let x = 0.42 * side + 3.4 * f64::from(n) - 6.0;
        if number.is_multiple_of(2) {
            car(b, [x + 12.0 + 0.1 * side, 12.4]);
        }
    }
    let mut x = 2.0;
    while x < side {
        b.cylinder([x, 11.6], 0.07, [0.0, 3.8]);
        b.cylinder([x + 1.9, 2.2], 0.1, [0.0, 0.9]);
        x += 11.0;
    }
    // A shed with a slanted roof.
    if number == 2 {
        b.block_with(
            [10.0, 15.0],
            [14.0, 18.0],
            [0.0, 2.4],
            &[Facing::Front, Facing::Back, Facing::Left, Facing::Right],
        );
        b.polygon(&[[9.8, 13.8, 2.2], [15.2, 13.8, 2.2], [15.2, 18.2, 3.6], [9.8, 18.2, 3.6]]);
    }
}

fn car(b: &mut Builder, at: [f64; 2]) {
    b.within([at[0], at[1], 0.0], 4.0, |b| {
        b.block([0.0, 2.0], [0.0, 4.3], [0.2, 0.95]);
        b.block([0.1, 1.9], [1.0, 3.4], [0.95, 1.5]);
    });
}
