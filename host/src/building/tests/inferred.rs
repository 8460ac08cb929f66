//! What no laser saw of the two rooms.

use super::rooms::{DOOR_M, Drive, HEAD_M, WINDOW_M, WINDOW_Z_M, house, through_the_door, with_evidence};
use crate::building::rooms;
use crate::building::spaces::evidence::{Evidence, Seen};
use crate::building::surfaces::inferred::surfaces;
use crate::model::PlanarPolygon;
use crate::model::inferred::{InferredKind, InferredSurface};
use crate::reconstruct::polygons::validate;

/// The lowest that the laser sees.
const LOWEST_M: f64 = 0.5;

/// The two rooms, their walls seen from a height up.
fn seen_from(low_m: f64) -> Drive {
    let mut drive = house();
    drive.through(1, 5.0, 8.1, [DOOR_M, [0.45, HEAD_M]]);
    drive.through(0, 4.0, 4.15, [WINDOW_M, WINDOW_Z_M]);
    let rings =
        drive.model.polygons.iter_mut().flat_map(|p| std::iter::once(&mut p.outer_m).chain(&mut p.holes_m));
    rings.flatten().filter(|corner| corner[2] == 0.0).for_each(|corner| corner[2] = low_m);
    drive
}

/// What is inferred of them, when cells of the map are as `seen` has them.
fn inferred(drive: &Drive, seen: impl Fn([f64; 2], Seen) -> Seen) -> Vec<InferredSurface> {
    with_evidence(drive, &through_the_door(), |evidence| {
        let elements = rooms(evidence);
        let cells = evidence.seen.iter().enumerate();
        let cells: Vec<Seen> =
            cells.map(|(cell, known)| seen(evidence.area.grid.center_m(cell), *known)).collect();
        let evidence = Evidence { seen: &cells, ..*evidence };
        surfaces(&evidence, &elements, &drive.model.polygons)
    })
}

fn area_m2(found: &[InferredSurface], kind: InferredKind) -> f64 {
    found.iter().filter(|surface| surface.kind == kind).map(InferredSurface::area_m2).sum()
}

fn all_are_valid(found: &[InferredSurface]) {
    for surface in found {
        assert_eq!(validate::check(&surface.polygon(), &surface.plane()), Ok(()), "{surface:?}");
    }
}

#[test]
fn walls_reach_the_floor_and_the_floor_goes_through_the_door() {
    let drive = seen_from(LOWEST_M);
    let found = inferred(&drive, |_, seen| seen);
    all_are_valid(&found);
    // Around both rooms, but for the door on either side.
    let around_m = 2.0 * (5.0 + 4.0) + 2.0 * (3.0 + 4.0) - 2.0 * 0.9;
    assert_eq!(area_m2(&found, InferredKind::OpeningSurround), 0.0, "nothing is hidden");
    let base_m2 = area_m2(&found, InferredKind::WallBase);
    assert!((base_m2 - LOWEST_M * around_m).abs() < 0.1, "{base_m2} is not {}", LOWEST_M * around_m);
    let floor: Vec<&InferredSurface> =
        found.iter().filter(|surface| surface.kind == InferredKind::Floor).collect();
    assert_eq!((floor.len(), floor[0].part_of.as_str()), (1, "S1"));
    assert!((floor[0].area_m2() - (20.0 + 12.0 + 0.09)).abs() < 0.1, "{}", floor[0].area_m2());
    // Bases begin where the seen wall ends, on its own corners.
    let corners: Vec<[f64; 3]> =
        drive.model.polygons.iter().flat_map(|polygon: &PlanarPolygon| polygon.outer_m.clone()).collect();
    let bases = found.iter().filter(|surface| surface.kind == InferredKind::WallBase);
    assert!(bases.clone().all(|base| base.outer_m.iter().any(|p| corners.contains(p))));
    assert!(bases.flat_map(|base| &base.outer_m).all(|p| p[2] <= LOWEST_M + 1e-9));
}

/// From where to where, and up to where, nobody saw the wall beside the window.
const HIDDEN_M: [f64; 2] = [1.8, 2.0];
const HIDDEN_TO_M: f64 = 1.5;

/// The two rooms, with a piece of wall beside the lower half of the window that nobody saw.
fn hidden_beside_the_window() -> Drive {
    let ([left, right], [low, high]) = (WINDOW_M, WINDOW_Z_M);
    let [hidden, middle] = [HIDDEN_M[0], HIDDEN_TO_M];
    let hole = [(left, middle), (left, high), (right, high), (right, low), (hidden, low), (hidden, middle)];
    hidden_at_the_window(&hole, [low, middle])
}

/// The two rooms, with another hole for the window, and no points beside it from one height to another.
fn hidden_at_the_window(new_hole: &[(f64, f64)], [from_m, to_m]: [f64; 2]) -> Drive {
    let mut drive = seen_from(LOWEST_M);
    let is_hidden = |[x, y, z]: [f64; 3]| {
        let is_wall = (y - 4.0).abs() < 0.01 && HIDDEN_M[0] < x && x < HIDDEN_M[1];
        is_wall && from_m < z && z < to_m
    };
    let holes = drive.model.polygons.iter_mut().flat_map(|polygon| &mut polygon.holes_m);
    for hole in holes.filter(|hole| hole.iter().all(|p| p[1] == 4.0)) {
        *hole = new_hole.iter().map(|(x, z)| [*x, 4.0, *z]).collect();
    }
    let keep: Vec<bool> = drive.cloud.points_m.iter().map(|p| !is_hidden(p.map(f64::from))).collect();
    let mut is_kept = keep.iter().cycle();
    drive.cloud.points_m.retain(|_| is_kept.next() == Some(&true));
    drive.cloud.scan.retain(|_| is_kept.next() == Some(&true));
    drive.cloud.beam.retain(|_| is_kept.next() == Some(&true));
    drive.labels.retain(|_| is_kept.next() == Some(&true));
    drive
}

