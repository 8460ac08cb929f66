//! The inputs that stand in the repository: `tests/fuzz/corpus/TARGET/`, seeds and every input that ever
//! broke a promise.

use std::path::PathBuf;

use crate::inputs::Target;

/// Folder of a target's inputs.
#[must_use]
pub fn folder(target: &Target) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("fuzz/corpus").join(target.name)
}

/// All inputs of a target in the order of their names.
///
/// # Panics
/// When the folder cannot be read.
#[must_use]
pub fn of(target: &Target) -> Vec<(String, Vec<u8>)> {
    let folder = folder(target);
    let entries = std::fs::read_dir(&folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display()));
    let mut inputs: Vec<_> = entries
        .map(|entry| {
            let path = entry.expect("a folder that lists").path();
            let bytes = std::fs::read(&path).expect("a file that reads");
            (path.file_name().unwrap_or_default().to_string_lossy().into_owned(), bytes)
        })
        .collect();
    inputs.sort();
    inputs
}
