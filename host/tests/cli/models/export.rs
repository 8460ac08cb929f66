//! `biplane export`: the files of a build, written later.

use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::room::{self, Content};
use crate::run::{Folder, names};

/// What differs from one build to the next: measured times.
const TIMED: &str = "summary.json";

#[track_caller]
fn assert_same(one: &Path, other: &Path) {
    let all = names(one);
    assert_eq!(all, names(other));
    for name in all.iter().filter(|name| *name != TIMED) {
        assert!(fs::read(one.join(name)).unwrap() == fs::read(other.join(name)).unwrap(), "{name} differs");
    }
}

#[test]
fn what_is_exported_later_is_what_the_build_of_a_room_writes() {
    let folder = Folder::new("export-room");
    room::record(&folder.path("run.mcap"), Content { poses: true, vertical: true });
    folder.expect("build run.mcap -o all --no-report --formats all", 0, &[]);
    folder.expect("build run.mcap -o bare --no-report --formats none", 0, &[]);
    assert!(!names(&folder.path("bare")).iter().any(|name| name.ends_with(".glb")));
    let ran = folder.expect("export bare --formats all --threads 1", 0, &[]);
    assert_same(&folder.path("all"), &folder.path("bare"));
    let exported = if cfg!(feature = "las") { 10 } else { 8 };
    assert_eq!(ran.stdout.lines().count(), exported, "{}", ran.stdout);
    assert!(ran.stdout.contains(" bytes  bare/model.lod2.glb\n"), "{}", ran.stdout);
}

#[test]
fn what_is_exported_later_is_what_the_build_of_several_passes_writes() {
    let folder = Folder::new("export-twice");
    room::record(&folder.path("first.mcap"), Content { poses: true, vertical: true });
    for name in ["second.mcap", "third.mcap"] {
        fs::copy(folder.path("first.mcap"), folder.path(name)).unwrap();
    }
    let build = "build first.mcap second.mcap third.mcap --no-optimize --no-report";
    folder.expect(&format!("{build} -o all --formats all,mcap"), 0, &[]);
    let summary: Value = serde_json::from_slice(&fs::read(folder.path("all").join(TIMED)).unwrap()).unwrap();
    assert!(summary["revisited_points"].as_u64().unwrap() > 1000, "{summary}");
    folder.expect(&format!("{build} -o later"), 0, &[]);
    folder.expect("export later --formats dxf,ifc,lod,mcap", 0, &[]);
    if cfg!(feature = "las") {
        folder.expect("export later --formats laz,las", 0, &[]);
    }
    assert_same(&folder.path("all"), &folder.path("later"));
}

#[test]
fn what_is_exported_later_is_what_compact_writes_far_from_zero() {
    let folder = Folder::new("export-mesh");
    // Two walls and a loose pyramid in UTM coordinates.
    let mesh = "v 500000 5400000 100\nv 500004 5400000 100\nv 500004 5400000 103\nv 500000 5400000 103\n\
        v 500004 5400005 100\nv 500004 5400005 103\nv 500001 5400001 101\nv 500001.2 5400001 101\n\
        v 500001 5400001.2 101.1\nv 500001.05 5400001.05 101.2\n\
        f 1 2 3\nf 1 3 4\nf 2 5 6 3\nf 7 8 9\nf 7 8 10\nf 8 9 10\nf 9 7 10\n";
    folder.write("walls.obj", mesh);
    let compact = "compact walls.obj --floor 100 --no-report";
    folder.expect(&format!("{compact} -o all --formats all,mcap"), 0, &["2 polygons", "+ 4 triangles"]);
    folder.expect(&format!("{compact} -o bare --formats none"), 0, &[]);
    folder.expect("export bare --formats all,mcap", 0, &[]);
    assert_same(&folder.path("all"), &folder.path("bare"));
    let plan = fs::read_to_string(folder.path("bare/model.dxf")).unwrap();
    assert!(plan.contains("floor +100.00 m"), "the floor that compact was told");
    folder.expect("compact walls.obj -o flat --formats none", 0, &[]);
    folder.expect("export flat --formats dxf", 0, &["no floor with walls over it was found"]);
}

