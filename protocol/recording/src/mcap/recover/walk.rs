//! Finds the records of a broken file: each must prove itself before its length is believed, and behind
//! damage the next one that does is searched for.

use crate::mcap::chunk::{MAX_CHUNK_SIZE, MAX_RECORD_SIZE};
use crate::mcap::read::Source;
use crate::mcap::records::{
    ATTACHMENT, Attachment, CHANNEL, CHUNK, Channel, ChunkHeader, DATA_END, FOOTER, Fields, HEADER, Header,
    MAGIC, MESSAGE, MESSAGE_INDEX, METADATA, Metadata, PREFIX_SIZE, Prefix, SCHEMA, Schema,
};
use std::io;

/// Enough of a chunk's body for its header.
const CHUNK_HEADER_SPAN: u64 = 256;
/// No record is longer than this.
const LONGEST: u64 = 1 << 40;
/// Definitions, metadata and indexes are not longer than this.
const LONGEST_WORDS: u64 = 1 << 24;
/// Enough of an attachment's body for everything before what is attached.
const ATTACHMENT_FRONT: u64 = 1 << 16;
/// While records are searched for, at most so many times the file's size goes through checksums, so that a
/// file made to be slow is not.
const MAX_PASSES: u64 = 16;
/// How much is searched at a time.
const STRIDE: u64 = 1 << 20;

/// A stretch of the file.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
pub(crate) enum Piece {
    /// A record that proved itself.
    Record { offset: u64, prefix: Prefix },
    /// No record that does begins between these bytes.
    Broken { offset: u64, end: u64 },
}

/// The stretches of a file, one after the other.
pub(crate) struct Walk<'a> {
    source: Source<'a>,
    offset: u64,
}

impl<'a> Walk<'a> {
    pub(super) fn new(source: Source<'a>, offset: u64) -> Self {
        Self { source, offset }
    }

    pub(super) fn source(&mut self) -> &mut Source<'a> {
        &mut self.source
    }

    /// The next stretch; `None` at the file's end.
    pub(super) fn next(&mut self) -> io::Result<Option<Piece>> {
        let offset = self.offset;
        if self.source.left(offset) == 0 {
            return Ok(None);
        }
        let mut end = None;
        if let Some(prefix) = proven(&mut self.source, offset, false)? {
            end = swallowed(&mut self.source, offset, prefix)?;
            if end.is_none() {
                self.offset = offset + PREFIX_SIZE + prefix.length;
                return Ok(Some(Piece::Record { offset, prefix }));
            }
        }
        let end = match end {
            Some(end) => end,
            None => find_record(&mut self.source, offset + 1)?.unwrap_or(self.source.size()),
        };
        self.offset = end;
        Ok(Some(Piece::Broken { offset, end }))
    }
}

/// Where the first record begins that this one has swallowed: bytes of its own are gone from the file, so
/// that its length reaches into what follows. One behind which a record stands has its right length.
fn swallowed(source: &mut Source, offset: u64, prefix: Prefix) -> io::Result<Option<u64>> {
    let body = offset + PREFIX_SIZE;
    let end = body + prefix.length;
    // What is attached may be a recording itself.
    let is_attached = prefix.opcode == ATTACHMENT
        && source.bytes(end.saturating_sub(4), 4)? != Some(&[0; 4])
        && attachment_holds(source, body, prefix.length, true)?;
    let is_followed =
        source.left(end) == 0 || next_is_magic(source, end)? || proven(source, end, false)?.is_some();
    if is_attached || is_followed {
        return Ok(None);
    }
    Ok(find_record(source, offset + 1)?.filter(|found| *found < end))
}

/// The profile of the file's header; that of ROS 2 when it cannot be read.
pub(crate) fn profile(source: &mut Source) -> io::Result<String> {
    let offset = MAGIC.len() as u64;
    let Some(prefix) = proven(source, offset, false)? else { return Ok("ros2".to_owned()) };
    let body = source.bytes(offset + PREFIX_SIZE, prefix.length)?.unwrap_or_default();
    let header = Header::parse(body).filter(|_| prefix.opcode == HEADER);
    Ok(header.map_or("ros2", |header| header.profile).to_owned())
}

