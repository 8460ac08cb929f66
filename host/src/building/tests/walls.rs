//! Walls of made-up sides of rooms: no two in one place, and their thickness.

use super::rooms::{house, through_the_door, with_free_floor};
use crate::building::spaces::faces::Face;
use crate::building::spaces::line::Line;
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

/// Whether no two walls share more than a centimeter across and along.
fn no_overlaps(walls: &[Slab]) -> bool {
    let shared_m = |a: [f64; 2], b: [f64; 2]| a[1].min(b[1]) - a[0].max(b[0]);
    let overlap =
        |a: &Slab, b: &Slab| shared_m(a.faces_m, b.faces_m) > 0.0101 && shared_m(a.span, b.span) > 0.0101;
    let is_alone = |at: usize| walls[..at].iter().all(|other| !overlap(other, &walls[at]));
    (0..walls.len()).all(is_alone)
}
