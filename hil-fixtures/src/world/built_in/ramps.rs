//! Corridors with ramps, and one with a door sill: floors that lift and tilt the robot.
//!
//! 2.2 m wide, 2.5 m high, the drive starts at the origin along x. Between two level parts lies a ramp of 6
//! degrees, 10 m long in plan; its ceiling is parallel to it or level. Cabinets, frames and pillars tell
//! where along the corridor the robot is.

use super::builder::Builder;
use super::passage::{Passage, Station, Thing};
use crate::world::World;
use crate::world::path::Path;

const HALF_WIDTH: f64 = 1.1;
const HEIGHT: f64 = 2.5;
/// Where the corridor begins and where its ramp does, along x.
const START: f64 = -2.0;
const FOOT: f64 = 5.0;
/// Length of the ramp in plan, and of the level part behind it.
const RAMP: f64 = 10.0;
const BEHIND: f64 = 8.0;
const SLOPE_DEG: f64 = 6.0;
/// The curved ramp's radius, and the angle of each of its straight pieces.
const RADIUS: f64 = 5.0;
const PIECE_DEG: f64 = 5.0;

/// A ramp up; the ceiling goes with it.
pub(crate) fn up() -> World {
    straight("ramp-up", 1.0, false)
}

/// A ramp down; the ceiling goes with it.
pub(crate) fn down() -> World {
    straight("ramp-down", -1.0, false)
}

/// A ramp up; the ceiling stays level above all of it.
pub(crate) fn up_under_a_level_ceiling() -> World {
    straight("ramp-level", 1.0, true)
}

fn straight(name: &str, sign: f64, level: bool) -> World {
    let rise = sign * RAMP * SLOPE_DEG.to_radians().tan();
    let station = |x: f64, floor_m: f64| {
        let ceiling_m = if level { rise.max(0.0) + HEIGHT } else { floor_m + HEIGHT };
        Station { at_m: [x, 0.0], floor_m, ceiling_m }
    };
    let top = FOOT + RAMP;
    let stations =
        vec![station(START, 0.0), station(FOOT, 0.0), station(top, rise), station(top + BEHIND, rise)];
    let way = vec![[0.0, 0.0], [top + BEHIND - 2.0, 0.0]];
    world(name, &Passage { stations, half_m: HALF_WIDTH }, way)
}

/// A quarter turn to the left that climbs all along.
pub(crate) fn curved() -> World {
    let pieces = (90.0 / PIECE_DEG) as usize;
    let rise = RADIUS * std::f64::consts::FRAC_PI_2 * SLOPE_DEG.to_radians().tan();
    let mut stations = vec![Station { at_m: [START, 0.0], floor_m: 0.0, ceiling_m: HEIGHT }];
    for piece in 0..=pieces {
        let (sin, cos) = (piece as f64 * PIECE_DEG).to_radians().sin_cos();
        let floor_m = rise * piece as f64 / pieces as f64;
        let at_m = [FOOT + RADIUS * sin, RADIUS * (1.0 - cos)];
        stations.push(Station { at_m, floor_m, ceiling_m: floor_m + HEIGHT });
    }
    let at_m = [FOOT + RADIUS, RADIUS + BEHIND];
    stations.push(Station { at_m, floor_m: rise, ceiling_m: rise + HEIGHT });
    let mut way = vec![[0.0, 0.0]];
    way.extend(stations[1..stations.len() - 1].iter().map(|station| station.at_m));
    way.push([FOOT + RADIUS, RADIUS + BEHIND - 2.0]);
    world("ramp-curved", &Passage { stations, half_m: HALF_WIDTH }, way)
}

/// A level corridor with a sill 2 cm high across it.
pub(crate) fn sill() -> World {
    let heights = [
        (START, 0.0),
        (FOOT, 0.0),
        (FOOT + 0.03, 0.02),
        (FOOT + 0.11, 0.02),
        (FOOT + 0.14, 0.0),
        (FOOT + RAMP, 0.0),
    ];
    let station = |&(x, floor_m): &(f64, f64)| Station { at_m: [x, 0.0], floor_m, ceiling_m: HEIGHT };
    let passage = Passage { stations: heights.iter().map(station).collect(), half_m: HALF_WIDTH };
    world("sill", &passage, vec![[0.0, 0.0], [FOOT + RAMP - 2.0, 0.0]])
}

fn world(name: &str, passage: &Passage, waypoints_m: Vec<[f64; 2]>) -> World {
    let mut builder = Builder::default();
    passage.build(&mut builder, &THINGS);
    let weaving = Path {
        name: "along".to_owned(),
        waypoints_m,
        follow_ground: true,
        speed_m_s: 0.3,
        acceleration_m_s2: 0.4,
        weave_m: 0.12,
        weave_length_m: 5.0,
        ..Path::default()
    };
    let straight = Path { name: "straight".to_owned(), weave_m: 0.0, ..weaving.clone() };
    let paths = vec![weaving, straight];
    let (mesh, rounds) = builder.finish_all();
    World { name: name.to_owned(), mesh, rounds, objects: Vec::new(), plan: None, paths }
}

const fn thing(along_m: [f64; 2], left: bool, depth_m: f64, height_m: [f64; 2]) -> Thing {
    Thing { along_m, left, depth_m, height_m }
}

/// What stands along the way, meters from the corridor's beginning.
const THINGS: [Thing; 18] = [
    thing([0.6, 1.5], true, 0.4, [0.0, 1.9]),
    thing([2.9, 3.0], false, 0.04, [0.0, 2.1]),
    thing([3.9, 4.0], false, 0.04, [0.0, 2.1]),
    thing([4.6, 5.4], true, 0.35, [0.0, 0.9]),
    thing([6.2, 6.5], false, 0.15, [0.0, 2.8]),
    thing([7.6, 7.7], true, 0.04, [0.0, 2.1]),
    thing([8.6, 8.7], true, 0.04, [0.0, 2.1]),
    thing([9.3, 10.2], false, 0.4, [0.0, 1.8]),
    thing([10.9, 11.2], true, 0.15, [0.0, 2.8]),
    thing([12.4, 13.1], false, 0.3, [0.0, 1.1]),
    thing([13.6, 13.7], true, 0.04, [0.0, 2.1]),
    thing([14.6, 14.7], true, 0.04, [0.0, 2.1]),
    thing([15.5, 15.8], false, 0.15, [0.0, 2.8]),
    thing([16.6, 17.5], true, 0.38, [0.0, 1.5]),
    thing([18.6, 18.7], false, 0.04, [0.0, 2.1]),
    thing([19.6, 19.7], false, 0.04, [0.0, 2.1]),
    thing([21.0, 21.3], true, 0.15, [0.0, 2.8]),
    thing([22.6, 23.3], false, 0.4, [0.0, 1.7]),
];
