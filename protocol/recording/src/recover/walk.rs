//! Finds the records of a broken file: each must prove itself before its length is believed, and behind damage the next one that
//! does is searched for.

use crate::chunk::MAX_CHUNK_SIZE;
use crate::read::Source;
use crate::records::{
    ATTACHMENT, Attachment, CHANNEL, CHUNK, Channel, ChunkHeader, DATA_END, FOOTER, Fields, HEADER, Header,
    MAGIC, MESSAGE, MESSAGE_INDEX, METADATA, Metadata, PREFIX_SIZE, Prefix, SCHEMA, Schema,
};
use std::io;

/// Enough of a chunk's body for its header.
const CHUNK_HEADER_SPAN: u64 = 256;
/// No record is longer than this.
const LONGEST: u64 = 1 << 40;
/// How much is searched at a time.
const STRIDE: u64 = 1 << 20;

/// A stretch of the file.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
pub(super) enum Piece {
    /// A record that proved itself.
    Record { offset: u64, prefix: Prefix },
    /// No record that does begins between these bytes.
    Broken { offset: u64, end: u64 },
}

/// The stretches of a file, one after the other.
pub(super) struct Walk<'a> {
    source: Source<'a>,
    offset: u64,
}

impl<'a> Walk<'a> {
    pub fn new(source: Source<'a>, offset: u64) -> Self {
        Self { source, offset }
    }

    pub fn source(&mut self) -> &mut Source<'a> {
        &mut self.source
    }

    /// The next stretch; `None` at the file's end.
    pub fn next(&mut self) -> io::Result<Option<Piece>> {
        let offset = self.offset;
        if self.source.left(offset) == 0 {
            return Ok(None);
        }
        if let Some(prefix) = proven(&mut self.source, offset, false)? {
            self.offset = offset + PREFIX_SIZE + prefix.length;
            return Ok(Some(Piece::Record { offset, prefix }));
        }
        let end = find_record(&mut self.source, offset + 1)?.unwrap_or(self.source.size());
        self.offset = end;
        Ok(Some(Piece::Broken { offset, end }))
    }
}

/// The profile of the file's header; that of ROS 2 when it cannot be read.
pub(super) fn profile(source: &mut Source) -> io::Result<String> {
    let offset = MAGIC.len() as u64;
    let Some(prefix) = proven(source, offset, false)? else { return Ok("ros2".to_owned()) };
    let body = source.bytes(offset + PREFIX_SIZE, prefix.length)?.unwrap_or_default();
    let header = Header::parse(body).filter(|_| prefix.opcode == HEADER);
    Ok(header.map_or("ros2", |header| header.profile).to_owned())
}

/// The first place at or after `from` where a record stands that proves itself by its own content.
pub(super) fn find_record(source: &mut Source, from: u64) -> io::Result<Option<u64>> {
    let mut start = from;
    while source.left(start) > 0 {
        let span = STRIDE.min(source.left(start));
        let window = source.bytes(start, span)?.unwrap_or_default().to_vec();
        for (at, opcode) in (start..).zip(window) {
            let may_be = matches!(opcode, CHUNK | ATTACHMENT | METADATA | DATA_END);
            if may_be && proven(source, at, true)?.is_some() {
                return Ok(Some(at));
            }
        }
        start += span;
    }
    Ok(None)
}

/// The record at `offset`, if it is whole and its body is what its opcode says. With `strict`, only what can hardly stand
/// anywhere by chance.
fn proven(source: &mut Source, offset: u64, strict: bool) -> io::Result<Option<Prefix>> {
    let Some(prefix) = source.prefix(offset)? else { return Ok(None) };
    let body = offset + PREFIX_SIZE;
    if prefix.opcode == 0 || prefix.length > source.left(body) {
        return Ok(None);
    }
    let holds = match prefix.opcode {
        CHUNK => chunk_holds(source, body, prefix.length)?,
        DATA_END => prefix.length == 4 && follows(source, body + prefix.length)?,
        MESSAGE_INDEX => index_holds(source, body, prefix.length)?,
        HEADER | SCHEMA | CHANNEL | ATTACHMENT | METADATA => {
            let bytes = source.bytes(body, prefix.length)?.unwrap_or_default();
            let (parses, fills) = (parses(prefix.opcode, bytes, strict), fills(prefix.opcode, bytes, strict));
            // The format lets later versions add fields.
            fills || parses && follows(source, body + prefix.length)?
        }
        // A message says nothing of itself, nor does a record of unknown kind: what follows must be a record.
        MESSAGE => prefix.length >= 22 && follows(source, body + prefix.length)?,
        _ => follows(source, body + prefix.length)?,
    };
    Ok(holds.then_some(prefix))
}

