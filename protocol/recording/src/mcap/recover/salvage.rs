//! Takes what is intact out of each stretch of a broken file, and notes what is not.

use super::finding::{Finding, Problem};
use super::hole::{hole_in, written};
use super::walk::{self, Piece, Walk};
use super::{RecoverError, RecoverReport};
use crate::mcap::chunk;
use crate::mcap::chunk::{ChunkError, MAX_CHUNK_SIZE};
use crate::mcap::read::{Definitions, Entry, Problem as Unreadable, ReadError, Source};
use crate::mcap::records::{
    ATTACHMENT, Attachment, CHANNEL, CHUNK, ChunkHeader, DATA_END, FOOTER, Fields, Inner, MAGIC, MESSAGE,
    MESSAGE_INDEX, METADATA, Message, Metadata, PREFIX_SIZE, Prefix, SCHEMA,
};
use crate::mcap::write::{WriteError, Writer};
use std::fs::File;
use std::io;
use std::path::Path;

/// Enough of a chunk for its header.
const CHUNK_FRONT: u64 = 1 << 12;

/// A recovery at work.
pub(crate) struct Salvage<'a> {
    input: &'a Path,
    file: &'a File,
    size: u64,
    definitions: Definitions,
    /// Definitions from all over the file, the index included; read when a message's channel is not known.
    fallback: Option<Definitions>,
    writer: Writer,
    report: RecoverReport,
    hasher: crc32fast::Hasher,
    unpacked: Vec<u8>,
    /// The finding of the chunk just before, if it was damaged, and how many messages its index has named so
    /// far.
    damaged: Option<(usize, u64)>,
}

/// What became of the messages in a stretch.
#[derive(Default)]
struct Tally {
    kept: u64,
    lost: u64,
    /// Bytes that the stretch should have had and the file has not.
    missing: u64,
    what: Option<String>,
}

impl<'a> Salvage<'a> {
    pub(super) fn new(input: &'a Path, file: &'a File, size: u64, writer: Writer) -> Self {
        let mut hasher = crc32fast::Hasher::new();
        hasher.update(&MAGIC);
        Self {
            input,
            file,
            size,
            definitions: Definitions::default(),
            fallback: None,
            writer,
            report: RecoverReport::default(),
            hasher,
            unpacked: Vec::new(),
            damaged: None,
        }
    }

    fn io(&self, offset: u64, source: io::Error) -> RecoverError {
        ReadError::Io { path: self.input.to_owned(), offset, source }.into()
    }

    fn note(&mut self, offset: u64, bytes: u64, tally: &Tally, problem: Problem) {
        let Tally { kept: kept_messages, lost: lost_messages, missing: missing_bytes, .. } = *tally;
        let chunk = matches!(problem, Problem::DamagedChunk { .. } | Problem::TornChunk);
        self.damaged = chunk.then_some((self.report.findings.len(), 0));
        self.report.findings.push(Finding {
            offset,
            bytes,
            missing_bytes,
            kept_messages,
            lost_messages,
            problem,
        });
    }

    /// Goes through the whole file.
    pub(super) fn run(&mut self, mut walk: Walk) -> Result<(), RecoverError> {
        let mut offset = 0;
        loop {
            let piece = walk.next().map_err(|error| self.io(offset, error))?;
            let source = walk.source();
            match piece {
                None => {
                    self.note(self.size, 0, &Tally::default(), Problem::NoEnd);
                    return Ok(());
                }
                Some(Piece::Broken { offset: at, end }) => {
                    offset = end;
                    self.broken(source, at, end)?;
                }
                Some(Piece::Record { offset: at, prefix }) => {
                    offset = at + PREFIX_SIZE + prefix.length;
                    if matches!(prefix.opcode, DATA_END | FOOTER) {
                        return self.end(source, at, prefix);
                    }
                    self.record(source, at, prefix)?;
                }
            }
        }
    }

    /// Closes the new file.
    pub(super) fn finish(mut self) -> Result<RecoverReport, WriteError> {
        self.report.messages = self.writer.messages();
        self.writer.finish()?;
        Ok(self.report)
    }

