//! A curved wall between two rooms, drawn by hand, with the rays that a drive through its door would have.

use super::rooms::{Drive, HEAD_M, HEIGHT_M, LASERS_M, with_free_floor};
use crate::building::elements::{Elements, KnownBy, Use};
use crate::building::rooms;
use crate::model::Cloud;
use crate::model::cylinder::{Cylinder, CylinderKind, SeenFrom};
use biplane_geometry::PortableMath;
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI};

/// Faces of the wall around the corner of the first room: a quarter of a circle.
const FACES_M: [f64; 2] = [4.0, 4.12];
/// Width of the door in the middle of the wall, along it.
const DOOR_M: f64 = 0.9;
/// From here a laser sees what the curve hides from that of the second room.
const BEHIND_M: [f64; 3] = [2.0, 5.5, 0.45];
/// The far corner of the second room.
const FAR_M: [f64; 2] = [8.1, 6.0];

fn is_door(angle_rad: f64) -> bool {
    (angle_rad - FRAC_PI_4).abs() * (FACES_M[0] + FACES_M[1]) / 2.0 < DOOR_M / 2.0
}

fn at(radius_m: f64, angle_rad: f64, z_m: f64) -> [f64; 3] {
    let (sin, cos) = angle_rad.portable_sin_cos();
    [radius_m * cos, radius_m * sin, z_m]
}

fn quarter(radius_m: f64, seen_from: SeenFrom) -> Cylinder {
    Cylinder {
        kind: CylinderKind::Wall,
        axis_point_m: [0.0; 3],
        axis_direction: [0.0, 0.0, 1.0],
        radius_m,
        from_m: 0.0,
        to_m: HEIGHT_M,
        arc_deg: [0.0, 90.0],
        seen_arc_deg: [0.0, 90.0],
        seen_from,
        points: 1000,
        rms_m: 0.01,
        seen_m: [0.0, HEIGHT_M],
        cuts: [[0.0; 2]; 2],
    }
}

/// Both rooms under one ceiling. `inner` and `outer` say which faces of the curved wall were seen.
fn house(inner: bool, outer: bool) -> Drive {
    let mut drive = Drive::default();
    drive.cloud.origins_m = LASERS_M.iter().chain([&BEHIND_M]).map(|p| p.map(|value| value as f32)).collect();
    let (up, [wide, deep]) = ([0.0, 0.0, HEIGHT_M], FAR_M);
    let [low, high] = FACES_M;
    for (room, from, to_x, to_y) in [(0, 0.0, low, low), (1, high, wide, deep)] {
        drive.face(room, [0.0, 1.0, 0.0], [from, 0.0, 0.0], [[to_x - from, 0.0, 0.0], up], None);
        drive.face(room, [1.0, 0.0, 0.0], [0.0, from, 0.0], [[0.0, to_y - from, 0.0], up], None);
    }
    drive.face(1, [0.0, -1.0, 0.0], [0.0, deep, 0.0], [[wide, 0.0, 0.0], up], None);
    drive.face(1, [-1.0, 0.0, 0.0], [wide, 0.0, 0.0], [[0.0, deep, 0.0], up], None);
    let sides = [[wide, 0.0, 0.0], [0.0, deep, 0.0]];
    drive.face(1, [0.0, 0.0, -1.0], [0.0, 0.0, HEIGHT_M], sides, None);
    for (room, radius_m, seen_from, is_seen) in
        [(0, low, SeenFrom::Inside, inner), (1, high, SeenFrom::Outside, outer)]
    {
        if is_seen {
            drive.model.cylinders.push(quarter(radius_m, seen_from));
            curved(&mut drive, room, radius_m);
        }
    }
    through_the_door(&mut drive);
    without_hidden(&mut drive);
    drive
}

/// Drops points that the curved wall hides from their laser.
fn without_hidden(drive: &mut Drive) {
    let cloud = &drive.cloud;
    let is_seen = |index: usize| {
        let (from, to) = (cloud.origins_m[cloud.scan[index] as usize], cloud.points_m[index]);
        let (from, to) = (from.map(f64::from), to.map(f64::from));
        (0..150).all(|step| {
            let [x, y, z] = [0, 1, 2].map(|k| from[k] + f64::from(step) / 150.0 * (to[k] - from[k]));
            let is_in_wall = (x.portable_hypot(y) - 4.06).abs() < 0.03;
            !is_in_wall || is_door(y.portable_atan2(x)) && z < HEAD_M
        })
    };
    let kept: Vec<usize> = (0..cloud.points_m.len()).filter(|index| is_seen(*index)).collect();
    drive.labels = kept.iter().map(|index| drive.labels[*index]).collect();
    drive.cloud = Cloud {
        points_m: kept.iter().map(|index| cloud.points_m[*index]).collect(),
        scan: kept.iter().map(|index| cloud.scan[*index]).collect(),
        beam: kept.iter().map(|index| cloud.beam[*index]).collect(),
        ..cloud.clone()
    };
}

