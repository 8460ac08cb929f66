//! Two rooms drawn by hand, with the rays that a drive through them would have.

use super::add;
use crate::building::elements::{Elements, KnownBy, Use};
use crate::building::rooms;
use crate::building::spaces::evidence::{Area, Evidence, Seen};
use crate::building::spaces::line::Line;
use crate::building::walls::sides::Side;
use crate::building::walls::slabs::{self, Slab};
use crate::model::{Cloud, Model};
use biplane_geometry::vec3::cross;

/// Wall between the rooms: x from 5.0 to 5.1, with a door 0.9 m wide and 2.1 m high.
pub(super) const DOOR_M: [f64; 2] = [1.5, 2.4];
pub(super) const HEAD_M: f64 = 2.1;
/// Window in the wall y = 4 of the first room, with a pane 15 cm behind it.
pub(super) const WINDOW_M: [f64; 2] = [2.0, 3.2];
pub(super) const WINDOW_Z_M: [f64; 2] = [0.9, 2.1];
pub(super) const HEIGHT_M: f64 = 2.6;
/// Where the laser stands in each room.
pub(super) const LASERS_M: [[f64; 3]; 2] = [[2.5, 2.0, 0.45], [6.6, 2.0, 0.45]];

#[derive(Default)]
pub(super) struct Drive {
    pub(super) model: Model,
    pub(super) cloud: Cloud,
    pub(super) labels: Vec<i32>,
}

impl Drive {
    /// A point seen from the laser of a room.
    pub(super) fn see(&mut self, room: u32, label: i32, point: [f64; 3]) {
        self.cloud.points_m.push(point.map(|value| value as f32));
        self.cloud.scan.push(room);
        self.cloud.beam.push(0);
        self.labels.push(label);
    }

    /// A rectangle with a hole, its corner and sides, seen from a room.
    pub(super) fn face(
        &mut self,
        room: u32,
        normal: [f64; 3],
        corner: [f64; 3],
        sides: [[f64; 3]; 2],
        hole: Hole,
    ) {
        let at = |u: f64, v: f64| [0, 1, 2].map(|k| corner[k] + u * sides[0][k] + v * sides[1][k]);
        let length = |side: [f64; 3]| side.iter().map(|value| value * value).sum::<f64>().sqrt();
        let [wide, high] = sides.map(length);
        let ring = |u: [f64; 2], v: [f64; 2]| {
            [(u[0], v[0]), (u[1], v[0]), (u[1], v[1]), (u[0], v[1])].map(|(u, v)| at(u / wide, v / high))
        };
        let mut outer = ring([0.0, wide], [0.0, high]);
        let turns = (0..3).map(|k| cross(sides[0], sides[1])[k] * normal[k]).sum::<f64>() > 0.0;
        if !turns {
            outer.reverse();
        }
        match hole {
            Some([u, v]) => {
                let mut inner = ring(u, v);
                if turns {
                    inner.reverse();
                }
                add(&mut self.model, normal, &[&outer, &inner]);
            }
            None => add(&mut self.model, normal, &[&outer]),
        }
        let label = self.model.planes.len() as i32 - 1;
        let steps = |length: f64| (0..(length / 0.04) as usize).map(|step| 0.02 + 0.04 * step as f64);
        for (u, v) in steps(wide).flat_map(|u| steps(high).map(move |v| (u, v))) {
            let is_open = hole.is_some_and(|[us, vs]| us[0] < u && u < us[1] && vs[0] < v && v < vs[1]);
            if !is_open {
                self.see(room, label, at(u / wide, v / high));
            }
        }
    }

    /// Rays of the first laser through an opening, to where they reach a plane behind it.
    pub(super) fn through(&mut self, along: usize, face_m: f64, behind_m: f64, spans: [[f64; 2]; 2]) {
        let laser = LASERS_M[0];
        let across = 1 - along;
        let steps = |[from, to]: [f64; 2]| {
            (0..((to - from) / 0.02) as usize).map(move |k| from + 0.01 + 0.02 * k as f64)
        };
        for (at, z) in steps(spans[0]).flat_map(|at| steps(spans[1]).map(move |z| (at, z))) {
            let mut place = [0.0, 0.0, z];
            (place[along], place[across]) = (at, face_m);
            let share = (behind_m - laser[across]) / (face_m - laser[across]);
            self.see(0, -1, [0, 1, 2].map(|k| laser[k] + share * (place[k] - laser[k])));
        }
    }
}

pub(super) type Hole = Option<[[f64; 2]; 2]>;