    fn record(&mut self, source: &mut Source, offset: u64, prefix: Prefix) -> Result<(), RecoverError> {
        if !matches!(prefix.opcode, SCHEMA..=MESSAGE_INDEX | ATTACHMENT | METADATA) {
            // Nothing that is kept, and as long as it likes.
            let hashed = source.hash(&mut self.hasher, offset, PREFIX_SIZE + prefix.length);
            self.damaged = None;
            return hashed.map(drop).map_err(|error| self.io(offset, error));
        }
        let whole = source.bytes(offset, PREFIX_SIZE + prefix.length);
        let whole = whole.map_err(|error| self.io(offset, error))?.unwrap_or_default();
        self.hasher.update(whole);
        let body = whole.get(PREFIX_SIZE as usize..).unwrap_or_default();
        if prefix.opcode != MESSAGE_INDEX {
            self.damaged = None;
        }
        match prefix.opcode {
            CHUNK => self.chunk(offset, body),
            ATTACHMENT => self.attachment(offset, body),
            METADATA => self.metadata(body),
            MESSAGE_INDEX => {
                self.count_lost(body);
                Ok(())
            }
            opcode => {
                let mut tally = Tally::default();
                self.take(opcode, body, &mut tally)?;
                self.note_tally(offset, whole.len() as u64, tally);
                Ok(())
            }
        }
    }

    /// Notes records that could not be kept though their place is intact.
    fn note_tally(&mut self, offset: u64, bytes: u64, mut tally: Tally) {
        if let Some(what) = tally.what.take() {
            self.note(offset, bytes, &tally, Problem::DamagedRecord { what });
        }
    }

    fn attachment(&mut self, offset: u64, body: &[u8]) -> Result<(), RecoverError> {
        match Attachment::parse(body) {
            Some(attachment) if attachment.intact => {
                self.writer.copy_attachment(&attachment)?;
                self.report.attachments += 1;
            }
            _ => self.note(offset, body.len() as u64, &Tally::default(), Problem::DamagedAttachment),
        }
        Ok(())
    }

    fn metadata(&mut self, body: &[u8]) -> Result<(), RecoverError> {
        if let Some(Metadata { name, values }) = Metadata::parse(body) {
            self.writer.metadata(name, &values)?;
            self.report.metadata += 1;
        }
        Ok(())
    }

    /// A chunk that has its full length.
    fn chunk(&mut self, offset: u64, body: &[u8]) -> Result<(), RecoverError> {
        let Some((header, size)) = ChunkHeader::parse(body) else {
            self.note(offset, body.len() as u64, &Tally::default(), Problem::NoRecord);
            return Ok(());
        };
        let packed = body.get(size..).unwrap_or_default();
        let mut unpacked = std::mem::take(&mut self.unpacked);
        let result = match chunk::unpack(&header, packed, &mut unpacked) {
            Ok(()) => {
                self.report.chunks += 1;
                let mut tally = Tally::default();
                let kept = self.messages(&unpacked, None, &mut tally);
                self.note_tally(offset, 0, tally);
                kept
            }
            Err(ChunkError::Memory) => Err(self.io(offset, io::ErrorKind::OutOfMemory.into())),
            Err(error) => self.damaged_chunk(offset, (&header, size), packed, &mut unpacked, &error),
        };
        self.unpacked = unpacked;
        result
    }

    /// Keeps what lies before a hole; without one, nothing of a damaged chunk can be told good from bad.
    fn damaged_chunk(
        &mut self,
        offset: u64,
        (header, size): (&ChunkHeader, usize),
        packed: &[u8],
        unpacked: &mut Vec<u8>,
        error: &ChunkError,
    ) -> Result<(), RecoverError> {
        let mut tally = Tally::default();
        let Some(hole) = hole_in(header, packed, offset + PREFIX_SIZE + size as u64) else {
            let what = error.to_string();
            self.note(offset, packed.len() as u64, &tally, Problem::DamagedChunk { what });
            return Ok(());
        };
        let front = packed.get(..hole).unwrap_or_default();
        self.prefix_of_chunk(offset, header, front, unpacked, &mut tally)?;
        self.note(offset, (packed.len() - hole) as u64, &tally, Problem::TornChunk);
        Ok(())
    }

