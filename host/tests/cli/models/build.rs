//! `biplane build` and `biplane compare`.

use std::fs;

use serde_json::Value;

use crate::room::{self, Content};
use crate::run::{Folder, names};

const EVERYTHING: [&str; 16] = [
    "building.json",
    "map.pgm",
    "map.png",
    "map.yaml",
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
    "trajectory.tum",
];

/// The six sides of the room, as triangles.
const TRUTH: &str = "ply\nformat ascii 1.0\nelement vertex 8\nproperty float x\nproperty float y\nproperty float z\n\
    element face 6\nproperty list uchar int vertex_indices\nend_header\n\
    -1 -2 0\n7 -2 0\n7 2 0\n-1 2 0\n-1 -2 2.5\n7 -2 2.5\n7 2 2.5\n-1 2 2.5\n\
    4 0 1 2 3\n4 4 5 6 7\n4 0 1 5 4\n4 1 2 6 5\n4 2 3 7 6\n4 3 0 4 7\n";

#[test]
fn a_room_becomes_a_few_flat_surfaces_in_every_format() {
    let folder = Folder::new("build");
    room::record(&folder.path("run.mcap"), Content { poses: true, vertical: true });
    folder.expect("build run.mcap -o out", 0, &["% fewer"]);
    assert_eq!(names(&folder.path("out")), EVERYTHING);
    assert_eq!(folder.names(), ["out", "run.mcap"]);
    let read_summary =
        || -> Value { serde_json::from_slice(&fs::read(folder.path("out/summary.json")).unwrap()).unwrap() };
    let summary = read_summary();
    assert_eq!(summary["parameters"]["as_seen"], false, "{summary}");
    let count = |key: &str| summary[key].as_u64().unwrap_or_else(|| panic!("{key}: {summary}"));
    // What the vertical laser sees of the room: two sides, floor and ceiling (and not what is right under
    // it).
    assert!(count("raw_points") > 10_000 && count("planes") >= 3, "{summary}");
    assert!(summary["reduction_percent"].as_f64().unwrap() > 90.0, "{summary}");

    folder.write("truth.ply", TRUTH);
    let ran = folder.expect("compare out --truth truth.ply --json", 0, &[]);
    let report: Value = serde_json::from_str(&ran.stdout).unwrap();
    let rms_m = report["model"]["to_truth"]["rms_m"].as_f64().unwrap();
    assert!(rms_m < 0.01, "{report}");
    assert_eq!(report["model"]["polygons"], summary["polygons"]);
    let qslim = &report["qslim"];
    assert_eq!(qslim["triangles"].as_u64(), report["model"]["surfaces"].as_u64(), "{report}");
    assert!(qslim["to_truth"]["rms_m"].as_f64().unwrap() > 3.0 * rms_m, "{report}");
    assert_eq!(report["model"]["rays"]["blocked"], 0, "{report}");
    // The truth does not tell its faces apart.
    assert!(report["true_faces_seen"].is_null(), "{report}");

    folder.expect("build run.mcap -o out", 1, &["out exists already", "--force"]);
    let report = fs::read_to_string(folder.path("out/report.html")).unwrap();
    assert!(report.contains("<h1>run</h1>") && report.contains("data-mesh=\"raw\">"));
    assert!(report.len() < 2_000_000, "{}", report.len());
    let more = "--force --formats all --threads 1 --sigma 0.006 --no-report --as-seen";
    folder.expect(&format!("build run.mcap -o out {more}"), 0, &["noise 0.6 cm (as given)"]);
    assert_eq!(read_summary()["parameters"]["as_seen"], true);
    let has = |name: &str| names(&folder.path("out")).contains(&name.to_owned());
    for name in ["model.dxf", "model.glb", "model.ifc", "model.lod1.glb", "model.lod2.glb", "model.obj"] {
        assert!(has(name), "{name}");
    }
    assert_eq!((has("points.laz"), has("report.html")), (cfg!(feature = "las"), false));
    // Its own folder may be replaced, and only what is asked for is there again.
    folder.expect("build run.mcap -o out --force --formats glb,dxf", 0, &[]);
    assert!(has("model.dxf") && !has("model.obj"));
    // The robot stands on the floor, so there is a plan though the laser saw no floor.
    let plan = fs::read_to_string(folder.path("out/model.dxf")).unwrap();
    assert!(plan.contains("floor +0.00 m, cut 1.20 m above it") && plan.contains("run.mcap"));
}

