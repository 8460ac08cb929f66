//! Writes a recording so that a crash costs a second at most: chunks go to disk whole, one a second of log time, in a file
//! `NAME.active` that takes its name when it is finished.
//!
//! The same calls give the same bytes, on any machine: no clock is read, nothing depends on threads or hash order.

use crate::msg::{ByteArray, Message};
use crate::read::Entry;
use crate::schema;
use crate::topics::{Direction, Port, Topic};
use mcap::records::{MessageHeader, Metadata};
use mcap::write::NoSeek;
use mcap::{Attachment, Compression, McapError, WriteOptions};
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::ffi::OsString;
use std::fs::File;
use std::io::{self, BufWriter};
use std::path::{Path, PathBuf};

/// How a recording is written.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct WriterOptions {
    /// Replace an existing file, and an unfinished one, of that name. Otherwise both are an error.
    pub overwrite: bool,
    /// Wait until each chunk is on the disk itself (`fdatasync`), so that a power cut costs a second at most. For live recording;
    /// a replay writes hours in seconds and would only wait.
    pub sync: bool,
    /// A chunk is closed before a message whose log time is this much after the chunk's first, in ns. Larger packs better and loses
    /// more in a crash. The default of 0.9 s leaves time for writing within the second that is promised.
    pub chunk_span_ns: i64,
    /// A chunk is closed when its messages take this many bytes.
    pub chunk_bytes: u64,
}

impl Default for WriterOptions {
    fn default() -> Self {
        Self { overwrite: false, sync: false, chunk_span_ns: 900_000_000, chunk_bytes: 1 << 20 }
    }
}

/// What a finished file holds.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct WriteReport {
    /// Where it is.
    pub path: PathBuf,
    /// How many messages it holds.
    pub messages: u64,
    /// How many chunks.
    pub chunks: u64,
    /// Its size.
    pub bytes: u64,
}

/// Why a file could not be written.
#[derive(Debug, thiserror::Error)]
pub enum WriteError {
    /// The file is there already.
    #[error("{} exists already; it is not overwritten unless asked", path.display())]
    Exists {
        /// The file.
        path: PathBuf,
    },
    /// An unfinished recording of that name is there: of a run that still goes on, or that was cut off.
    #[error(
        "{} exists: an unfinished recording, not overwritten unless asked; `biplane recover` salvages it, if no process is still writing it",
        path.display()
    )]
    Unfinished {
        /// The unfinished file.
        path: PathBuf,
    },
    /// No room is left.
    #[error("disk full while writing {}: what was written before is kept", path.display())]
    DiskFull {
        /// The file.
        path: PathBuf,
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
    /// A write failed before; nothing more can be added.
    #[error("{} cannot be written any more: an earlier write failed", path.display())]
    Failed {
        /// The file.
        path: PathBuf,
    },
    /// The format refuses it.
    #[error("cannot write to {}: {what}", path.display())]
    Format {
        /// The file.
        path: PathBuf,
        /// Why.
        what: String,
    },
}

pub(crate) type Sink = NoSeek<BufWriter<File>>;

/// The name of a file while it is written: `NAME.active`.
#[must_use]
pub fn active_path(path: &Path) -> PathBuf {
    let mut name = OsString::from(path.as_os_str());
    name.push(".active");
    PathBuf::from(name)
}

/// A channel of the file: its id in it, and how many messages it has.
#[derive(Copy, Clone)]
struct Channel {
    id: u16,
    messages: u32,
}

/// What a channel is found again by: topic, type and encoding.
type ChannelKey = (String, String, String);

/// Writes one recording or capture.
///
/// Dropped before [`Writer::finish`], it leaves `NAME.active` behind.
pub struct Writer {
    inner: mcap::Writer<Sink>,
    file: File,
    path: PathBuf,
    active: PathBuf,
    options: WriterOptions,
    channels: BTreeMap<Topic, Channel>,
    foreign: BTreeMap<ChannelKey, Channel>,
    log_time_ns: i64,
    chunk_start_ns: Option<i64>,
    messages: u64,
    scratch: Vec<u8>,
}

