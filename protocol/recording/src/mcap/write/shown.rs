//! A file of what viewers show: one message a topic, all at one time.

use std::collections::BTreeMap;
use std::io::{self, Write};

use mcap::records::MessageHeader;
use mcap::write::NoSeek;
use mcap::{Compression, McapError, WriteOptions};

use crate::messages::schema;

/// A message of such a file.
#[derive(Copy, Clone, Debug)]
pub struct Shown<'a> {
    /// Its topic, for example `/model`.
    pub topic: &'a str,
    /// Its type, one of those of [`schema::ros2msg`].
    pub type_name: &'a str,
    /// Its CDR bytes.
    pub bytes: &'a [u8],
}

/// Writes an MCAP file of profile `ros2` with these messages, all at `time_ns`. The same messages give the
/// same bytes.
///
/// # Errors
/// When writing fails.
pub fn write_shown(out: impl Write, time_ns: i64, messages: &[Shown<'_>]) -> io::Result<()> {
    let io_error = |error| match error {
        McapError::Io(error) => error,
        other => io::Error::other(other),
    };
    let mut writer = WriteOptions::new()
        .profile("ros2")
        .library(concat!("biplane ", env!("CARGO_PKG_VERSION")))
        .compression(Some(Compression::Zstd))
        .compression_threads(0)
        .disable_seeking(true)
        .create(NoSeek::new(out))
        .map_err(io_error)?;
    let time_ns = u64::try_from(time_ns).unwrap_or(0);
    for message in messages {
        let text = schema::ros2msg(message.type_name).unwrap_or_default();
        let schema = writer.add_schema(message.type_name, "ros2msg", text.as_bytes()).map_err(io_error)?;
        let channel = writer.add_channel(schema, message.topic, "cdr", &BTreeMap::new()).map_err(io_error)?;
        let header =
            MessageHeader { channel_id: channel, sequence: 0, log_time: time_ns, publish_time: time_ns };
        writer.write_to_known_channel(&header, message.bytes).map_err(io_error)?;
    }
    writer.finish().map(drop).map_err(io_error)
}