    /// Keeps the messages at a chunk's front.
    fn prefix_of_chunk(
        &mut self,
        offset: u64,
        header: &ChunkHeader,
        packed: &[u8],
        unpacked: &mut Vec<u8>,
        tally: &mut Tally,
    ) -> Result<(), RecoverError> {
        // A chunk that was being written may not know its size yet.
        let limit = header.uncompressed_size.min(MAX_CHUNK_SIZE);
        // That it ends early is known.
        if chunk::unpack_prefix(&header.compression, packed, limit, unpacked) == Err(ChunkError::Memory) {
            return Err(self.io(offset, io::ErrorKind::OutOfMemory.into()));
        }
        self.messages(unpacked, Some(header), tally)
    }

    /// Bytes where no whole record is: perhaps a chunk that was cut off, or whose length is damaged.
    fn broken(&mut self, source: &mut Source, offset: u64, end: u64) -> Result<(), RecoverError> {
        let front = source.bytes(offset, (end - offset).min(CHUNK_FRONT));
        let front = front.map_err(|error| self.io(offset, error))?.unwrap_or_default();
        let mut tally = Tally { missing: self.missing(front, offset), ..Tally::default() };
        let body = front.get(PREFIX_SIZE as usize..).unwrap_or_default();
        let header = ChunkHeader::parse(body).filter(|_| front.first() == Some(&CHUNK));
        let Some((header, size)) = header else {
            self.note(offset, end - offset, &tally, Problem::NoRecord);
            return Ok(());
        };
        let before = PREFIX_SIZE + size as u64;
        let packed = header.compressed_size.min(MAX_CHUNK_SIZE).min(end - offset - before);
        let packed = source.bytes(offset + before, packed);
        let packed = packed.map_err(|error| self.io(offset, error))?.unwrap_or_default();
        let start = offset + before;
        let mut unpacked = std::mem::take(&mut self.unpacked);
        let result = match chunk::unpack(&header, packed, &mut unpacked) {
            Ok(()) => {
                self.report.chunks += 1;
                let kept = self.messages(&unpacked, None, &mut tally);
                let what = "the length of a chunk is damaged".to_owned();
                self.note(offset, 0, &tally, Problem::DamagedRecord { what });
                kept
            }
            Err(ChunkError::Memory) => Err(self.io(offset, io::ErrorKind::OutOfMemory.into())),
            Err(error)
                if end < self.size || error.is_damage() || hole_in(&header, packed, start).is_some() =>
            {
                self.damaged_chunk(offset, (&header, size), packed, &mut unpacked, &error)
            }
            Err(_cut) => {
                let kept = self.prefix_of_chunk(offset, &header, written(packed), &mut unpacked, &mut tally);
                let unused = if tally.kept > 0 { 0 } else { end - offset };
                self.note(offset, unused, &tally, Problem::CutChunk);
                kept
            }
        };
        self.unpacked = unpacked;
        result
    }

    /// How many bytes of a record that the file ends in are not there, if its length can be believed.
    fn missing(&self, bytes: &[u8], offset: u64) -> u64 {
        let prefix =
            bytes.get(..PREFIX_SIZE as usize).and_then(|prefix| prefix.try_into().ok()).map(Prefix::parse);
        let length = prefix.map_or(0, |prefix| prefix.length);
        let left = self.size.saturating_sub(offset + PREFIX_SIZE);
        if length < MAX_CHUNK_SIZE { length.saturating_sub(left) } else { 0 }
    }

    /// Keeps the messages among a chunk's records. Those of a chunk that no checksum covers (`unproven`) must
    /// lie within its times and be what their type says.
    fn messages(
        &mut self,
        records: &[u8],
        unproven: Option<&ChunkHeader>,
        tally: &mut Tally,
    ) -> Result<(), RecoverError> {
        for (opcode, body) in Inner::at(records, 0) {
            match unproven {
                Some(header) if !self.plausible(opcode, body, header) => return Ok(()),
                _ => self.take(opcode, body, tally)?,
            }
        }
        Ok(())
    }

