//! What is in a chunk: its compressed bytes unpacked, within bounds, whole or as far as they go.

use crate::mcap::records::ChunkHeader;
use std::cell::Cell;
use std::io::Read;
use zstd::stream::read::Decoder;
use zstd::zstd_safe::DCtx;

/// The most that a chunk may unpack to. ROS 2 bags and ours stay near 1 MiB; a file that claims more than
/// this is broken or hostile.
pub(crate) const MAX_CHUNK_SIZE: u64 = 1 << 28;
/// The most that a record other than an attachment takes in a file: a chunk that does not pack, and its
/// header.
pub(crate) const MAX_RECORD_SIZE: u64 = MAX_CHUNK_SIZE + (1 << 16);

/// Why a chunk's bytes could not be had.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) enum ChunkError {
    /// Its header or its length cannot be.
    Header(&'static str),
    /// Neither zstd, lz4 nor plain.
    Compression(String),
    /// It claims to unpack to so many bytes, above [`MAX_CHUNK_SIZE`].
    TooLarge(u64),
    /// There is too little memory to unpack them. They may be intact.
    Memory,
    /// The compressed bytes are broken or end early.
    Corrupt(String),
    /// It unpacked to another size than its header says.
    Size { expected: u64, found: u64 },
    /// The bytes are not those that were written.
    Checksum { expected: u32, found: u32 },
}

impl ChunkError {
    /// True when bytes were changed, false when they may merely end early.
    pub(crate) fn is_damage(&self) -> bool {
        match self {
            Self::Header(_) | Self::Compression(_) | Self::Checksum { .. } => true,
            Self::Size { expected, found } => found > expected,
            Self::TooLarge(_) | Self::Memory | Self::Corrupt(_) => false,
        }
    }
}

impl std::fmt::Display for ChunkError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Header(what) => f.write_str(what),
            Self::Compression(name) => {
                write!(f, "compression {name:?} is not known (zstd, lz4 and none are)")
            }
            Self::TooLarge(size) => write!(f, "chunk of {size} bytes; at most {MAX_CHUNK_SIZE} are taken"),
            Self::Memory => write!(f, "too little memory to unpack it"),
            Self::Corrupt(what) => write!(f, "compressed bytes are broken: {what}"),
            Self::Size { expected, found } => {
                write!(f, "chunk of {found} bytes where {expected} were announced")
            }
            Self::Checksum { expected, found } => {
                write!(f, "checksum of the chunk is {found:08x}, {expected:08x} was recorded")
            }
        }
    }
}

/// Unpacks as far as the bytes go, to `limit` bytes at most; an error says why no further. `out` is replaced.
pub(crate) fn unpack_prefix(
    compression: &str,
    packed: &[u8],
    limit: u64,
    out: &mut Vec<u8>,
) -> Result<(), ChunkError> {
    out.clear();
    if limit > MAX_CHUNK_SIZE {
        return Err(ChunkError::TooLarge(limit));
    }
    let corrupt = |error: std::io::Error| unpack_error(&error);
    // A decoder that cannot even be made has read no byte yet: it lacks memory, whatever it says.
    match compression {
        "" => packed.take(limit).read_to_end(out).map(drop).map_err(corrupt),
        "zstd" => {
            let mut context = CONTEXT.take().or_else(DCtx::try_create).ok_or(ChunkError::Memory)?;
            let decoder = Decoder::with_context(packed, &mut context).single_frame();
            decoder.take(limit).read_to_end(out).map_err(corrupt)?;
            if context.sizeof() <= MAX_CONTEXT_SIZE {
                CONTEXT.set(Some(context));
            }
            Ok(())
        }
        "lz4" => {
            let decoder = lz4::Decoder::new(packed).map_err(|_| ChunkError::Memory)?;
            decoder.take(limit).read_to_end(out).map(drop).map_err(corrupt)
        }
        other => Err(ChunkError::Compression(other.to_owned())),
    }
}

thread_local! {
    /// What zstd unpacks with. Made anew for each chunk it takes a third of the time of unpacking.
    static CONTEXT: Cell<Option<DCtx<'static>>> = const { Cell::new(None) };
}

/// A context that a chunk made larger than this is not kept, bytes.
const MAX_CONTEXT_SIZE: usize = 1 << 23;

/// What the libraries' words for too little memory have in common.
const LACKS_MEMORY: [&str; 3] = ["not enough memory", "allocation_failed", "could not allocate"];

/// The libraries of zstd and lz4 say in words alone that they could not allocate: "Allocation error :
/// not enough memory", "ERROR_allocation_failed", "zstd could not allocate a decompression context".
fn unpack_error(error: &std::io::Error) -> ChunkError {
    let text = error.to_string();
    let is_memory = error.kind() == std::io::ErrorKind::OutOfMemory
        || LACKS_MEMORY.iter().any(|words| text.contains(words));
    if is_memory { ChunkError::Memory } else { ChunkError::Corrupt(text) }
}

/// Unpacks a whole chunk and checks size and checksum. `out` is replaced.
pub(crate) fn unpack(header: &ChunkHeader, packed: &[u8], out: &mut Vec<u8>) -> Result<(), ChunkError> {
    if header.uncompressed_size >= MAX_CHUNK_SIZE {
        return Err(ChunkError::TooLarge(header.uncompressed_size));
    }
    // One byte more than announced, to notice when there is more.
    unpack_prefix(&header.compression, packed, header.uncompressed_size + 1, out)?;
    let found = out.len() as u64;
    if found != header.uncompressed_size {
        return Err(ChunkError::Size { expected: header.uncompressed_size, found });
    }
    let found = if header.crc == 0 { 0 } else { crc32fast::hash(out) };
    if found != header.crc {
        return Err(ChunkError::Checksum { expected: header.crc, found });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::{ChunkError, unpack_error};

    #[test]
    fn too_little_memory_is_no_damage() {
        for words in [
            "Allocation error : not enough memory",
            "LZ4 error: ERROR_allocation_failed",
            "zstd could not allocate a decompression context",
        ] {
            assert_eq!(unpack_error(&std::io::Error::other(words)), ChunkError::Memory);
        }
        let memory = unpack_error(&std::io::ErrorKind::OutOfMemory.into());
        assert!(memory == ChunkError::Memory && !memory.is_damage());
        let broken = unpack_error(&std::io::Error::other("Data corruption detected"));
        assert!(matches!(broken, ChunkError::Corrupt(_)));
    }
}
