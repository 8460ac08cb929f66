//! Walls of made-up sides of rooms: no two in one place, and their thickness. What is under an opening.

use super::rooms::{DOOR_M, Drive, HEAD_M, WINDOW_M, WINDOW_Z_M, house, through_the_door, with_free_floor};
use crate::building::elements::{Use, WallOpening};
use crate::building::rooms;
use crate::building::spaces::faces::Face;
use crate::building::spaces::line::{Curve, Line};
use crate::building::walls::overlaps;
use crate::building::walls::sides::Side;
use crate::building::walls::slabs::{self, Slab, ThicknessFrom};

/// A side of a room along x.
fn side(space: usize, offset_m: f64, outward: f64, span: [f64; 2]) -> Side {
    Side { space, line: Line::Straight { normal: [0.0, 1.0] }, offset_m, outward, span }
}

/// A face along x that looks up the plan, in places.
fn face(offset_m: f64, places_m: &[[f64; 2]]) -> Face {
    // Along a face is to the left of its normal.
    let any_m: Vec<[f64; 2]> = places_m.iter().map(|[from, to]| [-to, -from]).collect();
    Face {
        normal: [0.0, 1.0],
        offset_m,
        upper_m: any_m.clone(),
        any_m,
        area_m2: 1.0,
        rms_m: 0.01,
        curve: None,
    }
}

fn walls(sides: &[Side], faces: &[Face]) -> Vec<Slab> {
    let nothing_free = |_| false;
    with_free_floor(&house(), &through_the_door(), nothing_free, |evidence| {
        overlaps::cut(slabs::find(evidence, sides, faces))
    })
}

#[test]
fn a_wall_whose_far_face_shows_in_a_few_doors_is_one_wall_of_that_thickness() {
    let sides = [side(0, 1.0, 1.0, [-15.0, 0.0])];
    let behind = face(1.14, &[[4.0, 4.3], [10.0, 10.35]]);
    let found = walls(&sides, &[behind]);
    let [wall] = &found[..] else { panic!("{found:?}") };
    assert_eq!((wall.from, wall.span), (ThicknessFrom::SameLine, [-15.0, 0.0]));
    assert!((wall.thickness_m().unwrap() - 0.14).abs() < 1e-9);
}

#[test]
fn a_far_face_that_hardly_shows_tells_no_thickness() {
    // Of two pieces, that lie differently deep: one is of something else.
    let sides = [side(0, 1.0, 1.0, [-15.0, 0.0])];
    let behind = [face(1.14, &[[4.0, 4.6]]), face(1.3, &[[10.0, 10.6]])];
    let found = walls(&sides, &behind);
    let long = found.iter().filter(|wall| wall.thickness_m().is_none()).map(Slab::length_m).sum::<f64>();
    assert!(long > 13.0, "{found:?}");
    assert!(no_overlaps(&found), "{found:?}");
}

#[test]
fn a_side_that_lies_in_a_wall_is_that_wall() {
    // A wall 10 cm thick between two rooms, and a third room whose side was only seen 4 cm within it.
    let sides =
        [side(0, 1.0, 1.0, [-8.0, -3.0]), side(1, 1.1, -1.0, [-8.0, 0.0]), side(2, 1.04, 1.0, [-3.2, 0.0])];
    let found = walls(&sides, &[]);
    assert!(no_overlaps(&found), "{found:?}");
    let between = found.iter().find(|wall| wall.thickness_m().is_some()).unwrap();
    assert!((between.thickness_m().unwrap() - 0.1).abs() < 1e-9);
}

#[test]
fn a_wall_of_unknown_thickness_is_not_drawn_into_the_one_behind_it() {
    let sides = [side(0, 1.0, 1.0, [-8.0, -3.0]), side(1, 1.12, -1.0, [-3.3, 0.0])];
    let found = walls(&sides, &[]);
    assert_eq!(found.len(), 2);
    assert!(no_overlaps(&found), "{found:?}");
    assert!(found.iter().all(|wall| wall.thickness_m().is_none()));
}

