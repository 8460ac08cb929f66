//! The writer of one file: chunks, channels, attachments.

mod copy;

use crate::mcap::read::Attachment;
use crate::mcap::write::error::{explain, refused};
use crate::mcap::write::storage::Stream;
use crate::mcap::write::target::{self, sync_folder};
use crate::mcap::write::{StoredFile, Whereabouts, WriteError, WriteReport, WriterOptions, active_path};
use crate::messages::schema;
use crate::messages::{ByteArray, Message};
use crate::topics::{Direction, Port, Topic};
use mcap::records::{MessageHeader, Metadata};
use mcap::write::NoSeek;
use mcap::{Compression, McapResult, WriteOptions};
use std::collections::BTreeMap;
use std::io::BufWriter;
use std::path::{Path, PathBuf};
use std::sync::Arc;

type Sink = NoSeek<BufWriter<Stream>>;

/// A channel of the file: its id in it, and how many messages it has.
#[derive(Copy, Clone)]
struct Channel {
    id: u16,
    messages: u32,
}

/// A message's place in the file.
#[derive(Copy, Clone)]
struct Stamped {
    channel: u16,
    sequence: u32,
    log_time_ns: i64,
    publish_time_ns: i64,
}

/// What a channel is found again by: topic, type and encoding.
/// The highest log time of a file, nanoseconds, and each topic's next number.
pub(crate) type ResumePoint = (i64, BTreeMap<Topic, u32>);
type ChannelKey = (String, String, String);

/// Writes one recording or capture.
///
/// Dropped before [`Writer::finish`], it leaves `NAME.active` behind.
pub struct Writer {
    inner: mcap::Writer<Sink>,
    file: Arc<dyn StoredFile>,
    path: PathBuf,
    active: PathBuf,
    options: WriterOptions,
    channels: BTreeMap<Topic, Channel>,
    foreign: BTreeMap<ChannelKey, Channel>,
    /// Numbers that the first message of a topic has here, when this file goes on with another one's.
    first_numbers: BTreeMap<Topic, u32>,
    log_time_ns: i64,
    chunk_start_ns: Option<i64>,
    /// Log time of the first message that no flush has taken yet.
    unsaved_since_ns: Option<i64>,
    messages: u64,
    flushed_bytes: u64,
    failed: bool,
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

impl Writer {
    /// Starts a file: creates `PATH.active`, which [`Writer::finish`] renames to `path`.
    ///
    /// # Errors
    /// As [`Writer::check`], or what the system refuses.
    pub fn create(path: &Path, options: &WriterOptions) -> Result<Self, WriteError> {
        target::check(path, options)?;
        let active = active_path(path);
        let file = target::create(&active, options)?;
        if options.sync {
            sync_folder(&active, options)?;
        }
        Self::start(path, active, file, options, "ros2")
    }

    /// Whether [`Writer::create`] would begin, for whoever wants to know before long work. Nothing is
    /// created.
    ///
    /// # Errors
    /// [`WriteError::IsInput`], [`WriteError::NotAFile`] and [`WriteError::BeingWritten`];
    /// [`WriteError::Exists`] and [`WriteError::Unfinished`] for what is there already (unless
    /// `options.overwrite`), and [`WriteError::InTheWay`] for what is no recording.
    pub fn check(path: &Path, options: &WriterOptions) -> Result<(), WriteError> {
        target::check(path, options)?;
        target::check_temporary(&active_path(path), options)
    }

    pub(crate) fn start(
        path: &Path,
        active: PathBuf,
        file: Arc<dyn StoredFile>,
        options: &WriterOptions,
        profile: &str,
    ) -> Result<Self, WriteError> {
        // Without seeking, a chunk is put together in memory and written whole: what is on the disk never
        // holds a chunk whose length is still a placeholder, on which other people's readers give up.
        let inner = WriteOptions::new()
            .profile(profile)
            .library(concat!("biplane ", env!("CARGO_PKG_VERSION")))
            .compression(Some(Compression::Zstd))
            .compression_threads(0)
            .chunk_size(Some(options.chunk_bytes))
            .disable_seeking(true)
            .create(NoSeek::new(BufWriter::new(Stream(Arc::clone(&file)))))
            .map_err(|error| explain(&active, error))?;
        Ok(Self {
            inner,
            file,
            path: path.to_owned(),
            active,
            options: options.clone(),
            channels: BTreeMap::new(),
            foreign: BTreeMap::new(),
            first_numbers: BTreeMap::new(),
            log_time_ns: 0,
            chunk_start_ns: None,
            unsaved_since_ns: None,
            messages: 0,
            flushed_bytes: 0,
            failed: false,
            scratch: Vec::new(),
        })
    }

