//! What is there already is somebody's: no command destroys what it reads, or what it did not make.

use std::fs;

use crate::room::{self, Content};
use crate::run::Folder;

const LOG: &str = "FLASER 2 1.5 81.83 0 0 0 1 2 0.5 100.25 nohost 0.1\n";

#[test]
fn a_build_replaces_only_what_a_build_wrote() {
    let folder = Folder::new("replace");
    fs::create_dir(folder.path("d")).unwrap();
    room::record(&folder.path("d/run.mcap"), Content { poses: true, vertical: false });
    folder.expect("build d/run.mcap -o d --force", 1, &["d/run.mcap is read and lies in d"]);
    folder.expect("build d/run.mcap -o out", 0, &[]);
    folder.expect("build d/run.mcap -o out --force", 0, &[]);
    folder.write("out/notes.txt", "mine");
    folder.expect("build d/run.mcap -o out --force", 1, &["out holds notes.txt"]);
    fs::create_dir(folder.path("other")).unwrap();
    folder.write("other/summary.json", "{}");
    folder.expect("build d/run.mcap -o other --force", 1, &["other holds no summary.json of a build"]);
    assert!(folder.path("d/run.mcap").exists() && folder.path("out/notes.txt").exists());
}

#[test]
fn no_output_is_the_input_under_its_own_or_its_temporary_name() {
    let folder = Folder::new("same");
    for name in ["z.log", "w.active"] {
        folder.write(name, LOG);
    }
    for name in ["s.mcap", "s.pgm", "t.part"] {
        room::record(&folder.path(name), Content { poses: true, vertical: false });
    }
    let names = folder.names();
    for command in [
        "import carmen z.log -o z.log --force",
        "import carmen w.active -o w --force",
        "import carmen w.active -o w",
        "traj s.mcap -o s.mcap --force",
        "traj t.part -o t",
        "map s.pgm -o s --force",
    ] {
        folder.expect(command, 1, &["read: name another output"]);
    }
    assert_eq!(folder.names(), names);
    assert_eq!(fs::read_to_string(folder.path("w.active")).unwrap(), LOG);
}

#[test]
fn an_input_under_its_own_name_is_named_once_and_under_another_with_both() {
    let folder = Folder::new("words");
    room::record(&folder.path("run.mcap"), Content { poses: true, vertical: false });
    std::os::unix::fs::symlink("run.mcap", folder.path("link.mcap")).unwrap();
    folder.expect("traj run.mcap -o run.mcap", 1, &["biplane: run.mcap is read: name another output"]);
    let words = "biplane: link.mcap is run.mcap, which is read: name another output";
    folder.expect("traj run.mcap -o link.mcap --force", 1, &[words]);
}

#[test]
fn two_outputs_are_two_files() {
    let folder = Folder::new("two");
    room::record(&folder.path("run.mcap"), Content { poses: true, vertical: true });
    folder.expect("build run.mcap -o out --no-optimize", 0, &[]);
    let names = folder.names();
    for command in [
        "optimize run.mcap -o o.mcap --loops o.mcap",
        "optimize run.mcap -o o.mcap --loops ./o.mcap --force",
        "optimize run.mcap -o o.mcap --loops o.mcap.loops",
        "compare out --pictures p.png --report p.png --force",
    ] {
        folder.expect(command, 1, &["is another output of the same run"]);
        assert_eq!(folder.names(), names, "{command}");
    }
}

#[test]
fn what_cannot_be_written_is_said_before_anything_is_computed() {
    let folder = Folder::new("early");
    room::record(&folder.path("run.mcap"), Content { poses: true, vertical: true });
    folder.expect("build run.mcap -o out --no-optimize", 0, &[]);
    folder.write("mine", "mine");
    for (command, words) in [
        ("compare out --pictures mine", "mine exists already"),
        ("compare out --report mine", "mine exists already"),
        ("compare out --truth out/raw.ply --report out/raw.ply --force", "raw.ply is read"),
        ("calibrate run.mcap -o run.mcap --force", "run.mcap is read"),
    ] {
        let ran = folder.expect(command, 1, &[words]);
        assert_eq!(ran.stdout, "", "{command}");
    }
}

#[test]
fn a_temporary_name_that_is_taken_is_said_and_left_alone() {
    let folder = Folder::new("part");
    room::record(&folder.path("run.mcap"), Content { poses: true, vertical: false });
    folder.write("t.tum.part", "mine");
    fs::create_dir(folder.path("out.part")).unwrap();
    folder.write("out.part/notes.txt", "mine");
    folder.expect("traj run.mcap -o t.tum", 1, &["t.tum.part exists already", "move it away"]);
    folder.expect("build run.mcap -o out", 1, &["out.part exists already", "move it away"]);
    assert_eq!(fs::read_to_string(folder.path("t.tum.part")).unwrap(), "mine");
    assert_eq!(fs::read_to_string(folder.path("out.part/notes.txt")).unwrap(), "mine");
}

#[test]
fn a_cause_is_said_once_and_a_wild_pose_is_named() {
    let folder = Folder::new("cause");
    room::record(&folder.path("run.mcap"), Content { poses: true, vertical: false });
    let ran = folder.expect("traj run.mcap -o none/t.tum", 1, &["No such file"]);
    assert_eq!(ran.stderr.matches("No such file").count(), 1, "{}", ran.stderr);
    folder.write("wild.tum", "1700000000 1 0 0 0 0 0 1\n1700000001 1e7 0 0 0 0 0 1\n");
    folder.expect("build run.mcap -o x --poses wild.tum", 1, &["wild.tum: line 2: expected"]);
}