fn parses(opcode: u8, body: &[u8], strict: bool) -> bool {
    match opcode {
        HEADER => Header::parse(body).is_some(),
        SCHEMA => Schema::parse(body).is_some(),
        CHANNEL => Channel::parse(body).is_some(),
        // A damaged attachment keeps its place, so that what follows is found; by chance it must be intact.
        ATTACHMENT => Attachment::parse(body).is_some_and(|attachment| attachment.intact || !strict),
        METADATA => Metadata::parse(body).is_some_and(|metadata| !metadata.name.is_empty() || !strict),
        _ => false,
    }
}

/// Whether a body is what its opcode says, to its last byte.
fn fills(opcode: u8, body: &[u8], strict: bool) -> bool {
    let shorter = body.get(..body.len().saturating_sub(1)).unwrap_or_default();
    parses(opcode, body, strict) && !parses(opcode, shorter, false)
}

fn chunk_holds(source: &mut Source, body: u64, length: u64) -> io::Result<bool> {
    let front = source.bytes(body, CHUNK_HEADER_SPAN.min(length))?.unwrap_or_default();
    Ok(ChunkHeader::parse(front).is_some_and(|(header, size)| {
        matches!(header.compression.as_str(), "" | "zstd" | "lz4")
            && header.uncompressed_size < MAX_CHUNK_SIZE
            && (size as u64).checked_add(header.compressed_size) == Some(length)
    }))
}

/// A message index is a channel and as many bytes of entries, 16 each, as it says.
fn index_holds(source: &mut Source, body: u64, length: u64) -> io::Result<bool> {
    let Some(front) = source.bytes(body, 6.min(length))? else { return Ok(false) };
    let count = front.get(2..6).and_then(|count| count.try_into().ok()).map(u32::from_le_bytes);
    Ok(count.is_some_and(|count| u64::from(count) + 6 == length && count % 16 == 0))
}

/// Whether a record, the closing magic or the file's end is at `offset`.
fn follows(source: &mut Source, offset: u64) -> io::Result<bool> {
    if source.left(offset) < PREFIX_SIZE {
        let left = source.left(offset);
        let rest = source.bytes(offset, left)?.unwrap_or_default();
        return Ok(rest.is_empty() || rest == MAGIC || rest.first().is_some_and(|opcode| *opcode != 0));
    }
    // The record that follows may itself be cut off, or be a chunk of unknown length that was being written.
    let likely = |prefix: Prefix| {
        matches!(prefix.opcode, HEADER..=DATA_END | 0x80..)
            && (prefix.length < LONGEST || prefix == Prefix { opcode: CHUNK, length: u64::MAX })
    };
    Ok(source.prefix(offset)?.is_some_and(likely) || next_is_magic(source, offset)?)
}

fn next_is_magic(source: &mut Source, offset: u64) -> io::Result<bool> {
    Ok(source.bytes(offset, MAGIC.len() as u64)? == Some(MAGIC.as_slice()))
}

/// What a walk meets after the data: whether footer and closing magic are there.
pub(super) fn index_is_whole(source: &mut Source) -> io::Result<bool> {
    // Footer: prefix, 20 bytes; then the magic.
    let tail = PREFIX_SIZE + 20 + MAGIC.len() as u64;
    let Some(offset) = source.size().checked_sub(tail) else { return Ok(false) };
    let footer = source.prefix(offset)? == Some(Prefix { opcode: FOOTER, length: 20 });
    Ok(footer && next_is_magic(source, offset + PREFIX_SIZE + 20)?)
}

/// Whether the index is what the checksum in the footer says (MCAP specification, "Footer": from the summary's start up to the
/// checksum itself). True when there is no index, or no checksum of it.
pub(super) fn index_is_intact(source: &mut Source) -> io::Result<bool> {
    let end = source.size().saturating_sub(MAGIC.len() as u64);
    let footer = source.bytes(end.saturating_sub(20), 20)?.unwrap_or_default();
    let mut fields = Fields(footer);
    let (Some(start), Some(_offsets), Some(expected)) = (fields.u64(), fields.u64(), fields.u32()) else {
        return Ok(false);
    };
    if start == 0 || expected == 0 {
        return Ok(true);
    }
    let mut hasher = crc32fast::Hasher::new();
    let (mut at, covered_end) = (start, end.saturating_sub(4));
    if start >= covered_end {
        return Ok(false);
    }
    while at < covered_end {
        let span = STRIDE.min(covered_end - at);
        hasher.update(source.bytes(at, span)?.unwrap_or_default());
        at += span;
    }
    Ok(hasher.finalize() == expected)
}
