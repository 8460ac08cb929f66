//! The names of an output: `NAME.active` while it is written, `NAME` when it is finished; and what may stand
//! there before.
//!
//! Nothing is truncated or replaced that somebody may still need: an input of the same run never, a device or
//! folder never, what another process is writing never, an earlier output only when asked.

use super::error::refused;
use super::{StoredFile, WriteError, WriterOptions};
use std::ffi::OsString;
use std::fs::{File, TryLockError};
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::mcap::records::MAGIC;

/// The name of a file while it is written: `NAME.active`.
#[must_use]
pub fn active_path(path: &Path) -> PathBuf {
    with_suffix(path, ".active")
}

/// A path with `suffix` added to its whole name.
#[must_use]
pub fn with_suffix(path: &Path, suffix: &str) -> PathBuf {
    let mut name = OsString::from(path.as_os_str());
    name.push(suffix);
    PathBuf::from(name)
}

/// The name of a copy of a broken file while it is written: `NAME.recovering`.
pub(crate) fn recovering_path(path: &Path) -> PathBuf {
    with_suffix(path, ".recovering")
}

/// Brings a new or renamed file's name to the disk: it stands in the folder, not in the file.
pub(crate) fn sync_folder(path: &Path, options: &WriterOptions) -> Result<(), WriteError> {
    let folder = match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    let synced = options.disk.storage().sync_folder(folder);
    synced.map_err(|source| refused("sync the folder of", path, source))
}

/// Whether both names are of one file, also through links. A file that is not there yet is known by its
/// folder and its name. What is no regular file (`/dev/null`, say) is never the same as another.
#[must_use]
pub fn is_same_file(one: &Path, other: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    match (one.metadata(), other.metadata()) {
        (Ok(one), Ok(other)) => one.is_file() && (one.dev(), one.ino()) == (other.dev(), other.ino()),
        (Err(_), Err(_)) => place(one).is_some_and(|place_of_one| Some(place_of_one) == place(other)),
        _ => false,
    }
}

/// Folder and name of a file that is not there.
fn place(path: &Path) -> Option<PathBuf> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    // A folder that is yet to be made is known by its words alone.
    let folder = folder.canonicalize().or_else(|_| std::path::absolute(folder)).ok()?;
    Some(folder.join(path.file_name()?))
}

/// Whether a process holds the lock of a recording that it writes under this name. A file system without
/// locks does not tell.
#[must_use]
pub fn is_being_written(path: &Path) -> bool {
    // Opened for reading, a pipe would wait for its writer.
    let is_file = path.metadata().is_ok_and(|found| found.is_file());
    is_file && File::open(path).is_ok_and(|file| matches!(file.try_lock(), Err(TryLockError::WouldBlock)))
}

/// Whether a new output may begin that will have the name `path`: as [`check_name`], and an error when
/// another process writes a recording that has this name, or will have it.
pub(crate) fn check(path: &Path, options: &WriterOptions) -> Result<(), WriteError> {
    for name in [path.to_owned(), active_path(path)] {
        refuse_being_written(&name)?;
    }
    check_name(path, options)
}

fn refuse_being_written(path: &Path) -> Result<(), WriteError> {
    if is_being_written(path) { Err(WriteError::BeingWritten { path: path.to_owned() }) } else { Ok(()) }
}

/// Whether `path` may become the name of an output: an error when it is there and is an input, no regular
/// file, or not to be replaced.
pub(crate) fn check_name(path: &Path, options: &WriterOptions) -> Result<(), WriteError> {
    // What cannot be looked at (no such folder, say) is told when the file is created.
    let Ok(entry) = path.symlink_metadata() else { return Ok(()) };
    let Ok(found) = path.metadata() else {
        // A link to what is not there (a disk that is not mounted, say) is somebody's all the same.
        let may_replace = options.overwrite || !entry.is_symlink();
        return if may_replace { Ok(()) } else { Err(WriteError::Exists { path: path.to_owned() }) };
    };
    refuse_input(path, options)?;
    if !found.is_file() {
        return Err(WriteError::NotAFile { path: path.to_owned() });
    }
    if options.overwrite { Ok(()) } else { Err(WriteError::Exists { path: path.to_owned() }) }
}

