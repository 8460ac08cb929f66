//! Clouds and meshes that are no building: a clear result or a clear error each, never a panic, a hang or a
//! polygon of nothing.

use std::fmt::Write;
use std::fs;

use serde_json::Value;

use crate::run::Folder;

const XYZ: &str = "property float x\nproperty float y\nproperty float z\n";

/// A PLY of these points.
fn ply(points: &[[f64; 3]]) -> String {
    let mut text = format!("ply\nformat ascii 1.0\nelement vertex {}\n{XYZ}end_header\n", points.len());
    points.iter().for_each(|[x, y, z]| writeln!(text, "{x} {y} {z}").unwrap());
    text
}

/// Numbers from 0 to 1 that follow no pattern: SplitMix64.
fn noise(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed;
    move || {
        state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = state;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// A square floor with about 1 cm of noise, a point every `step` meters.
fn floor(side: f64, step: f64) -> Vec<[f64; 3]> {
    let mut next = noise(3);
    let count = (side / step) as usize;
    let mut at = |k: usize| {
        let off = 0.01 * (next() + next() + next() + next() - 2.0) * 3f64.sqrt();
        [step * (k % count) as f64, step * (k / count) as f64, off]
    };
    (0..count * count).map(&mut at).collect()
}

/// The planes that `planes` finds; the labels must be one a point.
fn planes(name: &str, text: &str, points: usize) -> Vec<Value> {
    let folder = Folder::new(&format!("odd-{name}"));
    folder.write("cloud.ply", text);
    folder.expect("planes cloud.ply -o out --explain", 0, &["points"]);
    let labels = fs::read(folder.path("out/labels.bin")).unwrap();
    assert_eq!(labels.len(), 4 * points, "{name}");
    let report: Value = serde_json::from_slice(&fs::read(folder.path("out/planes.json")).unwrap()).unwrap();
    let planes = report["planes"].as_array().unwrap().clone();
    for plane in &planes {
        let normal: [f64; 3] = serde_json::from_value(plane["normal"].clone()).unwrap();
        let length = normal.iter().map(|v| v * v).sum::<f64>().sqrt();
        assert!((length - 1.0).abs() < 1e-9 && plane["offset_m"].is_f64(), "{name}: {plane}");
    }
    planes
}

#[test]
fn one_scan_is_no_surface() {
    let mut text = format!(
        "ply\nformat ascii 1.0\nelement vertex 181\n{XYZ}property int scan\nproperty int beam\nend_header\n"
    );
    for beam in 0..181 {
        let angle = f64::from(beam).to_radians();
        writeln!(text, "0 {} {} 0 {beam}", 2.0 * angle.cos(), 2.0 * angle.sin()).unwrap();
    }
    assert!(planes("scan", &text, 181).is_empty());
}

#[test]
fn a_line_is_no_surface_nor_are_points_at_one_place() {
    let mut next = noise(1);
    let line: Vec<[f64; 3]> =
        (0..3000).map(|k| [0.01 * f64::from(k), 0.002 * next(), 0.002 * next()]).collect();
    assert!(planes("line", &ply(&line), 3000).is_empty());
    let straight: Vec<[f64; 3]> = (0..3000).map(|k| [0.01 * f64::from(k), 1.0, 1.0]).collect();
    assert!(planes("straight", &ply(&straight), 3000).is_empty());
    assert!(planes("place", &ply(&vec![[1.0, 2.0, 3.0]; 2000]), 2000).is_empty());
}

#[test]
fn points_that_are_nowhere_or_twice_there_change_nothing() {
    let mut points = floor(3.0, 0.03);
    points = points.iter().flat_map(|p| [*p; 3]).collect();
    for k in (0..points.len()).step_by(10) {
        points[k][k % 3] = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300][k / 10 % 4];
    }
    let found = planes("nowhere", &ply(&points), points.len());
    assert_eq!(found.len(), 1);
    assert!(found[0]["points"].as_u64().unwrap() as usize > points.len() * 88 / 100, "{found:?}");
}

#[test]
fn among_nine_times_as_many_stray_points_there_is_the_floor_or_nothing() {
    let mut points = floor(4.0, 0.05);
    let count = points.len();
    let mut next = noise(9);
    points.extend((0..9 * count).map(|_| [12.0 * next() - 4.0, 12.0 * next() - 4.0, 12.0 * next() - 6.0]));
    let found = planes("outliers", &ply(&points), 10 * count);
    assert!(found.len() < 2, "{found:?}");
    let is_floor = |plane: &Value| {
        plane["normal"][2].as_f64().unwrap().abs() > 0.999 && plane["offset_m"].as_f64().unwrap().abs() < 0.01
    };
    assert!(found.iter().all(is_floor), "{found:?}");
}

#[test]
fn one_huge_plane_is_one_plane() {
    let points = floor(30.0, 0.1);
    let found = planes("huge", &ply(&points), points.len());
    assert_eq!(found.len(), 1);
    assert!(found[0]["points"].as_u64().unwrap() as usize > points.len() * 98 / 100);
}

#[test]
fn a_pipe_and_a_ball_give_no_plane_that_lies_off_its_points() {
    let mut next = noise(5);
    let mut points: Vec<[f64; 3]> = Vec::new();
    for _ in 0..8000 {
        let (sin, cos) = (std::f64::consts::TAU * next()).sin_cos();
        points.push([0.25 * cos, 0.25 * sin, 2.0 * next()]);
        let height = 2.0 * next() - 1.0;
        let ring = (1.0 - height * height).sqrt() * 0.4;
        points.push([3.0 + ring * cos, ring * sin, 0.4 * height]);
    }
    let found = planes("curved", &ply(&points), points.len());
    let rms_m = |plane: &Value| plane["rms_m"].as_f64().unwrap();
    assert!(found.iter().all(|plane| rms_m(plane) < 0.02), "{found:?}");
    // Strips of the pipe may pass for planes; they must not swallow it.
    let maximum = found.iter().map(|plane| plane["points"].as_u64().unwrap()).max().unwrap_or(0);
    assert!(maximum < 4000, "{found:?}");
}

#[test]
fn coordinates_beyond_all_measure_are_on_no_plane() {
    let far: Vec<[f64; 3]> =
        (0..500).map(|k| [1e20 * f64::from(k % 20), 1e25 * f64::from(k / 20), 0.0]).collect();
    assert!(planes("far", &ply(&far), 500).is_empty());
    let folder = Folder::new("odd-infinite");
    folder.write("cloud.ply", ply(&[[f64::INFINITY, 0.0, 0.0], [f64::NAN, 0.0, 0.0]]));
    folder.expect("planes cloud.ply -o out", 1, &["none of the 2 points has finite coordinates"]);
    folder.write("empty.ply", ply(&[]));
    folder.expect("planes empty.ply -o out", 1, &["the file holds no point"]);
    folder.expect("compact empty.ply -o out", 1, &["no triangle"]);
    assert_eq!(folder.names(), ["cloud.ply", "empty.ply"]);
}

#[test]
fn a_header_that_boasts_and_a_file_that_ends_early_are_said_and_leave_nothing() {
    let folder = Folder::new("odd-cut");
    let whole = ply(&floor(1.0, 0.1));
    folder.write("boast.ply", whole.replace("vertex 100", "vertex 1000000000000"));
    let says = ["cannot read boast.ply", "ends inside vertex 100 of 1000000000000"];
    folder.expect("planes boast.ply -o out", 1, &says);
    folder.expect("compact boast.ply -o out", 1, &says);
    folder.write("faces.ply", whole.replace("end_header", "element face 1000000000000\nend_header"));
    folder.expect("compact faces.ply -o out", 1, &["no triangle"]);
    folder.write("cut.ply", &whole[..whole.len() - 40]);
    folder.expect("planes cut.ply -o out", 1, &["ends inside vertex 9"]);
    assert_eq!(folder.names(), ["boast.ply", "cut.ply", "faces.ply"]);
}

#[test]
fn a_mesh_of_slivers_and_nonsense_gives_valid_polygons_or_none() {
    let folder = Folder::new("odd-mesh");
    let mut next = noise(11);
    let mut text = String::new();
    for k in 0..600 {
        let x = if k % 50 == 0 { f64::NAN } else { 2.0 * next() };
        writeln!(text, "v {x} {} {}", 2.0 * next(), 0.01 * next()).unwrap();
    }
    for _ in 0..900 {
        let mut corner = || 1 + (600.0 * next()) as u32;
        writeln!(text, "f {} {} {}", corner(), corner(), corner()).unwrap();
    }
    folder.write("mess.obj", text);
    folder.expect("compact mess.obj -o out", 0, &["are left out", "% fewer"]);
    let city: Value = serde_json::from_slice(&fs::read(folder.path("out/model.city.json")).unwrap()).unwrap();
    let surfaces = city["CityObjects"]["building"]["geometry"][0]["boundaries"].as_array().unwrap();
    // A carpet of triangles over one square: one surface, perhaps in a few pieces.
    assert!(!surfaces.is_empty() && surfaces.len() < 10, "{}", surfaces.len());
}
