//! The stages together on a simulated corridor: what must hold of every model.

use super::{BuildOutput, model_of};
use crate::metrics::compare::{CompareParams, Reference};
use crate::metrics::surface_distance::Surface;
use crate::model::{Cloud, Mesh};
use crate::pipeline::params::BuildParams;
use crate::reconstruct::fixture::{corridor, drive, truth};
use crate::reconstruct::planes::paper::random::Random;
use crate::reconstruct::polygons::seams::t_junctions;
use crate::reconstruct::polygons::triangulate::model_mesh;
use crate::reconstruct::polygons::triangulate::polygons_mesh;
use crate::reconstruct::polygons::validate;
use std::sync::OnceLock;

fn build(cloud: Cloud) -> BuildOutput {
    model_of(cloud, &BuildParams::default(), &mut ())
}

/// The corridor at the noise of the paper's sensor, built once.
fn output() -> &'static BuildOutput {
    static OUTPUT: OnceLock<BuildOutput> = OnceLock::new();
    OUTPUT.get_or_init(|| build(drive(&corridor(), 250, 0.02, 1)))
}

fn assert_valid(output: &BuildOutput) {
    for polygon in &output.model.polygons {
        assert_eq!(validate::check(polygon, &output.model.planes[polygon.plane]), Ok(()));
    }
    assert_eq!(output.labels.len(), output.cloud.len());
    assert!(output.labels.iter().all(|label| (-1..output.model.planes.len() as i32).contains(label)));
    let finite = |p: &[f32; 3]| p.iter().all(|v| v.is_finite());
    assert!(output.model.leftovers.vertices_m.iter().all(finite));
}

#[test]
fn a_corridor_shrinks_to_its_walls() {
    let output = output();
    assert_valid(output);
    assert!(output.counts.raw_triangles > 60_000);
    assert!(output.counts.reduction_percent() > 99.0, "{:?}", output.counts);
    // Seen: both walls, the ceilings (of one height) and the back of the room; its other walls run along the
    // scans.
    assert!((4..=5).contains(&output.counts.planes), "{:?}", output.counts);
    assert!(output.counts.polygons <= 6, "{:?}", output.counts);
}

#[test]
fn the_noise_is_estimated_to_a_tenth() {
    // Across the surfaces the noise is a little smaller than along the beams.
    assert!((0.016..0.021).contains(&output().counts.sigma_m), "{}", output().counts.sigma_m);
}

#[test]
fn the_model_is_truer_than_the_raw_mesh_and_misses_nothing() {
    let (output, truth) = (output(), truth(&corridor()));
    let (planes, whole) = (polygons_mesh(&output.model), model_mesh(&output.model));
    let params = CompareParams { samples: 20_000, ..CompareParams::default() };
    let reference = Reference::truth(&params, &truth, &Surface::new(&output.mesh));
    let measure = |mesh: &Mesh| reference.measure(mesh, &Surface::new(mesh));
    let (raw, planes, model) = (measure(&output.mesh), measure(&planes), measure(&whole));
    assert!(model.to_reference.rms_m < 0.01, "{model:?}");
    assert!(planes.to_reference.rms_m < 0.01, "{planes:?}");
    assert!(raw.to_reference.rms_m > 2.0 * model.to_reference.rms_m, "{raw:?}");
    assert!(model.from_reference.p95_m < 0.02, "{model:?}");
}

/// The corridor with a cabinet: steps, seams, corners of three planes, ends of walls on a ceiling.
fn furnished(seed: u64, sigma_m: f64) -> BuildOutput {
    let mut scene = corridor();
    for (corner_m, sides_m) in [
        ([3.5, -0.7, 0.0], [[1.0, 0.0, 0.0], [0.0, 0.0, 1.2]]),
        ([3.5, -0.9, 0.0], [[-0.4, 0.15, 0.0], [0.0, 0.0, 1.2]]),
        ([4.5, -0.7, 0.0], [[0.0, -0.3, 0.0], [0.0, 0.0, 1.2]]),
    ] {
        let mut side = corridor().swap_remove(0);
        (side.corner_m, side.sides_m) = (corner_m, sides_m);
        scene.push(side);
    }
    build(drive(&scene, 200, sigma_m, seed))
}

#[test]
fn neighbors_have_no_cracks_between_them() {
    let mut shared_m = 0.0;
    for (seed, sigma_m) in [(1, 0.02), (2, 0.015), (3, 0.03), (4, 0.02), (5, 0.0)] {
        let output = furnished(seed, sigma_m);
        assert_valid(&output);
        let found = t_junctions::find(&output.model);
        assert_eq!((found.corners_in_edges, found.corners_apart), (0, 0), "{seed}: {found:?}");
        assert_eq!(found.gaps_m, 0.0, "{seed}: {found:?}");
        shared_m += found.shared_m;
    }
    assert!(shared_m > 30.0, "{shared_m}");
}

