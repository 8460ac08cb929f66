//! Reads recordings, captures and other people's ROS 2 bags, message by message in file order.
//!
//! Memory is bounded by the largest chunk, not by the file; no index is needed. A file that is cut off is
//! refused at the start with the place where it breaks; one whose bytes changed is refused at the latest when
//! the end is reached (checksums).

mod channel_info;
mod definitions;
mod entry;
mod error;
mod messages;
mod recording;
mod source;

pub use channel_info::ChannelInfo;
pub use entry::Entry;
pub use error::ReadError;
pub use messages::Messages;
pub use recording::Recording;

pub use crate::mcap::records::Attachment;

pub(crate) use definitions::{Definitions, Problem};
pub(crate) use source::Source;

use crate::file_kind::KIND_BYTES;
use crate::mcap::chunk::MAX_RECORD_SIZE;
use crate::mcap::records;
use crate::mcap::records::{ATTACHMENT, DATA_END, FOOTER, HEADER, MAGIC, METADATA, PREFIX_SIZE, Prefix};
use crate::mcap::write::active_path;
use crate::rig::Rig;
use std::collections::BTreeMap;
use std::fs::File;
use std::io;
use std::ops::ControlFlow;
use std::os::unix::fs::FileExt;
use std::path::{Path, PathBuf};

/// The name of the attachment that holds the resolved `rig.toml`.
pub const RIG_ATTACHMENT: &str = "rig.toml";

/// The value of the metadata record `biplane` that says what of the rig is assumed, of recordings that others
/// made.
pub const RIG_ASSUMED: &str = "rig";

/// An attachment's name stands within its first so many bytes.
const ATTACHMENT_FRONT: u64 = 1 << 12;

/// An open recording, capture or bag.
#[derive(Debug)]
pub struct Reader {
    file: File,
    path: PathBuf,
    size: u64,
    profile: String,
    library: String,
}

impl Reader {
    /// Opens a finished file.
    ///
    /// # Errors
    /// [`ReadError::Missing`], [`ReadError::NotMcap`], or [`ReadError::Truncated`] with the place where it
    /// breaks.
    pub fn open(path: &Path) -> Result<Self, ReadError> {
        let reader = Self::open_unfinished(path)?;
        let end = reader.size.saturating_sub(MAGIC.len() as u64);
        let mut last = [0; MAGIC.len()];
        reader.file.read_exact_at(&mut last, end).map_err(|source| reader.io(end, source))?;
        if last == MAGIC { Ok(reader) } else { Err(reader.find_break()) }
    }

    /// Opens a file that may be cut off, or may still be written: its messages come as far as they go, then
    /// the error.
    ///
    /// # Errors
    /// [`ReadError::Missing`], [`ReadError::Unfinished`], [`ReadError::NotMcap`].
    pub fn open_unfinished(path: &Path) -> Result<Self, ReadError> {
        let cannot = |source: io::Error| match source.kind() {
            io::ErrorKind::NotFound => match active_path(path) {
                unfinished if unfinished.exists() => {
                    ReadError::Unfinished { path: path.to_owned(), unfinished }
                }
                _ => ReadError::Missing { path: path.to_owned() },
            },
            _ => ReadError::Io { path: path.to_owned(), offset: 0, source },
        };
        let file = File::open(path).map_err(cannot)?;
        let metadata = file.metadata().map_err(cannot)?;
        if metadata.is_dir() {
            return Err(ReadError::Directory { path: path.to_owned() });
        }
        let size = metadata.len();
        let (profile, library) = (String::new(), String::new());
        let mut reader = Self { file, path: path.to_owned(), size, profile, library };
        reader.read_start()?;
        Ok(reader)
    }

    fn read_start(&mut self) -> Result<(), ReadError> {
        let mut source = Source::new(&self.file, self.size);
        let found = source.bytes(0, self.size.min(KIND_BYTES)).map_err(|error| self.io(0, error))?;
        let found = found.unwrap_or_default();
        if !found.starts_with(MAGIC.as_slice()) {
            let found = found.to_vec();
            return Err(ReadError::NotMcap { path: self.path.clone(), found });
        }
        let offset = MAGIC.len() as u64;
        let (prefix, body) = self.record(&mut source, offset)?;
        let header = records::Header::parse(body).filter(|_| prefix.opcode == HEADER);
        let header = header.ok_or_else(|| self.damaged(offset, "no header record".to_owned()))?;
        let (profile, library) = (header.profile.to_owned(), header.library.to_owned());
        self.profile = profile;
        self.library = library;
        Ok(())
    }