/// The two rooms; what of the openings rays pass is for the caller to say.
pub(super) fn house() -> Drive {
    let mut drive = Drive::default();
    drive.cloud.origins_m = LASERS_M.iter().map(|p| p.map(|value| value as f32)).collect();
    let up = [0.0, 0.0, HEIGHT_M];
    for (room, x, far) in [(0, 0.0, 5.0), (1, 5.1, 8.1)] {
        let wide = far - x;
        let door = Some([DOOR_M, [0.0, HEAD_M]]);
        let window = Some([WINDOW_M, WINDOW_Z_M]).filter(|_| room == 0);
        let (west, east) = if room == 0 { (None, door) } else { (door, None) };
        drive.face(room, [0.0, 1.0, 0.0], [x, 0.0, 0.0], [[wide, 0.0, 0.0], up], None);
        drive.face(room, [0.0, -1.0, 0.0], [x, 4.0, 0.0], [[wide, 0.0, 0.0], up], window);
        drive.face(room, [1.0, 0.0, 0.0], [x, 0.0, 0.0], [[0.0, 4.0, 0.0], up], west);
        drive.face(room, [-1.0, 0.0, 0.0], [far, 0.0, 0.0], [[0.0, 4.0, 0.0], up], east);
        let sides = [[wide, 0.0, 0.0], [0.0, 4.0, 0.0]];
        drive.face(room, [0.0, 0.0, -1.0], [x, 0.0, HEIGHT_M], sides, None);
    }
    // The head of the door, seen from below.
    let sides = [[0.1, 0.0, 0.0], [0.0, DOOR_M[1] - DOOR_M[0], 0.0]];
    drive.face(0, [0.0, 0.0, -1.0], [5.0, DOOR_M[0], HEAD_M], sides, None);
    drive
}

fn found(drive: &Drive, path_m: &[[f64; 2]]) -> Elements {
    with_evidence(drive, path_m, rooms)
}

