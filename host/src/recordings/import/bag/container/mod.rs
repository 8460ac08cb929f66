//! The files that bags are kept in, read front to back without their indexes: one message at a time, memory
//! bounded by one message (ROS 1, SQLite) or one chunk (MCAP), whatever a length in the file says.

mod channel;
mod folder;
mod losses;
mod mcap;
mod packed;
mod ros1;
mod ros1_records;
mod sqlite;

pub(crate) use channel::{Encoding, Kind, RawMessage};
pub use losses::Losses;

use std::path::{Path, PathBuf};

use biplane_recording::file_kind::describe;

use self::channel::Visit;
use crate::recordings::import::bag::error::BagError;

/// One file of a bag.
#[derive(Clone, Debug)]
pub(crate) struct BagFile {
    path: PathBuf,
    format: Format,
}

#[derive(Copy, Clone, Debug, PartialEq, Eq)]
enum Format {
    Ros1,
    Sqlite,
    Mcap,
}

/// The files of what somebody calls a bag, in order: a file, or a folder as ROS 2 writes it.
pub(crate) fn files_of(bag: &Path, losses: &mut Losses) -> Result<Vec<BagFile>, BagError> {
    if !bag.is_dir() {
        return Ok(vec![BagFile::of(bag)?]);
    }
    let paths = folder::files(bag, losses)?;
    paths.iter().map(|path| BagFile::of(path)).collect()
}

impl BagFile {
    fn of(path: &Path) -> Result<Self, BagError> {
        let start =
            packed::start_of(path).map_err(|source| BagError::Read { path: path.to_owned(), source })?;
        let format = if packed::is_packed(&start) {
            let inner = packed::unpacked_start_of(path)?;
            format_of(&inner).ok_or_else(|| not_a_bag(path, &inner))?
        } else {
            format_of(&start).ok_or_else(|| not_a_bag(path, &start))?
        };
        Ok(Self { path: path.to_owned(), format })
    }

    /// Its name.
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// Visits all its messages in file order. What cannot be read is added to `losses`.
    pub(crate) fn read(
        &self,
        spool: &Path,
        losses: &mut Losses,
        visit: &mut Visit<'_>,
    ) -> Result<(), BagError> {
        let file = packed::open(&self.path, spool)?;
        match self.format {
            Format::Ros1 => ros1::read(file, &self.path, losses, visit),
            Format::Sqlite => sqlite::read(&file, &self.path, losses, visit),
            Format::Mcap => mcap::read(&file, &self.path, losses, visit),
        }
    }
}

fn format_of(start: &[u8]) -> Option<Format> {
    let magics: [(&[u8], Format); 3] =
        [(ros1::MAGIC, Format::Ros1), (sqlite::MAGIC, Format::Sqlite), (b"\x89MCAP", Format::Mcap)];
    magics.into_iter().find(|(magic, _)| start.starts_with(magic)).map(|(_, format)| format)
}

fn not_a_bag(path: &Path, start: &[u8]) -> BagError {
    let found = if start.starts_with(b"#ROS") {
        let line: String = String::from_utf8_lossy(start).lines().next().unwrap_or_default().to_owned();
        format!("is a bag of another version ({line}): `rosbag migrate` makes a bag V2.0 of it")
    } else {
        describe(start)
    };
    BagError::NotABag { path: path.to_owned(), found }
}
