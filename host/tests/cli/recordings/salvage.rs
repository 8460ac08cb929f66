//! `biplane recover`, and what the other commands say of a recording that was cut off.

use std::fs;

use crate::room::{self, Content};
use crate::run::Folder;

#[test]
fn a_cut_recording_is_salvaged_and_the_exit_code_says_what_was_lost() {
    let folder = Folder::new("recover");
    let whole = folder.path("whole.mcap");
    room::record(&whole, Content { poses: true, vertical: false });
    let bytes = fs::read(&whole).unwrap();
    // Only the footer's end is missing: nothing is lost.
    folder.write("footer.mcap", &bytes[..bytes.len() - 10]);
    folder.expect("recover footer.mcap -o a.mcap", 0, &["nothing lost"]);
    // Half of the file: data is lost, and said also when quiet.
    folder.write("half.mcap", &bytes[..bytes.len() / 2]);
    folder.expect("--quiet recover half.mcap -o b.mcap", 3, &["b.mcap: ", "messages kept; lost:"]);
    let ran = folder.expect("--quiet recover half.mcap -o b.mcap --force --json", 3, &["lost:"]);
    let reported: serde_json::Value = serde_json::from_str(&ran.stdout).unwrap();
    assert_eq!(reported["lost"], true);
    let kept = reported["messages"].as_u64().unwrap();
    assert!(ran.stderr.contains(&format!("b.mcap: {kept} messages kept")), "{ran:?}");
    folder.expect("traj b.mcap -o -", 0, &[]);
    assert_eq!(fs::read(folder.path("half.mcap")).unwrap(), bytes[..bytes.len() / 2]);
    folder.expect("recover half.mcap -o a.mcap", 1, &["a.mcap exists already"]);
    for command in ["info half.mcap", "traj half.mcap -o t", "map half.mcap -o m", "build half.mcap -o d"] {
        folder.expect(command, 1, &["half.mcap", "byte", "biplane recover"]);
    }
    assert_eq!(folder.names(), ["a.mcap", "b.mcap", "footer.mcap", "half.mcap", "whole.mcap"]);
}

#[test]
fn what_a_power_cut_left_unfinished_is_named_with_the_command_that_makes_it_whole() {
    let folder = Folder::new("recover-active");
    room::record(&folder.path("run.mcap"), Content { poses: true, vertical: false });
    let bytes = fs::read(folder.path("run.mcap")).unwrap();
    fs::remove_file(folder.path("run.mcap")).unwrap();
    folder.write("run.mcap.active", &bytes[..bytes.len() / 2]);
    let command = "`biplane recover run.mcap.active -o run.mcap`";
    for words in
        ["info run.mcap", "build run.mcap -o d", "build run.mcap.active -o d", "traj run.mcap.active -o t"]
    {
        folder.expect(words, 1, &["run.mcap.active is", command]);
    }
    folder.expect("recover run.mcap.active -o run.mcap", 3, &[]);
    folder.expect("traj run.mcap -o -", 0, &[]);
    folder.write("part_0.mcap.active", &bytes[..bytes.len() / 2]);
    folder.expect("info part.mcap", 1, &["`biplane recover part_0.mcap.active -o part_0.mcap`"]);
    folder.expect("info gone.mcap", 1, &["gone.mcap does not exist"]);
}
