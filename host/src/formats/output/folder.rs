//! A folder of results that takes its name when everything in it is written.
//!
//! Until then it is `NAME.part`, and holds a file that its run keeps locked. A run that was killed leaves the
//! folder behind; the next one sees by the lock that nobody is at it any more, and takes it over. A folder of
//! that name without the file is somebody's, and stays, unless it is empty: killed in its first moment, a run
//! leaves that.

use std::fs::{self, File, TryLockError};
use std::io;
use std::path::{Path, PathBuf};

use crate::formats::output::error::OutputError;
use crate::formats::output::error::taken_or;
use crate::formats::output::unfinished::Unfinished;
use biplane_recording::mcap::write::with_suffix;

/// The file that says whose an unfinished folder is. Killed in the moment of finishing, a run leaves it in
/// the finished folder.
pub(crate) const MARKER: &str = ".unfinished";
/// What a long search keeps to go on with.
const SEARCHES: &str = ".searches";

/// See the module's text. Dropped before it is finished, it is removed.
#[derive(Debug)]
pub(crate) struct OutputFolder {
    path: PathBuf,
    part: PathBuf,
    overwrite: bool,
    finished: bool,
    /// Locked as long as it lives.
    _marker: File,
    _unfinished: Unfinished,
}

/// What is there under the name of an unfinished folder.
enum Found {
    Nothing,
    /// A folder that a killed run has left; its marker is locked now.
    Left(File),
}

impl OutputFolder {
    /// Whether [`OutputFolder::create`] would find the name free, for whoever wants to know before long work.
    /// Nothing is made.
    ///
    /// # Errors
    /// [`OutputError::NotEmpty`], [`OutputError::PartExists`] and [`OutputError::Busy`].
    pub(crate) fn check(path: &Path, overwrite: bool) -> Result<(), OutputError> {
        look(path, overwrite).map(drop)
    }

    /// Makes `PATH.part`, or takes over the one of a run that was killed. What is there of that name
    /// otherwise stays: it may be somebody's.
    ///
    /// # Errors
    /// When `path` exists, is not an empty folder and `overwrite` is not set; when `PATH.part` exists and is
    /// not such a run's; when the system refuses.
    pub(crate) fn create(path: &Path, overwrite: bool) -> Result<Self, OutputError> {
        let (path, part, found) = look(path, overwrite)?;
        let marker = match found {
            Found::Left(marker) => {
                clear(&part)?;
                marker
            }
            Found::Nothing => begin(&path, &part)?,
        };
        let _unfinished = Unfinished::with_checkpoint(&part, &part.join(SEARCHES));
        Ok(Self { path, part, overwrite, finished: false, _marker: marker, _unfinished })
    }

    /// Where to write the files until [`OutputFolder::finish`].
    pub(crate) fn part(&self) -> &Path {
        &self.part
    }

    /// Where a long search keeps what it has found: a run that is killed leaves it to the one that takes
    /// over.
    pub(crate) fn searches(&self) -> PathBuf {
        self.part.join(SEARCHES)
    }

    /// Gives the folder its name. An older folder of that name is replaced as a whole.
    ///
    /// # Errors
    /// When the system refuses.
    pub(crate) fn finish(mut self) -> Result<(), OutputError> {
        let _ = fs::remove_file(self.searches());
        sync(&self.part)?;
        let old = if self.path.is_dir() { self.set_aside()? } else { None };
        fs::rename(&self.part, &self.path).map_err(OutputError::io("write", &self.path))?;
        self.finished = true;
        let marker = self.path.join(MARKER);
        fs::remove_file(&marker).map_err(OutputError::io("remove", &marker))?;
        sync(parent(&self.path))?;
        old.map_or(Ok(()), |old| fs::remove_dir_all(&old).map_err(OutputError::io("remove", &old)))
    }

    /// Makes room for the new folder; returns where the older one is, if it holds something.
    fn set_aside(&self) -> Result<Option<PathBuf>, OutputError> {
        if !(self.overwrite && holds_something(&self.path)) {
            fs::remove_dir(&self.path).map_err(OutputError::io("replace", &self.path))?;
            return Ok(None);
        }
        let old = with_suffix(&self.path, ".old");
        // Of a run that was killed while it replaced one: it has the marker, as this one gets it now.
        if old.join(MARKER).exists() {
            fs::remove_dir_all(&old).map_err(OutputError::io("remove", &old))?;
        }
        let marker = self.path.join(MARKER);
        File::create(&marker).map_err(OutputError::io("replace", &self.path))?;
        fs::rename(&self.path, &old).map_err(OutputError::io("replace", &self.path))?;
        Ok(Some(old))
    }
}

