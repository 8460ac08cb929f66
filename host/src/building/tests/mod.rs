//! Rooms drawn by hand.

mod curved;
mod inferred;
mod rooms;
mod surfaces;
mod turned;
mod walls;

use crate::building::part::Kind;
use crate::building::plan::{self, Plan};
use crate::building::section::Line;
use crate::building::{Building, OpeningKind};
use crate::formats::Shapes;
use crate::model::{Model, PlanarPolygon, Plane};

/// Adds a polygon of its own plane.
pub(crate) fn add(model: &mut Model, normal: [f64; 3], rings_m: &[&[[f64; 3]]]) {
    let offset_m = (0..3).map(|k| normal[k] * rings_m[0][0][k]).sum();
    model.planes.push(Plane { normal, offset_m, points: 1000, rms_m: 0.01 });
    model.polygons.push(PlanarPolygon {
        plane: model.planes.len() - 1,
        outer_m: rings_m[0].to_vec(),
        holes_m: rings_m[1..].iter().map(|ring| ring.to_vec()).collect(),
    });
}

/// A room of 5 m by 4 m, 2.6 m high, its floor at `z`: a door of 0.9 m by 2 m in the wall y = 0, a window of
/// 1.2 m by 1.2 m with its sill at 0.9 m in the wall y = 4. Walls 0 to 3, floor 4, ceiling 5, and 6, a table
/// of 0.75 m.
pub(crate) fn add_room(model: &mut Model, z: f64) {
    let flat = |points: &[[f64; 2]], y: f64| points.iter().map(|[x, up]| [*x, y, z + up]).collect::<Vec<_>>();
    let door =
        [[0.0, 0.0], [1.0, 0.0], [1.0, 2.0], [1.9, 2.0], [1.9, 0.0], [5.0, 0.0], [5.0, 2.6], [0.0, 2.6]];
    add(model, [0.0, 1.0, 0.0], &[&flat(&door, 0.0)]);
    let whole = [[0.0, 0.0], [0.0, 2.6], [5.0, 2.6], [5.0, 0.0]];
    let window = [[2.0, 0.9], [3.2, 0.9], [3.2, 2.1], [2.0, 2.1]];
    add(model, [0.0, -1.0, 0.0], &[&flat(&whole, 4.0), &flat(&window, 4.0)]);
    for (x, side) in [(0.0, 1.0), (5.0, -1.0)] {
        let ring = [[x, 0.0, z], [x, 4.0, z], [x, 4.0, z + 2.6], [x, 0.0, z + 2.6]];
        add(model, [side, 0.0, 0.0], &[&ring]);
    }
    let level =
        |x: f64, y: f64, up: f64| [[0.0, 0.0, z + up], [x, 0.0, z + up], [x, y, z + up], [0.0, y, z + up]];
    add(model, [0.0, 0.0, 1.0], &[&level(5.0, 4.0, 0.0)]);
    add(model, [0.0, 0.0, -1.0], &[&level(5.0, 4.0, 2.6)]);
    add(model, [0.0, 0.0, 1.0], &[&level(2.0, 1.5, 0.75)]);
}

/// One room on the ground.
pub(crate) fn room() -> Model {
    let mut model = Model::default();
    add_room(&mut model, 0.0);
    model
}

fn kinds(building: &Building) -> Vec<Kind> {
    building.parts.iter().map(|part| part.kind).collect()
}

/// Lines with their ends, and then the lines, in order, millimeters.
fn sorted(lines: &[Line]) -> Vec<[[i64; 2]; 2]> {
    let whole = |line: &Line| {
        let mut ends = line.map(|end| end.map(|value| (value * 1000.0).round() as i64));
        ends.sort_unstable();
        ends
    };
    let mut lines: Vec<[[i64; 2]; 2]> = lines.iter().map(whole).collect();
    lines.sort_unstable();
    lines
}

const ROOM_LINES: [[[i64; 2]; 2]; 6] = [
    [[0, 0], [0, 4000]],
    [[0, 0], [1000, 0]],
    [[0, 4000], [2000, 4000]],
    [[1900, 0], [5000, 0]],
    [[3200, 4000], [5000, 4000]],
    [[5000, 0], [5000, 4000]],
];