#[test]
fn a_straight_piece_of_a_curved_wall_is_no_wall_of_its_own() {
    let slab = |line: Line, faces_m: [f64; 2], span: [f64; 2]| Slab {
        line,
        faces_m,
        is_seen: [true; 2],
        span,
        from: ThicknessFrom::Faces,
        spaces: vec![0],
    };
    // A quarter of a circle about the origin, a chord in it, a piece that goes on from it straight on, and a
    // wall that comes to it from inside.
    let circle = Curve { center_m: [0.0; 2], radius_m: 5.0, zero_rad: 0.0 };
    let arc = slab(Line::Curved(circle), [4.93, 5.07], [-3.9, 3.9]);
    let level = Line::Straight { normal: [1.0, 0.0] };
    let chord = slab(level, [4.9, 5.0], [-0.6, 0.6]);
    let tangent = slab(level, [4.93, 5.07], [0.0, 2.0]);
    let spoke = slab(Line::Straight { normal: [0.0, 1.0] }, [0.0, 0.1], [-5.0, -1.0]);
    let found = overlaps::cut(vec![chord, tangent, spoke.clone(), arc.clone()]);
    assert_eq!(found.len(), 3, "{found:?}");
    assert!(found.contains(&arc) && found.contains(&spoke), "{found:?}");
    // At 1.2 m the tangent has left the arc.
    assert!(found.iter().any(|wall| (wall.span[0] - 1.2).abs() < 0.15 && wall.span[1] == 2.0), "{found:?}");
}

/// Whether no two walls share more than a centimeter across and along.
fn no_overlaps(walls: &[Slab]) -> bool {
    let shared_m = |a: [f64; 2], b: [f64; 2]| a[1].min(b[1]) - a[0].max(b[0]);
    let overlap =
        |a: &Slab, b: &Slab| shared_m(a.faces_m, b.faces_m) > 0.0101 && shared_m(a.span, b.span) > 0.0101;
    let is_alone = |at: usize| walls[..at].iter().all(|other| !overlap(other, &walls[at]));
    (0..walls.len()).all(is_alone)
}

/// The openings that a drive through the first room shows.
fn openings(drive: &Drive) -> Vec<WallOpening> {
    let inside: Vec<[f64; 2]> = (0..40).map(|step| [1.0 + 0.05 * f64::from(step), 2.0]).collect();
    let is_free = |[x, y]: [f64; 2]| x > 0.0 && x < 5.0 && y > 0.0 && y < 4.0;
    with_free_floor(drive, &inside, is_free, rooms).openings
}

#[test]
fn a_shut_leaf_behind_the_face_of_its_wall_is_a_door_and_no_window() {
    // A leaf 6 cm behind the face; low down some of the beams that end on it count as ending on the wall.
    let mut drive = house();
    drive.through(1, 5.0, 5.045, [DOOR_M, [0.45, 0.65]]);
    drive.through(1, 5.0, 5.06, [DOOR_M, [0.65, HEAD_M]]);
    let found = openings(&drive);
    let [door] = &found[..] else { panic!("{found:?}") };
    assert_eq!((door.kind, door.evidence.as_str(), door.sill_m), (Use::Door, "closed leaf", 0.0));
    assert!(door.inferred, "nothing was seen of its foot: {door:?}");
    assert!((door.width_m - 0.9).abs() < 0.05 && (door.height_m - HEAD_M).abs() < 0.05, "{door:?}");
}

#[test]
fn a_window_is_measured_where_wall_was_seen_under_it() {
    let mut drive = house();
    drive.through(0, 4.0, 4.15, [WINDOW_M, WINDOW_Z_M]);
    let seen = openings(&drive);
    let [window] = &seen[..] else { panic!("{seen:?}") };
    assert_eq!((window.kind, window.inferred), (Use::Window, false));

    // A chest before it: its sill is a guess, and it is no door.
    let is_hidden = |p: &[f32; 3]| p[1] > 3.9 && p[2] < 0.9 && p[0] > 1.9 && p[0] < 3.3;
    let cloud = drive.cloud.clone();
    let left: Vec<usize> = (0..cloud.points_m.len()).filter(|at| !is_hidden(&cloud.points_m[*at])).collect();
    drive.cloud.points_m = left.iter().map(|at| cloud.points_m[*at]).collect();
    drive.cloud.scan = left.iter().map(|at| cloud.scan[*at]).collect();
    drive.cloud.beam = left.iter().map(|at| cloud.beam[*at]).collect();
    drive.labels = left.iter().map(|at| drive.labels[*at]).collect();
    let hidden = openings(&drive);
    let [window] = &hidden[..] else { panic!("{hidden:?}") };
    assert_eq!((window.kind, window.inferred), (Use::Window, true));
}
