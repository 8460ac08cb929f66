//! The walk through a file that yields its messages, chunk by chunk.

use super::{Definitions, Entry, ReadError, Reader, Source};
use crate::mcap::chunk;
use crate::mcap::chunk::ChunkError;
use crate::mcap::records::{
    CHANNEL, CHUNK, ChunkHeader, DATA_END, FOOTER, Fields, Inner, MAGIC, MESSAGE, PREFIX_SIZE, SCHEMA,
};

/// All messages of a file, in file order. Ends after the first error.
pub struct Messages<'a> {
    reader: &'a Reader,
    source: Source<'a>,
    definitions: Definitions,
    /// Of everything before `offset`.
    hasher: crc32fast::Hasher,
    /// The next record of the file.
    offset: u64,
    /// The chunk that is being read: where it begins, its records, and how far they are read.
    chunk_offset: u64,
    chunk: Vec<u8>,
    chunk_position: usize,
    done: bool,
}

impl<'a> Messages<'a> {
    pub(crate) fn new(reader: &'a Reader) -> Self {
        let mut hasher = crc32fast::Hasher::new();
        hasher.update(&MAGIC);
        Self {
            reader,
            source: Source::new(&reader.file, reader.size),
            definitions: Definitions::default(),
            hasher,
            offset: MAGIC.len() as u64,
            chunk_offset: 0,
            chunk: Vec::new(),
            chunk_position: 0,
            done: false,
        }
    }

    /// The byte offset of the next record of the file: how far the reading has come.
    #[must_use]
    pub fn offset(&self) -> u64 {
        self.offset
    }

    fn damaged(&self, offset: u64, what: String) -> ReadError {
        self.reader.damaged(offset, what)
    }

    /// The next message of the chunk at hand; `None` at its end.
    fn next_in_chunk(&mut self) -> Result<Option<Entry>, ReadError> {
        let mut inner = Inner::at(&self.chunk, self.chunk_position);
        let mut taken = Ok(None);
        for (opcode, body) in inner.by_ref() {
            taken = self.definitions.take(opcode, body);
            if !matches!(taken, Ok(None)) {
                break;
            }
        }
        self.chunk_position = inner.position();
        let rest = inner.rest();
        match taken {
            Ok(None) if rest > 0 => {
                Err(self.damaged(self.chunk_offset, format!("its chunk ends inside a record ({rest} bytes)")))
            }
            Ok(entry) => Ok(entry),
            Err(problem) => Err(self.damaged(self.chunk_offset, problem.to_string())),
        }
    }

    /// Reads the next record of the file; [`Step::End`] at the end of the data.
    fn next_record(&mut self) -> Result<Step, ReadError> {
        let offset = self.offset;
        let prefix = self.reader.prefix(&mut self.source, offset)?;
        match prefix.opcode {
            DATA_END => return self.check_end(offset).map(|()| Step::End),
            FOOTER => return Err(self.damaged(offset, "the data does not end before the footer".to_owned())),
            _ => {}
        }
        self.offset += PREFIX_SIZE + prefix.length;
        if !matches!(prefix.opcode, CHUNK | SCHEMA | CHANNEL | MESSAGE) {
            return self.pass_over(offset).map(|()| Step::Next(None));
        }
        self.reader.check_size(offset, prefix)?;
        let whole = self.source.bytes(offset, PREFIX_SIZE + prefix.length);
        let whole = whole.map_err(|error| self.reader.io(offset, error))?.unwrap_or_default();
        self.hasher.update(whole);
        let body = whole.get(PREFIX_SIZE as usize..).unwrap_or_default();
        if prefix.opcode == CHUNK {
            self.chunk_offset = offset;
            self.chunk_position = 0;
            let opened = open_chunk(body, &mut self.chunk);
            return match opened {
                Ok(()) => Ok(Step::Next(None)),
                Err(ChunkError::Memory) => Err(self.reader.out_of_memory(offset)),
                Err(error) => Err(self.damaged(offset, error.to_string())),
            };
        }
        let taken = self.definitions.take(prefix.opcode, body);
        taken.map(Step::Next).map_err(|problem| self.damaged(offset, problem.to_string()))
    }

    /// Takes a record between `offset` and the next into the checksum, without holding it in memory.
    fn pass_over(&mut self, offset: u64) -> Result<(), ReadError> {
        let hashed = self.source.hash(&mut self.hasher, offset, self.offset - offset);
        match hashed.map_err(|error| self.reader.io(offset, error))? {
            true => Ok(()),
            false => Err(self.reader.truncated(offset)),
        }
    }

    /// At the end of the data, the checksum of all that came before tells of changed bytes that no chunk's
    /// own checksum covers.
    fn check_end(&mut self, offset: u64) -> Result<(), ReadError> {
        let (_, body) = self.reader.record(&mut self.source, offset)?;
        let found = self.hasher.clone().finalize();
        match Fields(body).u32() {
            Some(expected) if expected == 0 || expected == found => Ok(()),
            Some(expected) => {
                let what = format!("checksum of all before is {found:08x}, {expected:08x} was recorded");
                Err(self.damaged(offset, what))
            }
            None => Err(self.damaged(offset, "end of data that cannot be read".to_owned())),
        }
    }

    fn step(&mut self) -> Result<Step, ReadError> {
        match self.next_in_chunk()? {
            Some(entry) => Ok(Step::Next(Some(entry))),
            None => self.next_record(),
        }
    }
}

enum Step {
    Next(Option<Entry>),
    End,
}

fn open_chunk(body: &[u8], out: &mut Vec<u8>) -> Result<(), ChunkError> {
    let (header, size) =
        ChunkHeader::parse(body).ok_or(ChunkError::Header("a chunk whose header cannot be read"))?;
    let packed = body.get(size..).filter(|packed| packed.len() as u64 == header.compressed_size);
    let packed = packed.ok_or(ChunkError::Header("a chunk whose length is not that of its bytes"))?;
    chunk::unpack(&header, packed, out)
}

impl Iterator for Messages<'_> {
    type Item = Result<Entry, ReadError>;

    fn next(&mut self) -> Option<Self::Item> {
        while !self.done {
            match self.step() {
                Ok(Step::Next(Some(entry))) => return Some(Ok(entry)),
                Ok(Step::Next(None)) => {}
                Ok(Step::End) => self.done = true,
                Err(error) => {
                    self.done = true;
                    return Some(Err(error));
                }
            }
        }
        None
    }
}
