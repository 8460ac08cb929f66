//! Triangles at the borders of planes, one case each.

use super::merge;
use crate::model::{Cloud, Mesh, Plane};
use crate::reconstruct::fixture::{corridor, drive};
use crate::reconstruct::planes::labeled::Planes;
use crate::reconstruct::polygons::params::Merging;
use crate::reconstruct::polygons::params::PolygonParams;
use crate::reconstruct::polygons::triangles::assign::{Assigner, Pieces};
use crate::reconstruct::polygons::validate;
use biplane_geometry::vec3::{cross, dot};

const WALL: Plane = Plane { normal: [0.0, -1.0, 0.0], offset_m: -1.0, points: 3, rms_m: 0.0 };
const CEILING: Plane = Plane { normal: [0.0, 0.0, -1.0], offset_m: -2.0, points: 3, rms_m: 0.0 };
const BACK: Plane = Plane { normal: [-1.0, 0.0, 0.0], offset_m: -3.0, points: 3, rms_m: 0.0 };
const BOARD: Plane = Plane { normal: [0.0, -1.0, 0.0], offset_m: -0.95, points: 3, rms_m: 0.0 };

/// One triangle seen from the origin; its corners are on the planes with these indices, or on none.
fn pieces(planes: &[Plane], corners: [([f32; 3], i32); 3]) -> Pieces {
    pieces_with(PolygonParams::default().min_structure_points, planes, corners)
}

fn pieces_with(min_structure_points: usize, planes: &[Plane], corners: [([f32; 3], i32); 3]) -> Pieces {
    let cloud = Cloud {
        points_m: corners.iter().map(|c| c.0).collect(),
        scan: vec![0, 0, 0],
        beam: vec![0, 1, 2],
        origins_m: vec![[0.0; 3]],
        beams_per_scan: 3,
        ..Cloud::default()
    };
    let labels: Vec<i32> = corners.iter().map(|c| c.1).collect();
    let params = PolygonParams { min_structure_points, ..Default::default() };
    let laid_m =
        crate::reconstruct::polygons::triangles::project_to_plane::onto_planes(&cloud, &labels, planes);
    let mesh = Mesh { vertices_m: cloud.points_m.clone(), triangles: vec![[0, 1, 2]] };
    Assigner { params: &params, cloud: &cloud, planes, labels: &labels, laid_m }.assign(&mesh)
}

fn area_m2(pieces: &[Vec<[f64; 3]>]) -> f64 {
    let of = |p: &Vec<[f64; 3]>| {
        let side = |k: usize| std::array::from_fn(|i| p[k][i] - p[0][i]);
        let normal = cross(side(1), side(2));
        0.5 * dot(normal, normal).sqrt()
    };
    pieces.iter().map(of).sum()
}

#[test]
fn a_triangle_round_an_edge_is_folded_into_the_common_line() {
    // Two corners 10 cm below the ceiling, 10 cm apart, one on the ceiling 8 cm from the wall.
    let found =
        pieces(&[WALL, CEILING], [([0.0, 1.0, 1.9], 0), ([0.1, 1.0, 1.9], 0), ([0.05, 0.92, 2.0], 1)]);
    assert!(found.rest.is_empty() && found.jump_edges == 0);
    // Each plane gets the part up to the line y = 1, z = 2: triangles with a base of 10 cm.
    assert!((area_m2(&found.rings[0]) - 0.005).abs() < 1e-6, "{found:?}");
    assert!((area_m2(&found.rings[1]) - 0.004).abs() < 1e-6, "{found:?}");
}

#[test]
fn a_triangle_in_the_corner_of_a_room_is_shared_by_three_planes() {
    let found =
        pieces(&[WALL, CEILING, BACK], [([2.9, 1.0, 1.9], 0), ([2.9, 0.9, 2.0], 1), ([3.0, 0.9, 1.9], 2)]);
    assert!(found.rest.is_empty() && found.jump_edges == 0);
    for plane in 0..3 {
        assert!((area_m2(&found.rings[plane]) - 0.01).abs() < 1e-6, "{found:?}");
    }
}

#[test]
fn a_small_step_is_flattened_onto_both_planes_with_the_border_half_way() {
    let corners = [([0.0, 1.0, 0.2], 0), ([0.1, 1.0, 0.2], 0), ([0.05, 0.95, 0.3], 1)];
    let found = pieces(&[WALL, BOARD], corners);
    assert!(found.rings[0][0].iter().all(|p| WALL.distance_m(*p).abs() < 1e-9 && p[2] < 0.25 + 1e-6));
    assert!(found.rings[1][0].iter().all(|p| BOARD.distance_m(*p).abs() < 1e-9 && p[2] > 0.25 - 1e-6));
    // What was seen between both planes, a step too small for a surface, is laid on the one that has two
    // corners.
    let outlier = [corners[0], corners[1], (corners[2].0, -1)];
    let found = pieces(&[WALL, BOARD], outlier);
    assert_eq!((found.rings[0].len(), found.rings[1].len()), (1, 0));
}

