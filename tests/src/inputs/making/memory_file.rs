//! Bytes as a file that stands on no disk: most readers take a path.

use std::fs::File;
use std::io::Write;
use std::os::fd::AsRawFd;
use std::path::PathBuf;

use rustix::fs::{MemfdFlags, memfd_create};

/// A file in memory, gone when dropped.
pub(crate) struct MemoryFile {
    file: File,
}

impl MemoryFile {
    /// A file that holds these bytes.
    pub(crate) fn of(bytes: &[u8]) -> Self {
        let descriptor = memfd_create("biplane-input", MemfdFlags::CLOEXEC).expect("memory for a file");
        let mut file = File::from(descriptor);
        file.write_all(bytes).expect("memory for a file");
        Self { file }
    }

    /// A name under which it can be opened.
    pub(crate) fn path(&self) -> PathBuf {
        PathBuf::from(format!("/proc/self/fd/{}", self.file.as_raw_fd()))
    }
}

/// A name for a file that a test writes, in memory where there is such a folder; the file goes with it. One a
/// thread.
pub(crate) struct Scratch(pub PathBuf);

impl Scratch {
    /// The calling thread's name.
    pub(crate) fn new() -> Self {
        let folder = PathBuf::from("/dev/shm");
        let folder = if folder.is_dir() { folder } else { std::env::temp_dir() };
        let thread = format!("{:?}", std::thread::current().id()).replace(['(', ')'], "");
        Self(folder.join(format!("biplane-inputs-{}-{thread}.mcap", std::process::id())))
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.0);
    }
}
