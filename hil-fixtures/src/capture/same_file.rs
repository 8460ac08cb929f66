//! An output that is its own input, under whatever name: writing it would destroy what is read.
//!
//! A capture is written as `NAME.active` and renamed to `NAME` when it is whole, so neither may be the input.
//! Files are told apart by device and inode: links and other spellings of a path do not hide one.

use std::fs;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

/// Writing the output would destroy an input.
#[derive(Debug, thiserror::Error)]
#[error(
    "{}: writing {} would destroy this input; choose another output (nothing was changed)",
    input.display(),
    output.display()
)]
pub struct SameFile {
    /// What is read.
    pub input: PathBuf,
    /// What was to be written.
    pub output: PathBuf,
}

/// Refuses a capture `output` if it, or the name that it has while it is written, is `input`.
pub fn refuse_same_file(input: &Path, output: &Path) -> Result<(), SameFile> {
    let Some(found) = identity(input) else { return Ok(()) };
    let active = biplane_recording::mcap::write::active_path(output);
    if [output, &active].into_iter().any(|written| identity(written) == Some(found)) {
        return Err(SameFile { input: input.to_owned(), output: output.to_owned() });
    }
    Ok(())
}

fn identity(path: &Path) -> Option<(u64, u64)> {
    fs::metadata(path).ok().map(|file| (file.dev(), file.ino()))
}

#[cfg(test)]
mod tests {
    use crate::capture::encode;
    use crate::capture::encode::EncodeOptions;
    use crate::capture::extract::{ExtractOptions, extract};
    use crate::simulate::{self, SimulateOptions};
    use std::fs;
    use std::path::PathBuf;

    #[test]
    fn an_input_that_is_the_output_or_its_unfinished_name_or_a_link_to_it_is_left_alone() {
        let folder = std::env::temp_dir().join(format!("biplane-same-file-{}", std::process::id()));
        let _ = fs::remove_dir_all(&folder);
        fs::create_dir_all(folder.join("inner")).expect("a folder");
        let fixture = concat!(env!("CARGO_MANIFEST_DIR"), "/captures/");
        let fixture = fs::read_dir(fixture).expect("captures").filter_map(|e| e.ok().map(|e| e.path()));
        let fixture = fixture.filter(|path| path.extension().is_some_and(|e| e == "mcap")).min();
        let bytes = fs::read(fixture.expect("a capture")).expect("read");
        let file = |name: &str| -> PathBuf {
            let path = folder.join(name);
            fs::write(&path, &bytes).expect("written");
            path
        };
        let (whole, active) = (file("q.mcap"), file("q2.mcap.active"));
        std::os::unix::fs::symlink(&whole, folder.join("link.mcap")).expect("a link");
        for (input, output) in [
            (&whole, folder.join("q.mcap")),
            (&whole, folder.join("inner/../q.mcap")),
            (&whole, folder.join("link.mcap")),
            (&active, folder.join("q2.mcap")),
        ] {
            let (input, overwrite) = (input.clone(), true);
            let options = ExtractOptions {
                input: input.clone(),
                output: output.clone(),
                overwrite,
                ..Default::default()
            };
            let extracted = extract(&options).expect_err("refused").to_string();
            let options = EncodeOptions { input: input.clone(), output, overwrite, ..Default::default() };
            let encoded = encode::run(&options).expect_err("refused").to_string();
            for message in [extracted, encoded] {
                assert!(message.contains("would destroy this input"), "{message}");
            }
            assert!(fs::read(&input).expect("still there") == bytes);
        }
        let path = folder.join("path.toml");
        fs::write(&path, "waypoints_m = [[0, 0], [1, 0]]").expect("written");
        let options = SimulateOptions {
            path: Some(path.display().to_string()),
            output: path.clone(),
            overwrite: true,
            ..Default::default()
        };
        let message = simulate::run(&options).expect_err("refused").to_string();
        assert!(message.contains("would destroy this input") && path.exists(), "{message}");
        let _ = fs::remove_dir_all(&folder);
    }
}
