//! A building that stands otherwise in the map is the same building.

use super::rooms::{Drive, house, through_the_door, with_free_floor};
use crate::building::elements::{Elements, Use};
use crate::building::rooms;

/// The plane of the wall x = 8.1, in which the second room ends.
const EAST: usize = 8;
/// Where the floor beside it ends that was seen without a ceiling, meters.
const FREE_M: f64 = 14.0;

/// A turn about the origin.
#[derive(Clone, Copy)]
struct Turned {
    sin: f64,
    cos: f64,
}

impl Turned {
    fn by(degrees: f64) -> Self {
        let (sin, cos) = degrees.to_radians().sin_cos();
        Self { sin, cos }
    }

    fn flat(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        [self.cos * x - self.sin * y, self.sin * x + self.cos * y]
    }

    fn back(&self, place: [f64; 2]) -> [f64; 2] {
        Self { sin: -self.sin, ..*self }.flat(place)
    }

    fn place(&self, [x, y, z]: [f64; 3]) -> [f64; 3] {
        let [x, y] = self.flat([x, y]);
        [x, y, z]
    }

    fn drive(&self, mut drive: Drive) -> Drive {
        for plane in &mut drive.model.planes {
            plane.normal = self.place(plane.normal);
        }
        for polygon in &mut drive.model.polygons {
            for point in polygon.outer_m.iter_mut().chain(polygon.holes_m.iter_mut().flatten()) {
                *point = self.place(*point);
            }
        }
        let cloud = &mut drive.cloud;
        for point in cloud.points_m.iter_mut().chain(&mut cloud.origins_m) {
            *point = self.place(point.map(f64::from)).map(|value| value as f32);
        }
        drive
    }
}

/// The house without its last wall: the second room has an open end.
fn open_house() -> Drive {
    let mut drive = house();
    drive.model.polygons.retain(|polygon| polygon.plane != EAST);
    for label in drive.labels.iter_mut().filter(|label| **label == EAST as i32) {
        *label = -1;
    }
    drive
}

fn found(drive: Drive, degrees: f64) -> Elements {
    let turned = Turned::by(degrees);
    let path_m: Vec<[f64; 2]> = through_the_door().into_iter().map(|place| turned.flat(place)).collect();
    let is_free = |place: [f64; 2]| {
        let [x, y] = turned.back(place);
        let is_door = x > 4.9 && x < 5.2 && y > 1.5 && y < 2.4;
        is_door || y > 0.0 && y < 4.0 && (x > 0.0 && x < 5.0 || x > 5.1 && x < FREE_M)
    };
    with_free_floor(&turned.drive(drive), &path_m, is_free, rooms)
}

/// Areas of rooms, widths of doors, hundredths.
fn sizes(found: &Elements) -> Vec<[i64; 2]> {
    let whole = |value: f64| (value * 100.0).round() as i64;
    let doors = found.openings.iter().filter(|opening| opening.kind == Use::Door);
    let rooms = found.rooms.iter().map(|room| [0, whole(room.area_m2)]);
    let mut sizes: Vec<[i64; 2]> = rooms.chain(doors.map(|door| [1, whole(door.width_m)])).collect();
    sizes.sort_unstable();
    sizes
}

#[test]
fn rooms_are_as_large_however_the_building_stands_also_where_no_wall_ends_them() {
    let straight = sizes(&found(open_house(), 0.0));
    assert_eq!(straight.len(), 3, "two rooms and a door: {straight:?}");
    for degrees in [10.45, 22.45, 45.0, 67.4, 91.0, 200.0] {
        let turned = sizes(&found(open_house(), degrees));
        let is_near = |(a, b): (&[i64; 2], &[i64; 2])| a[0] == b[0] && (a[1] - b[1]).abs() <= 6;
        let is_same = turned.len() == straight.len() && straight.iter().zip(&turned).all(is_near);
        assert!(is_same, "{degrees}: {turned:?} is not {straight:?}");
    }
}
