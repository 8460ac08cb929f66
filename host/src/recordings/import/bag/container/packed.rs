//! Files and messages packed with zstd. A packed file is unpacked beside the output, under a name that is
//! gone as soon as it is open: what reads it wants to jump about in it.

use std::fs::{self, File};
use std::io::{self, BufRead, BufReader, Read, Seek, SeekFrom, Write};
use std::path::Path;

use biplane_recording::file_kind::KIND_BYTES;
use zstd::stream::read::Decoder;

use super::channel::LONGEST_MESSAGE;
use crate::recordings::import::bag::error::BagError;

const MAGIC: [u8; 4] = [0x28, 0xB5, 0x2F, 0xFD];

/// Whether bytes begin as a zstd frame does. No CDR message begins so, and no container.
pub(crate) fn is_packed(start: &[u8]) -> bool {
    start.starts_with(&MAGIC)
}

/// What a file begins with.
pub(crate) fn start_of(path: &Path) -> io::Result<Vec<u8>> {
    let mut start = Vec::new();
    File::open(path)?.take(KIND_BYTES).read_to_end(&mut start)?;
    Ok(start)
}

/// A decoder that cannot be made has read no byte yet: it lacks memory, whatever it says.
fn decoder<'a, R: BufRead>(packed: R) -> io::Result<Decoder<'a, R>> {
    Decoder::with_buffer(packed)
        .map_err(|_| io::Error::new(io::ErrorKind::OutOfMemory, "too little memory to unpack it"))
}

/// Back to a file's first byte.
fn rewind(file: &mut File) -> io::Result<()> {
    file.seek(SeekFrom::Start(0)).map(drop)
}

/// What a packed file begins with, unpacked.
pub(crate) fn unpacked_start_of(path: &Path) -> Result<Vec<u8>, BagError> {
    let failed = |source| BagError::Read { path: path.to_owned(), source };
    let mut start = Vec::new();
    let decoder = File::open(path).and_then(|file| decoder(BufReader::new(file))).map_err(failed)?;
    decoder.take(KIND_BYTES).read_to_end(&mut start).map_err(failed)?;
    Ok(start)
}

/// The file, or what it unpacks to.
pub(crate) fn open(path: &Path, spool: &Path) -> Result<File, BagError> {
    let failed = |source| BagError::Read { path: path.to_owned(), source };
    let start = start_of(path).map_err(failed)?;
    let mut file = File::open(path).map_err(failed)?;
    if !is_packed(&start) {
        return Ok(file);
    }
    rewind(&mut file).map_err(failed)?;
    unpack(file, spool).map_err(|source| BagError::Unpack { path: path.to_owned(), source })
}

fn unpack(file: File, spool: &Path) -> io::Result<File> {
    let name = spool.join(format!(".biplane-unpacked-{}", std::process::id()));
    let mut unpacked = File::options().read(true).write(true).create(true).truncate(true).open(&name)?;
    fs::remove_file(&name)?;
    let mut decoder = decoder(BufReader::new(file))?;
    match io::copy(&mut decoder, &mut unpacked) {
        // A file that is cut off is read as far as it goes.
        Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => {}
        copied => {
            copied?;
        }
    }
    unpacked.flush()?;
    rewind(&mut unpacked)?;
    Ok(unpacked)
}

/// A message's bytes, unpacked into `buffer` where they are packed.
pub(crate) fn message<'a>(bytes: &'a [u8], buffer: &'a mut Vec<u8>) -> io::Result<&'a [u8]> {
    if !is_packed(bytes) {
        return Ok(bytes);
    }
    buffer.clear();
    let decoder = decoder(bytes)?.single_frame();
    decoder.take(LONGEST_MESSAGE + 1).read_to_end(buffer)?;
    if buffer.len() as u64 > LONGEST_MESSAGE {
        return Err(io::Error::other(format!("a message that unpacks to over {LONGEST_MESSAGE} bytes")));
    }
    Ok(buffer)
}