#[test]
fn a_gap_along_the_beam_is_no_surface() {
    // An edge at half a meter and the wall behind it, in one line with the laser.
    let found = pieces(&[WALL], [([0.0, 0.7, 0.0], -1), ([0.0, 1.0, 0.0], 0), ([0.02, 1.0, 0.02], 0)]);
    assert_eq!((found.jump_edges, found.rest.len(), found.rings[0].len()), (1, 0, 0));
}

#[test]
fn a_mixed_pixel_between_two_planes_takes_its_triangles_with_it() {
    // Ranges 0.9, 1.1, 1.4: the middle beam met the edge.
    let near = Plane { offset_m: -0.9, ..WALL };
    let far = Plane { offset_m: -1.4, ..WALL };
    let corners = [([0.0, 0.9, 0.1], 0), ([0.0, 1.1, 0.35], -1), ([0.0, 1.4, 0.8], 1)];
    assert_eq!(pieces(&[near, far], corners).jump_edges, 1);
    // A point before both is something of its own.
    let before = [([0.0, 0.9, 0.1], 0), ([0.2, 0.7, 0.3], -1), ([0.4, 1.4, 1.3], 1)];
    assert_eq!(pieces_with(1, &[near, far], before).rest, [0]);
}

#[test]
fn planes_that_do_not_meet_leave_a_slit_and_a_spike_takes_its_triangles_with_it() {
    // A step of 14 cm, deeper than is laid on a plane.
    let recess = Plane { offset_m: -1.14, ..WALL };
    let step = [([0.0, 1.0, 0.2], 0), ([0.1, 1.0, 0.2], 0), ([0.05, 1.14, 0.5], 1)];
    let found = pieces(&[WALL, recess], step);
    assert_eq!((found.jump_edges, found.rest.len()), (1, 0));
    // A single point 20 cm before the wall is a spike; where four hang together there is something.
    let spike = [([0.0, 1.0, 0.2], 0), ([0.3, 1.0, 0.2], 0), ([0.15, 0.8, 0.5], -1)];
    let found = pieces(&[WALL], spike);
    assert_eq!((found.jump_edges, found.rest.len()), (1, 0));
}

#[test]
fn a_stray_point_near_a_wall_is_laid_on_it() {
    let (mut cloud, mesh, mut planes) = wall(|_, _| false);
    let outlier = 20 * 41 + 20;
    cloud.points_m[outlier][1] -= 0.08;
    planes.labels[outlier] = -1;
    let merged = merge(&PolygonParams::default(), &cloud, &mesh, &planes);
    assert_eq!((merged.polygons.len(), merged.polygons[0].holes_m.len(), merged.rest.len()), (1, 0, 0));
}

#[test]
fn triangles_of_no_plane_are_left_over() {
    let alone = [([0.0, 0.5, 0.0], -1), ([0.1, 0.5, 0.0], -1), ([0.0, 0.5, 0.1], -1)];
    let with = |min_structure_points: usize| pieces_with(min_structure_points, &[WALL], alone);
    assert_eq!(with(3).rest, [0]);
    assert!(with(4).rest.is_empty(), "three points are too few to be something");
}

/// A wall of 2 m by 2 m in cells of 5 cm, seen from the origin; cells that `open` names by their middle are
/// missing.
fn wall(open: impl Fn(f32, f32) -> bool) -> (Cloud, Mesh, Planes) {
    let (mut cloud, mut mesh) = (Cloud { beams_per_scan: 41, ..Cloud::default() }, Mesh::default());
    for (column, row) in (0..41u16).flat_map(|column| (0..41u16).map(move |row| (column, row))) {
        cloud.points_m.push([0.05 * f32::from(column), 1.0, 0.05 * f32::from(row)]);
        cloud.scan.push(u32::from(column));
        cloud.beam.push(row);
        let here = u32::from(column) * 41 + u32::from(row);
        let middle = (0.05 * f32::from(column) + 0.025, 0.05 * f32::from(row) + 0.025);
        if column < 40 && row < 40 && !open(middle.0, middle.1) {
            mesh.triangles.extend([[here, here + 41, here + 42], [here, here + 42, here + 1]]);
        }
    }
    cloud.origins_m = vec![[1.0, 0.0, 1.0]; 41];
    mesh.vertices_m = cloud.points_m.clone();
    let planes =
        Planes { planes: vec![WALL], labels: vec![0; cloud.len()], sigma_m: 0.01, ..Planes::default() };
    (cloud, mesh, planes)
}

