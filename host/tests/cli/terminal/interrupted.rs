//! Ctrl-C and SIGTERM: one line says what is kept, and nothing else is.

use std::fs;
use std::process::{Command, Stdio};
use std::thread;
use std::time::Duration;

use crate::ring::{Drive, record};
use crate::room::{self, Content};
use crate::run::{Folder, Ran};

/// Longer than any run here waits, milliseconds.
const PATIENCE_MS: u32 = 60_000;

/// Runs the command and sends it the signal when it is time.
fn signaled(folder: &Folder, arguments: &str, signal: &str, is_time: impl Fn() -> bool) -> Ran {
    let run = Command::new(env!("CARGO_BIN_EXE_biplane"))
        .args(arguments.split_whitespace())
        .current_dir(folder.path("."))
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    for _ in 0..PATIENCE_MS {
        if is_time() {
            break;
        }
        thread::sleep(Duration::from_millis(1));
    }
    let sent = Command::new("kill").args([signal, &run.id().to_string()]).status().unwrap();
    assert!(sent.success(), "biplane {arguments} was over too soon");
    let output = run.wait_with_output().unwrap();
    Ran {
        code: output.status.code().expect("an exit code, not a signal"),
        stdout: String::from_utf8_lossy(&output.stdout).into_owned(),
        stderr: String::from_utf8_lossy(&output.stderr).into_owned(),
    }
}

/// Whether a checkpoint has answers.
fn has_answers(folder: &Folder, name: &str) -> bool {
    fs::read_to_string(folder.path(name)).is_ok_and(|text| text.lines().count() > 2)
}

#[test]
fn an_interrupted_search_is_kept_and_the_same_command_goes_on() {
    let folder = Folder::new("interrupted-search");
    record(&folder.path("run.mcap"), Drive::default());
    for (command, begun, checkpoint) in [
        ("build run.mcap -o out", "out.part", "out.part/.searches"),
        ("optimize run.mcap -o opt.mcap", "opt.mcap.loops", "opt.mcap.loops"),
    ] {
        let ran = signaled(&folder, command, "-INT", || has_answers(&folder, checkpoint));
        assert_eq!(ran.code, 1, "{ran:?}");
        let words = format!("biplane: interrupted; the same command goes on with what is in {begun}\n");
        assert!(ran.stderr.ends_with(&words), "{ran:?}");
        folder.expect(command, 0, &["going on after"]);
    }
    assert_eq!(folder.names(), ["opt.mcap", "out", "run.mcap"]);
}

#[test]
fn what_nobody_can_go_on_with_is_removed() {
    let folder = Folder::new("interrupted");
    room::record(&folder.path("run.mcap"), Content { poses: true, vertical: true });
    let is_begun = || folder.path("out.part").exists();
    let ran = signaled(&folder, "build run.mcap -o out --no-optimize", "-TERM", is_begun);
    assert_eq!(ran.code, 1, "{ran:?}");
    assert!(ran.stderr.ends_with("biplane: told to end (SIGTERM); nothing unfinished is kept\n"), "{ran:?}");
    assert_eq!(ran.stderr.matches("biplane:").count(), 1, "{ran:?}");
    assert_eq!(folder.names(), ["run.mcap"]);
}

#[cfg(feature = "demo")]
#[test]
fn an_interrupted_demo_leaves_nothing() {
    let folder = Folder::new("interrupted-demo");
    for begun in ["demo/rig", "demo/run.mcap.active"] {
        let ran = signaled(&folder, "demo -o demo", "-INT", || folder.path(begun).exists());
        assert_eq!(ran.code, 1, "{ran:?}");
        assert!(ran.stderr.ends_with("biplane: interrupted; nothing unfinished is kept\n"), "{ran:?}");
        assert_eq!(folder.names(), [] as [&str; 0]);
    }
}