#[test]
fn beyond_a_jamb_that_nobody_saw_there_is_wall_over_the_head_and_under_the_sill() {
    let ([left, right], [sill, head]) = (WINDOW_M, WINDOW_Z_M);
    let ([hidden, _], beyond_m) = (HIDDEN_M, 0.2);
    let [low, high] = [sill - beyond_m, head + beyond_m];
    let hole = [
        (left, low),
        (hidden, low),
        (hidden, high),
        (left, high),
        (left, head),
        (right, head),
        (right, sill),
        (left, sill),
    ];
    let found = inferred(&hidden_at_the_window(&hole, [low, high]), |_, seen| seen);
    all_are_valid(&found);
    let surrounds: Vec<&InferredSurface> =
        found.iter().filter(|surface| surface.kind == InferredKind::OpeningSurround).collect();
    assert_eq!(surrounds.len(), 2, "{surrounds:?}");
    for surround in surrounds {
        assert!((surround.area_m2() - beyond_m * (left - hidden)).abs() < 0.01, "{surround:?}");
        let is_open = |p: &[f64; 3]| (sill + 0.02..head - 0.02).contains(&p[2]);
        assert!(!surround.outer_m.iter().any(is_open), "{surround:?}");
    }
}

#[test]
fn openings_are_whole_rectangles_where_something_hid_the_wall_beside_them() {
    let found = inferred(&hidden_beside_the_window(), |_, seen| seen);
    all_are_valid(&found);
    let surrounds: Vec<&InferredSurface> =
        found.iter().filter(|surface| surface.kind == InferredKind::OpeningSurround).collect();
    let [surround] = surrounds[..] else { panic!("{surrounds:?}") };
    let hidden_m2 = (HIDDEN_M[1] - HIDDEN_M[0]) * (HIDDEN_TO_M - WINDOW_Z_M[0]);
    assert!((surround.area_m2() - hidden_m2).abs() < 0.01, "{surround:?}");
    let is_beside = |p: &[f64; 3]| {
        (HIDDEN_M[0] - 0.01..HIDDEN_M[1] + 0.02).contains(&p[0])
            && (WINDOW_Z_M[0] - 0.02..HIDDEN_TO_M + 0.01).contains(&p[2])
    };
    assert!(surround.outer_m.iter().all(is_beside), "{surround:?}");
}

#[test]
fn where_rays_pass_beside_an_opening_nothing_surrounds_it() {
    let mut drive = hidden_beside_the_window();
    // A slit, too narrow to be a part of the window.
    let slit = [HIDDEN_M[0] + 0.05, HIDDEN_M[0] + 0.08];
    drive.through(0, 4.0, 6.0, [slit, [WINDOW_Z_M[0], HIDDEN_TO_M]]);
    let found = inferred(&drive, |_, seen| seen);
    assert_eq!(area_m2(&found, InferredKind::OpeningSurround), 0.0);
}

#[test]
fn a_wall_that_begins_high_up_gets_no_base() {
    let found = inferred(&seen_from(0.8), |_, seen| seen);
    assert_eq!(area_m2(&found, InferredKind::WallBase), 0.0);
}

#[test]
fn what_the_lower_laser_looked_through_stays_open() {
    let drive = seen_from(LOWEST_M);
    // A meter and a half of the wall y = 0.
    let is_open = |[x, y]: [f64; 2]| (-0.3..0.0).contains(&y) && (1.0..2.5).contains(&x);
    let all = area_m2(&inferred(&drive, |_, seen| seen), InferredKind::WallBase);
    let found = inferred(&drive, |place, seen| if is_open(place) { Seen::Free } else { seen });
    all_are_valid(&found);
    let less_m2 = all - area_m2(&found, InferredKind::WallBase);
    assert!((less_m2 - 1.5 * LOWEST_M).abs() < 0.06, "{less_m2}");
}

#[test]
fn what_nobody_saw_to_be_free_is_no_floor() {
    let drive = seen_from(LOWEST_M);
    // A bed in the corner of the first room.
    let is_bed = |[x, y]: [f64; 2]| x < 1.0 && y < 2.0;
    let all = area_m2(&inferred(&drive, |_, seen| seen), InferredKind::Floor);
    let found = inferred(&drive, |place, seen| if is_bed(place) { Seen::Unknown } else { seen });
    all_are_valid(&found);
    let less_m2 = all - area_m2(&found, InferredKind::Floor);
    assert!((less_m2 - 2.0).abs() < 0.25, "{less_m2}");
    let floor = found.iter().find(|surface| surface.kind == InferredKind::Floor).unwrap();
    assert!(floor.holes_m.is_empty(), "up to the walls, with no strip behind it");
}