/// The same of `temporary`, the name while it is written. Only an unfinished recording may be replaced there,
/// not whatever else has such a name.
pub(crate) fn check_temporary(temporary: &Path, options: &WriterOptions) -> Result<(), WriteError> {
    let Ok(entry) = temporary.symlink_metadata() else { return Ok(()) };
    refuse_input(temporary, options)?;
    if !entry.is_file() {
        return Err(WriteError::NotAFile { path: temporary.to_owned() });
    }
    refuse_being_written(temporary)?;
    if !options.overwrite {
        return Err(WriteError::Unfinished { path: temporary.to_owned() });
    }
    if begins_as_recording(temporary).unwrap_or(false) {
        return Ok(());
    }
    Err(WriteError::InTheWay { path: temporary.to_owned() })
}

/// Creates `temporary`, which nothing but an unfinished recording that may go can have stood for.
pub(crate) fn create(temporary: &Path, options: &WriterOptions) -> Result<Arc<dyn StoredFile>, WriteError> {
    check_temporary(temporary, options)?;
    if options.overwrite {
        // Its name goes, not its bytes: whoever has it under another name keeps it.
        match options.disk.storage().remove(temporary) {
            Err(source) if source.kind() != io::ErrorKind::NotFound => {
                return Err(refused("replace", temporary, source));
            }
            _ => {}
        }
    }
    options.disk.storage().create(temporary).map_err(|source| match source.kind() {
        io::ErrorKind::AlreadyExists => WriteError::Unfinished { path: temporary.to_owned() },
        _ => refused("create", temporary, source),
    })
}

/// Removes the unfinished copy of a recovery that was itself cut off: what it was made from is still there,
/// and nobody holds its lock. One that still goes on is left, and what is no recording.
pub(crate) fn clear_stale(recovering: &Path, options: &WriterOptions) -> Result<(), WriteError> {
    let is_file = recovering.symlink_metadata().is_ok_and(|entry| entry.is_file());
    if !is_file || !begins_as_recording(recovering).unwrap_or(false) {
        return Ok(());
    }
    check_temporary(recovering, &WriterOptions { overwrite: true, ..options.clone() })?;
    // Without locks nobody can tell; it stays then.
    if File::open(recovering).is_ok_and(|file| file.try_lock().is_ok()) {
        options.disk.storage().remove(recovering).map_err(|source| refused("replace", recovering, source))?;
    }
    Ok(())
}

/// Removes a part of an earlier recording that the output was to replace; one that is not there, or was never
/// finished, is left.
pub(crate) fn remove_replaced(path: &Path, options: &WriterOptions) -> Result<(), WriteError> {
    if !path.exists() {
        return Ok(());
    }
    check(path, options)?;
    if !begins_as_recording(path).unwrap_or(false) {
        return Err(WriteError::InTheWay { path: path.to_owned() });
    }
    options.disk.storage().remove(path).map_err(|source| refused("replace", path, source))
}

fn refuse_input(path: &Path, options: &WriterOptions) -> Result<(), WriteError> {
    let is_found = |input: &&PathBuf| is_same_file(path, input);
    match options.inputs.iter().find(is_found) {
        Some(input) => Err(WriteError::IsInput { path: path.to_owned(), input: input.clone() }),
        None => Ok(()),
    }
}

/// Whether a file begins as a recording does, as far as it goes; one whose first bytes never reached the disk
/// is zeros there.
fn begins_as_recording(path: &Path) -> io::Result<bool> {
    let mut first = Vec::new();
    File::open(path)?.take(MAGIC.len() as u64).read_to_end(&mut first)?;
    Ok(MAGIC.starts_with(&first) || first.iter().all(|byte| *byte == 0))
}
