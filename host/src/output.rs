//! Files that are whole or not there: each is written as `NAME.part`, brought to the disk, and takes its name when it is finished. So is a
//! folder of them ([`OutputFolder`]).

mod folder;

use std::ffi::OsString;
use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

pub use folder::{MARKER, OutputFolder};

/// Why a file could not be written.
#[derive(Debug, thiserror::Error)]
pub enum OutputError {
    /// The file is there already.
    #[error("{} exists already; it is not overwritten without --force", path.display())]
    Exists {
        /// The file.
        path: PathBuf,
    },
    /// The folder is there already and holds something.
    #[error("{} exists already and is not empty; it is not overwritten without --force", path.display())]
    NotEmpty {
        /// The folder.
        path: PathBuf,
    },
    /// The name that the result has until it is finished is taken.
    #[error("{} exists already: it is the name of {} while that is written; move it away first", part.display(), path.display())]
    PartExists {
        /// The name that is taken.
        part: PathBuf,
        /// What was to be written.
        path: PathBuf,
    },
    /// Another run is writing the same.
    #[error("{} is being written by another run just now, as {}", path.display(), part.display())]
    Busy {
        /// Its unfinished folder.
        part: PathBuf,
        /// What was to be written.
        path: PathBuf,
    },
    /// Writing would destroy what is read.
    #[error("{} is {}, which is read: name another output", output.display(), input.display())]
    IsInput {
        /// What would be written.
        output: PathBuf,
        /// What is read.
        input: PathBuf,
    },
    /// The system refused.
    #[error("cannot {action} {}: {source}", path.display())]
    Io {
        /// What was tried.
        action: &'static str,
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
}

impl OutputError {
    fn io(action: &'static str, path: &Path) -> impl FnOnce(io::Error) -> Self {
        move |source| Self::Io { action, path: path.to_owned(), source }
    }
}

/// `path` with `suffix` added to its whole name.
pub fn with_suffix(path: &Path, suffix: &str) -> PathBuf {
    let mut name = OsString::from(path.as_os_str());
    name.push(suffix);
    PathBuf::from(name)
}

/// Whether a file may be written here: there is none, or an empty one, or `overwrite` is set.
///
/// # Errors
/// [`OutputError::Exists`].
pub fn check_free(path: &Path, overwrite: bool) -> Result<(), OutputError> {
    match fs::metadata(path) {
        Ok(found) if found.len() > 0 && found.is_file() && !overwrite => {
            Err(OutputError::Exists { path: path.to_owned() })
        }
        _ => Ok(()),
    }
}

/// Refuses an output that is the input, under its own name or under the one with `suffix` that it has while it is written.
///
/// # Errors
/// [`OutputError::IsInput`].
pub fn check_not_input(output: &Path, suffix: &str, input: &Path) -> Result<(), OutputError> {
    for output in [output.to_owned(), with_suffix(output, suffix)] {
        if is_same_file(&output, input) {
            return Err(OutputError::IsInput { output, input: input.to_owned() });
        }
    }
    Ok(())
}

/// Whether both names are of one regular file, also through links.
#[cfg(unix)]
fn is_same_file(one: &Path, other: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    match (fs::metadata(one), fs::metadata(other)) {
        (Ok(one), Ok(other)) => one.is_file() && (one.dev(), one.ino()) == (other.dev(), other.ino()),
        _ => false,
    }
}

/// Whether both names are of one file, also through symbolic links.
#[cfg(not(unix))]
fn is_same_file(one: &Path, other: &Path) -> bool {
    matches!((one.canonicalize(), other.canonicalize()), (Ok(one), Ok(other)) if one == other)
}

/// Writes a file through `fill`. When that fails nothing of the name is left behind, and what was there before stays. What is no
/// regular file (`/dev/null`, a named pipe) is written to as it is.
///
/// # Errors
/// When the file exists (see [`check_free`]), or the system refuses.
pub fn write_file(
    path: &Path,
    overwrite: bool,
    fill: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>,
) -> Result<(), OutputError> {
    check_free(path, overwrite)?;
    if fs::metadata(path).is_ok_and(|found| !found.is_file()) {
        let file = File::create(path).map_err(OutputError::io("create", path))?;
        return fill_file(file, path, fill).map(drop);
    }
    let part = with_suffix(path, ".part");
    // What is there of that name is somebody's.
    let file = File::create_new(&part).map_err(|source| taken_or("create", &part, path, source))?;
    let written = fill_file(file, path, fill).and_then(|file| {
        // A name must not reach the disk before what it stands for.
        file.sync_data().map_err(OutputError::io("write", path))?;
        fs::rename(&part, path).map_err(|source| OutputError::Io {
            action: "write",
            path: path.to_owned(),
            source,
        })
    });
    if written.is_err() {
        let _ = fs::remove_file(&part);
    }
    written
}

/// Why `part` could not be made; what is not its being there names `path`, which was asked for.
fn taken_or(action: &'static str, part: &Path, path: &Path, source: io::Error) -> OutputError {
    match source.kind() {
        io::ErrorKind::AlreadyExists => {
            OutputError::PartExists { part: part.to_owned(), path: path.to_owned() }
        }
        _ => OutputError::Io { action, path: path.to_owned(), source },
    }
}

/// Fills a file and returns it; errors name the file `path` that was asked for.
fn fill_file(
    file: File,
    path: &Path,
    fill: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>,
) -> Result<File, OutputError> {
    let mut out = BufWriter::with_capacity(1 << 18, file);
    fill(&mut out).and_then(|()| out.flush()).map_err(OutputError::io("write", path))?;
    out.into_inner().map_err(|error| OutputError::io("write", path)(error.into_error()))
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::io::{self, Write};
    use std::path::{Path, PathBuf};

    use super::{OutputError, write_file};

    /// A fresh folder of its own for a test.
    fn scratch(name: &str) -> PathBuf {
        let path = std::env::temp_dir().join(format!("biplane-output-{}-{name}", std::process::id()));
        let _ = fs::remove_dir_all(&path);
        fs::create_dir_all(&path).unwrap();
        path
    }

    #[test]
    fn a_file_is_not_overwritten_unless_asked_and_a_failed_one_leaves_nothing() {
        let folder = scratch("file");
        let path = folder.join("a.txt");
        write_file(&path, false, |out| out.write_all(b"one")).unwrap();
        let refused = write_file(&path, false, |out| out.write_all(b"two")).unwrap_err();
        assert!(matches!(refused, OutputError::Exists { .. }), "{refused}");
        let failed = write_file(&path, true, |_| Err(io::Error::other("no more room"))).unwrap_err();
        assert!(failed.to_string().contains("no more room"), "{failed}");
        assert_eq!(fs::read(&path).unwrap(), b"one");
        write_file(&path, true, |out| out.write_all(b"three")).unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"three");
        assert_eq!(fs::read_dir(&folder).unwrap().count(), 1);
        fs::remove_dir_all(folder).unwrap();
    }

    #[test]
    fn a_device_is_written_to_and_never_replaced() {
        write_file(Path::new("/dev/null"), false, |out| out.write_all(b"gone")).unwrap();
        assert!(!fs::metadata("/dev/null").unwrap().is_file());
        let full = write_file(Path::new("/dev/full"), false, |out| out.write_all(b"no room")).unwrap_err();
        assert!(full.to_string().starts_with("cannot write /dev/full: "), "{full}");
        let missing = write_file(Path::new("/nowhere/a.txt"), false, |_| Ok(())).unwrap_err();
        assert!(missing.to_string().starts_with("cannot create /nowhere/a.txt: "), "{missing}");
    }
}
