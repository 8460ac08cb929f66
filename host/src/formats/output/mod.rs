//! Files that are whole or not there: each is written as `NAME.part`, brought to the disk, and takes its name
//! when it is finished. So is a folder of them ([`OutputFolder`]).

pub(crate) mod error;
mod folder;
pub(crate) mod unfinished;

use crate::formats::output::error::taken_or;
use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::Path;

use biplane_recording::mcap::write::{active_path, is_being_written, is_same_file, with_suffix};

pub(crate) use error::OutputError;
pub(crate) use folder::{MARKER, OutputFolder};
use unfinished::Unfinished;

/// Whether a file may be written here: there is none, or an empty one, or `overwrite` is set. A link to what
/// is not there is somebody's too. What another process records under this name is never replaced.
///
/// # Errors
/// [`OutputError::Exists`] and [`OutputError::Busy`].
pub(crate) fn check_free(path: &Path, overwrite: bool) -> Result<(), OutputError> {
    if let Some(part) = [path.to_owned(), active_path(path)].into_iter().find(|name| is_being_written(name)) {
        return Err(OutputError::Busy { part, path: path.to_owned() });
    }
    let is_taken = match fs::metadata(path) {
        Ok(found) => found.len() > 0 && found.is_file(),
        Err(_) => path.is_symlink(),
    };
    if is_taken && !overwrite { Err(OutputError::Exists { path: path.to_owned() }) } else { Ok(()) }
}

/// Refuses an output that is the input, under its own name or under the one with `suffix` that it has while
/// it is written.
///
/// # Errors
/// [`OutputError::IsInput`].
pub(crate) fn check_not_input(output: &Path, suffix: &str, input: &Path) -> Result<(), OutputError> {
    for output in [output.to_owned(), with_suffix(output, suffix)] {
        if is_same_file(&output, input) {
            return Err(OutputError::IsInput { output, input: input.to_owned() });
        }
    }
    Ok(())
}

/// Writes a file through `fill`. When that fails nothing of the name is left behind, and what was there
/// before stays. What is no regular file (`/dev/null`, a named pipe) is written to as it is.
///
/// # Errors
/// When the file exists (see [`check_free`]), or the system refuses.
pub(crate) fn write_file(
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
    let unfinished = (!part.exists()).then(|| Unfinished::new(&part));
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
    drop(unfinished);
    written
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

    use biplane_recording::{Writer, WriterOptions};

    use super::{active_path, write_file};
    use crate::formats::output::error::OutputError;

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
    fn a_link_to_what_is_not_there_is_replaced_only_when_asked() {
        let folder = scratch("dangling");
        let path = folder.join("map.png");
        std::os::unix::fs::symlink("/nowhere/map.png", &path).unwrap();
        let refused = write_file(&path, false, |out| out.write_all(b"one")).unwrap_err();
        assert!(matches!(refused, OutputError::Exists { .. }), "{refused}");
        write_file(&path, true, |out| out.write_all(b"one")).unwrap();
        assert!(!path.is_symlink());
        fs::remove_dir_all(folder).unwrap();
    }

    #[test]
    fn what_is_being_recorded_is_replaced_under_neither_name() {
        let folder = scratch("live");
        let path = folder.join("run.mcap");
        let live = Writer::create(&path, &WriterOptions::default()).unwrap();
        for name in [path.clone(), active_path(&path)] {
            let refused = write_file(&name, true, |out| out.write_all(b"one")).unwrap_err();
            assert!(matches!(refused, OutputError::Busy { .. }), "{refused}");
        }
        live.finish().unwrap();
        write_file(&path, true, |out| out.write_all(b"one")).unwrap();
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
