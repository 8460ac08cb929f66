//! A job that is killed at any moment leaves nothing that looks finished, and the same command does it again
//! with the same result.

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::thread;
use std::time::Duration;

use crate::ring::{Drive, record};
use crate::room::{self, Content};
use crate::run::{Folder, names};

/// The first run is killed so soon, milliseconds.
const FIRST_MS: u64 = 30;
/// More runs than this are not needed.
const MAX_RUNS: u64 = 40;

/// When a run is killed, milliseconds: each later than the one before by seven tenths, until one has come to
/// its end.
fn after_ms(run: u64) -> u64 {
    (0..run).fold(FIRST_MS, |after_ms, _| after_ms * 17 / 10)
}

/// Runs the command; kills it when it is time. Whether it came to its end before.
fn killed_when(folder: &Folder, arguments: &str, mut is_time: impl FnMut() -> bool) -> bool {
    let mut run = Command::new(env!("CARGO_BIN_EXE_biplane"))
        .args(arguments.split_whitespace())
        .current_dir(folder.path("."))
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let mut is_over = false;
    while !is_over && !is_time() {
        thread::sleep(Duration::from_millis(1));
        is_over = run.try_wait().unwrap().is_some();
    }
    // The same as kill -9.
    let _ = run.kill();
    let _ = run.wait();
    is_over
}

/// The same after so long.
fn killed_after(folder: &Folder, arguments: &str, after_ms: u64) -> bool {
    let mut left_ms = after_ms;
    killed_when(folder, arguments, || {
        left_ms = left_ms.saturating_sub(1);
        left_ms == 0
    })
}

/// Kills the command again and again, each time later, until it is done; returns how often, and how often it
/// left something behind.
fn killed_again_and_again(folder: &Folder, arguments: &str, output: &str, beside: &[&str]) -> (u64, u64) {
    let mut left = 0;
    for runs in 1..MAX_RUNS {
        if killed_after(folder, arguments, after_ms(runs)) {
            return (runs - 1, left);
        }
        let mut names = folder.names();
        names.retain(|name| name != "run.mcap" && name != "calm" && name != "calm.mcap");
        left += u64::from(!names.is_empty());
        // Killed in its very last moment it is there, and whole.
        for name in names.iter().filter(|name| *name != output) {
            assert!(beside.contains(&name.as_str()), "{names:?}");
        }
    }
    panic!("it does not come to an end in {} ms", after_ms(MAX_RUNS));
}

/// The files of two builds are the same, but for measured times.
fn assert_same(one: &Path, other: &Path) {
    assert_eq!(names(one), names(other));
    for name in names(one).iter().filter(|name| !["summary.json", "report.html"].contains(&name.as_str())) {
        assert!(fs::read(one.join(name)).unwrap() == fs::read(other.join(name)).unwrap(), "{name} differs");
    }
}

#[test]
fn a_build_that_is_killed_is_done_again_with_the_same_result() {
    for (name, is_ring) in [("killed-ring", true), ("killed-room", false)] {
        let folder = Folder::new(name);
        match is_ring {
            true => drop(record(&folder.path("run.mcap"), Drive::default())),
            false => room::record(&folder.path("run.mcap"), Content { poses: true, vertical: true }),
        }
        folder.expect("build run.mcap -o calm", 0, &[]);
        let (kills, left) = killed_again_and_again(&folder, "build run.mcap -o out", "out", &["out.part"]);
        println!("{name}: killed {kills} times, {left} of them with something begun");
        assert!(left > 0, "no kill met a build at work");
        assert_same(&folder.path("calm"), &folder.path("out"));
        assert_eq!(folder.names(), ["calm", "out", "run.mcap"]);
        // Killed while it replaces one.
        assert!(!killed_after(&folder, "build run.mcap -o out --force", FIRST_MS));
        folder.expect("build run.mcap -o out --force", 0, &[]);
        assert_same(&folder.path("calm"), &folder.path("out"));
        assert_eq!(folder.names(), ["calm", "out", "run.mcap"]);
    }
}

#[test]
fn an_optimization_that_is_killed_goes_on_where_it_was() {
    let folder = Folder::new("killed-optimize");
    record(&folder.path("run.mcap"), Drive::default());
    folder.expect("optimize run.mcap -o calm.mcap", 0, &[]);
    let beside = ["out.mcap.loops", "out.mcap.active"];
    let (kills, left) = killed_again_and_again(&folder, "optimize run.mcap -o out.mcap", "out.mcap", &beside);
    println!("killed {kills} times, {left} of them with something begun");
    assert!(left > 0, "no kill met it at work");
    assert!(fs::read(folder.path("calm.mcap")).unwrap() == fs::read(folder.path("out.mcap")).unwrap());
    assert_eq!(folder.names(), ["calm.mcap", "out.mcap", "run.mcap"]);
    // Killed while it writes, which takes too short to be met by chance.
    fs::remove_file(folder.path("out.mcap")).unwrap();
    let is_begun =
        || fs::read_to_string(folder.path("out.mcap.loops")).is_ok_and(|text| text.lines().count() > 2);
    assert!(!killed_when(&folder, "optimize run.mcap -o out.mcap", is_begun));
    folder.write("out.mcap.active", "half");
    folder.expect("optimize run.mcap -o out.mcap", 0, &["going on after"]);
    assert_eq!(folder.names(), ["calm.mcap", "out.mcap", "run.mcap"]);
}
