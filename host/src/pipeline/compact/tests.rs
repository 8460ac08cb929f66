//! Meshes that are drawn: boxes and rooms become their faces, the right way round.

use super::compact;
use crate::model::area::area_m2;
use crate::model::{Mesh, PlanarPolygon};
use crate::pipeline::params::BuildParams;
use crate::reconstruct::planes::paper::random::Random;
use crate::reconstruct::polygons::validate;

/// A box as it is drawn: twelve triangles, seen from inside when `inwards`.
fn drawn_box(size_m: [f32; 3], inwards: bool) -> Mesh {
    let [x, y, z] = size_m;
    let vertices_m =
        (0..8u8).map(|k| [x * f32::from(k & 1), y * f32::from(k >> 1 & 1), z * f32::from(k >> 2)]).collect();
    // Each side as a ring that runs counter-clockwise seen from outside.
    let sides = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let mut triangles: Vec<[u32; 3]> =
        sides.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect();
    if inwards {
        triangles.iter_mut().for_each(|t| t.swap(1, 2));
    }
    Mesh { vertices_m, triangles }
}

#[test]
fn a_drawn_room_becomes_six_rectangles_that_face_as_its_triangles_do() {
    for inwards in [false, true] {
        let built = compact(drawn_box([5.0, 4.0, 2.5], inwards), &BuildParams::default(), &mut ());
        assert_eq!(
            (built.model.polygons.len(), built.counts.leftover_triangles),
            (6, 0),
            "{:?}",
            built.counts
        );
        let middle = [2.5, 2.0, 1.25];
        for polygon in &built.model.polygons {
            let plane = &built.model.planes[polygon.plane];
            assert_eq!(validate::check(polygon, plane), Ok(()));
            assert_eq!((polygon.outer_m.len(), polygon.holes_m.len()), (4, 0), "{polygon:?}");
            assert_eq!(plane.distance_m(middle) > 0.0, inwards);
            // Each corner is one of the box's.
            for corner in &polygon.outer_m {
                let off = |v: f64, size: f64| v.abs().min((v - size).abs());
                let off_m = off(corner[0], 5.0).max(off(corner[1], 4.0)).max(off(corner[2], 2.5));
                assert!(off_m < 0.01, "{corner:?}");
            }
        }
        assert_eq!((built.counts.raw_triangles, built.cloud.len(), built.labels.len()), (12, 8, 8));
    }
}

#[test]
fn a_drawn_pipe_is_its_own_sides_or_its_own_triangles() {
    // Twelve sides of 1.6 cm by 3 m.
    let mut tube = Mesh::default();
    for k in 0..12u8 {
        let (sin, cos) = (f32::from(k) * std::f32::consts::TAU / 12.0).sin_cos();
        tube.vertices_m.extend([[0.03 * cos, 0.03 * sin, 0.0], [0.03 * cos, 0.03 * sin, 3.0]]);
    }
    for k in 0..12u32 {
        let (a, b) = (2 * k, 2 * ((k + 1) % 12));
        tube.triangles.extend([[a, b, b + 1], [a, b + 1, a + 1]]);
    }
    let built = compact(tube.clone(), &BuildParams::default(), &mut ());
    let kept = built.model.leftovers.triangles.len();
    assert!(kept <= 24 && built.counts.polygons + kept > 0, "{:?}", built.counts);
    for p in built.model.polygons.iter().flat_map(|polygon| &polygon.outer_m) {
        assert!((p[0].hypot(p[1]) - 0.03).abs() < 0.01, "{p:?}");
    }
}

#[test]
fn a_triangle_is_drawn_too() {
    let vertices_m = vec![[0.0; 3], [4.0, 0.0, 0.0], [4.0, 3.0, 0.0]];
    let built = compact(Mesh { vertices_m, triangles: vec![[0, 1, 2]] }, &BuildParams::default(), &mut ());
    assert_eq!((built.model.polygons.len(), built.counts.leftover_triangles), (1, 0));
}

/// A hundred by a hundred points a meter apart, as far off the floor as `height` says.
fn wide(mut height: impl FnMut() -> f64) -> Mesh {
    let at = |k: u32| [(k % 100) as f32, (k / 100) as f32, height() as f32];
    let vertices_m = (0..10_000).map(at).collect();
    let corners = (0..9900).filter(|k| k % 100 < 99);
    let triangles = corners.flat_map(|k| [[k, k + 1, k + 101], [k, k + 101, k + 100]]).collect();
    Mesh { vertices_m, triangles }
}

#[test]
fn a_floor_scanned_with_a_meter_between_points_is_one_polygon() {
    let mut random = Random::new(6);
    let built = compact(wide(|| 0.02 * random.normal()), &BuildParams::default(), &mut ());
    assert_eq!((built.model.polygons.len(), built.counts.leftover_triangles), (1, 0), "{:?}", built.counts);
    assert!(built.model.polygons[0].holes_m.is_empty());
}

#[test]
fn rough_ground_with_a_meter_between_points_stays_as_it_is() {
    let mut random = Random::new(7);
    let mesh = wide(|| 40.0 * random.unit());
    let all_m2 = area_m2(&mesh);
    let built = compact(mesh, &BuildParams::default(), &mut ());
    assert!(area_m2(&built.model.leftovers) > 0.9 * all_m2, "{:?}", built.counts);
}

#[test]
fn of_a_drawn_house_beside_its_trees_the_walls_are_polygons() {
    // A room, and three thousand leaves of half a meter each that lie every way.
    let mut random = Random::new(8);
    let mut mesh = drawn_box([20.0, 12.0, 6.0], false);
    let all_m2 = area_m2(&mesh);
    for _ in 0..3000 {
        let (first, at) = (mesh.vertices_m.len() as u32, [40.0 + 20.0 * random.unit(), 20.0 * random.unit()]);
        for _ in 0..3 {
            let place = [at[0] + 0.4 * random.unit(), at[1] + 0.4 * random.unit(), 5.0 + 0.4 * random.unit()];
            mesh.vertices_m.push(place.map(|v| v as f32));
        }
        mesh.triangles.push([first, first + 1, first + 2]);
    }
    let built = compact(mesh, &BuildParams::default(), &mut ());
    let flat = |polygon: &&PlanarPolygon| polygon.outer_m.iter().all(|p| p[0] < 21.0);
    let walls: Vec<&PlanarPolygon> = built.model.polygons.iter().filter(flat).collect();
    assert_eq!(walls.len(), 6, "{:?}", built.counts);
    assert!(all_m2 > 800.0);
}

#[test]
fn a_mesh_without_triangles_gives_an_empty_model() {
    let built = compact(Mesh::default(), &BuildParams::default(), &mut ());
    assert_eq!((built.counts.polygons, built.counts.leftover_triangles), (0, 0));
}