    /// The file's name.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The file's size when it was opened, in bytes.
    #[must_use]
    pub fn size(&self) -> u64 {
        self.size
    }

    /// The profile that the file names: `ros2` in ours.
    #[must_use]
    pub fn profile(&self) -> &str {
        &self.profile
    }

    /// The program that wrote the file, by its own word.
    #[must_use]
    pub fn library(&self) -> &str {
        &self.library
    }

    /// All messages in file order. May be called several times.
    #[must_use]
    pub fn messages(&self) -> Messages<'_> {
        Messages::new(self)
    }

    /// The first attachment of that name; `None` when there is none.
    ///
    /// # Errors
    /// As far as the file must be walked to find it.
    pub fn attachment(&self, name: &str) -> Result<Option<Vec<u8>>, ReadError> {
        let mut found = None;
        self.walk(|offset, prefix, source| {
            if prefix.opcode != ATTACHMENT {
                return Ok(ControlFlow::Continue(()));
            }
            if self.attachment_name(source, offset, prefix)?.as_deref() != Some(name) {
                return Ok(ControlFlow::Continue(()));
            }
            let (_, body) = self.record(source, offset)?;
            found = Some(self.whole_attachment(offset, body)?.data.to_vec());
            Ok(ControlFlow::Break(()))
        })?;
        Ok(found)
    }

    /// Visits all attachments in file order, one of them in memory at a time.
    ///
    /// # Errors
    /// Where the file breaks, or an attachment is not whole; the first error of `visit` ends it.
    pub fn for_each_attachment<E: From<ReadError>>(
        &self,
        mut visit: impl FnMut(&Attachment<'_>) -> Result<(), E>,
    ) -> Result<(), E> {
        let mut visited = Ok(());
        self.walk(|offset, prefix, source| {
            if prefix.opcode == ATTACHMENT {
                let (_, body) = self.record(source, offset)?;
                visited = visit(&self.whole_attachment(offset, body)?);
            }
            Ok(if visited.is_ok() { ControlFlow::Continue(()) } else { ControlFlow::Break(()) })
        })?;
        visited
    }

    fn whole_attachment<'b>(&self, offset: u64, body: &'b [u8]) -> Result<Attachment<'b>, ReadError> {
        let whole = Attachment::parse(body).filter(|attachment| attachment.intact);
        whole.ok_or_else(|| {
            let name = Attachment::parse_name(body).unwrap_or_default();
            self.damaged(offset, format!("attachment {name:?} is not whole"))
        })
    }

    /// The names of all attachments, in file order.
    ///
    /// # Errors
    /// Where the file breaks.
    pub fn attachment_names(&self) -> Result<Vec<String>, ReadError> {
        let mut names = Vec::new();
        self.walk(|offset, prefix, source| {
            if prefix.opcode == ATTACHMENT {
                names.extend(self.attachment_name(source, offset, prefix)?);
            }
            Ok(ControlFlow::Continue(()))
        })?;
        Ok(names)
    }

    /// The name of the attachment at `offset`, without reading what is attached.
    fn attachment_name(
        &self,
        source: &mut Source,
        offset: u64,
        prefix: Prefix,
    ) -> Result<Option<String>, ReadError> {
        let front = source.bytes(offset + PREFIX_SIZE, prefix.length.min(ATTACHMENT_FRONT));
        let front = front.map_err(|error| self.io(offset, error))?.unwrap_or_default();
        Ok(Attachment::parse_name(front).map(str::to_owned))
    }

    /// All metadata records by name; the last of a name counts.
    ///
    /// # Errors
    /// Where the file breaks.
    pub fn metadata(&self) -> Result<BTreeMap<String, BTreeMap<String, String>>, ReadError> {
        let mut all = BTreeMap::new();
        self.walk(|offset, prefix, source| {
            if prefix.opcode == METADATA {
                let (_, body) = self.record(source, offset)?;
                let unreadable = || self.damaged(offset, "metadata that cannot be read".to_owned());
                let metadata = records::Metadata::parse(body).ok_or_else(unreadable)?;
                all.insert(metadata.name.to_owned(), metadata.values);
            }
            Ok(ControlFlow::Continue(()))
        })?;
        Ok(all)
    }

    /// When its run began, as its metadata has it: the same in all parts of a recording. `None` where nothing
    /// tells, or the file is damaged before it.
    pub(crate) fn run_began(&self) -> Option<String> {
        let mut began = None;
        let walked = self.walk(|offset, prefix, source| {
            if prefix.opcode != METADATA {
                return Ok(ControlFlow::Continue(()));
            }
            let (_, body) = self.record(source, offset)?;
            let values = records::Metadata::parse(body).map(|metadata| metadata.values);
            began = values.and_then(|mut values| values.remove("start_time_ns"));
            Ok(if began.is_some() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) })
        });
        walked.ok().and(began)
    }

    /// The rig that the file was recorded with; `None` when it carries none.
    ///
    /// # Errors
    /// [`ReadError::Rig`] when the attachment is there and is not a rig.
    pub fn rig(&self) -> Result<Option<Rig>, ReadError> {
        let Some(bytes) = self.attachment(RIG_ATTACHMENT)? else { return Ok(None) };
        let text = String::from_utf8_lossy(&bytes);
        let rig = Rig::parse(&text).map_err(|source| ReadError::Rig { path: self.path.clone(), source })?;
        Ok(Some(rig))
    }

    /// Visits the records of the data section by their prefixes, until its end or until told to stop.
    fn walk<'a>(
        &'a self,
        mut visit: impl FnMut(u64, Prefix, &mut Source<'a>) -> Result<ControlFlow<()>, ReadError>,
    ) -> Result<(), ReadError> {
        let mut source = Source::new(&self.file, self.size);
        let mut offset = MAGIC.len() as u64;
        loop {
            let prefix = self.prefix(&mut source, offset)?;
            if matches!(prefix.opcode, DATA_END | FOOTER) || visit(offset, prefix, &mut source)?.is_break() {
                return Ok(());
            }
            offset += PREFIX_SIZE + prefix.length;
        }
    }

    /// The prefix of the record at `offset`, which is whole.
    fn prefix(&self, source: &mut Source, offset: u64) -> Result<Prefix, ReadError> {
        let prefix = source.prefix(offset).map_err(|error| self.io(offset, error))?;
        let whole = |prefix: &Prefix| prefix.length <= source.left(offset).saturating_sub(PREFIX_SIZE);
        match prefix {
            Some(Prefix { opcode: 0, .. }) => {
                Err(self.damaged(offset, "zeros where a record should be".to_owned()))
            }
            Some(prefix) if whole(&prefix) => Ok(prefix),
            _ => Err(self.truncated(offset)),
        }
    }

    fn record<'s>(&self, source: &'s mut Source, offset: u64) -> Result<(Prefix, &'s [u8]), ReadError> {
        let prefix = self.prefix(source, offset)?;
        self.check_size(offset, prefix)?;
        let body =
            source.bytes(offset + PREFIX_SIZE, prefix.length).map_err(|error| self.io(offset, error))?;
        Ok((prefix, body.ok_or_else(|| self.truncated(offset))?))
    }

    /// What goes into memory whole is no larger than a writer would make it.
    fn check_size(&self, offset: u64, prefix: Prefix) -> Result<(), ReadError> {
        if prefix.length <= MAX_RECORD_SIZE {
            return Ok(());
        }
        let what = format!("a record of {} bytes; at most {MAX_RECORD_SIZE} are taken", prefix.length);
        Err(self.damaged(offset, what))
    }

    /// Why a file without an end is not whole.
    fn find_break(&self) -> ReadError {
        let mut offset = MAGIC.len() as u64;
        let mut source = Source::new(&self.file, self.size);
        loop {
            match self.prefix(&mut source, offset) {
                Ok(Prefix { opcode: FOOTER, length }) => {
                    let end = offset + PREFIX_SIZE + length;
                    let whole = end.saturating_add(MAGIC.len() as u64) <= self.size;
                    return match whole {
                        true => self.damaged(end, "the file does not end with its end mark".to_owned()),
                        false => self.truncated(end),
                    };
                }
                Ok(prefix) => offset += PREFIX_SIZE + prefix.length,
                Err(error) => return error,
            }
        }
    }

    fn io(&self, offset: u64, source: io::Error) -> ReadError {
        ReadError::Io { path: self.path.clone(), offset, source }
    }

    fn truncated(&self, offset: u64) -> ReadError {
        ReadError::Truncated { path: self.path.clone(), offset, size: self.size }
    }

    /// Too little memory for what is there, which may be intact.
    fn out_of_memory(&self, offset: u64) -> ReadError {
        let source = io::ErrorKind::OutOfMemory.into();
        ReadError::Io { path: self.path.clone(), offset, source }
    }

    fn damaged(&self, offset: u64, what: String) -> ReadError {
        ReadError::Damaged { path: self.path.clone(), offset, what }
    }
}
