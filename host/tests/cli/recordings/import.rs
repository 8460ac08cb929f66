//! `biplane import carmen` and `biplane info`.

use std::fs;

use crate::run::Folder;

const LOG: &str = "# made by hand\nFLASER 2 1.5 81.83 0 0 0 1 2 0.5 100.25 nohost 0.1\n\
    FLASER 2 1.25 1.75 0 0 0 3 4 0.5 100.125 nohost 0.2\n";

#[test]
fn a_log_becomes_a_recording_that_info_tells_about() {
    let folder = Folder::new("import");
    folder.write("a.log", LOG);
    folder.expect("import carmen a.log -o a.mcap", 0, &["a.mcap: 2 scans of 2 beams", "1 stamps step back"]);
    let ran = folder.expect("info a.mcap --json", 0, &[]);
    let info: serde_json::Value = serde_json::from_str(&ran.stdout).unwrap();
    assert_eq!(info["topics"][1]["name"], "/scan/horizontal");
    assert_eq!(info["topics"][1]["messages"], 2);
    assert_eq!(info["profile"], "ros2");
    let ran = folder.expect("info a.mcap", 0, &[]);
    assert!(ran.stdout.contains("/odom") && ran.stdout.contains("resolution_deg"), "{}", ran.stdout);
    let ran = folder.expect("--quiet import carmen a.log -o b.mcap", 0, &[]);
    assert_eq!((ran.stdout.as_str(), ran.stderr.as_str()), ("", ""));
    assert_eq!(fs::read(folder.path("a.mcap")).unwrap(), fs::read(folder.path("b.mcap")).unwrap());
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
    folder.write("empty.log", "# nothing\n");
    folder.write("kept.mcap", "somebody's");
    folder.expect("import carmen none.log -o x.mcap", 1, &["cannot read none.log"]);
    folder.expect("import carmen empty.log -o x.mcap", 1, &["empty.log holds no laser line", "1 lines"]);
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
    assert_eq!(fs::read(folder.path("kept.mcap")).unwrap(), b"somebody's");
    assert_eq!(folder.names(), ["a.log", "empty.log", "kept.mcap"]);
    folder.expect("import carmen a.log -o kept.mcap --force", 0, &[]);
}
