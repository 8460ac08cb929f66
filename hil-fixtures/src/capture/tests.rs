//! What is read is never written, under whatever name.

use crate::capture::encode;
use crate::capture::encode::EncodeOptions;
use crate::capture::extract::{ExtractOptions, extract};
use crate::simulate::{self, SimulateOptions};
use std::fs;
use std::path::PathBuf;

#[test]
fn an_input_that_is_the_output_or_its_unfinished_name_or_a_link_to_it_is_left_alone() {
    let folder = std::env::temp_dir().join(format!("biplane-same-file-{}", std::process::id()));
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(folder.join("inner")).expect("a folder");
    let fixture = concat!(env!("CARGO_MANIFEST_DIR"), "/captures/");
    let fixture = fs::read_dir(fixture).expect("captures").filter_map(|e| e.ok().map(|e| e.path()));
    let fixture = fixture.filter(|path| path.extension().is_some_and(|e| e == "mcap")).min();
    let bytes = fs::read(fixture.expect("a capture")).expect("read");
    let file = |name: &str| -> PathBuf {
        let path = folder.join(name);
        fs::write(&path, &bytes).expect("written");
        path
    };
    let (whole, active) = (file("q.mcap"), file("q2.mcap.active"));
    std::os::unix::fs::symlink(&whole, folder.join("link.mcap")).expect("a link");
    for (input, output) in [
        (&whole, folder.join("q.mcap")),
        (&whole, folder.join("inner/../q.mcap")),
        (&whole, folder.join("link.mcap")),
        (&active, folder.join("q2.mcap")),
    ] {
        let (input, overwrite) = (input.clone(), true);
        let options =
            ExtractOptions { input: input.clone(), output: output.clone(), overwrite, ..Default::default() };
        let extracted = extract(&options).expect_err("refused").to_string();
        let options = EncodeOptions { input: input.clone(), output, overwrite, ..Default::default() };
        let encoded = encode::run(&options).expect_err("refused").to_string();
        for message in [extracted, encoded] {
            assert!(message.contains("name another output"), "{message}");
        }
        assert!(fs::read(&input).expect("still there") == bytes);
    }
    let path = folder.join("path.toml");
    fs::write(&path, "waypoints_m = [[0, 0], [1, 0]]").expect("written");
    let options = SimulateOptions {
        path: Some(path.display().to_string()),
        output: path.clone(),
        overwrite: true,
        ..Default::default()
    };
    let message = simulate::run(&options).expect_err("refused").to_string();
    assert!(message.contains("name another output") && path.exists(), "{message}");
    let _ = fs::remove_dir_all(&folder);
}

#[test]
fn a_truth_replaces_neither_the_world_that_is_read_nor_the_capture() {
    let folder = std::env::temp_dir().join(format!("biplane-truth-input-{}", std::process::id()));
    let _ = fs::remove_dir_all(&folder);
    let truth = folder.join("truth");
    fs::create_dir_all(&truth).expect("a folder");
    let world = truth.join("surfaces.ply");
    fs::write(&world, "somebody's").expect("written");
    let options = SimulateOptions {
        world: world.display().to_string(),
        output: folder.join("c.mcap"),
        truth: Some(truth.clone()),
        overwrite: true,
        ..Default::default()
    };
    let message = simulate::run(&options).expect_err("refused").to_string();
    assert!(message.contains("surfaces.ply is an input"), "{message}");
    let onto = SimulateOptions { world: "corridor".to_owned(), output: truth.join("poses.tum"), ..options };
    let message = simulate::run(&onto).expect_err("refused").to_string();
    assert!(message.contains("another output"), "{message}");
    assert_eq!(fs::read_to_string(&world).ok().as_deref(), Some("somebody's"));
    let _ = fs::remove_dir_all(&folder);
}