impl Drop for OutputFolder {
    fn drop(&mut self) {
        if !self.finished {
            let _ = fs::remove_dir_all(&self.part);
        }
    }
}

/// The folder's name, the one until it is finished, and what is there under that.
fn look(path: &Path, overwrite: bool) -> Result<(PathBuf, PathBuf, Found), OutputError> {
    // "results/" and "results" are one folder; its sibling must not land inside.
    let path: PathBuf = path.components().collect();
    let part = with_suffix(&path, ".part");
    if !overwrite && holds_something(&path) {
        return Err(OutputError::NotEmpty { path });
    }
    if !part.exists() || is_empty_folder(&part) {
        return Ok((path, part, Found::Nothing));
    }
    let Ok(marker) = File::options().write(true).open(part.join(MARKER)) else {
        return Err(OutputError::PartExists { part, path });
    };
    match marker.try_lock() {
        Ok(()) => Ok((path, part, Found::Left(marker))),
        Err(TryLockError::WouldBlock) => Err(OutputError::Busy { part, path }),
        Err(TryLockError::Error(source)) => Err(OutputError::Io { action: "lock", path: part, source }),
    }
}

fn begin(path: &Path, part: &Path) -> Result<File, OutputError> {
    let above = parent(part);
    fs::create_dir_all(above).map_err(OutputError::io("create", above))?;
    if !is_empty_folder(part) {
        fs::create_dir(part).map_err(|source| taken_or("create", part, path, source))?;
    }
    let name = part.join(MARKER);
    let marker = File::create(&name).map_err(OutputError::io("create", &name))?;
    marker.try_lock().map_err(|error| match error {
        TryLockError::WouldBlock => OutputError::Busy { part: part.to_owned(), path: path.to_owned() },
        TryLockError::Error(source) => OutputError::Io { action: "lock", path: name.clone(), source },
    })?;
    Ok(marker)
}

/// Removes what a killed run has left, but for what it kept to go on with.
fn clear(part: &Path) -> Result<(), OutputError> {
    for entry in fs::read_dir(part).map_err(OutputError::io("read", part))? {
        let path = entry.map_err(OutputError::io("read", part))?.path();
        let is_kept = [MARKER, SEARCHES].iter().any(|name| path.ends_with(name));
        if !is_kept {
            let removed = if path.is_dir() { fs::remove_dir_all(&path) } else { fs::remove_file(&path) };
            removed.map_err(OutputError::io("remove", &path))?;
        }
    }
    Ok(())
}

/// Brings a folder's names to the disk. Where the system has no such thing nothing is done.
fn sync(folder: &Path) -> Result<(), OutputError> {
    let opened = match File::open(folder) {
        Err(error) if error.kind() == io::ErrorKind::PermissionDenied => return Ok(()),
        opened => opened.map_err(OutputError::io("open", folder))?,
    };
    match opened.sync_all() {
        Err(error) if error.kind() == io::ErrorKind::InvalidInput => Ok(()),
        synced => synced.map_err(OutputError::io("sync", folder)),
    }
}

