//! Messages and attachments of another file, written as they stand there: for optimized, imported and
//! salvaged recordings.

use super::{Channel, Stamped, Writer};
use crate::mcap::read::{Attachment, Entry};
use crate::mcap::write::target::{self, recovering_path};
use crate::mcap::write::{WriteError, WriterOptions};
use std::borrow::Cow;
use std::path::Path;

impl Stamped {
    fn of(entry: &Entry, channel: u16) -> Self {
        let (log_time_ns, publish_time_ns) = (entry.log_time_ns, entry.publish_time_ns);
        Self { channel, sequence: entry.sequence, log_time_ns, publish_time_ns }
    }
}

impl Writer {
    /// Starts the copy of a broken file, of any profile. While it is written its name is `PATH.recovering`,
    /// because the broken file itself may well be `PATH.active`. When it is finished it is on the disk
    /// itself: the broken file may then be removed.
    ///
    /// # Errors
    /// As [`Writer::create`]; [`WriteError::Recovering`] when another recovery to that name goes on.
    pub(crate) fn create_copy(
        path: &Path,
        input: &Path,
        profile: &str,
        options: &WriterOptions,
    ) -> Result<Self, WriteError> {
        let mut options = WriterOptions { sync: true, ..options.clone() };
        options.inputs.push(input.to_owned());
        target::check(path, &options)?;
        let recovering = recovering_path(path);
        target::clear_stale(&recovering, &options)?;
        let kept = WriterOptions { overwrite: false, ..options.clone() };
        let file = target::create(&recovering, &kept).map_err(|error| match error {
            WriteError::Unfinished { path } => WriteError::Recovering { path },
            other => other,
        })?;
        Self::start(path, recovering, file, &options, profile)
    }

    /// Writes a message of another file as it is: same topic, type, schema, encoding, times and bytes; also
    /// of topics and types that Biplane does not know.
    ///
    /// # Errors
    /// As [`Writer::write`].
    pub fn copy(&mut self, entry: &Entry) -> Result<(), WriteError> {
        if let (Some(topic), "cdr") = (entry.topic, entry.encoding()) {
            return self.write_encoded(topic, entry.log_time_ns, entry.publish_time_ns, &entry.bytes);
        }
        self.log_time_ns = self.log_time_ns.max(entry.log_time_ns);
        let channel = self.foreign_channel(entry)?;
        let sequence = channel.messages;
        self.put(
            Stamped { log_time_ns: self.log_time_ns, sequence, ..Stamped::of(entry, channel.id) },
            &entry.bytes,
        )
    }

    /// Writes a message of another file with its own number and log time, even where that is before an
    /// earlier one.
    pub(crate) fn copy_exactly(&mut self, entry: &Entry) -> Result<(), WriteError> {
        self.log_time_ns = self.log_time_ns.max(entry.log_time_ns);
        let channel = self.foreign_channel(entry)?;
        self.put(Stamped::of(entry, channel.id), &entry.bytes)
    }

    fn foreign_channel(&mut self, entry: &Entry) -> Result<Channel, WriteError> {
        let key = (entry.topic_name.clone(), entry.type_name.clone(), entry.encoding().to_owned());
        let channel = match self.foreign.get(&key) {
            Some(channel) => *channel,
            None => self.add_foreign(entry)?,
        };
        self.foreign.insert(key, Channel { messages: channel.messages.wrapping_add(1), ..channel });
        Ok(channel)
    }

    fn add_foreign(&mut self, entry: &Entry) -> Result<Channel, WriteError> {
        let channel = &entry.channel;
        let schema = (entry.type_name.as_str(), channel.schema_encoding.as_str(), channel.schema.as_slice());
        self.add_channel(schema, &entry.topic_name, &channel.message_encoding, &channel.metadata)
    }

    /// Adds an attachment of another file as it is: same name, media type, times and bytes. Closes the chunk.
    ///
    /// # Errors
    /// As [`Writer::write`].
    pub fn copy_attachment(&mut self, attachment: &Attachment<'_>) -> Result<(), WriteError> {
        let attachment = mcap::Attachment {
            log_time: attachment.log_time_ns,
            create_time: attachment.create_time_ns,
            name: attachment.name.to_owned(),
            media_type: attachment.media_type.to_owned(),
            data: Cow::Borrowed(attachment.data),
        };
        self.chunk_start_ns = None;
        self.attempt(|inner| inner.attach(&attachment))
    }
}