/// The points of one face.
fn curved(drive: &mut Drive, room: u32, radius_m: f64) {
    for column in 0..320 {
        let angle_rad = (f64::from(column) + 0.5) / 320.0 * FRAC_PI_2;
        let room = if room == 1 && angle_rad > FRAC_PI_4 { 2 } else { room };
        for z_m in (0..125).map(|row| 0.05 + 0.02 * f64::from(row)) {
            if !is_door(angle_rad) || z_m > HEAD_M {
                drive.see(room, -1, at(radius_m, angle_rad, z_m));
            }
        }
    }
}

/// Rays of the first laser through the door, to the far walls.
fn through_the_door(drive: &mut Drive) {
    let laser = LASERS_M[0];
    for angle_rad in (0..400).map(|k| f64::from(k) / 400.0 * FRAC_PI_2).filter(|angle| is_door(*angle)) {
        for z_m in (0..82).map(|k| 0.46 + 0.02 * f64::from(k)) {
            let place = at(FACES_M[0], angle_rad, z_m);
            let way = [0, 1, 2].map(|k| place[k] - laser[k]);
            let share = (0..2).map(|k| (FAR_M[k] - laser[k]) / way[k]).fold(f64::INFINITY, f64::min);
            drive.see(0, -1, [0, 1, 2].map(|k| laser[k] + share * way[k]));
        }
    }
}

fn found(drive: &Drive) -> Elements {
    let is_free = |[x, y]: [f64; 2]| {
        let away_m = x.portable_hypot(y);
        let is_in_wall = away_m > FACES_M[0] && away_m < FACES_M[1];
        (0.0..FAR_M[0]).contains(&x)
            && (0.0..FAR_M[1]).contains(&y)
            && (!is_in_wall || is_door(y.portable_atan2(x)))
    };
    let path_m: Vec<[f64; 2]> = (0..60).map(|k| [1.5 + 0.05 * f64::from(k); 2]).collect();
    with_free_floor(drive, &path_m, is_free, rooms)
}

#[test]
fn a_curved_wall_between_two_rooms_is_one_wall_with_its_door() {
    let found = found(&house(true, true));
    let mut areas: Vec<f64> = found.rooms.iter().map(|room| room.area_m2).collect();
    areas.sort_by(f64::total_cmp);
    let quarters = FACES_M.map(|radius_m| PI * radius_m * radius_m / 4.0);
    let [small, large] = [quarters[0], FAR_M[0] * FAR_M[1] - quarters[1]];
    assert!(areas.len() == 2 && (areas[0] - small).abs() < 0.05, "{areas:?}, {small} expected");
    assert!((areas[1] - large).abs() < 0.05, "{areas:?}, {large} expected");

    let curved: Vec<_> = found.walls.iter().filter(|wall| !wall.is_straight()).collect();
    let [wall] = curved[..] else { panic!("{:?}", found.walls) };
    let curve = wall.curve.unwrap();
    assert!((curve.radius_m - 4.06).abs() < 0.005, "{curve:?}");
    assert_eq!((wall.thickness_from, wall.rooms.len(), wall.inferred), (KnownBy::Faces, 2, false));
    assert!((wall.thickness_m.unwrap() - 0.12).abs() < 0.005, "{wall:?}");
    assert!((wall.length_m() - 4.06 * FRAC_PI_2).abs() < 0.1, "{}", wall.length_m());
    // The middle of a quarter lies at 45 degrees; what is left of its way is its center.
    let middle = wall.point(wall.length_m() / 2.0, 0.0);
    assert!((middle[0] - middle[1]).abs() < 0.05, "{middle:?}");
    assert!(wall.place_of([0.0, 0.0])[1] > 4.0);

    let [door] = &found.openings[..] else { panic!("{:?}", found.openings) };
    assert_eq!((door.kind, &door.wall, door.rooms.len()), (Use::Door, &wall.id, 2));
    assert!((door.width_m - DOOR_M).abs() < 0.03 && (door.height_m - HEAD_M).abs() < 0.03, "{door:?}");
    let away_m = door.center_m[0].portable_hypot(door.center_m[1]);
    assert!((away_m - 4.06).abs() < 0.01, "in the middle of the wall, not on a chord: {door:?}");
}

#[test]
fn a_curved_wall_of_which_one_face_was_seen_has_no_thickness() {
    let found = found(&house(true, false));
    let curved: Vec<_> = found.walls.iter().filter(|wall| !wall.is_straight()).collect();
    assert!(!curved.is_empty() && curved.iter().all(|wall| wall.thickness_m.is_none() && wall.inferred));
}
