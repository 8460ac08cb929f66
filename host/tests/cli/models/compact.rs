//! `biplane compact`.

use std::fs;

use serde_json::Value;

use crate::room::{self, Content};
use crate::run::{Folder, names};

const EVERYTHING: [&str; 11] = [
    "model.city.json",
    "model.glb",
    "model.json",
    "model.obj",
    "model.ply",
    "planes.ply",
    "points.ply",
    "raw.ply",
    "report.html",
    "shapes.json",
    "summary.json",
];

/// Two walls of a room in UTM coordinates, four triangles.
const WALLS: &str = "v 500000 5400000 100\nv 500004 5400000 100\nv 500004 5400000 103\nv 500000 5400000 103\nv 500004 5400005 100\n\
    v 500004 5400005 103\nf 1 2 3\nf 1 3 4\nf 2 5 6 3\n";

fn summary(folder: &Folder, of: &str) -> Value {
    serde_json::from_slice(&fs::read(folder.path(of).join("summary.json")).unwrap()).unwrap()
}

#[test]
fn drawn_walls_far_from_zero_become_rectangles_where_they_were_in_every_format() {
    let folder = Folder::new("compact");
    folder.write("walls.obj", WALLS);
    folder.expect("compact walls.obj -o out", 0, &["4 triangles -> 2 polygons"]);
    assert_eq!(names(&folder.path("out")), EVERYTHING);
    let found = summary(&folder, "out");
    assert_eq!((&found["raw_triangles"], &found["polygons"]), (&4.into(), &2.into()), "{found}");
    assert_eq!(found["leftover_triangles"], 0);

    let text = fs::read_to_string(folder.path("out/model.obj")).unwrap();
    let corners: Vec<Vec<f64>> = text
        .lines()
        .filter_map(|line| line.strip_prefix("v "))
        .map(|line| line.split(' ').map(|value| value.parse().unwrap()).collect())
        .collect();
    assert_eq!(corners.len(), 6, "{text}");
    let near = |v: f64, ends: [f64; 2]| ends.iter().any(|end| (v - end).abs() < 0.01);
    let at = |c: &[f64]| {
        near(c[0], [5e5, 500_004.0]) && near(c[1], [5.4e6, 5_400_005.0]) && near(c[2], [100.0, 103.0])
    };
    assert!(corners.iter().all(|corner| at(corner)), "{corners:?}");

    let city: Value = serde_json::from_slice(&fs::read(folder.path("out/model.city.json")).unwrap()).unwrap();
    let extent: [f64; 6] = serde_json::from_value(city["metadata"]["geographicalExtent"].clone()).unwrap();
    assert!((extent[0] - 5e5).abs() < 0.01 && (extent[4] - 5_400_005.0).abs() < 0.01, "{extent:?}");
    let glb = fs::read(folder.path("out/model.glb")).unwrap();
    let glb = String::from_utf8_lossy(&glb).into_owned();
    assert!(glb.contains("\"translation\":[500000.0,0.0,-5400000.0]"), "{}", &glb[..2000.min(glb.len())]);
    let model = fs::read(folder.path("out/model.ply")).unwrap();
    assert!(String::from_utf8_lossy(&model[..300]).contains("property double x"));
}

#[test]
fn the_report_of_a_model_without_rooms_lists_the_openings_of_its_surfaces() {
    let folder = Folder::new("compact-openings");
    // A wall of 4 m by 3 m with a window of 1 m by 1.2 m, 0.9 m over the floor before it.
    let corners = [
        [0.0, 2.0, 0.0],
        [4.0, 2.0, 0.0],
        [4.0, 2.0, 3.0],
        [0.0, 2.0, 3.0],
        [1.0, 2.0, 0.9],
        [2.0, 2.0, 0.9],
        [2.0, 2.0, 2.1],
        [1.0, 2.0, 2.1],
        [0.0, 0.0, 0.0],
        [4.0, 0.0, 0.0],
    ];
    let vertices: String = corners.iter().map(|[x, y, z]| format!("v {x} {y} {z}\n")).collect();
    let house = vertices + "f 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\nf 9 10 2 1\n";
    folder.write("house.obj", &house);
    let list = "<h2>Doors and windows</h2>";
    let row = "S1-N01</span></th><td>window</td><td>1.00</td><td>1.20</td><td>0.90</td><td><span class=\"name\">surface 0<";
    for formats in ["glb", "glb,ifc"] {
        folder.expect(&format!("compact house.obj -o house --force --formats {formats}"), 0, &[]);
        let report = fs::read_to_string(folder.path("house/report.html")).unwrap();
        assert!(report.contains(list) && report.contains(row), "{formats}");
    }
    folder.write("walls.obj", WALLS);
    folder.expect("compact walls.obj -o walls", 0, &[]);
    assert!(!fs::read_to_string(folder.path("walls/report.html")).unwrap().contains(list));
}