    /// Writes a message. `publish_time_ns` is its header's stamp (where it has one), `log_time_ns` when it
    /// was received or made.
    ///
    /// A log time before an earlier one is raised to it ([`WriterOptions::in_order`]): readers want a file in
    /// order. Times before 1970 become 0.
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
        self.log_time_ns =
            if self.options.in_order { self.log_time_ns.max(log_time_ns) } else { log_time_ns };
        let channel = match self.channels.get(&topic) {
            Some(channel) => *channel,
            None => self.add_topic(topic)?,
        };
        self.channels.insert(topic, Channel { messages: channel.messages.wrapping_add(1), ..channel });
        let (log_time_ns, sequence) = (self.log_time_ns, channel.messages);
        self.put(Stamped { channel: channel.id, log_time_ns, publish_time_ns, sequence }, cdr)
    }

    fn add_topic(&mut self, topic: Topic) -> Result<Channel, WriteError> {
        let type_name = topic.type_name();
        // Every type of a topic has its text (a test walks them all).
        let text = schema::ros2msg(type_name).unwrap_or_default();
        let qos = ("offered_qos_profiles".to_owned(), topic.offered_qos_profiles());
        let schema = (type_name, "ros2msg", text.as_bytes());
        let channel = self.add_channel(schema, topic.name(), "cdr", &BTreeMap::from([qos]))?;
        Ok(Channel { messages: self.first_numbers.get(&topic).copied().unwrap_or(0), ..channel })
    }

    fn add_channel(
        &mut self,
        (name, encoding, data): (&str, &str, &[u8]),
        topic: &str,
        message_encoding: &str,
        metadata: &BTreeMap<String, String>,
    ) -> Result<Channel, WriteError> {
        let id = self.attempt(|inner| {
            // A channel without a type has no schema.
            let schema = if name.is_empty() { 0 } else { inner.add_schema(name, encoding, data)? };
            inner.add_channel(schema, topic, message_encoding, metadata)
        })?;
        Ok(Channel { id, messages: 0 })
    }

    fn put(&mut self, stamped: Stamped, bytes: &[u8]) -> Result<(), WriteError> {
        let start = *self.chunk_start_ns.get_or_insert(stamped.log_time_ns);
        if stamped.log_time_ns.saturating_sub(start) >= self.options.chunk_span_ns {
            self.close_chunk()?;
            self.chunk_start_ns = Some(stamped.log_time_ns);
        }
        self.unsaved_since_ns.get_or_insert(stamped.log_time_ns);
        let header = MessageHeader {
            channel_id: stamped.channel,
            sequence: stamped.sequence,
            log_time: u64::try_from(stamped.log_time_ns).unwrap_or(0),
            publish_time: u64::try_from(stamped.publish_time_ns).unwrap_or(0),
        };
        self.attempt(|inner| inner.write_to_known_channel(&header, bytes))?;
        self.messages += 1;
        Ok(())
    }

    /// Adds a file to the file, for example `rig.toml`. Closes the chunk.
    ///
    /// # Errors
    /// As [`Writer::write`].
    pub fn attach(&mut self, name: &str, media_type: &str, data: &[u8]) -> Result<(), WriteError> {
        let time_ns = self.log_time_ns.unsigned_abs();
        let (log_time_ns, create_time_ns, intact) = (time_ns, time_ns, true);
        self.copy_attachment(&Attachment { log_time_ns, create_time_ns, name, media_type, data, intact })
    }

