//! Too little memory: one sentence, exit code 1, nothing left behind, and no intact file called damaged.

use std::process::{Command, Output};

use crate::room::{self, Content};
use crate::run::Folder;

/// Address space, kB: from less than the program's own image takes to what is enough for all.
const LIMITS_KB: [u32; 10] =
    [16_000, 20_000, 26_000, 34_000, 45_000, 60_000, 90_000, 150_000, 300_000, 2_000_000];

/// Below this, kB, the system may be unable to load a test build at all: its image alone is 17,000.
const LOADS_KB: u32 = 26_000;

/// What the program does with this address space.
fn run(limit_kb: u32, arguments: &str, folder: &Folder) -> Output {
    let program = env!("CARGO_BIN_EXE_biplane");
    let command = format!("ulimit -v {limit_kb}; exec {program} {arguments}");
    Command::new("sh").args(["-c", &command]).current_dir(folder.path("")).output().unwrap()
}

/// Whether the program can begin. Where it cannot, the system's loader says so with code 127, or the
/// system ends it with a signal before it has begun.
fn loads(limit_kb: u32, folder: &Folder) -> bool {
    limit_kb >= LOADS_KB || matches!(run(limit_kb, "--version", folder).status.code(), Some(0 | 1))
}

#[test]
fn too_little_memory_is_a_sentence_and_leaves_nothing() {
    let folder = Folder::new("memory");
    room::record(&folder.path("run.mcap"), Content { poses: true, vertical: true });
    let mut exhausted = 0;
    for limit_kb in LIMITS_KB.into_iter().filter(|&limit_kb| loads(limit_kb, &folder)) {
        for arguments in [
            "info run.mcap",
            "map run.mcap -o floor",
            "build run.mcap -o out",
            "optimize run.mcap -o opt.mcap",
        ] {
            let output = run(limit_kb, arguments, &folder);
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
                    // With less than the reserve to spare the last words are these alone.
                    let is_sentence = last.starts_with("biplane: ") || last == "out of memory";
                    assert!(is_sentence && has_reason && !last.contains("damaged"), "{context}");
                    exhausted += 1;
                }
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