/// The first place at or after `from` where a record stands that proves itself by its own content.
pub(crate) fn find_record(source: &mut Source, from: u64) -> io::Result<Option<u64>> {
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

/// The record at `offset`, if it is whole and its body is what its opcode says. With `strict`, only what can
/// hardly stand anywhere by chance.
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
        ATTACHMENT => attachment_holds(source, body, prefix.length, strict)?,
        HEADER | SCHEMA | CHANNEL | METADATA if prefix.length <= LONGEST_WORDS => {
            if strict && is_too_slow(source, prefix.length) {
                return Ok(None);
            }
            let bytes = source.bytes(body, prefix.length)?.unwrap_or_default();
            let (parses, fills) = (parses(prefix.opcode, bytes, strict), fills(prefix.opcode, bytes, strict));
            // The format lets later versions add fields.
            fills || parses && follows(source, body + prefix.length)?
        }
        HEADER | SCHEMA | CHANNEL | METADATA => false,
        // A message says nothing of itself, nor does a record of unknown kind: what follows must be a record.
        MESSAGE => (22..=MAX_RECORD_SIZE).contains(&prefix.length) && follows(source, body + prefix.length)?,
        _ => follows(source, body + prefix.length)?,
    };
    Ok(holds.then_some(prefix))
}

fn parses(opcode: u8, body: &[u8], strict: bool) -> bool {
    match opcode {
        HEADER => Header::parse(body).is_some(),
        SCHEMA => Schema::parse(body).is_some(),
        CHANNEL => Channel::parse(body).is_some(),
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
            && length <= MAX_RECORD_SIZE
            && (size as u64).checked_add(header.compressed_size) == Some(length)
    }))
}

/// An attachment is as long as it says. A damaged one keeps its place, so that what follows is found; one
/// that is met by chance, or that would take much memory, must be intact.
fn attachment_holds(source: &mut Source, body: u64, length: u64, strict: bool) -> io::Result<bool> {
    let front = source.bytes(body, ATTACHMENT_FRONT.min(length))?.unwrap_or_default();
    let Some(own) = Attachment::parse_length(front).filter(|own| *own <= length) else { return Ok(false) };
    // The format lets later versions add fields.
    let fits = own == length || follows(source, body + length)?;
    if !fits || !strict && length <= MAX_CHUNK_SIZE {
        return Ok(fits);
    }
    let Some(sum) = source.bytes(body + own - 4, 4)?.and_then(|bytes| Fields(bytes).u32()) else {
        return Ok(false);
    };
    if sum == 0 {
        return Ok(length <= MAX_CHUNK_SIZE);
    }
    let mut hasher = crc32fast::Hasher::new();
    let is_read = !is_too_slow(source, own) && source.hash(&mut hasher, body, own - 4)?;
    Ok(is_read && hasher.finalize() == sum)
}

/// Whether a search has read so much already that it does not read so many bytes more.
fn is_too_slow(source: &Source, length: u64) -> bool {
    let maximum = source.size().saturating_mul(MAX_PASSES).saturating_add(1 << 26);
    source.hashed().saturating_add(length) > maximum
}

/// A message index is a channel and as many bytes of entries, 16 each, as it says.
fn index_holds(source: &mut Source, body: u64, length: u64) -> io::Result<bool> {
    let Some(front) = source.bytes(body, 6.min(length))? else { return Ok(false) };
    let count = front.get(2..6).and_then(|count| count.try_into().ok()).map(u32::from_le_bytes);
    Ok(length <= LONGEST_WORDS
        && count.is_some_and(|count| u64::from(count) + 6 == length && count.is_multiple_of(16)))
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
pub(crate) fn index_is_whole(source: &mut Source) -> io::Result<bool> {
    // Footer: prefix, 20 bytes; then the magic.
    let tail = PREFIX_SIZE + 20 + MAGIC.len() as u64;
    let Some(offset) = source.size().checked_sub(tail) else { return Ok(false) };
    let footer = source.prefix(offset)? == Some(Prefix { opcode: FOOTER, length: 20 });
    Ok(footer && next_is_magic(source, offset + PREFIX_SIZE + 20)?)
}

/// Whether the index is what the checksum in the footer says. True when there is no index, or no checksum of
/// it.
pub(crate) fn index_is_intact(source: &mut Source) -> io::Result<bool> {
    match footer(source)? {
        Some((0, _)) => Ok(true),
        Some((start, _)) => index_from_is_intact(source, start),
        None => Ok(false),
    }
}

/// Where the index begins, by the footer's word, and its checksum.
fn footer(source: &mut Source) -> io::Result<Option<(u64, u32)>> {
    let end = source.size().saturating_sub(MAGIC.len() as u64);
    let mut fields = Fields(source.bytes(end.saturating_sub(20), 20)?.unwrap_or_default());
    let (start, _offsets, sum) = (fields.u64(), fields.u64(), fields.u32());
    Ok(start.zip(sum))
}

/// The same of the index that begins at `start`, wherever the footer says that it does (MCAP specification,
/// "Footer": the checksum is that of all from the index's start up to itself).
pub(crate) fn index_from_is_intact(source: &mut Source, start: u64) -> io::Result<bool> {
    let Some((_, expected)) = footer(source)? else { return Ok(false) };
    if expected == 0 {
        return Ok(true);
    }
    let end = source.size().saturating_sub(MAGIC.len() as u64);
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