impl std::fmt::Debug for Writer {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Writer")
            .field("path", &self.path)
            .field("messages", &self.messages)
            .finish_non_exhaustive()
    }
}

fn open_active(path: &Path, active: &Path, overwrite: bool) -> Result<File, WriteError> {
    if !overwrite && path.try_exists().unwrap_or(false) {
        return Err(WriteError::Exists { path: path.to_owned() });
    }
    let mut options = File::options();
    options.write(true);
    if overwrite {
        options.create(true).truncate(true);
    } else {
        options.create_new(true);
    }
    options.open(active).map_err(|source| match source.kind() {
        io::ErrorKind::AlreadyExists => WriteError::Unfinished { path: active.to_owned() },
        _ => WriteError::Io { action: "create", path: active.to_owned(), source },
    })
}

impl Writer {
    /// Starts a file: creates `PATH.active`, which [`Writer::finish`] renames to `path`.
    ///
    /// # Errors
    /// [`WriteError::Exists`] and [`WriteError::Unfinished`] for what is there already (unless `options.overwrite`), or what the
    /// system refuses.
    pub fn create(path: &Path, options: &WriterOptions) -> Result<Self, WriteError> {
        Self::create_as(path, options, "ros2")
    }

    /// As [`Writer::create`], with the profile of a file that is copied.
    pub(crate) fn create_as(path: &Path, options: &WriterOptions, profile: &str) -> Result<Self, WriteError> {
        let active = active_path(path);
        let file = open_active(path, &active, options.overwrite)?;
        let sink = file.try_clone().map_err(|source| WriteError::Io {
            action: "open",
            path: active.clone(),
            source,
        })?;
        // Without seeking, a chunk is put together in memory and written whole: what is on the disk never holds a chunk whose
        // length is still a placeholder, on which other people's readers give up.
        let inner = WriteOptions::new()
            .profile(profile)
            .library(concat!("biplane ", env!("CARGO_PKG_VERSION")))
            .compression(Some(Compression::Zstd))
            .compression_threads(0)
            .chunk_size(Some(options.chunk_bytes))
            .disable_seeking(true)
            .create(NoSeek::new(BufWriter::new(sink)))
            .map_err(|error| explain(&active, error))?;
        Ok(Self {
            inner,
            file,
            path: path.to_owned(),
            active,
            options: options.clone(),
            channels: BTreeMap::new(),
            foreign: BTreeMap::new(),
            log_time_ns: 0,
            chunk_start_ns: None,
            messages: 0,
            scratch: Vec::new(),
        })
    }

    /// Writes a message. `publish_time_ns` is its header's stamp (where it has one), `log_time_ns` when it was received or made.
    ///
    /// A log time before an earlier one is raised to it: readers want a file in order. Times before 1970 become 0.
    ///
    /// # Errors
    /// [`WriteError::DiskFull`] and the like; after an error nothing more is written.
    pub fn write<M: Message>(
        &mut self,
        topic: Topic,
        log_time_ns: i64,
        publish_time_ns: i64,
        message: &M,
    ) -> Result<(), WriteError> {
        let mut bytes = std::mem::take(&mut self.scratch);
        message.encode(&mut bytes);
        let result = self.write_encoded(topic, log_time_ns, publish_time_ns, &bytes);
        self.scratch = bytes;
        result
    }

    /// Writes bytes of a serial line. `time_ns` is when the read returned, or the write was made.
    ///
    /// # Errors
    /// As [`Writer::write`].
    pub fn write_serial(
        &mut self,
        port: Port,
        direction: Direction,
        time_ns: i64,
        bytes: &[u8],
    ) -> Result<(), WriteError> {
        let mut encoded = std::mem::take(&mut self.scratch);
        ByteArray::encode_slice(bytes, &mut encoded);
        let result = self.write_encoded(Topic::Serial(port, direction), time_ns, time_ns, &encoded);
        self.scratch = encoded;
        result
    }

