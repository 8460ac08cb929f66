//! `biplane import` and `biplane info`.

use std::fs;

use crate::run::Folder;

const LOG: &str = "# made by hand\nFLASER 2 1.5 81.83 0 0 0 1 2 0.5 100.25 nohost 0.1\n\
    FLASER 2 1.25 1.75 0 0 0 3 4 0.5 100.125 nohost 0.2\n";

#[test]
fn a_log_becomes_a_recording_that_info_tells_about() {
    let folder = Folder::new("import");
    folder.write("a.log", LOG);
    folder.expect(
        "import carmen a.log -o a.mcap",
        0,
        &["a.mcap: 2 scans of 2 beams", "1 step back in the stamps"],
    );
    let ran = folder.expect("info a.mcap --json", 0, &[]);
    let info: serde_json::Value = serde_json::from_str(&ran.stdout).unwrap();
    assert_eq!(info["topics"][1]["name"], "/scan/horizontal");
    assert_eq!(info["topics"][1]["messages"], 2);
    assert_eq!(info["profile"], "ros2");
    let ran = folder.expect("info a.mcap", 0, &[]);
    assert!(ran.stdout.contains("/odom") && ran.stdout.contains("resolution_deg"), "{}", ran.stdout);
    assert!(ran.stdout.contains("rig (ports, mounts and the base are assumed"), "{}", ran.stdout);
    let ran = folder.expect("--quiet import carmen a.log -o b.mcap", 0, &[]);
    assert_eq!((ran.stdout.as_str(), ran.stderr.as_str()), ("", ""));
    assert_eq!(fs::read(folder.path("a.mcap")).unwrap(), fs::read(folder.path("b.mcap")).unwrap());
}

#[test]
fn a_recording_of_our_own_is_named_when_it_is_imported_as_a_bag() {
    let folder = Folder::new("import-own");
    folder.write("a.log", LOG);
    folder.expect("import carmen a.log -o a.mcap", 0, &[]);
    let ran = folder.expect("import bag a.mcap -o b.mcap", 0, &["a.mcap is a recording of Biplane already"]);
    assert!(!ran.stderr.contains("after their stamps"), "{}", ran.stderr);
}

#[test]
fn a_broken_line_is_named_and_costs_exit_code_3() {
    let folder = Folder::new("broken-line");
    folder.write("a.log", format!("{LOG}FLASER 2 1.5\n"));
    folder.expect(
        "--quiet import carmen a.log -o a.mcap",
        3,
        &["a.log line 4: the line ends where a range should stand"],
    );
    let ran = folder.biplane("info a.mcap --json");
    let info: serde_json::Value = serde_json::from_str(&ran.stdout).unwrap();
    assert_eq!(info["topics"][1]["messages"], 2);
}

#[test]
fn bad_input_is_one_sentence_and_nothing_is_written_or_lost() {
    let folder = Folder::new("bad-input");
    folder.write("a.log", LOG);
    folder.write("kept.mcap", "somebody's");
    folder.expect("import carmen none.log -o x.mcap", 1, &["none.log does not exist"]);
    for (lines, counted) in [("# nothing\n", "in 1 line: "), ("# nothing\n# at all\n", "in 2 lines: ")] {
        folder.write("empty.log", lines);
        folder.expect("import carmen empty.log -o x.mcap", 1, &["empty.log holds no laser line", counted]);
    }
    folder.expect("import carmen a.log -o kept.mcap", 1, &["kept.mcap exists already"]);
    folder.expect("import carmen a.log", 2, &["--output"]);
    folder.expect("import toast a.log -o x.mcap", 2, &["toast"]);
    folder.expect("", 2, &["Usage"]);
    folder.expect("info none.mcap", 1, &["none.mcap"]);
    folder.expect("info a.log", 1, &["a.log", "MCAP"]);
    for name in ["traj a.log -o -", "map a.log -o m", "build a.log -o d", "recover a.log -o r.mcap"] {
        let ran = folder.expect(name, 1, &["a.log"]);
        assert_eq!(ran.stderr.lines().count(), 1, "{}", ran.stderr);
    }
    let way_out = "`biplane import carmen` and then `biplane-onboard replay` make one of the log";
    for name in ["plot trajectory a.log -o p.svg", "evaluate trajectory a.log a.log"] {
        folder.expect(name, 1, &["a.log is a CARMEN log; expected a posed recording", way_out]);
    }
    folder.expect("plot trajectory a.log --map a.log -o p.svg", 1, &["; --map takes the posed recording"]);
    assert_eq!(fs::read(folder.path("kept.mcap")).unwrap(), b"somebody's");
    assert_eq!(folder.names(), ["a.log", "empty.log", "kept.mcap"]);
    folder.expect("import carmen a.log -o kept.mcap --force", 0, &[]);
}