#[test]
fn no_surface_is_further_from_what_was_seen_than_said() {
    for (seed, sigma_m) in [(1, 0.02), (3, 0.03)] {
        let output = furnished(seed, sigma_m);
        let raw = Surface::new(&output.mesh);
        let model = polygons_mesh(&output.model);
        let mut furthest_m: f64 = 0.0;
        for corners in &model.triangles {
            let [a, b, c] = corners.map(|corner| model.vertices_m[corner as usize].map(f64::from));
            // Points of a lattice over the triangle, 4 cm apart.
            let longest_m = [(a, b), (b, c), (c, a)]
                .map(|(p, q)| [0, 1, 2].map(|k| p[k] - q[k]).map(|v: f64| v * v).iter().sum::<f64>().sqrt())
                .into_iter()
                .fold(0.0, f64::max);
            let steps = (longest_m / 0.04).ceil().max(1.0) as usize;
            for (i, k) in (0..=steps).flat_map(|i| (0..=steps - i).map(move |k| (i, k))) {
                let (s, t) = (i as f64 / steps as f64, k as f64 / steps as f64);
                let p = [0, 1, 2].map(|n| a[n] + s * (b[n] - a[n]) + t * (c[n] - a[n]));
                furthest_m = furthest_m.max(raw.distance_m(p));
            }
        }
        assert!(furthest_m < 0.25, "{seed}: {furthest_m}");
    }
}

#[test]
fn the_door_stays_open_and_the_wall_round_it_closed() {
    let flat = polygons_mesh(&output().model);
    let in_wall = |x: f64, z: f64| {
        flat.triangles.iter().any(|t| {
            let [a, b, c] = t.map(|corner| flat.vertices_m[corner as usize].map(f64::from));
            let on_wall = [a, b, c].iter().all(|p| (p[1] - 1.0).abs() < 0.05);
            let side = |p: [f64; 3], q: [f64; 3]| (q[0] - p[0]) * (z - p[2]) - (q[2] - p[2]) * (x - p[0]);
            let sides = [side(a, b), side(b, c), side(c, a)];
            on_wall && (sides.iter().all(|s| *s >= 0.0) || sides.iter().all(|s| *s <= 0.0))
        })
    };
    for x in [2.1, 2.3, 2.5, 2.7, 2.8] {
        for z in [0.8, 1.2, 1.6, 2.0] {
            assert!(!in_wall(x, z), "the door is blocked at {x}, {z}");
        }
        assert!(in_wall(x, 2.4), "the wall above the door is missing at {x}");
    }
    assert!([0.5, 1.0, 1.8, 3.1, 4.0, 5.5].iter().all(|x| in_wall(*x, 1.5)));
}

#[test]
fn the_result_does_not_depend_on_the_number_of_threads() {
    let cloud = drive(&corridor(), 60, 0.02, 2);
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| build(cloud.clone()))
    };
    assert_eq!(with(1), with(3));
}

#[test]
fn other_noise_and_seeds_give_valid_models_of_the_same_walls() {
    for (sigma_m, seed) in [(0.0, 3), (0.01, 4), (0.03, 5)] {
        let output = build(drive(&corridor(), 120, sigma_m, seed));
        assert_valid(&output);
        assert!(output.counts.reduction_percent() > 97.0, "sigma {sigma_m}: {:?}", output.counts);
        assert!((4..=7).contains(&output.counts.planes), "sigma {sigma_m}: {:?}", output.counts);
    }
}

#[test]
fn degenerate_clouds_give_small_valid_models() {
    let organized = |points: Vec<[f32; 3]>| {
        let count = points.len();
        Cloud {
            scan: (0..count as u32).map(|k| k / 50).collect(),
            beam: (0..count).map(|k| (k % 50) as u16).collect(),
            origins_m: vec![[0.0; 3]; count.div_ceil(50)],
            points_m: points,
            beams_per_scan: 50,
            ..Cloud::default()
        }
    };
    let mut random = Random::new(8);
    let mut anywhere =
        |size: f64| -> [f32; 3] { std::array::from_fn(|_| (size * (random.unit() - 0.5)) as f32) };
    let line = |k: i32| [0.01 * k as f32, 1.0, 1.0];
    let mut with_nan = drive(&corridor(), 40, 0.02, 6);
    for k in (0..with_nan.len()).step_by(3) {
        with_nan.points_m[k] = [f32::NAN, f32::INFINITY, -1e30];
    }
    let cases = [
        ("no points", Cloud::default(), 0),
        ("one scan", drive(&corridor(), 1, 0.02, 6), 8),
        ("a line", organized((0..1000).map(line).collect()), 0),
        ("one place", organized(vec![[1.0, 2.0, 3.0]; 1000]), 0),
        ("nothing finite", organized(vec![[f32::NAN; 3]; 1000]), 0),
        ("holes and infinities", with_nan, 20),
        ("outliers only", organized((0..3000).map(|_| anywhere(4.0)).collect()), 20),
    ];
    for (name, cloud, max_planes) in cases {
        let output = build(cloud);
        assert_valid(&output);
        assert!(output.model.planes.len() <= max_planes, "{name}: {} planes", output.model.planes.len());
    }
}