#[test]
fn a_room_is_its_walls_with_a_gap_for_the_door_and_one_for_the_window() {
    use Kind::{Ceiling, Floor, Other, Wall};
    let model = room();
    let building = Building::read(&model, None);
    assert_eq!(building.floors_m, [0.0]);
    assert_eq!(kinds(&building), [Wall, Wall, Wall, Wall, Floor, Ceiling, Other]);
    let plan = plan::draw(&model, &building, 0).unwrap();
    assert_eq!(sorted(&plan.walls), ROOM_LINES);
    assert!(plan.section.is_empty() && plan.leaves.is_empty());
    assert_eq!((plan.floors.len(), plan.floors[0].len(), plan.ceilings.len()), (1, 4, 1));

    let [door, window] = building.openings[..] else { panic!("{:?}", building.openings) };
    assert_eq!((door.kind, door.polygon), (OpeningKind::Door, 0));
    assert!((door.width_m() - 0.9).abs() < 1e-9 && (door.height_m() - 2.0).abs() < 1e-9, "{door:?}");
    assert_eq!((window.kind, window.polygon), (OpeningKind::Window, 1));
    assert!((window.width_m() - 1.2).abs() < 1e-9, "{window:?}");
    assert!((window.bottom_m - 0.9).abs() < 1e-9 && (window.top_m - 2.1).abs() < 1e-9, "{window:?}");
}

#[test]
fn rectangular_holes_over_the_cut_are_windows_that_no_plan_shows() {
    let mut model = Model::default();
    let at = |[x, z]: [f64; 2]| [x, 0.0, z];
    let facade = [[0.0, 0.0], [9.0, 0.0], [9.0, 6.0], [0.0, 6.0]].map(at);
    let window = |x: f64, low: f64| [[x, low], [x, low + 1.6], [x + 1.2, low + 1.6], [x + 1.2, low]].map(at);
    let gable = [[6.0, 4.3], [6.6, 5.9], [7.2, 4.3]].map(at);
    add(
        &mut model,
        [0.0, -1.0, 0.0],
        &[&facade, &window(1.0, 1.0), &window(1.0, 4.3), &window(3.0, 4.3), &gable],
    );
    let building = Building::read(&model, Some(0.0));
    let bottoms_m: Vec<f64> = building.openings.iter().map(|window| window.bottom_m).collect();
    assert_eq!(bottoms_m, [1.0, 4.3, 4.3]);
    for window in &building.openings {
        assert_eq!(window.kind, OpeningKind::Window);
        assert!(
            (window.width_m() - 1.2).abs() < 1e-9 && (window.height_m() - 1.6).abs() < 1e-9,
            "{window:?}"
        );
    }
    let shown: Vec<bool> = building.openings.iter().map(|window| window.is_cut(0.0)).collect();
    assert_eq!(shown, [true, false, false]);
}

#[test]
fn two_storeys_have_a_plan_each_and_keep_their_parts() {
    let mut model = room();
    add_room(&mut model, 3.0);
    let building = Building::read(&model, None);
    assert_eq!(building.floors_m, [0.0, 3.0]);
    let storeys: Vec<usize> = building.parts.iter().map(|part| part.storey).collect();
    assert_eq!(storeys, [[0; 7], [1; 7]].concat());
    let plans: Vec<Plan> = (0..2).filter_map(|storey| plan::draw(&model, &building, storey)).collect();
    assert_eq!(sorted(&plans[0].walls), ROOM_LINES);
    assert_eq!(sorted(&plans[1].walls), ROOM_LINES);
    assert_eq!((plans[1].floor_m, plans[1].floors.len()), (3.0, 1));
    let per_storey = |storey| building.openings.iter().filter(|o| o.storey == storey).count();
    assert_eq!((per_storey(0), per_storey(1)), (2, 2));
}

#[test]
fn a_floor_that_nobody_saw_is_where_it_is_known_to_be_and_no_part() {
    let mut model = room();
    model.polygons.remove(4);
    // The laser sees nothing below itself: walls begin at 0.45 m.
    for p in model.polygons.iter_mut().flat_map(|polygon| &mut polygon.outer_m) {
        p[2] = p[2].max(0.45);
    }
    let known = Building::read(&model, Some(0.0));
    assert_eq!(known.floors_m, [0.0]);
    assert!(!kinds(&known).contains(&Kind::Floor));
    assert_eq!(known.openings.len(), 2);
    assert!((known.openings[0].height_m() - 2.0).abs() < 1e-9);
    let unknown = Building::read(&model, None);
    assert_eq!((unknown.floors_m.len(), unknown.openings.len()), (0, 0), "a table is no floor");
    assert_eq!(plan::draw(&model, &unknown, 0), None);
    assert_eq!(kinds(&unknown)[..4], [Kind::Wall; 4]);
}

