//! The floor: what of the rooms the robot drove on or its lower laser saw to be free, and the thresholds of
//! doors between them.

use super::simplify::simplified;
use crate::building::elements::{Elements, Room, Use, WallOpening};
use crate::building::spaces::evidence::{Evidence, Seen};
use crate::building::spaces::raster::{CELL_M, Grid};
use crate::model::inferred::{InferredKind, InferredSurface};
use crate::reconstruct::polygons::outline::union::{Ring, Shape, area_m2, difference, doubled_area, union};
use crate::reconstruct::polygons::plane_frame::{FlatPoint, STEP_M};
use crate::reconstruct::polygons::seams::clearance;

/// What is no free floor in a room is left out when it is wider than twice this, meters: walls' feet and
/// the legs of furniture are narrower.
const HALF_WIDTH_M: f64 = 0.15;
/// And larger than this, square meters.
const MIN_HOLE_M2: f64 = 0.25;
/// What is left out reaches into walls by this, meters.
const TO_WALL_M: f64 = 0.15;
/// Borders of what is left out move by no more than this, meters: a cell and its diagonal.
const BORDER_M: f64 = 0.08;
/// Smaller pieces of floor are none, square meters.
const MIN_PIECE_M2: f64 = 0.5;
/// Thresholds reach into the rooms on both sides by this, meters, so that they hang together.
const OVERLAP_M: f64 = 0.02;

/// The floors of all rooms, storey by storey.
pub(super) fn surfaces(evidence: &Evidence<'_>, elements: &Elements) -> Vec<InferredSurface> {
    let mut found = Vec::new();
    for storey in &elements.storeys {
        let rooms: Vec<&Room> = elements.rooms.iter().filter(|room| room.storey == storey.id).collect();
        let lift = |p: &FlatPoint| {
            let [x, y] = evidence.area.grid.origin_m;
            [x + f64::from(p.x) * STEP_M, y + f64::from(p.y) * STEP_M, storey.floor_z_m]
        };
        for shape in shapes(evidence, elements, &rooms) {
            let mut rings = shape.iter().map(|ring| ring.iter().map(lift).collect());
            let Some(outer_m) = rings.next() else { continue };
            found.push(InferredSurface {
                kind: InferredKind::Floor,
                part_of: storey.id.clone(),
                normal: [0.0, 0.0, 1.0],
                offset_m: storey.floor_z_m,
                outer_m,
                holes_m: rings.collect(),
            });
        }
    }
    found
}

/// The floor of some rooms, in steps from the corner of the grid.
fn shapes(evidence: &Evidence<'_>, elements: &Elements, rooms: &[&Room]) -> Vec<Shape> {
    let grid = &evidence.area.grid;
    let mut rings: Vec<Ring> = Vec::new();
    for room in rooms {
        rings.push(flat(grid, &room.outline_m));
        rings.extend(room.holes_m.iter().map(|hole| flat(grid, hole)));
    }
    let doors = elements.openings.iter().filter(|opening| is_crossed(evidence, opening));
    rings.extend(doors.filter_map(|door| threshold(elements, door)).map(|ring| flat(grid, &ring)));
    let whole = union(rings.iter().map(Vec::as_slice));
    let left_out = not_free(evidence, rooms);
    let free = difference(whole.iter().flatten().map(Vec::as_slice), left_out.iter().map(Vec::as_slice));
    let mut shapes = clearance::clear(free);
    shapes.retain(|shape| shape.first().is_some_and(|outer| area_m2(outer) >= MIN_PIECE_M2));
    shapes
}

fn flat(grid: &Grid, ring: &[[f64; 2]]) -> Ring {
    let step = |p: &[f64; 2], axis: usize| ((p[axis] - grid.origin_m[axis]) / STEP_M).round() as i32;
    ring.iter().map(|p| FlatPoint::new(step(p, 0), step(p, 1))).collect()
}

/// Whether a door leads from one room to another, and the lower laser saw the way to be free.
fn is_crossed(evidence: &Evidence<'_>, opening: &WallOpening) -> bool {
    let [x, y, _] = opening.center_m;
    let cell = evidence.area.grid.cell([x, y]);
    opening.kind != Use::Window
        && opening.rooms.len() == 2
        && cell.is_some_and(|cell| evidence.seen[cell] == Seen::Free)
}

/// The floor in a door, counter-clockwise.
fn threshold(elements: &Elements, door: &WallOpening) -> Option<[[f64; 2]; 4]> {
    let wall = elements.wall(&door.wall)?;
    let [x, y] = wall.along_at(wall.place_m(door));
    let half = [door.width_m / 2.0, wall.drawn_thickness_m / 2.0 + OVERLAP_M];
    let at = |along: f64, aside: f64| {
        let (along, aside) = (along * half[0], aside * half[1]);
        [door.center_m[0] + along * x - aside * y, door.center_m[1] + along * y + aside * x]
    };
    Some([at(-1.0, -1.0), at(1.0, -1.0), at(1.0, 1.0), at(-1.0, 1.0)])
}

/// The borders of what is in rooms, and that nobody saw to be free, counter-clockwise.
fn not_free(evidence: &Evidence<'_>, rooms: &[&Room]) -> Vec<Ring> {
    let grid = &evidence.area.grid;
    let (mut is_room, mut mask) = (vec![false; grid.len()], vec![false; grid.len()]);
    for room in rooms {
        let rings = std::iter::once(&room.outline_m).chain(&room.holes_m);
        grid.fill(&rings.map(Vec::as_slice), |cell| {
            (is_room[cell], mask[cell]) = (true, evidence.seen[cell] != Seen::Free);
        });
    }
    let mask = grid.opened(&mask, HALF_WIDTH_M);
    // What stands at a wall is left out up to the wall: no strip of floor is behind it.
    let to_wall = ((TO_WALL_M / CELL_M) * (TO_WALL_M / CELL_M)) as f32;
    let away = grid.squared_distances(&mask);
    let mask: Vec<bool> =
        (0..grid.len()).map(|cell| mask[cell] || !is_room[cell] && away[cell] <= to_wall).collect();
    let (piece_of, sizes) = grid.pieces(&mask);
    let is_large = |piece: &u32| sizes[*piece as usize] as f64 * CELL_M * CELL_M >= MIN_HOLE_M2;
    let cells = (0..grid.len()).filter(|cell| piece_of[*cell].as_ref().is_some_and(is_large));
    let side = (CELL_M / STEP_M).round() as i32;
    let squares: Vec<Ring> = cells
        .map(|cell| {
            let [x, y] = [cell % grid.size[0], cell / grid.size[0]].map(|at| at as i32 * side);
            [(x, y), (x + side, y), (x + side, y + side), (x, y + side)]
                .map(|(x, y)| FlatPoint::new(x, y))
                .to_vec()
        })
        .collect();
    let pieces = union(squares.iter().map(Vec::as_slice));
    // Holes of pieces are closed: what is free around nothing but what is not is out of reach.
    let outer = pieces.into_iter().filter_map(|shape| shape.into_iter().next());
    let rings = outer.map(|ring| simplified(&ring, BORDER_M / STEP_M));
    rings.filter(|ring| doubled_area(ring) > 0).collect()
}
