//! A file read by position through one buffer, which grows to the longest piece asked for: a chunk.

use crate::mcap::records::{PREFIX_SIZE, Prefix};
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
    hashed: u64,
}

impl<'a> Source<'a> {
    pub(crate) fn new(file: &'a File, size: u64) -> Self {
        Self { file, size, buffer: Vec::new(), start: 0, hashed: 0 }
    }

    /// The file's size.
    pub(crate) fn size(&self) -> u64 {
        self.size
    }

    /// How many bytes went through checksums so far.
    pub(crate) fn hashed(&self) -> u64 {
        self.hashed
    }

    /// Bytes between a position and the file's end.
    pub(crate) fn left(&self, offset: u64) -> u64 {
        self.size.saturating_sub(offset)
    }

    /// `length` bytes from `offset`; `None` when the file ends before.
    pub(crate) fn bytes(&mut self, offset: u64, length: u64) -> io::Result<Option<&[u8]>> {
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

    /// The record that begins at `offset`: opcode and length; `None` when the file ends before its length is
    /// told.
    pub(crate) fn prefix(&mut self, offset: u64) -> io::Result<Option<Prefix>> {
        let bytes = self.bytes(offset, PREFIX_SIZE)?;
        Ok(bytes.and_then(|bytes| bytes.try_into().ok()).map(Prefix::parse))
    }

    /// Adds a stretch of the file to a checksum, a piece at a time. False when the file ends before.
    pub(crate) fn hash(
        &mut self,
        hasher: &mut crc32fast::Hasher,
        offset: u64,
        length: u64,
    ) -> io::Result<bool> {
        let mut done = 0;
        self.hashed = self.hashed.saturating_add(length);
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

#[cfg(test)]
mod tests {
    use super::{Source, WINDOW};
    use std::os::unix::fs::FileExt;

    #[test]
    fn every_stretch_is_what_stands_in_the_file() {
        let size = WINDOW * 3 + 17;
        let bytes: Vec<u8> = (0..size).map(|place| (place * 7 + place / 251) as u8).collect();
        let path = std::env::temp_dir().join(format!("biplane-source-{}", std::process::id()));
        let file =
            std::fs::File::options().read(true).write(true).create(true).truncate(true).open(&path).unwrap();
        std::fs::remove_file(&path).unwrap();
        file.write_all_at(&bytes, 0).unwrap();
        let mut source = Source::new(&file, size);
        let near = |place: u64| place.saturating_sub(2)..=place + 2;
        let places = || [0, 100, WINDOW, WINDOW + 100, 2 * WINDOW, size].into_iter().flat_map(near);
        for from in places() {
            for to in places() {
                // From a fresh place each time, so that windows begin everywhere.
                let _ = source.bytes(from / 2, 1);
                let length = to.saturating_sub(from);
                let found = source.bytes(from, length).unwrap();
                assert_eq!(found, bytes.get(from as usize..(from + length) as usize), "{from} {length}");
                let end = from.saturating_sub(from / 2 + 3);
                let again = source.bytes(from / 2, end).unwrap();
                assert_eq!(again, bytes.get((from / 2) as usize..(from / 2 + end) as usize));
            }
        }
        assert_eq!(source.bytes(u64::MAX, 2).unwrap(), None);
    }
}
