//! The folder that the truth of a drive is written to, by `simulate` and `serve`: made before anything else,
//! its files never replaced unasked, each one whole or not there.

use std::fs;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

/// Every file of a truth.
pub const FILES: [&str; 7] = [
    "poses.tum",
    "poses_vertical.tum",
    "scans_horizontal.txt",
    "scans_vertical.txt",
    "surfaces.ply",
    "trajectory.tum",
    "truth.json",
];

/// The truth could not be written.
#[derive(Debug, thiserror::Error)]
pub enum TruthError {
    /// The system refused.
    #[error("{}: cannot write the truth: {source}", path.display())]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// An earlier truth is there.
    #[error("{} exists already; it is not overwritten without --force", path.display())]
    Exists {
        /// The first file found.
        path: PathBuf,
    },
}

/// Every file that a truth in this folder may have.
pub fn truth_files(folder: &Path) -> Vec<PathBuf> {
    FILES.iter().map(|name| folder.join(name)).collect()
}

/// Makes the folder; refuses one that holds a truth, unless that may be overwritten.
pub fn prepare(folder: &Path, overwrite: bool) -> Result<(), TruthError> {
    fs::create_dir_all(folder).map_err(|source| TruthError::Io { path: folder.to_owned(), source })?;
    let existing = truth_files(folder).into_iter().find(|path| path.symlink_metadata().is_ok());
    match existing {
        Some(path) if !overwrite => Err(TruthError::Exists { path }),
        _ => Ok(()),
    }
}

/// Writes a file as `NAME.part`, which takes its name when it is whole.
pub fn write_file(
    folder: &Path,
    name: &str,
    write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> Result<(), TruthError> {
    let (path, part) = (folder.join(name), folder.join(format!("{name}.part")));
    let written = fs::File::create(&part).and_then(|file| {
        let mut out = BufWriter::new(file);
        write(&mut out)?;
        out.flush()?;
        fs::rename(&part, &path)
    });
    written.map_err(|source| TruthError::Io { path, source })
}

#[cfg(test)]
mod tests {
    use super::{TruthError, prepare, write_file};
    use std::fs;

    #[test]
    fn an_earlier_truth_is_replaced_only_when_asked_and_only_by_a_whole_file() {
        let folder = std::env::temp_dir().join(format!("biplane-truth-folder-{}", std::process::id()));
        let _ = fs::remove_dir_all(&folder);
        prepare(&folder, false).expect("made");
        write_file(&folder, "surfaces.ply", |out| out.write_all(b"first")).expect("written");
        let refused = prepare(&folder, false);
        assert!(matches!(refused, Err(TruthError::Exists { path }) if path.ends_with("surfaces.ply")));
        prepare(&folder, true).expect("asked");
        let broken = write_file(&folder, "surfaces.ply", |out| {
            out.write_all(b"half")?;
            Err(std::io::Error::other("full"))
        });
        assert!(broken.is_err());
        assert_eq!(fs::read_to_string(folder.join("surfaces.ply")).ok().as_deref(), Some("first"));
        let _ = fs::remove_dir_all(&folder);
    }
}