    /// Adds named words, for example versions. Closes the chunk.
    ///
    /// # Errors
    /// As [`Writer::write`].
    pub fn metadata(&mut self, name: &str, values: &BTreeMap<String, String>) -> Result<(), WriteError> {
        let record = Metadata { name: name.to_owned(), metadata: values.clone() };
        self.chunk_start_ns = None;
        self.attempt(|inner| inner.write_metadata(&record))
    }

    /// Closes the chunk and brings it to the file, with `options.sync` to the disk. What was written before
    /// is then safe.
    ///
    /// # Errors
    /// As [`Writer::write`].
    pub fn flush(&mut self) -> Result<(), WriteError> {
        self.close_chunk()?;
        if self.options.sync {
            let synced = self.file.sync();
            self.attempt(|_| Ok(synced?))?;
        }
        self.unsaved_since_ns = None;
        Ok(())
    }

    /// Closes the chunk and hands it to the system: the end of the process no longer matters to it.
    fn close_chunk(&mut self) -> Result<(), WriteError> {
        self.chunk_start_ns = None;
        self.attempt(mcap::Writer::flush)?;
        let size = self.file.size();
        self.flushed_bytes = self.attempt(|_| Ok(size?))?;
        Ok(())
    }

    /// Log time of the first message that was written since the last flush, in ns.
    pub(crate) fn unsaved_since_ns(&self) -> Option<i64> {
        self.unsaved_since_ns
    }

    /// Does something with the file, unless something failed before: after an error nothing more is written.
    fn attempt<T>(
        &mut self,
        action: impl FnOnce(&mut mcap::Writer<Sink>) -> McapResult<T>,
    ) -> Result<T, WriteError> {
        if self.failed {
            return Err(WriteError::Failed { path: self.active.clone() });
        }
        action(&mut self.inner).map_err(|error| {
            self.failed = true;
            explain(&self.active, error)
        })
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

    /// The file's size after the last chunk that was closed for its span of time, in bytes.
    pub(crate) fn flushed_bytes(&self) -> u64 {
        self.flushed_bytes
    }

    /// What the next file must know to go on where this one ends: the highest log time, and each topic's next
    /// number.
    pub(crate) fn resume_point(&self) -> ResumePoint {
        let mut numbers = self.first_numbers.clone();
        numbers.extend(self.channels.iter().map(|(&topic, channel)| (topic, channel.messages)));
        (self.log_time_ns, numbers)
    }

    /// What was written so far stands in an earlier part, too: a power cut cannot take it.
    pub(crate) fn is_repeated(&mut self) {
        self.unsaved_since_ns = None;
    }

    /// Goes on where another file ended; before the first message.
    pub(crate) fn resume(&mut self, (log_time_ns, numbers): ResumePoint) {
        self.log_time_ns = log_time_ns;
        self.first_numbers = numbers;
    }

    /// What became of the file since it was created.
    pub(crate) fn whereabouts(&self) -> Whereabouts {
        self.file.whereabouts(&self.active)
    }

    /// Writes index and end into a file that was moved away: it is whole under whatever name it has now.
    pub(crate) fn end(mut self) -> Result<(), WriteError> {
        self.attempt(mcap::Writer::finish)?;
        self.file.sync().map_err(|source| refused("sync", &self.active, source))
    }

    /// Writes index and end, and gives the file its name.
    ///
    /// # Errors
    /// As [`Writer::write`]; `NAME.active` is then left, and holds what was written.
    pub fn finish(mut self) -> Result<WriteReport, WriteError> {
        let summary = self.attempt(mcap::Writer::finish)?;
        if self.options.sync {
            self.file.sync().map_err(|source| refused("sync", &self.active, source))?;
        }
        // Somebody may have put a file there while we wrote.
        target::check_name(&self.path, &self.options)?;
        let storage = self.options.disk.storage();
        storage
            .rename(&self.active, &self.path)
            .map_err(|source| refused("rename to its name", &self.active, source))?;
        if self.options.sync {
            sync_folder(&self.path, &self.options)?;
        }
        let bytes = self.file.size().map_err(|source| refused("look at", &self.path, source))?;
        let chunks = summary.chunk_indexes.len() as u64;
        Ok(WriteReport { path: self.path, messages: self.messages, chunks, bytes })
    }
}
