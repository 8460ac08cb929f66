//! Too little memory: one sentence, exit code 1, nothing left behind, and no intact file called damaged.

use std::process::Command;

use crate::room::{self, Content};
use crate::run::Folder;

/// Address space, kB: from what the program can hardly start with to what is enough for all.
const LIMITS_KB: [u32; 10] =
    [16_000, 20_000, 26_000, 34_000, 45_000, 60_000, 90_000, 150_000, 300_000, 2_000_000];

#[test]
fn too_little_memory_is_a_sentence_and_leaves_nothing() {
    let folder = Folder::new("memory");
    room::record(&folder.path("run.mcap"), Content { poses: true, vertical: true });
    let mut exhausted = 0;
    for limit_kb in LIMITS_KB {
        for arguments in [
            "info run.mcap",
            "map run.mcap -o floor",
            "build run.mcap -o out",
            "optimize run.mcap -o opt.mcap",
        ] {
            let program = env!("CARGO_BIN_EXE_biplane");
            let command = format!("ulimit -v {limit_kb}; exec {program} {arguments}");
            let output =
                Command::new("sh").args(["-c", &command]).current_dir(folder.path("")).output().unwrap();
            let reported = String::from_utf8_lossy(&output.stderr);
            let context = format!("{limit_kb} kB: {arguments}: {:?}: {reported}", output.status);
            let mut names = folder.names();
            match output.status.code() {
                Some(0) => {
                    names.retain(|name| !["floor", "out", "opt"].iter().any(|ours| name.starts_with(ours)));
                }
                Some(1) => {
                    let last = reported.lines().last().unwrap_or_default();
                    let has_reason = ["memory", "address space"].iter().any(|word| last.contains(word));
                    assert!(
                        last.starts_with("biplane: ") && has_reason && !last.contains("damaged"),
                        "{context}"
                    );
                    exhausted += 1;
                }
                // The system's loader itself has not got enough.
                Some(127) if limit_kb < 20_000 => {}
                _ => panic!("{context}"),
            }
            assert!(!reported.contains("panicked"), "{context}");
            assert_eq!(names, ["run.mcap"], "{context}");
            for name in folder.names().iter().filter(|name| *name != "run.mcap") {
                let path = folder.path(name);
                let _ = std::fs::remove_dir_all(&path).or_else(|_| std::fs::remove_file(&path));
            }
        }
    }
    assert!(exhausted > 2, "memory was never short");
}
