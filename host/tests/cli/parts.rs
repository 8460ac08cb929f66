//! A recording in parts is the same recording.

use std::fs;
use std::path::Path;

use biplane_recording::read::RIG_ATTACHMENT;
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
