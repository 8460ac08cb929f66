//! The disk under a recording: the few things that a writer asks of it. What they keep in a power cut is
//! their whole point, so a test can put a disk of its own here that forgets what was not synced, or refuses.

use std::fs::File;
use std::io::{self, Write};
use std::os::unix::fs::MetadataExt;
use std::path::Path;
use std::sync::Arc;

/// What a writer asks of a disk. All errors are the system's.
pub trait Storage: std::fmt::Debug + Send + Sync {
    /// Creates a file that must not exist, and locks it, as far as there are locks: who salvages unfinished
    /// recordings sees by that that this one is being written.
    ///
    /// # Errors
    /// `AlreadyExists`, and what else the system refuses.
    fn create(&self, path: &Path) -> io::Result<Arc<dyn StoredFile>>;

    /// Gives a file another name, in place of a file that has it.
    ///
    /// # Errors
    /// What the system refuses.
    fn rename(&self, from: &Path, to: &Path) -> io::Result<()>;

    /// Removes a file.
    ///
    /// # Errors
    /// What the system refuses.
    fn remove(&self, path: &Path) -> io::Result<()>;

    /// Brings the names in a folder to the disk: they stand in it, not in the files.
    ///
    /// # Errors
    /// What the system refuses.
    fn sync_folder(&self, folder: &Path) -> io::Result<()>;
}

/// An open file that is only added to.
pub trait StoredFile: Send + Sync {
    /// Adds bytes at the end, some of them or all; how many.
    ///
    /// # Errors
    /// What the system refuses.
    fn append(&self, bytes: &[u8]) -> io::Result<usize>;

    /// Waits until the bytes so far are on the disk itself.
    ///
    /// # Errors
    /// What the system refuses. What was not on the disk before may then never come there.
    fn sync(&self) -> io::Result<()>;

    /// Bytes so far.
    ///
    /// # Errors
    /// What the system refuses.
    fn size(&self) -> io::Result<u64>;

    /// Where the file is that was created as `path`: a writer goes on into a file that has gone, and hears
    /// nothing of it. A disk of a test's own leaves its files where they are.
    fn whereabouts(&self, path: &Path) -> Whereabouts {
        let _ = path;
        Whereabouts::InPlace
    }
}

/// What became of a file while it was written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Whereabouts {
    /// It has its name, as far as the system tells.
    InPlace,
    /// It, or a folder above it, has another name.
    Moved,
    /// It has no name any more: what is in it goes when it is closed.
    Removed,
}

/// The disk to write to: that of the system, unless a test brings its own.
#[derive(Clone, Debug, Default)]
pub struct Disk(Option<Arc<dyn Storage>>);

impl Disk {
    /// A disk of a test's own.
    #[must_use]
    pub fn of(storage: Arc<dyn Storage>) -> Self {
        Self(Some(storage))
    }

    /// What to ask.
    #[must_use]
    pub fn storage(&self) -> &dyn Storage {
        self.0.as_deref().unwrap_or(&System)
    }
}

impl PartialEq for Disk {
    fn eq(&self, other: &Self) -> bool {
        match (&self.0, &other.0) {
            (None, None) => true,
            (Some(one), Some(other)) => Arc::ptr_eq(one, other),
            _ => false,
        }
    }
}

impl Eq for Disk {}

/// The operating system's files.
#[derive(Copy, Clone, Debug)]
struct System;

impl Storage for System {
    fn create(&self, path: &Path) -> io::Result<Arc<dyn StoredFile>> {
        let file = File::options().write(true).create_new(true).open(path)?;
        // A file system without locks cannot.
        let _ = file.try_lock();
        Ok(Arc::new(file))
    }

    fn rename(&self, from: &Path, to: &Path) -> io::Result<()> {
        std::fs::rename(from, to)
    }

    fn remove(&self, path: &Path) -> io::Result<()> {
        std::fs::remove_file(path)
    }

    fn sync_folder(&self, folder: &Path) -> io::Result<()> {
        File::open(folder)?.sync_all()
    }
}

impl StoredFile for File {
    fn append(&self, bytes: &[u8]) -> io::Result<usize> {
        (&mut &*self).write(bytes)
    }

    fn sync(&self) -> io::Result<()> {
        // A file that has grown: its new length goes with the data, which is all that reading them back
        // needs.
        self.sync_data()
    }

    fn size(&self) -> io::Result<u64> {
        Ok(self.metadata()?.len())
    }

    fn whereabouts(&self, path: &Path) -> Whereabouts {
        let Ok(own) = self.metadata() else { return Whereabouts::InPlace };
        if own.nlink() == 0 {
            return Whereabouts::Removed;
        }
        match path.metadata() {
            Ok(found) if (found.dev(), found.ino()) == (own.dev(), own.ino()) => Whereabouts::InPlace,
            Ok(_) => Whereabouts::Moved,
            Err(error) => match error.kind() {
                io::ErrorKind::NotFound | io::ErrorKind::NotADirectory => Whereabouts::Moved,
                // A disk in trouble, say: nobody knows.
                _ => Whereabouts::InPlace,
            },
        }
    }
}

/// The same file as a stream.
pub(crate) struct Stream(pub Arc<dyn StoredFile>);

impl Write for Stream {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.append(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}