#[test]
fn a_report_of_several_recordings_names_them_all() {
    let folder = Folder::new("several");
    room::record(&folder.path("first.mcap"), Content { poses: true, vertical: true });
    fs::copy(folder.path("first.mcap"), folder.path("zw\u{f6}lf.mcap")).unwrap();
    let report = || fs::read_to_string(folder.path("out/report.html")).unwrap();
    folder.expect("build first.mcap zw\u{f6}lf.mcap -o out --no-optimize", 0, &[]);
    assert!(report().contains("<h1>first, zw\u{f6}lf</h1>") && !report().contains("loops closed"));
}

/// A wall far from everything.
const ELSEWHERE: &str = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
    element face 1\nproperty list uchar int vertex_indices\nend_header\n30 0 0\n30 5 0\n30 5 2\n3 0 1 2\n";

#[test]
fn a_model_is_compared_with_the_raw_points_and_a_closed_door_is_noticed() {
    let folder = Folder::new("compare");
    room::record(&folder.path("run.mcap"), Content { poses: true, vertical: true });
    folder.expect("build run.mcap -o out", 0, &[]);
    let ran = folder.expect("compare out --pictures all.png", 0, &["all.png: 2400 x"]);
    for word in ["distances to raw points", "\nqslim: the raw mesh simplified to", "0.000 %"] {
        assert!(ran.stdout.contains(word), "{word}: {}", ran.stdout);
    }
    folder.expect("compare out --pictures all.png", 1, &["all.png exists already"]);
    folder.expect("compare out --report compared.html", 0, &[]);
    let report = fs::read_to_string(folder.path("compared.html")).unwrap();
    assert!(report.contains("How true it is") && report.contains("Distances to raw points"));
    folder.expect("compare out --report compared.html", 1, &["compared.html exists already"]);
    let own = folder.expect("compare out --truth out/raw.ply", 0, &[]);
    assert!(!own.stderr.contains("frame `map`"), "{}", own.stderr);
    folder.write("elsewhere.ply", ELSEWHERE);
    folder.expect(
        "compare out --truth elsewhere.ply",
        0,
        &["m from elsewhere.ply in the mean: is that in the frame `map`"],
    );
    folder.expect("render out -o planes.png --what planes --width 300", 0, &["planes.png: 300 x"]);
    folder.expect(
        "render out -o half.png --view inside --at 50 --width 300 --height 200",
        0,
        &["half.png: 300 x"],
    );
    folder.expect(
        "render other -o x.png",
        1,
        &["other/model.ply does not exist", "is other a folder of `biplane build`?"],
    );
    for command in ["render run.mcap -o x.png", "compare run.mcap"] {
        folder.expect(
            command,
            1,
            &["run.mcap is an MCAP file; expected a folder", "`biplane build` makes one"],
        );
    }
    folder.write("empty.json", "{\"rooms\": []}");
    for (wrong, words) in
        [("run.mcap", "run.mcap is an MCAP file"), ("empty.json", "has no rooms to compare")]
    {
        folder.expect(&format!("compare out --building {wrong}"), 1, &[wrong, words]);
    }
    folder.expect("render out -o x.png --at 50", 1, &["--at goes with --view inside"]);
    folder.expect("render out -o x.png --view inside --at 101", 2, &["expected a number from 0 to 100"]);
    folder.expect("compare out --margin -1", 2, &["expected a length"]);
    // A wall across the room, in the way of half of what the laser saw of the sides, is in no one's way once
    // points.ply does not tell where they were seen from.
    let across = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
        element face 1\nproperty list uchar int vertex_indices\nend_header\n-9 1 -9\n9 1 -9\n9 1 9\n-9 1 9\n4 0 1 2 3\n";
    folder.write("out/planes.ply", across);
    let blocked = || -> Value {
        let ran = folder.expect("compare out --json", 0, &[]);
        serde_json::from_str::<Value>(&ran.stdout).unwrap()["planes"]["rays"].clone()
    };
    assert!(blocked()["percent"].as_f64().unwrap() > 20.0, "{}", blocked());
    let bare = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\nend_header\n0 0 0\n";
    folder.write("out/points.ply", bare);
    assert!(blocked().is_null());
    assert!(folder.expect("compare out", 0, &[]).stdout.contains("a model by build has one"));
}