    /// Writes a message that is encoded already (CDR with its header, of the topic's type).
    ///
    /// # Errors
    /// As [`Writer::write`].
    pub fn write_encoded(
        &mut self,
        topic: Topic,
        log_time_ns: i64,
        publish_time_ns: i64,
        cdr: &[u8],
    ) -> Result<(), WriteError> {
        let log_time = self.advance(log_time_ns)?;
        let channel = match self.channels.get(&topic) {
            Some(channel) => *channel,
            None => self.add_topic(topic)?,
        };
        self.put(channel, log_time, publish_time_ns, cdr)?;
        self.channels.insert(topic, Channel { messages: channel.messages.wrapping_add(1), ..channel });
        Ok(())
    }

    /// Writes a message of another file as it is: same topic, type, schema, encoding, times and bytes; also of topics and types that
    /// Biplane does not know.
    ///
    /// # Errors
    /// As [`Writer::write`].
    pub fn copy(&mut self, entry: &Entry) -> Result<(), WriteError> {
        if let (Some(topic), "cdr") = (entry.topic, entry.encoding()) {
            return self.write_encoded(topic, entry.log_time_ns, entry.publish_time_ns, &entry.bytes);
        }
        let log_time = self.advance(entry.log_time_ns)?;
        let key = (entry.topic_name.clone(), entry.type_name.clone(), entry.encoding().to_owned());
        let channel = match self.foreign.get(&key) {
            Some(channel) => *channel,
            None => self.add_foreign(entry)?,
        };
        self.put(channel, log_time, entry.publish_time_ns, &entry.bytes)?;
        self.foreign.insert(key, Channel { messages: channel.messages.wrapping_add(1), ..channel });
        Ok(())
    }

    /// Takes the running maximum of the log times, and closes the chunk when it has lasted long enough.
    fn advance(&mut self, log_time_ns: i64) -> Result<u64, WriteError> {
        self.log_time_ns = self.log_time_ns.max(log_time_ns);
        let start = *self.chunk_start_ns.get_or_insert(self.log_time_ns);
        if self.log_time_ns.saturating_sub(start) >= self.options.chunk_span_ns {
            self.flush()?;
            self.chunk_start_ns = Some(self.log_time_ns);
        }
        Ok(self.log_time_ns.unsigned_abs())
    }

    fn add_topic(&mut self, topic: Topic) -> Result<Channel, WriteError> {
        let type_name = topic.type_name();
        // Every type of a topic has its text (a test walks them all).
        let text = schema::ros2msg(type_name).unwrap_or_default();
        let qos = ("offered_qos_profiles".to_owned(), topic.offered_qos_profiles());
        self.add_channel((type_name, "ros2msg", text.as_bytes()), topic.name(), "cdr", &BTreeMap::from([qos]))
    }

    fn add_foreign(&mut self, entry: &Entry) -> Result<Channel, WriteError> {
        let channel = &entry.channel;
        let schema = (entry.type_name.as_str(), channel.schema_encoding.as_str(), channel.schema.as_slice());
        self.add_channel(schema, &entry.topic_name, &channel.message_encoding, &channel.metadata)
    }

    fn add_channel(
        &mut self,
        (name, encoding, data): (&str, &str, &[u8]),
        topic: &str,
        message_encoding: &str,
        metadata: &BTreeMap<String, String>,
    ) -> Result<Channel, WriteError> {
        let mut add = || {
            // A channel without a type has no schema.
            let schema = if name.is_empty() { 0 } else { self.inner.add_schema(name, encoding, data)? };
            self.inner.add_channel(schema, topic, message_encoding, metadata)
        };
        let id = add().map_err(|error| explain(&self.active, error))?;
        Ok(Channel { id, messages: 0 })
    }

