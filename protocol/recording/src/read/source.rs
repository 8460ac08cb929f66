//! A file read by position through one buffer, which grows to the longest piece asked for: a chunk.

use crate::records::{PREFIX_SIZE, Prefix};
use std::fs::File;
use std::io;
use std::os::unix::fs::FileExt;

const WINDOW: u64 = 1 << 16;

/// The bytes of a file of known size.
pub(crate) struct Source<'a> {
    file: &'a File,
    size: u64,
    buffer: Vec<u8>,
    start: u64,
}

impl<'a> Source<'a> {
    pub fn new(file: &'a File, size: u64) -> Self {
        Self { file, size, buffer: Vec::new(), start: 0 }
    }

    /// The file's size.
    pub fn size(&self) -> u64 {
        self.size
    }

    /// Bytes between a position and the file's end.
    pub fn left(&self, offset: u64) -> u64 {
        self.size.saturating_sub(offset)
    }

    /// `length` bytes from `offset`; `None` when the file ends before.
    pub fn bytes(&mut self, offset: u64, length: u64) -> io::Result<Option<&[u8]>> {
        let end = match offset.checked_add(length) {
            Some(end) if end <= self.size => end,
            _ => return Ok(None),
        };
        if offset < self.start || end > self.start + self.buffer.len() as u64 {
            let span = length.max(WINDOW).min(self.left(offset));
            self.buffer.resize(span as usize, 0);
            self.start = offset;
            if let Err(error) = self.file.read_exact_at(&mut self.buffer, offset) {
                self.buffer.clear();
                return Err(error);
            }
        }
        let from = (offset - self.start) as usize;
        Ok(self.buffer.get(from..from + length as usize))
    }

    /// The record that begins at `offset`: opcode and length; `None` when the file ends before its length is told.
    pub fn prefix(&mut self, offset: u64) -> io::Result<Option<Prefix>> {
        let bytes = self.bytes(offset, PREFIX_SIZE)?;
        Ok(bytes.and_then(|bytes| bytes.try_into().ok()).map(Prefix::parse))
    }

    /// Adds a stretch of the file to a checksum, a piece at a time. False when the file ends before.
    pub fn hash(&mut self, hasher: &mut crc32fast::Hasher, offset: u64, length: u64) -> io::Result<bool> {
        let mut done = 0;
        while done < length {
            let piece = WINDOW.min(length - done);
            match self.bytes(offset.saturating_add(done), piece)? {
                Some(bytes) => hasher.update(bytes),
                None => return Ok(false),
            }
            done += piece;
        }
        Ok(true)
    }
}
