//! Too little memory: one sentence, exit code 1, nothing left behind, and no intact file called damaged.

use std::process::{Command, Output};

use crate::room::{self, Content};
use crate::run::Folder;

/// Address space, kB, beyond what the program needs to begin: from next to nothing to what is enough for all.
/// The first is more than that need varies from run to run.
const BEYOND_KB: [u32; 9] = [700, 2_000, 8_000, 19_000, 34_000, 64_000, 124_000, 274_000, 1_974_000];

/// Step in which the need to begin is looked for, kB.
const STEP_KB: u32 = 500;

/// What the program does with this address space.
fn run(limit_kb: u32, arguments: &str, folder: &Folder) -> Output {
    let program = env!("CARGO_BIN_EXE_biplane");
    let command = format!("ulimit -v {limit_kb}; exec {program} {arguments}");
    Command::new("sh").args(["-c", &command]).current_dir(folder.path("")).output().unwrap()
}

/// What the program needs to begin, kB: most of it is its own image, which is larger in a test build. With
/// less the system's loader says so with code 127, or the system ends it with a signal before it has begun.
fn begins_kb(folder: &Folder) -> u32 {
    let begins = |limit_kb: &u32| {
        let output = run(*limit_kb, "--version", folder);
        let reported = String::from_utf8_lossy(&output.stderr);
        assert!(!reported.contains("panicked"), "{limit_kb} kB: {reported}");
        output.status.success()
    };
    (1..200).map(|steps| steps * STEP_KB).find(begins).unwrap()
}

#[test]
fn too_little_memory_is_a_sentence_and_leaves_nothing() {
    let folder = Folder::new("memory");
    room::record(&folder.path("run.mcap"), Content { poses: true, vertical: true });
    let mut exhausted = 0;
    let begins_kb = begins_kb(&folder);
    for limit_kb in BEYOND_KB.map(|beyond_kb| begins_kb + beyond_kb) {
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