#[test]
fn a_window_stays_a_hole_and_a_pinhole_is_closed() {
    let window = |x: f32, z: f32| (0.5..1.0).contains(&x) && (0.5..1.5).contains(&z);
    let pinhole = |x: f32, z: f32| (1.5..1.6).contains(&x) && (1.0..1.1).contains(&z);
    let (cloud, mesh, planes) = wall(|x, z| window(x, z) || pinhole(x, z));
    let with = |params: PolygonParams| merge(&params, &cloud, &mesh, &planes).polygons;
    let polygons = with(PolygonParams::default());
    assert_eq!(polygons.len(), 1);
    assert_eq!(validate::check(&polygons[0], &WALL), Ok(()));
    assert_eq!(
        (polygons[0].outer_m.len(), polygons[0].holes_m.len(), polygons[0].holes_m[0].len()),
        (4, 1, 4)
    );
    assert_eq!(with(PolygonParams { min_hole_m2: 0.0, ..Default::default() })[0].holes_m.len(), 2);
    assert_eq!(with(PolygonParams { min_hole_m2: 1.0, ..Default::default() })[0].holes_m.len(), 0);
    assert!(with(PolygonParams { min_polygon_m2: 10.0, ..Default::default() }).is_empty());
    let parts = with(PolygonParams { merging: Merging::Paper, ..Default::default() });
    assert!(
        (2..=4).contains(&parts.len()),
        "round the window the paper's rule leaves more than one: {}",
        parts.len()
    );
    assert!(parts.iter().all(|part| part.holes_m.is_empty() && validate::check(part, &WALL) == Ok(())));
}

#[test]
fn teeth_as_high_as_the_points_are_apart_become_straight_whatever_the_tolerance_and_higher_ones_with_it() {
    // In the upper rows every second stretch of cells is missing: teeth of 5 cm, or of 20 cm.
    let corners = |cells: i32, border_tolerance_m: f64| {
        let low = 2.0 - 0.05 * cells as f32;
        let (cloud, mesh, planes) = wall(|x, z| z > low && (x / 0.05) as i32 / cells % 2 == 0);
        let params = PolygonParams { border_tolerance_m, ..Default::default() };
        merge(&params, &cloud, &mesh, &planes).polygons[0].outer_m.len()
    };
    assert_eq!((corners(1, 0.001), corners(1, 0.03)), (4, 4));
    assert!(corners(4, 0.03) > 12 && corners(4, 0.15) <= 8, "{} {}", corners(4, 0.03), corners(4, 0.15));
}

#[test]
fn every_parameter_changes_what_is_made_of_a_noisy_corridor() {
    // A cabinet with a top and a side, so that there are steps, seams, corners and gaps behind edges.
    let mut scene = corridor();
    for (corner_m, sides_m) in [
        ([3.5, -0.7, 0.0], [[1.0, 0.0, 0.0], [0.0, 0.0, 1.2]]),
        ([3.5, -0.9, 0.0], [[-0.4, 0.15, 0.0], [0.0, 0.0, 1.2]]),
        ([4.8, -0.92, 0.0], [[0.5, 0.0, 0.0], [0.0, 0.0, 1.5]]),
    ] {
        let mut side = corridor().swap_remove(0);
        (side.corner_m, side.sides_m) = (corner_m, sides_m);
        scene.push(side);
    }
    let cloud = drive(&scene, 200, 0.02, 9);
    let mesh = crate::reconstruct::mesh::join(&crate::reconstruct::mesh::MeshParams::default(), &cloud);
    let planes = crate::reconstruct::planes::extract(
        &crate::reconstruct::planes::params::PlaneParams::default(),
        &cloud,
    );
    let base = merge(&PolygonParams::default(), &cloud, &mesh, &planes);
    let mut same = Vec::new();
    let mut turn = |name: &'static str, change: fn(&mut PolygonParams)| {
        let mut params = PolygonParams::default();
        change(&mut params);
        if merge(&params, &cloud, &mesh, &planes) == base {
            same.push(name);
        }
    };
    turn("border_tolerance_m", |p| p.border_tolerance_m = 0.1);
    turn("min_hole_m2", |p| p.min_hole_m2 = 0.0);
    turn("min_polygon_m2", |p| p.min_polygon_m2 = 3.0);
    turn("slit_m", |p| p.slit_m = 0.0);
    turn("seam_reach_m", |p| p.seam_reach_m = 0.01);
    turn("step_m", |p| p.step_m = 0.0);
    turn("veil_length_m", |p| p.veil_length_m = 0.4);
    turn("veil_angle_deg", |p| p.veil_angle_deg = 40.0);
    assert!(same.is_empty(), "no effect: {same:?}");
}