fn parent(path: &Path) -> &Path {
    path.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Whether it is a folder itself, and no link to one, with nothing in it.
fn is_empty_folder(path: &Path) -> bool {
    path.symlink_metadata().is_ok_and(|found| found.is_dir()) && !holds_something(path)
}

fn holds_something(path: &Path) -> bool {
    match fs::read_dir(path) {
        Ok(mut entries) => entries.next().is_some(),
        Err(_) => path.symlink_metadata().is_ok(),
    }
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::path::{Path, PathBuf};

    use super::{MARKER, OutputError, OutputFolder};

    fn scratch(name: &str) -> PathBuf {
        let path = std::env::temp_dir().join(format!("biplane-folder-{}-{name}", std::process::id()));
        let _ = fs::remove_dir_all(&path);
        fs::create_dir_all(&path).unwrap();
        path
    }

    fn names(folder: &Path) -> Vec<String> {
        let mut names: Vec<String> = fs::read_dir(folder)
            .unwrap()
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        names
    }

    #[test]
    fn a_folder_takes_its_name_only_when_it_is_finished() {
        let parent = scratch("folder");
        let path = parent.join("result");
        let unfinished = OutputFolder::create(&path, false).unwrap();
        fs::write(unfinished.part().join("model.glb"), b"half").unwrap();
        drop(unfinished);
        assert_eq!(fs::read_dir(&parent).unwrap().count(), 0);

        let first = OutputFolder::create(&path, false).unwrap();
        fs::write(first.part().join("old"), b"1").unwrap();
        first.finish().unwrap();
        assert!(matches!(OutputFolder::create(&path, false), Err(OutputError::NotEmpty { .. })));

        let second = OutputFolder::create(&parent.join("result/"), true).unwrap();
        fs::write(second.part().join("new"), b"2").unwrap();
        assert!(path.join("old").exists());
        second.finish().unwrap();
        assert!(path.join("new").exists() && !path.join("old").exists());
        assert_eq!(fs::read_dir(&parent).unwrap().count(), 1);
        fs::remove_dir_all(parent).unwrap();
    }

    #[test]
    fn what_a_killed_run_leaves_is_taken_over_and_only_while_nobody_is_at_it() {
        let parent = scratch("left");
        let path = parent.join("result");
        let first = OutputFolder::create(&path, false).unwrap();
        fs::write(first.searches(), b"found so far").unwrap();
        fs::write(first.part().join("raw.ply"), b"half").unwrap();
        let busy = OutputFolder::create(&path, false).unwrap_err();
        assert!(matches!(busy, OutputError::Busy { .. }), "{busy}");
        assert!(OutputFolder::check(&path, true).is_err());

        // Killed: neither dropped nor finished, and the lock is gone with the process.
        let part = first.part().to_owned();
        let leaked = std::mem::ManuallyDrop::new(first);
        leaked._marker.unlock().unwrap();
        OutputFolder::check(&path, false).unwrap();
        assert_eq!(names(&part), [".searches", MARKER, "raw.ply"], "a look changes nothing");
        let second = OutputFolder::create(&path, false).unwrap();
        assert_eq!(names(&part), [".searches", MARKER]);
        assert_eq!(fs::read(second.searches()).unwrap(), b"found so far");
        fs::write(second.part().join("raw.ply"), b"whole").unwrap();
        second.finish().unwrap();
        assert_eq!(names(&parent), ["result"]);
        assert_eq!(names(&path), ["raw.ply"]);
        fs::remove_dir_all(parent).unwrap();
    }

    #[test]
    fn what_a_run_leaves_that_is_killed_in_its_first_moment_is_taken_and_a_folder_with_anything_is_not() {
        let parent = scratch("first-moment");
        let (path, part) = (parent.join("result"), parent.join("result.part"));
        fs::create_dir(&part).unwrap();
        OutputFolder::check(&path, false).unwrap();
        OutputFolder::create(&path, false).unwrap().finish().unwrap();
        assert_eq!(names(&parent), ["result"]);
        fs::create_dir(&part).unwrap();
        fs::write(part.join("thesis.txt"), b"somebody's").unwrap();
        let refused = OutputFolder::create(&path, true).unwrap_err();
        assert!(matches!(refused, OutputError::PartExists { .. }), "{refused}");
        assert!(part.join("thesis.txt").exists());
        fs::remove_dir_all(parent).unwrap();
    }

    #[test]
    fn a_run_killed_while_it_replaced_an_older_folder_is_made_good_by_the_next() {
        let parent = scratch("replaced");
        let path = parent.join("result");
        // As it stands between the two renames.
        for name in ["result.old", "result.part"] {
            fs::create_dir(parent.join(name)).unwrap();
            fs::write(parent.join(name).join(MARKER), b"").unwrap();
            fs::write(parent.join(name).join("model.glb"), name).unwrap();
        }
        let next = OutputFolder::create(&path, true).unwrap();
        assert!(parent.join("result.old/model.glb").exists(), "the only whole one so far");
        fs::write(next.part().join("model.glb"), b"new").unwrap();
        next.finish().unwrap();
        assert_eq!(fs::read(path.join("model.glb")).unwrap(), b"new");

        let last = OutputFolder::create(&path, true).unwrap();
        fs::write(last.part().join("model.glb"), b"newest").unwrap();
        last.finish().unwrap();
        assert_eq!(names(&parent), ["result"]);
        assert_eq!(
            (names(&path), fs::read(path.join("model.glb")).unwrap()),
            (vec!["model.glb".to_owned()], b"newest".to_vec())
        );
        fs::remove_dir_all(parent).unwrap();
    }
}