#[test]
fn files_that_exist_are_kept_unless_force_is_said() {
    let folder = Folder::new("export-force");
    room::record(&folder.path("run.mcap"), Content { poses: true, vertical: true });
    folder.expect("build run.mcap -o out --no-report", 0, &[]);
    folder.write("out/model.obj", "mine");
    let before = names(&folder.path("out"));
    folder.expect("export out --formats dxf,obj", 1, &["out/model.obj exists already", "--force"]);
    assert_eq!(names(&folder.path("out")), before, "nothing was written");
    let align = "export out --formats dxf,ifc --align-walls --json";
    let ran = folder.expect(align, 0, &["main walls along x and y: turned by "]);
    let turned: Value = serde_json::from_str(&ran.stdout).unwrap();
    assert!(turned["turned_deg"].as_f64().is_some_and(|deg| deg.abs() < 1.0), "{turned}");
    let ifc = fs::read_to_string(folder.path("out/model.ifc")).unwrap();
    assert!(ifc.contains("IFCMAPCONVERSION(") && ifc.contains("turned by "), "the turn is said");
    for names in [",'S1-R01',$,$,", ",'room 1',.ELEMENT.,.INTERNAL.,", ",'S1',$,$,", ",'storey 1',.ELEMENT.,"]
    {
        assert!(ifc.contains(names), "{names}");
    }
    fs::remove_file(folder.path("out/model.ifc")).unwrap();
    let ran = folder.expect("export out --formats dxf,obj,obj --force --json", 0, &[]);
    let written: Value = serde_json::from_str(&ran.stdout).unwrap();
    let bytes = |name: &str| fs::metadata(folder.path("out").join(name)).unwrap().len();
    let files = serde_json::json!([
        { "name": "model.dxf", "bytes": bytes("model.dxf") },
        { "name": "model.obj", "bytes": bytes("model.obj") },
    ]);
    assert_eq!((&written["files"], &written["source"]), (&files, &"run.mcap".into()), "{written}");
    // What was exported is of the build, which may be replaced as a whole.
    folder.expect("build run.mcap -o out --no-report --force", 0, &[]);
    assert_eq!(names(&folder.path("out")), before);
}

#[test]
fn a_folder_that_holds_no_model_is_named_with_what_it_lacks() {
    let folder = Folder::new("export-odd");
    room::record(&folder.path("run.mcap"), Content { poses: true, vertical: false });
    folder.expect("export out --formats dxf,stl", 2, &["there are glb, ply"]);
    folder.expect("export out", 2, &["--formats"]);
    folder.expect(
        "export out --formats ifc,glb --align-walls",
        2,
        &["--align-walls goes with dxf and ifc alone", "Usage: biplane export"],
    );
    folder.expect("build run.mcap -o out --align-walls", 2, &["is a flag of `biplane export`"]);
    folder.expect("export out --formats none", 2, &["writes no file"]);
    folder.expect("export out --formats dxf", 1, &["biplane: out does not exist"]);
    folder.expect("export run.mcap --formats dxf", 1, &["run.mcap is an MCAP file; expected a folder"]);
    folder.expect("build run.mcap -o flat --no-report", 0, &[]);
    folder.expect("export flat --formats dxf", 1, &["flat holds no model"]);
    fs::create_dir(folder.path("other")).unwrap();
    folder.expect("export other --formats dxf", 1, &["is other a folder of `biplane build`?"]);
    folder.write("other/.unfinished", "");
    folder.expect("export other --formats dxf", 1, &["other is not finished"]);
    folder.write("other/summary.json", "{\"raw_triangles\": 5, \"version\": \"0.0.9\"}");
    let ran = folder.expect("export other --formats dxf", 1, &["other has no model.json", "biplane 0.0.9"]);
    assert_eq!(ran.stderr.lines().count(), 1, "{}", ran.stderr);
}

#[test]
fn damaged_files_of_a_model_are_a_sentence_and_leave_nothing_behind() {
    let folder = Folder::new("export-damaged");
    folder.write("walls.obj", "v 0 0 0\nv 4 0 0\nv 4 0 3\nv 0 0 3\nf 1 2 3\nf 1 3 4\n");
    folder.expect("compact walls.obj -o out --formats none --no-report", 0, &["1 polygon"]);
    let before = names(&folder.path("out"));
    let whole = fs::read_to_string(folder.path("out/model.json")).unwrap();
    let damages = [
        (
            whole[..whole.len() / 2].to_owned(),
            "cannot read out/model.json: expected the model of a build: EOF",
        ),
        (String::new(), "EOF while parsing a value"),
        ("{}".to_owned(), "expected a file of the format \"biplane-model\", found \"\""),
        (whole.replace("\"version\":1", "\"version\":7"), "expected a file of version 3, found version 7"),
        (whole.replace("\"polygons\"", "\"faces\""), "unknown field `faces`"),
    ];
    for (text, words) in damages {
        folder.write("out/model.json", text);
        folder.expect("export out --formats glb,dxf", 1, &[words]);
        assert_eq!(names(&folder.path("out")), before);
    }
    folder.write("out/model.json", &whole);
    if cfg!(feature = "las") {
        let points = fs::read(folder.path("out/points.ply")).unwrap();
        folder.write("out/points.ply", &points[..points.len() - 1]);
        let words = ["cannot read out/points.ply: the PLY file ends inside vertex 3 of 4"];
        folder.expect("export out --formats laz,glb", 1, &words);
        folder.write(
            "out/points.ply",
            String::from_utf8_lossy(&points).replace("int scan", "int line").as_bytes(),
        );
        folder.expect("export out --formats laz", 1, &["expected points in little endian", "plane, line"]);
        assert_eq!(names(&folder.path("out")), before);
    }
    folder.expect("export out --formats glb", 0, &[]);
}
