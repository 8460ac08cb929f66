//! A recording in parts is the same recording, also when the power went in its last part, or one part is
//! gone.

use std::fs;
use std::path::Path;

use biplane_recording::mcap::read::RIG_ATTACHMENT;
use biplane_recording::{PartsWriter, Reader, Rotation, WriterOptions};

use crate::room::{self, Content};
use crate::run::Folder;

/// Cuts a recording into parts of so many seconds.
fn cut(path: &Path, parts: &Path, seconds: f64) -> usize {
    let reader = Reader::open(path).unwrap();
    let rotation = Rotation { span_ns: Some((seconds * 1e9) as i64), bytes: None };
    let mut writer = PartsWriter::create(parts, &WriterOptions::default(), rotation).unwrap();
    let rig = reader.attachment(RIG_ATTACHMENT).unwrap().unwrap();
    writer.attach(RIG_ATTACHMENT, "application/toml", &rig).unwrap();
    for entry in reader.messages().map(Result::unwrap) {
        let topic = entry.topic.unwrap();
        writer.write_encoded(topic, entry.log_time_ns, entry.publish_time_ns, &entry.bytes).unwrap();
    }
    writer.finish().unwrap().parts.len()
}

#[test]
fn parts_give_the_trajectory_the_map_and_the_counts_of_the_whole_in_whatever_order_they_are_named() {
    let folder = Folder::new("parts");
    room::record(&folder.path("whole.mcap"), Content { poses: true, vertical: false });
    let parts = cut(&folder.path("whole.mcap"), &folder.path("run.mcap"), 0.5);
    assert!(parts > 3, "{parts}");
    let all: Vec<_> = (0..parts).rev().map(|number| format!("run_{number}.mcap")).collect();
    let all = all.join(" ");
    folder.expect("traj whole.mcap -o whole.tum", 0, &[]);
    for (words, name) in [(all.as_str(), "list.tum"), ("run.mcap", "name.tum")] {
        folder.expect(&format!("traj {words} -o {name}"), 0, &["poses"]);
        assert!(fs::read(folder.path(name)).unwrap() == fs::read(folder.path("whole.tum")).unwrap());
    }
    folder.expect("map whole.mcap -o whole", 0, &[]);
    folder.expect(&format!("map {all} -o run"), 0, &[]);
    assert!(fs::read(folder.path("whole.pgm")).unwrap() == fs::read(folder.path("run.pgm")).unwrap());
    let count = |words: &str| -> serde_json::Value {
        serde_json::from_str(&folder.expect(&format!("info --json {words}"), 0, &[]).stdout).unwrap()
    };
    let (whole, joined) = (count("whole.mcap"), count(&all));
    assert_eq!(whole["topics"], joined["topics"]);
    assert_eq!(joined["parts"].as_array().unwrap().len(), parts);
    folder.expect("traj run_0.mcap run_2.mcap -o hole.tum", 0, &["part 1 is not among the parts"]);
    folder.expect("traj run_0.mcap whole.mcap -o no.tum", 1, &["no parts of one recording"]);
    folder.expect("traj run_1.mcap -o run_1.mcap --force", 1, &["run_1.mcap"]);
}

/// Names of files, and what in them follows what names the input.
fn same_points(folder: &Folder, one: &str, other: &str) {
    let points = |name: &str| {
        let bytes = fs::read(folder.path(name)).unwrap();
        let header = bytes.windows(11).position(|window| window == b"end_header\n").unwrap();
        bytes[header..].to_vec()
    };
    for name in ["raw.ply", "planes.ply"] {
        assert!(points(&format!("{one}/{name}")) == points(&format!("{other}/{name}")), "{name}");
    }
}

#[test]
fn parts_give_the_model_and_the_closed_loops_of_the_whole() {
    let folder = Folder::new("parts-build");
    room::record(&folder.path("whole.mcap"), Content { poses: true, vertical: true });
    assert!(cut(&folder.path("whole.mcap"), &folder.path("run.mcap"), 6.0) > 2);
    for name in ["whole", "run"] {
        folder.expect(&format!("build {name}.mcap -o {name}"), 0, &[]);
        folder.expect(&format!("optimize {name}.mcap -o {name}.opt.mcap"), 0, &[]);
        folder.expect(&format!("traj {name}.opt.mcap -o {name}.tum"), 0, &[]);
    }
    same_points(&folder, "whole", "run");
    assert!(fs::read(folder.path("whole.tum")).unwrap() == fs::read(folder.path("run.tum")).unwrap());
}

#[test]
fn a_last_part_that_was_salvaged_goes_with_the_others_and_a_part_that_is_gone_is_told_by_every_command() {
    let folder = Folder::new("parts-salvaged");
    room::record(&folder.path("whole.mcap"), Content { poses: true, vertical: true });
    let parts = cut(&folder.path("whole.mcap"), &folder.path("run.mcap"), 6.0);
    let last = folder.path(&format!("run_{}.mcap", parts - 1));
    let bytes = fs::read(&last).unwrap();
    fs::remove_file(&last).unwrap();
    // The power went in the middle of the last part.
    fs::write(folder.path("run_last.mcap.active"), &bytes[..bytes.len() / 2]).unwrap();
    let name = last.file_name().unwrap().to_str().unwrap();
    folder.expect(&format!("recover run_last.mcap.active -o {name}"), 3, &["was not finished"]);
    let messages = |words: &str| -> u64 {
        let ran = folder.expect(&format!("info --json {words}"), 0, &[]);
        let info: serde_json::Value = serde_json::from_str(&ran.stdout).unwrap();
        info["messages"].as_u64().unwrap()
    };
    let sum: u64 = (0..parts).map(|number| messages(&format!("run_{number}.mcap"))).sum();
    // Each part repeats what is told once for all.
    let all = messages("run.mcap");
    assert!(all <= sum && all + parts as u64 > sum && all < messages("whole.mcap"), "{all} of {sum}");
    let commands = [
        "info {}",
        "traj {} -o {}.tum",
        "map {} -o {}.map",
        "optimize {} -o {}.opt.mcap",
        "build {} -o {}.model",
    ];
    for command in commands {
        let words = command.replacen("{}", "run.mcap", 1).replace("{}", "joined");
        folder.expect(&words, 0, &[]);
    }
    fs::remove_file(folder.path("run_1.mcap")).unwrap();
    for command in commands {
        let words = command.replacen("{}", "run.mcap", 1).replace("{}", "hole");
        let ran = folder.biplane(&words);
        let reported = format!("{}{}", ran.stdout, ran.stderr);
        assert!(reported.contains("part 1 is not among"), "{words}: {reported}");
        assert_eq!(ran.code, 0, "{words}: {reported}");
    }
}
