//! Serial captures: the bytes of each line as they came, one message a read (`/serial/<port>/rx` and `/tx`).
//! Written by [`Writer::write_serial`](crate::Writer::write_serial).

use crate::mcap::read::{Entry, ReadError, Reader};
use crate::messages::{ByteArray, Message};
use crate::topics::{Direction, Port, Topic};

/// One read from a serial line, or one write to it.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct SerialBytes {
    /// Which line.
    pub port: Port,
    /// Which way.
    pub direction: Direction,
    /// When the read returned, in ns.
    pub time_ns: i64,
    /// The bytes.
    pub bytes: Vec<u8>,
}

/// The serial bytes in a message of a file; `None` when it is another message.
///
/// # Errors
/// [`ReadError::Message`] when it is one and cannot be decoded.
pub fn serial_bytes(entry: &Entry) -> Result<Option<SerialBytes>, ReadError> {
    let Some(Topic::Serial(port, direction)) = entry.topic else { return Ok(None) };
    let message = ByteArray::decode(&entry.bytes).map_err(|source| ReadError::Message {
        path: None,
        topic: entry.topic_name.clone(),
        log_time_ns: entry.log_time_ns,
        source,
    })?;
    Ok(Some(SerialBytes { port, direction, time_ns: entry.log_time_ns, bytes: message.data }))
}

/// All serial bytes of a file, in file order; other messages are passed over.
pub fn serial(reader: &Reader) -> impl Iterator<Item = Result<SerialBytes, ReadError>> + '_ {
    reader.messages().filter_map(|entry| {
        entry.and_then(|entry| serial_bytes(&entry).map_err(|error| error.in_file(reader.path()))).transpose()
    })
}
