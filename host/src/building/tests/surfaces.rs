//! The openings of the two rooms as surfaces.

use super::rooms::{DOOR_M, Drive, HEAD_M, WINDOW_M, WINDOW_Z_M, house, through_the_door, with_evidence};
use crate::building::rooms;
use crate::building::surfaces::with_rectangles;
use crate::model::PlanarPolygon;
use crate::reconstruct::polygons::validate;

/// The plane of the wall with the window.
const WINDOW_WALL: usize = 1;

/// The two rooms, and rays through door and window.
fn seen_house() -> Drive {
    let mut drive = house();
    // What passes the farther face of the wall passed the nearer one.
    drive.through(1, 5.1, 8.1, [DOOR_M, [0.45, HEAD_M]]);
    drive.through(0, 4.0, 4.15, [WINDOW_M, WINDOW_Z_M]);
    drive
}

fn followed(drive: &Drive) -> Vec<PlanarPolygon> {
    with_evidence(drive, &through_the_door(), |evidence| with_rectangles(evidence, &rooms(evidence)))
}

/// The window of the wall y = 4 with a ragged border: its corners in x and z.
fn with_window(drive: &mut Drive, corners: &[[f64; 2]]) {
    let wall = drive.model.polygons.iter_mut().find(|polygon| polygon.plane == WINDOW_WALL).unwrap();
    wall.holes_m = vec![corners.iter().map(|[x, z]| [*x, 4.0, *z]).collect()];
}

fn window(polygons: &[PlanarPolygon]) -> Vec<[f64; 2]> {
    let wall = polygons.iter().find(|polygon| polygon.plane == WINDOW_WALL).unwrap();
    wall.holes_m[0].iter().map(|p| [p[0], p[2]]).collect()
}

fn extent(corners: &[[f64; 2]]) -> [[f64; 2]; 2] {
    [0, 1].map(|axis| {
        let places = corners.iter().map(|corner| corner[axis]);
        places.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], at| [low.min(at), high.max(at)])
    })
}

#[test]
fn borders_that_are_straight_stay_bit_for_bit() {
    let drive = seen_house();
    assert_eq!(followed(&drive), drive.model.polygons);
}

#[test]
fn a_ragged_window_becomes_a_rectangle() {
    let mut drive = seen_house();
    let ragged =
        [[1.96, 0.9], [2.03, 1.5], [1.95, 2.1], [2.6, 2.15], [3.25, 2.06], [3.17, 1.2], [3.24, 0.85]];
    with_window(&mut drive, &ragged);
    let polygons = followed(&drive);
    let corners = window(&polygons);
    assert_eq!(corners.len(), 4, "{corners:?}");
    let [x, z] = extent(&corners);
    for (at, expected) in x.iter().zip(WINDOW_M).chain(z.iter().zip(WINDOW_Z_M)) {
        assert!((at - expected).abs() < 0.03, "{corners:?}");
    }
    let wall = polygons.iter().find(|polygon| polygon.plane == WINDOW_WALL).unwrap();
    assert_eq!(validate::check(wall, &drive.model.planes[WINDOW_WALL]), Ok(()));
}

#[test]
fn nothing_is_added_where_rays_pass() {
    let mut drive = seen_house();
    // The window has a bulge to the right, and rays go through that.
    with_window(
        &mut drive,
        &[[2.0, 0.9], [2.0, 2.1], [3.2, 2.1], [3.2, 1.7], [3.26, 1.5], [3.2, 1.3], [3.2, 0.9]],
    );
    drive.through(0, 4.0, 4.15, [[3.2, 3.26], [1.45, 1.55]]);
    let corners = window(&followed(&drive));
    assert!(extent(&corners)[0][1] > 3.25, "{corners:?}");
}

#[test]
fn what_stands_in_a_window_stays() {
    let mut drive = seen_house();
    // A post from the sill to the middle, 20 cm wide, in the plane of the wall: points end on it.
    let post = [[2.5, 0.9], [2.5, 1.6], [2.7, 1.6], [2.7, 0.9]];
    let hole = [&[[2.0, 0.9], [2.0, 2.1], [3.2, 2.1], [3.2, 0.9]][..], &[post[3], post[2], post[1], post[0]]];
    with_window(&mut drive, &hole.concat());
    for step in 0..400 {
        let (column, row) = (step % 20, step / 20);
        let place = [2.505 + 0.01 * f64::from(column), 4.0, 0.92 + 0.034 * f64::from(row)];
        drive.see(0, WINDOW_WALL as i32, place);
    }
    let corners = window(&followed(&drive));
    assert!(corners.iter().any(|[x, z]| (z - 1.6).abs() < 0.01 && (*x - 2.5).abs() < 0.01), "{corners:?}");
}