#[test]
fn the_raw_mesh_of_a_build_becomes_about_the_model_of_the_build_on_any_number_of_threads() {
    let folder = Folder::new("compact-raw");
    room::record(&folder.path("run.mcap"), Content { poses: true, vertical: true });
    folder.expect("build run.mcap -o model", 0, &[]);
    folder.expect("compact model/raw.ply -o one --threads 1", 0, &["% fewer"]);
    folder.expect("compact model/raw.ply -o three --threads 3 --force", 0, &[]);
    // These two hold measured times.
    for name in EVERYTHING.iter().filter(|name| !["summary.json", "report.html"].contains(name)) {
        let of = |run: &str| fs::read(folder.path(run).join(name)).unwrap();
        assert!(of("one") == of("three"), "{name} differs");
    }
    let (built, compacted) = (summary(&folder, "model"), summary(&folder, "one"));
    assert_eq!(built["raw_triangles"], compacted["raw_triangles"]);
    assert_eq!(built["planes"], compacted["planes"], "{compacted}");
    assert!(compacted["reduction_percent"].as_f64().unwrap() > 90.0, "{compacted}");
    folder.expect("compact one/raw.ply -o one --force", 1, &["name another output"]);
    folder.expect(
        "compact run.mcap -o other",
        1,
        &["cannot read run.mcap", "expected a PLY or OBJ mesh; this file is an MCAP file"],
    );
}

#[test]
fn a_plan_is_left_out_where_there_is_no_floor_and_drawn_where_one_is_given() {
    let folder = Folder::new("compact-plan");
    folder.write("walls.obj", WALLS);
    folder.expect("compact walls.obj -o out --formats dxf", 0, &["no floor with walls over it was found"]);
    let plan = |out: &str| fs::read_to_string(folder.path(out).join("model.dxf")).unwrap();
    assert!(!plan("out").contains("WALLS") && plan("out").contains("3DFACE"));
    let words = ["out/model.ply does not exist: `biplane export out --formats ply` writes it"];
    folder.expect("render out -o x.png", 1, &words);
    folder.expect("compact walls.obj -o given --formats dxf --floor 100", 0, &["2 polygons"]);
    assert!(plan("given").contains("floor +100.00 m") && plan("given").contains("WALLS"));
    folder.expect("compact walls.obj -o x --floor nan", 2, &["expected meters"]);
    // Rooms are found in drives alone; what the surfaces show can be had all the same.
    let words =
        ["`biplane compact` made this of a mesh", "alone show 1 storey, 2 surfaces of walls, 0 doors"];
    let printed = folder.expect("info given", 0, &[]).stdout;
    assert!(words.iter().all(|words| printed.contains(words)), "{printed}");
    folder.expect(
        "info given --json",
        1,
        &["given has no building.json: `biplane compact` made it of a mesh"],
    );
}

#[test]
fn a_mesh_in_millimeters_and_a_noise_in_centimeters_are_asked_about() {
    let folder = Folder::new("compact-units");
    folder.write("walls.obj", WALLS);
    let lines = WALLS.lines().map(|line| match line.strip_prefix("v ") {
        Some(place) => place.split(' ').fold("v".to_owned(), |line, value| format!("{line} {value}000")),
        None => line.to_owned(),
    });
    folder.write("mm.obj", lines.map(|line| line + "\n").collect::<String>());
    let words = ["2 polygons", "these spread over ", "are they in another unit?"];
    folder.expect("compact mm.obj -o mm --no-report", 0, &words);
    let words = ["--sigma 1.5 is taken as meters", "if centimeters were meant, it is --sigma 0.015"];
    folder.expect("--quiet compact walls.obj -o loud --sigma 1.5 --no-report", 0, &words);
    let ran = folder.expect("compact walls.obj -o usual --sigma 0.015 --no-report", 0, &[]);
    assert!(!ran.stderr.contains("meant") && !ran.stderr.contains("unit"), "{}", ran.stderr);
}