    fn put(
        &mut self,
        channel: Channel,
        log_time: u64,
        publish_time_ns: i64,
        bytes: &[u8],
    ) -> Result<(), WriteError> {
        let header = MessageHeader {
            channel_id: channel.id,
            sequence: channel.messages,
            log_time,
            publish_time: u64::try_from(publish_time_ns).unwrap_or(0),
        };
        self.inner.write_to_known_channel(&header, bytes).map_err(|error| explain(&self.active, error))?;
        self.messages += 1;
        Ok(())
    }

    /// Adds a file to the file, for example `rig.toml`. Closes the chunk.
    ///
    /// # Errors
    /// As [`Writer::write`].
    pub fn attach(&mut self, name: &str, media_type: &str, data: &[u8]) -> Result<(), WriteError> {
        let time = self.log_time_ns.unsigned_abs();
        let attachment = Attachment {
            log_time: time,
            create_time: time,
            name: name.to_owned(),
            media_type: media_type.to_owned(),
            data: Cow::Borrowed(data),
        };
        self.chunk_start_ns = None;
        self.inner.attach(&attachment).map_err(|error| explain(&self.active, error))
    }

    /// Adds named words, for example versions. Closes the chunk.
    ///
    /// # Errors
    /// As [`Writer::write`].
    pub fn metadata(&mut self, name: &str, values: &BTreeMap<String, String>) -> Result<(), WriteError> {
        let record = Metadata { name: name.to_owned(), metadata: values.clone() };
        self.chunk_start_ns = None;
        self.inner.write_metadata(&record).map_err(|error| explain(&self.active, error))
    }

    /// Closes the chunk and brings it to the file, with `options.sync` to the disk. What was written before is then safe.
    ///
    /// # Errors
    /// As [`Writer::write`].
    pub fn flush(&mut self) -> Result<(), WriteError> {
        self.inner.flush().map_err(|error| explain(&self.active, error))?;
        self.chunk_start_ns = None;
        if self.options.sync {
            self.file.sync_data().map_err(|source| refused("sync", &self.active, source))?;
        }
        Ok(())
    }

    /// How many messages were written so far.
    #[must_use]
    pub fn messages(&self) -> u64 {
        self.messages
    }

    /// The highest log time so far, in ns; 0 before the first message.
    #[must_use]
    pub fn log_time_ns(&self) -> i64 {
        self.log_time_ns
    }

    /// Writes index and end, and gives the file its name.
    ///
    /// # Errors
    /// As [`Writer::write`]; `NAME.active` is then left, and holds what was written.
    pub fn finish(mut self) -> Result<WriteReport, WriteError> {
        let summary = self.inner.finish().map_err(|error| explain(&self.active, error))?;
        if self.options.sync {
            self.file.sync_all().map_err(|source| refused("sync", &self.active, source))?;
        }
        // Somebody may have put a file there while we wrote.
        if !self.options.overwrite && self.path.try_exists().unwrap_or(false) {
            return Err(WriteError::Exists { path: self.path });
        }
        std::fs::rename(&self.active, &self.path)
            .map_err(|source| refused("rename to its name", &self.active, source))?;
        let bytes = self.file.metadata().map_err(|source| refused("look at", &self.path, source))?.len();
        let chunks = summary.chunk_indexes.len() as u64;
        Ok(WriteReport { path: self.path, messages: self.messages, chunks, bytes })
    }
}

fn refused(action: &'static str, path: &Path, source: io::Error) -> WriteError {
    let path = path.to_owned();
    match source.kind() {
        io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => WriteError::DiskFull { path },
        _ => WriteError::Io { action, path, source },
    }
}

fn explain(path: &Path, error: McapError) -> WriteError {
    match error {
        McapError::Io(source) => refused("write", path, source),
        McapError::AttemptedWriteAfterFailure => WriteError::Failed { path: path.to_owned() },
        other => WriteError::Format { path: path.to_owned(), what: other.to_string() },
    }
}