/// What comes of all that a drive shows.
pub(super) fn with_evidence<T>(drive: &Drive, path_m: &[[f64; 2]], of: impl FnOnce(&Evidence<'_>) -> T) -> T {
    let is_free = |[x, y]: [f64; 2]| {
        let is_room = y > 0.0 && y < 4.0 && (x > 0.0 && x < 5.0 || x > 5.1 && x < 8.1);
        is_room || (x > 4.9 && x < 5.2 && y > DOOR_M[0] && y < DOOR_M[1])
    };
    with_free_floor(drive, path_m, is_free, of)
}

/// The same where the floor is free.
pub(super) fn with_free_floor<T>(
    drive: &Drive,
    path_m: &[[f64; 2]],
    is_free: impl Fn([f64; 2]) -> bool,
    of: impl FnOnce(&Evidence<'_>) -> T,
) -> T {
    let area = Area::around(&drive.model, path_m);
    let grid = &area.grid;
    let seen: Vec<Seen> = (0..grid.len())
        .map(|cell| if is_free(grid.center_m(cell)) { Seen::Free } else { Seen::Unknown })
        .collect();
    of(&Evidence {
        model: &drive.model,
        cloud: &drive.cloud,
        labels: &drive.labels,
        area: &area,
        seen: &seen,
        path_m,
        floor_m: 0.0,
        sigma_m: 0.01,
        storey: 1,
    })
}

/// From the first room into the second.
pub(super) fn through_the_door() -> Vec<[f64; 2]> {
    (0..=80).map(|step| [2.5 + 0.05 * f64::from(step), 2.0]).collect()
}

#[test]
fn two_rooms_with_a_door_and_a_window_are_found_with_their_sizes() {
    let mut drive = house();
    drive.through(1, 5.0, 8.1, [DOOR_M, [0.45, HEAD_M]]);
    drive.through(0, 4.0, 4.15, [WINDOW_M, WINDOW_Z_M]);
    let found = found(&drive, &through_the_door());
    let areas: Vec<f64> = found.rooms.iter().map(|room| room.area_m2).collect();
    assert!((areas[0] - 20.0).abs() < 0.05 && (areas[1] - 12.0).abs() < 0.05, "{areas:?}");
    assert!(found.rooms.iter().all(|room| room.closed && !room.inferred));
    assert!(found.storeys[0].floor_inferred, "no laser saw it");

    let known: Vec<_> = found.walls.iter().filter(|wall| wall.thickness_m.is_some()).collect();
    let [between] = known[..] else { panic!("{:?}", found.walls) };
    assert!((between.thickness_m.unwrap() - 0.1).abs() < 1e-3, "{between:?}");
    assert_eq!((between.thickness_from, between.rooms.len()), (KnownBy::Faces, 2));
    // Those on which one face was seen are drawn with a depth that is marked as a guess.
    assert!(found.walls.iter().all(|wall| wall.inferred == wall.thickness_m.is_none()));
    assert_eq!(found.walls.len(), 5, "the walls y = 0 and y = 4 run on past the one between the rooms");

    let of = |kind: Use| found.openings.iter().find(|opening| opening.kind == kind).unwrap();
    let (door, window) = (of(Use::Door), of(Use::Window));
    assert_eq!(found.openings.len(), 2);
    assert_eq!((&door.wall, door.evidence.as_str()), (&between.id, "driven through"));
    assert_eq!(door.rooms, ["S1-R01", "S1-R02"]);
    assert!((door.width_m - 0.9).abs() < 0.03 && (door.height_m - HEAD_M).abs() < 0.02, "{door:?}");
    assert!((door.center_m[1] - 1.95).abs() < 0.02 && door.sill_m == 0.0, "{door:?}");
    assert_eq!((window.evidence.as_str(), &window.rooms[..]), ("seen through", &["S1-R01".to_owned()][..]));
    assert!((window.width_m - 1.2).abs() < 0.03 && (window.height_m - 1.2).abs() < 0.03, "{window:?}");
    assert!((window.sill_m - 0.9).abs() < 0.03, "{window:?}");
}

#[test]
fn a_hole_that_no_ray_passes_is_no_window_and_a_room_that_nobody_entered_is_none() {
    let mut drive = house();
    drive.through(1, 5.0, 8.1, [DOOR_M, [0.45, HEAD_M]]);
    let inside: Vec<[f64; 2]> = (0..40).map(|step| [1.0 + 0.05 * f64::from(step), 2.0]).collect();
    let found = found(&drive, &inside);
    assert_eq!(found.rooms.len(), 1);
    let kinds: Vec<(Use, &str)> =
        found.openings.iter().map(|opening| (opening.kind, opening.evidence.as_str())).collect();
    // What hides the window's place, and the window itself, look the same: nothing came there.
    assert_eq!(kinds, [(Use::Door, "seen through")]);
}

#[test]
fn names_and_sizes_do_not_depend_on_the_order_of_the_points() {
    let mut drive = house();
    drive.through(1, 5.0, 8.1, [DOOR_M, [0.45, HEAD_M]]);
    let first = found(&drive, &through_the_door());
    let order: Vec<usize> = (0..drive.labels.len()).rev().collect();
    let cloud = &drive.cloud;
    let turned = Cloud {
        points_m: order.iter().map(|at| cloud.points_m[*at]).collect(),
        scan: order.iter().map(|at| cloud.scan[*at]).collect(),
        ..cloud.clone()
    };
    let labels = order.iter().map(|at| drive.labels[*at]).collect();
    let other = found(&Drive { cloud: turned, labels, ..drive }, &through_the_door());
    let ids = |found: &Elements| -> Vec<(String, f64)> {
        let walls = found.walls.iter().map(|wall| (wall.id.clone(), (wall.height_m * 1e3).round()));
        let rooms = found.rooms.iter().map(|room| (room.id.clone(), (room.area_m2 * 1e2).round()));
        walls.chain(rooms).collect()
    };
    assert_eq!(ids(&first), ids(&other));
}

#[test]
fn two_faces_further_apart_than_they_are_long_are_no_wall() {
    let thickness_m = |length_m: f64| {
        let side = |space: usize, offset_m: f64, outward: f64| Side {
            space,
            line: Line::Straight { normal: [1.0, 0.0] },
            offset_m,
            outward,
            span: [0.0, length_m],
        };
        let sides = [side(0, 5.0, 1.0), side(1, 5.6, -1.0)];
        let walls = with_free_floor(
            &house(),
            &through_the_door(),
            |_| false,
            |evidence| slabs::find(evidence, &sides, &[]),
        );
        walls.iter().find_map(Slab::thickness_m)
    };
    assert_eq!(thickness_m(0.55), None, "a shaft");
    assert!(thickness_m(0.65).is_some_and(|found| (found - 0.6).abs() < 1e-9));
}

#[test]
fn a_door_is_as_wide_as_its_reveals_are_apart_where_split_beams_end_beside_them() {
    let mut drive = house();
    let [from, to] = DOOR_M;
    let split_m = 0.04;
    drive.through(1, 5.0, 8.1, [[from + split_m, to - split_m], [0.45, HEAD_M]]);
    let heights = || (0..80).map(|k| 0.46 + 0.02 * f64::from(k));
    for (jamb_m, into) in [(from, 1.0), (to, -1.0)] {
        for z in heights() {
            (0..4).for_each(|k| drive.see(0, 2, [5.0, jamb_m + into * split_m * f64::from(k) / 4.0, z]));
            drive.see(0, -1, [5.06, jamb_m, z]);
        }
    }
    let found = found(&drive, &through_the_door());
    let door = found.openings.iter().find(|opening| opening.kind == Use::Door).unwrap();
    assert!((door.width_m - 0.9).abs() < 0.01, "{door:?}");
}