#[test]
fn any_number_of_threads_writes_the_same_bytes() {
    let folder = Folder::new("threads");
    room::record(&folder.path("run.mcap"), Content { poses: true, vertical: true });
    folder.expect("build run.mcap -o one --formats all --threads 1", 0, &[]);
    folder.expect("build run.mcap -o three --formats all --threads 3", 0, &[]);
    let all = names(&folder.path("one"));
    assert!(all.len() > EVERYTHING.len() && all == names(&folder.path("three")));
    // These two hold measured times.
    for name in all.iter().filter(|name| !["summary.json", "report.html"].contains(&name.as_str())) {
        let of = |run: &str| fs::read(folder.path(run).join(name)).unwrap();
        assert!(of("one") == of("three"), "{name} differs");
    }
}

#[test]
fn without_a_vertical_laser_there_are_map_and_trajectory_and_a_word_about_it() {
    let folder = Folder::new("flat");
    room::record(&folder.path("run.mcap"), Content { poses: true, vertical: false });
    let ran = folder.expect("build run.mcap -o out", 0, &["no scan of a vertical laser"]);
    assert_eq!(ran.stderr.matches("no model").count(), 1, "{}", ran.stderr);
    let what = "--floor-z names other.mcap, which is none of the recordings: run.mcap";
    folder.expect("build run.mcap -o up --floor-z other.mcap=3.1", 2, &[what, "Usage: biplane build"]);
    folder.expect("info out", 1, &["out is a folder without building.json"]);
    let expected = ["map.pgm", "map.png", "map.yaml", "report.html", "summary.json", "trajectory.tum"];
    assert_eq!(names(&folder.path("out")), expected);
    folder.expect("compare out", 1, &["out holds no model"]);
}

#[test]
fn foreign_poses_are_taken_when_their_time_fits() {
    let folder = Folder::new("poses");
    room::record(&folder.path("run.mcap"), Content { poses: false, vertical: true });
    let line = |t: i32| format!("{}.0 {} 0 0 0 0 0 1\n", 1_700_000_000 + t, f64::from(t) * 0.25);
    folder.write("good.tum", (0..=20).map(line).collect::<String>());
    folder.write("late.tum", (100..=120).map(line).collect::<String>());
    folder.write("broken.tum", "1 2 3\n");
    folder.expect("build run.mcap -o out --poses good.tum", 0, &["% fewer"]);
    folder.expect(
        "build run.mcap -o x --poses late.tum",
        1,
        &["no scan of run.mcap lies in the time of late.tum"],
    );
    folder.expect("build run.mcap -o x --poses broken.tum", 1, &["broken.tum: line 1: expected"]);
    folder.expect("build run.mcap -o x --poses none.tum", 1, &["none.tum does not exist"]);
    assert!(!folder.names().contains(&"x".to_owned()));
}

#[test]
fn formats_are_chosen_by_name_and_unknown_ones_refused_with_the_list() {
    let folder = Folder::new("formats");
    room::record(&folder.path("run.mcap"), Content { poses: true, vertical: false });
    folder.expect(
        "build run.mcap -o x --formats glb,toast",
        2,
        &["there are glb, ply, obj, cityjson, dxf, ifc, lod"],
    );
    folder.expect("build run.mcap run.mcap -o x", 1, &["run.mcap is given twice"]);
    assert_eq!(folder.names(), ["run.mcap"]);
}
