//! Runs the program in a folder of its own.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// A folder that is removed at the end.
pub struct Folder(PathBuf);

/// How a run ended.
#[derive(Debug)]
pub struct Ran {
    pub code: i32,
    pub stdout: String,
    pub stderr: String,
}

impl Folder {
    pub fn new(name: &str) -> Self {
        let path =
            PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(format!("cli-{name}-{}", std::process::id()));
        let _ = fs::remove_dir_all(&path);
        fs::create_dir_all(&path).unwrap();
        Self(path)
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.0.join(name)
    }

    pub fn write(&self, name: &str, bytes: impl AsRef<[u8]>) -> PathBuf {
        let path = self.path(name);
        fs::write(&path, bytes).unwrap();
        path
    }

    /// Names of everything in it, sorted.
    pub fn names(&self) -> Vec<String> {
        names(&self.0)
    }

    /// Runs `biplane` in the folder with arguments separated by blanks.
    pub fn biplane(&self, arguments: &str) -> Ran {
        let output = Command::new(env!("CARGO_BIN_EXE_biplane"))
            .args(arguments.split_whitespace())
            .current_dir(&self.0)
            .output()
            .unwrap();
        Ran {
            code: output.status.code().unwrap(),
            stdout: String::from_utf8_lossy(&output.stdout).into_owned(),
            stderr: String::from_utf8_lossy(&output.stderr).into_owned(),
        }
    }

    /// Runs `biplane` on a terminal and returns all that it drew there; `None` where there is no program `script` to make one.
    pub fn on_terminal(&self, arguments: &str) -> Option<String> {
        let command = format!("{} {arguments}", env!("CARGO_BIN_EXE_biplane"));
        let mut script = Command::new("script");
        script.args(["--quiet", "--return", "--command", &command, "/dev/null"]).env("TERM", "xterm");
        let output = script.current_dir(&self.0).output().ok()?;
        let drawn = String::from_utf8_lossy(&output.stdout).into_owned();
        assert!(output.status.success(), "{command}\n{drawn}");
        Some(drawn)
    }

    /// Runs `biplane`, which must end with this code and say all of these words on stderr.
    #[track_caller]
    pub fn expect(&self, arguments: &str, code: i32, words: &[&str]) -> Ran {
        let ran = self.biplane(arguments);
        assert_eq!(ran.code, code, "biplane {arguments}\n{ran:?}");
        for word in words {
            assert!(ran.stderr.contains(word), "biplane {arguments}: no {word:?} in {}", ran.stderr);
        }
        ran
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

pub fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}