/// A small bag of our own making, in the container of that name: two lasers, two scans each, and odometry.
fn bag(container: &str) -> Vec<u8> {
    let corpus = concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/fuzz/corpus/bag");
    fs::read(format!("{corpus}/seed-{container}")).unwrap()
}

#[test]
fn a_bag_in_any_container_becomes_the_same_recording() {
    let folder = Folder::new("import-bag");
    let summary = ["2 horizontal and 2 vertical scans in 0.1 s, 1 odometry message,"];
    let mut recordings = Vec::new();
    for container in ["none", "bz2", "lz4", "sqlite", "packed"] {
        folder.write("a.bag", bag(container));
        folder.expect("import bag a.bag -o a.mcap --force", 0, &summary);
        recordings.push(fs::read(folder.path("a.mcap")).unwrap());
    }
    assert!(recordings.windows(2).all(|pair| pair[0] == pair[1]));
    let ran = folder.expect("info a.mcap", 0, &[]);
    // base_link -> up: pitch -90; the laser that localizes lies flat, where it sits by default.
    let shown = ran.stdout.replace("\n    # ", " ");
    assert!(shown.contains("mount = { x = 0.2, y = 0.0, z = 0.3, roll = 0.0, pitch = 0.0, yaw"), "{shown}");
    assert!(shown.contains("mount = { x = 0.0, y = 0.0, z = 0.5, roll = 0.0, pitch = -90.0, yaw"), "{shown}");
    assert!(ran.stdout.lines().all(|line| line.len() <= 80), "{shown}");
    assert_eq!(folder.names(), ["a.bag", "a.mcap"]);
}

#[test]
fn a_damaged_bag_costs_what_is_damaged_and_exit_code_3() {
    let folder = Folder::new("damaged-bag");
    let whole = bag("none");
    for (cut, expected) in [(whole.len() - 1, 3), (13, 1), (0, 1)] {
        folder.write("a.bag", &whole[..cut]);
        let ran = folder.expect("--quiet import bag a.bag -o a.mcap --force", expected, &["a.bag"]);
        assert_eq!(ran.stderr.lines().count(), 1, "{}", ran.stderr);
    }
}

#[test]
fn what_is_not_the_only_choice_is_asked_for() {
    let folder = Folder::new("choice-bag");
    folder.write("a.bag", bag("none"));
    folder.expect("import bag a.bag -o a.mcap --horizontal nothing", 2, &["/scan@flat", "/scan_up@up"]);
    folder.expect("import bag a.bag -o a.mcap --vertical /scan", 2, &["cannot be both lasers"]);
    folder.expect("import bag a.bag -o a.mcap --odom wheels", 2, &["/odom (1 messages)"]);
    folder.expect("import bag a.bag -o a.mcap --base-frame moon", 2, &["no transform names it"]);
    folder.expect("import bag a.bag -o a.mcap --mount-vertical 1,2", 2, &["six numbers"]);
    assert_eq!(folder.names(), ["a.bag"]);
    folder.expect(
        "import bag a.bag -o a.mcap --vertical none --odom none",
        0,
        &["2 horizontal and 0 vertical"],
    );
}