#[test]
fn the_leaf_of_a_closed_door_is_no_wall_and_a_board_on_the_wall_no_window() {
    let mut model = room();
    let leaf = [[1.0, -0.08, 0.0], [1.9, -0.08, 0.0], [1.9, -0.08, 2.0], [1.0, -0.08, 2.0]];
    add(&mut model, [0.0, 1.0, 0.0], &[&leaf]);
    let board = [[2.0, 3.97, 0.9], [3.2, 3.97, 0.9], [3.2, 3.97, 2.1], [2.0, 3.97, 2.1]];
    add(&mut model, [0.0, -1.0, 0.0], &[&board]);
    let building = Building::read(&model, None);
    assert_eq!((building.parts[7].kind, building.leaves.as_slice()), (Kind::Leaf, [(7, 0)].as_slice()));
    assert_eq!(building.openings.len(), 1);
    let plan = plan::draw(&model, &building, 0).unwrap();
    assert_eq!(sorted(&plan.leaves), [[[1000, -80], [1900, -80]]]);
}

#[test]
fn a_slanting_gap_a_gap_without_lintel_and_a_passage_are_told_from_doors() {
    let wall = |ring: &[[f64; 2]]| {
        let mut model = room();
        model.polygons[0].outer_m = ring.iter().map(|[x, z]| [*x, 0.0, *z]).collect();
        Building::read(&model, None)
            .openings
            .iter()
            .filter(|o| o.polygon == 0)
            .map(|o| o.kind)
            .collect::<Vec<_>>()
    };
    let with = |gap: &[[f64; 2]]| {
        let mut ring = vec![[0.0, 0.0]];
        ring.extend_from_slice(gap);
        ring.extend([[5.0, 0.0], [5.0, 2.6], [0.0, 2.6]]);
        ring
    };
    assert_eq!(wall(&with(&[[1.0, 0.0], [1.0, 2.0], [1.9, 2.0], [1.9, 0.0]])), [OpeningKind::Door]);
    assert_eq!(wall(&with(&[[1.0, 0.0], [1.0, 2.2], [4.5, 2.2], [4.5, 0.0]])), [OpeningKind::Passage]);
    assert_eq!(wall(&with(&[[1.0, 0.0], [2.0, 2.0], [2.1, 2.0], [3.0, 0.0]])), [], "a shadow");
    assert_eq!(
        wall(&with(&[[1.0, 0.0], [1.0, 1.5], [1.9, 1.5], [1.9, 0.0]])),
        [],
        "behind a cupboard of 1.5 m"
    );
    assert_eq!(wall(&with(&[[1.0, 0.0], [1.0, 2.0], [1.3, 2.0], [1.3, 0.0]])), [], "a slit");
}

#[test]
fn lines_of_one_plane_that_touch_are_one_and_both_sides_of_a_wall_stay() {
    let mut model = room();
    let piece = |x0: f64, x1: f64| [[x0, 4.0, 0.0], [x1, 4.0, 0.0], [x1, 4.0, 2.6], [x0, 4.0, 2.6]].to_vec();
    model.polygons[1] = PlanarPolygon { plane: 1, outer_m: piece(0.0, 2.0), holes_m: Vec::new() };
    model.polygons.push(PlanarPolygon { plane: 1, outer_m: piece(2.0, 5.0), holes_m: Vec::new() });
    // The other side of that wall, 12 cm away.
    add(
        &mut model,
        [0.0, 1.0, 0.0],
        &[&[[0.0, 4.12, 0.0], [5.0, 4.12, 0.0], [5.0, 4.12, 2.6], [0.0, 4.12, 2.6]]],
    );
    let building = Building::read(&model, None);
    let walls = sorted(&plan::draw(&model, &building, 0).unwrap().walls);
    assert!(
        walls.contains(&[[0, 4000], [5000, 4000]]) && walls.contains(&[[0, 4120], [5000, 4120]]),
        "{walls:?}"
    );
    assert_eq!(Shapes::new(&model).faces.len(), model.polygons.len());
}