    fn plausible(&mut self, opcode: u8, body: &[u8], header: &ChunkHeader) -> bool {
        let Some(message) = Message::parse(body).filter(|_| opcode == MESSAGE) else {
            return true;
        };
        // A chunk that was being written knows neither its size nor its times yet.
        let known = header.uncompressed_size < MAX_CHUNK_SIZE;
        let within = !known || (header.start_time..=header.end_time).contains(&message.log_time);
        let decodes = match self.definitions.take(opcode, body) {
            Ok(Some(entry)) => entry.decode().is_ok(),
            _ => true,
        };
        within && decodes
    }

    /// Keeps one record.
    fn take(&mut self, opcode: u8, body: &[u8], tally: &mut Tally) -> Result<(), RecoverError> {
        let mut taken = self.definitions.take(opcode, body);
        if matches!(taken, Err(Unreadable::UnknownChannel(_))) {
            taken = self.fallback()?.take(opcode, body);
        }
        match taken {
            Ok(Some(entry)) => self.keep(&entry, tally)?,
            Ok(None) => {}
            Err(problem) => {
                tally.lost += u64::from(opcode == MESSAGE);
                tally.what.get_or_insert_with(|| problem.to_string());
            }
        }
        Ok(())
    }

    fn keep(&mut self, entry: &Entry, tally: &mut Tally) -> Result<(), RecoverError> {
        self.writer.copy_exactly(entry)?;
        tally.kept += 1;
        Ok(())
    }

    /// Every definition in the index at the end, if that is what was written: a damaged name would pass for
    /// another topic.
    fn fallback(&mut self) -> Result<&mut Definitions, RecoverError> {
        if self.fallback.is_none() {
            let mut all = Definitions::default();
            let mut walk = Walk::new(Source::new(self.file, self.size), MAGIC.len() as u64);
            let mut in_index = false;
            while let Some(piece) = walk.next().map_err(|error| self.io(0, error))? {
                let Piece::Record { offset, prefix } = piece else { continue };
                let source = walk.source();
                let (body, length) = (offset + PREFIX_SIZE, prefix.length);
                if prefix.opcode == DATA_END {
                    // Bytes that are gone before it move it, and do it no harm.
                    let intact = walk::index_from_is_intact(source, body + length);
                    in_index = intact.map_err(|error| self.io(offset, error))?;
                } else if in_index && matches!(prefix.opcode, SCHEMA | CHANNEL) {
                    let body = source.bytes(body, length).map_err(|error| self.io(offset, error))?;
                    // One that cannot be read defines nothing.
                    let _ = all.take(prefix.opcode, body.unwrap_or_default());
                }
            }
            self.fallback = Some(all);
        }
        Ok(self.fallback.get_or_insert_with(Definitions::default))
    }

    /// The index behind a damaged chunk tells how many messages were in it.
    fn count_lost(&mut self, body: &[u8]) {
        let Some((number, indexed)) = &mut self.damaged else { return };
        let mut fields = Fields(body);
        *indexed += fields.take(2).and_then(|_channel| fields.u32()).map_or(0, |bytes| u64::from(bytes) / 16);
        if let Some(finding) = self.report.findings.get_mut(*number) {
            finding.lost_messages = indexed.saturating_sub(finding.kept_messages);
        }
    }

    fn end(&mut self, source: &mut Source, offset: u64, prefix: Prefix) -> Result<(), RecoverError> {
        let body = source.bytes(offset + PREFIX_SIZE, prefix.length);
        let expected = body.map_err(|error| self.io(offset, error))?.and_then(|body| Fields(body).u32());
        let found = self.hasher.clone().finalize();
        let nothing = Tally::default();
        if prefix.opcode == FOOTER {
            let what = "the end of the data is not marked".to_owned();
            self.note(offset, 0, &nothing, Problem::DamagedRecord { what });
        } else if self.report.findings.is_empty() && expected.is_some_and(|crc| crc != 0 && crc != found) {
            self.note(offset, 0, &nothing, Problem::Checksum);
        }
        if !walk::index_is_whole(source).map_err(|error| self.io(offset, error))? {
            self.note(offset, 0, &nothing, Problem::NoIndex);
        } else if !walk::index_is_intact(source).map_err(|error| self.io(offset, error))? {
            self.note(offset, 0, &nothing, Problem::DamagedIndex);
        }
        Ok(())
    }
}
