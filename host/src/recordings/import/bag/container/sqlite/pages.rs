//! The pages of an SQLite file: equal pieces counted from 1, those of its log before its own.

use std::fs::File;
use std::io;
use std::os::unix::fs::FileExt;
use std::path::Path;

use super::wal::Log;

/// How a file begins.
pub(crate) const MAGIC: &[u8] = b"SQLite format 3\0";

/// Why something of a file cannot be read: a sentence without the file's name.
pub(crate) type Damage = String;

/// Bytes of the file's header, which the first page begins with.
pub(crate) const HEADER_SIZE: usize = 100;
const UTF_8: u32 = 1;

/// Pages of a file.
#[derive(Debug)]
pub(crate) struct Pages<'a> {
    file: &'a File,
    log: Option<Log>,
    /// Bytes of a page.
    pub size: usize,
    /// Bytes of a page that hold data.
    pub usable: usize,
    /// How many.
    pub count: u32,
}

impl<'a> Pages<'a> {
    /// Of a file, and of the log that lies beside it if its recorder did not close it. The inner error says
    /// what the file is.
    pub(crate) fn open(file: &'a File, path: &Path) -> io::Result<Result<Self, Damage>> {
        let mut header = [0; HEADER_SIZE];
        let size = file.metadata()?.len();
        if size < HEADER_SIZE as u64 {
            return Ok(Err("is cut off in its header".to_owned()));
        }
        file.read_exact_at(&mut header, 0)?;
        let encoding = u32::from_be_bytes([header[56], header[57], header[58], header[59]]);
        let page = match u16::from_be_bytes([header[16], header[17]]) {
            1 => 65536,
            size => usize::from(size),
        };
        let usable = page.saturating_sub(usize::from(header[20]));
        let is_sound = header.starts_with(MAGIC) && page >= 512 && page.is_power_of_two() && usable >= 480;
        if !is_sound || encoding > UTF_8 {
            let found = format!("has pages of {page} bytes, {usable} usable, and text encoding {encoding}");
            return Ok(Err(found));
        }
        let log = Log::beside(path, page)?;
        let own = size.div_ceil(page as u64).min(u64::from(u32::MAX)) as u32;
        let count = log.as_ref().map_or(own, |log| log.last_page().max(own));
        Ok(Ok(Self { file, log, size: page, usable, count }))
    }

    /// A page's bytes. The file's end may cut it.
    pub(crate) fn page(&self, number: u32) -> Result<Vec<u8>, Damage> {
        if number == 0 || number > self.count {
            return Err(format!("page {number} of {}", self.count));
        }
        let mut bytes = vec![0; self.size];
        let read = match self.log.as_ref().and_then(|log| log.place_of(number)) {
            Some((log, offset)) => log.read_exact_at(&mut bytes, offset),
            None => self.file.read_exact_at(&mut bytes, u64::from(number - 1) * self.size as u64),
        };
        match read {
            Ok(()) => Ok(bytes),
            Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => {
                Err(format!("the file is cut off in page {number} of {}", self.count))
            }
            Err(error) => Err(format!("page {number}: {error}")),
        }
    }
}
