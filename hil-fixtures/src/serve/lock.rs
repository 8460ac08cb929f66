//! One mock a folder of links: a lock file that a living mock holds.
//!
//! The system lets go of the lock when its holder ends, however that happens: links that a dead mock left
//! behind are free.

use rustix::fs::{FlockOperation, flock};
use std::fs::{self, File};
use std::io;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

/// Name of the lock file in the folder of the links.
pub(super) const LOCK_FILE: &str = ".serve.lock";

/// Why the folder could not be had.
#[derive(Debug, thiserror::Error)]
pub enum LockError {
    /// Another mock has its links there.
    #[error("{}: another mock serves in this folder; end it, or choose another one for the links", folder.display())]
    Taken {
        /// The folder.
        folder: PathBuf,
    },
    /// The lock file could not be made.
    #[error("{}: cannot lock this file: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
}

/// A folder of links that is this mock's until dropped.
#[derive(Debug)]
pub(super) struct FolderLock {
    path: PathBuf,
    /// Holds the lock.
    _file: File,
}

impl FolderLock {
    /// Takes the folder, which exists.
    pub(super) fn take(folder: &Path) -> Result<Self, LockError> {
        let path = folder.join(LOCK_FILE);
        let failed = |source| LockError::Io { path: path.clone(), source };
        loop {
            let file = File::options().create(true).append(true).open(&path).map_err(failed)?;
            match flock(&file, FlockOperation::NonBlockingLockExclusive) {
                Ok(()) => {}
                Err(rustix::io::Errno::WOULDBLOCK) => {
                    return Err(LockError::Taken { folder: folder.to_owned() });
                }
                Err(errno) => return Err(failed(errno.into())),
            }
            // The holder before may have removed the file between the two steps: then this is a lock on
            // nothing.
            let held = file.metadata().map_err(failed)?;
            if fs::metadata(&path).is_ok_and(|named| named.ino() == held.ino() && named.dev() == held.dev()) {
                return Ok(Self { path, _file: file });
            }
        }
    }
}

impl Drop for FolderLock {
    fn drop(&mut self) {
        let _ = fs::remove_file(&self.path);
    }
}
