//! `biplane demo`: the whole chain, fast.

use std::fs;

use serde_json::Value;

use crate::run::Folder;

#[test]
fn the_demo_drives_records_and_models_a_corridor() {
    let folder = Folder::new("demo");
    folder.write("taken", "x");
    folder.expect("demo --fast -o taken", 1, &["taken exists already"]);
    let ran = folder.expect("demo --fast", 0, &["matched poses"]);
    for name in ["outside.png", "model/model.glb", "model/map.png", "run.mcap"] {
        assert!(ran.stdout.contains(&format!("biplane-demo/{name}")), "{}", ran.stdout);
        assert!(fs::metadata(folder.path("biplane-demo").join(name)).unwrap().len() > 1000, "{name}");
    }
    let json = |name: &str| -> Value {
        serde_json::from_slice(&fs::read(folder.path("biplane-demo").join(name)).unwrap()).unwrap()
    };
    let summary = json("model/summary.json");
    assert!(summary["reduction_percent"].as_f64().unwrap() > 84.0);
    // The same counts as in the line of `build` above it.
    let counts = format!(
        " became {} polygons and {} triangles on no plane (",
        summary["polygons"], summary["leftover_triangles"]
    );
    assert!(ran.stdout.contains(&counts), "{counts} in {}", ran.stdout);
    let compared = json("compare.json");
    assert!(compared["model"]["to_truth"]["rms_m"].as_f64().unwrap() < 0.02, "{compared}");
}
