//! The log of an SQLite file that its writer did not close (`NAME-wal`): newer pages, in frames, as far as
//! the last frame that ends a transaction.

use std::collections::BTreeMap;
use std::ffi::OsString;
use std::fs::File;
use std::io;
use std::os::unix::fs::FileExt;
use std::path::{Path, PathBuf};

const HEADER_SIZE: u64 = 32;
const FRAME_HEADER_SIZE: usize = 24;
/// The number that a log begins with; its last bit says how the sums read their words.
const MAGIC: u32 = 0x377F_0682;

/// Newest places of pages in a log.
#[derive(Debug)]
pub(crate) struct Log {
    file: File,
    places: BTreeMap<u32, u64>,
    pages: u32,
}

impl Log {
    /// The log beside a file; `None` when there is none, or nothing in it counts.
    pub(crate) fn beside(path: &Path, page: usize) -> io::Result<Option<Self>> {
        let mut name = OsString::from(path);
        name.push("-wal");
        let file = match File::open(PathBuf::from(name)) {
            Ok(file) => file,
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
            Err(error) => return Err(error),
        };
        let mut header = [0; HEADER_SIZE as usize];
        if file.metadata()?.len() < HEADER_SIZE {
            return Ok(None);
        }
        file.read_exact_at(&mut header, 0)?;
        let big_endian = match word(&header, 0) {
            MAGIC => false,
            magic if magic == MAGIC + 1 => true,
            _ => return Ok(None),
        };
        let sum = sum([0; 2], &header[..24], big_endian);
        if word(&header, 8) as usize != page || sum != [word(&header, 24), word(&header, 28)] {
            return Ok(None);
        }
        let (places, pages) = frames(&file, page, &header, big_endian, sum)?;
        Ok((!places.is_empty()).then_some(Self { file, places, pages }))
    }

    /// Where the newest bytes of a page stand.
    pub(crate) fn place_of(&self, page: u32) -> Option<(&File, u64)> {
        self.places.get(&page).map(|&offset| (&self.file, offset))
    }

    /// Pages of the file after the last transaction.
    pub(crate) fn last_page(&self) -> u32 {
        self.pages
    }
}

/// Places of all pages up to the last frame that ends a transaction, and how many pages there are then.
fn frames(
    file: &File,
    page: usize,
    header: &[u8],
    big_endian: bool,
    mut running: [u32; 2],
) -> io::Result<(BTreeMap<u32, u64>, u32)> {
    let (mut places, mut open, mut pages) = (BTreeMap::new(), Vec::new(), 0);
    let mut frame = vec![0; FRAME_HEADER_SIZE + page];
    let mut offset = HEADER_SIZE;
    loop {
        match file.read_exact_at(&mut frame, offset) {
            Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => break,
            read => read?,
        }
        running = sum(running, &frame[..8], big_endian);
        running = sum(running, &frame[FRAME_HEADER_SIZE..], big_endian);
        let is_of_this_log = frame[8..16] == header[16..24];
        if !is_of_this_log || running != [word(&frame, 16), word(&frame, 20)] {
            break;
        }
        open.push((word(&frame, 0), offset + FRAME_HEADER_SIZE as u64));
        let pages_after = word(&frame, 4);
        if pages_after > 0 {
            places.extend(open.drain(..));
            pages = pages_after;
        }
        offset += frame.len() as u64;
    }
    Ok((places, pages))
}

fn word(bytes: &[u8], at: usize) -> u32 {
    bytes.get(at..at + 4).and_then(|four| four.try_into().ok()).map_or(0, u32::from_be_bytes)
}

/// The log's running sum over pairs of words.
fn sum([mut first, mut second]: [u32; 2], bytes: &[u8], big_endian: bool) -> [u32; 2] {
    let word = |four: &[u8]| {
        let four = four.try_into().unwrap_or([0; 4]);
        if big_endian { u32::from_be_bytes(four) } else { u32::from_le_bytes(four) }
    };
    for pair in bytes.chunks_exact(8) {
        first = first.wrapping_add(word(&pair[..4])).wrapping_add(second);
        second = second.wrapping_add(word(&pair[4..])).wrapping_add(first);
    }
    [first, second]
}
