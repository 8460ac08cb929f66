//! What a LAS or LAZ file claims to hold, against the bytes that it has: libraries take memory for what a
//! file claims.

use std::fs::File;
use std::io::{self, BufReader, Read, Seek, SeekFrom};

use las::Header;
use laz::laszip::ChunkTable;
use laz::{LazItemType, LazVlr};

use crate::formats::las::read::CloudFileError;

/// Offsets of fields in a LAS header; the long count is there from version 1.4 on.
const MINOR_VERSION_AT: u64 = 25;
const POINT_DATA_AT: u64 = 96;
const POINT_FORMAT_AT: u64 = 104;
const RECORD_LENGTH_AT: u64 = 105;
const SHORT_COUNT_AT: u64 = 107;
const LONG_COUNT_AT: u64 = 247;
/// Where the first record behind the points stands, and how many there are; from version 1.4 on.
const EXTENDED_AT: u64 = 235;
const EXTENDED_COUNT_AT: u64 = 243;
/// Bytes of such a record before its data, and where in them the length stands.
const EXTENDED_HEAD: u64 = 60;
const EXTENDED_LENGTH_AT: u64 = 20;
/// Bit of the point format that says that points are compressed.
const COMPRESSED: u8 = 0x80;

/// Refuses a file that claims more than it has bytes for.
pub(crate) fn check(file: &mut File, length: u64) -> Result<(), CloudFileError> {
    check_extended(file, length)?;
    let start = bytes_at(file, POINT_DATA_AT)?.map_or(0, |b| u64::from(u32::from_le_bytes(b)));
    match bytes_at(file, POINT_FORMAT_AT)? {
        Some([format]) if format & COMPRESSED != 0 => check_chunk_table(file, start, length),
        Some(_) => check_count(file, start, length),
        None => Ok(()),
    }
}

/// Refuses a file whose first record behind the points, the one that is read, is longer than the file.
fn check_extended(file: &mut File, length: u64) -> Result<(), CloudFileError> {
    let is_new = bytes_at(file, MINOR_VERSION_AT)?.is_some_and(|[minor]: [u8; 1]| minor >= 4);
    let count = bytes_at(file, EXTENDED_COUNT_AT)?.map_or(0, u32::from_le_bytes);
    let at = bytes_at(file, EXTENDED_AT)?.map_or(0, u64::from_le_bytes);
    if !is_new || count == 0 || at == 0 {
        return Ok(());
    }
    let claimed = bytes_at(file, at.saturating_add(EXTENDED_LENGTH_AT))?.map_or(0, u64::from_le_bytes);
    if claimed > length.saturating_sub(at.saturating_add(EXTENDED_HEAD)) {
        let what = format!("is cut off: the record at byte {at} of {length} claims {claimed} bytes");
        return Err(CloudFileError::Las { what });
    }
    Ok(())
}

/// Refuses an uncompressed file that is shorter than its points.
fn check_count(file: &mut File, start: u64, length: u64) -> Result<(), CloudFileError> {
    let record = bytes_at(file, RECORD_LENGTH_AT)?.map_or(0, |b| u64::from(u16::from_le_bytes(b)));
    let mut count = bytes_at(file, SHORT_COUNT_AT)?.map_or(0, |b| u64::from(u32::from_le_bytes(b)));
    if count == 0 && bytes_at(file, MINOR_VERSION_AT)?.is_some_and(|[minor]: [u8; 1]| minor >= 4) {
        count = bytes_at(file, LONG_COUNT_AT)?.map_or(0, u64::from_le_bytes);
    }
    let room = length.saturating_sub(start);
    if count.checked_mul(record).is_none_or(|bytes| bytes > room) {
        let fit = room / record.max(1);
        return Err(CloudFileError::Las { what: format!("ends after point {fit} of {count}") });
    }
    Ok(())
}

/// Refuses a compressed file whose chunk table claims more chunks than the file has bytes.
fn check_chunk_table(file: &mut File, start: u64, length: u64) -> Result<(), CloudFileError> {
    let mut table = bytes_at(file, start)?.map_or(0, i64::from_le_bytes);
    if table == -1 {
        // Written by a program that could not step back: the last eight bytes tell.
        table = bytes_at(file, length.saturating_sub(8))?.map_or(0, i64::from_le_bytes);
    }
    let Some(table) = u64::try_from(table).ok().filter(|at| *at < length) else {
        let what = format!("is cut off: its chunk table is said to be at byte {table} of {length}");
        return Err(CloudFileError::Las { what });
    };
    let chunks = bytes_at(file, table.saturating_add(4))?.map_or(0, |b| u64::from(u32::from_le_bytes(b)));
    if chunks > length {
        return Err(CloudFileError::Las { what: format!("claims {chunks} chunks in {length} bytes") });
    }
    Ok(())
}

/// The bytes at a place of a file; `None` beyond its end.
fn bytes_at<const N: usize>(file: &mut File, at: u64) -> io::Result<Option<[u8; N]>> {
    let mut bytes = [0; N];
    file.seek(SeekFrom::Start(at))?;
    match file.read_exact(&mut bytes) {
        Ok(()) => Ok(Some(bytes)),
        Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => Ok(None),
        Err(error) => Err(error),
    }
}

/// The most points that a byte of a compressed file may stand for. Scanners' clouds take one to six bytes a
/// point, and points all in one place still a twentieth of one.
const POINTS_PER_BYTE: u64 = 100;
/// The longest point of a compressed file, bytes: each beyond the usual thirty costs 10 kB of tables to
/// unpack. Twenty scalar fields of eight bytes are 190.
const LONGEST_PACKED: u64 = 1024;
/// Kind of a compressed file that is one piece without a chunk table, as the record `laszip encoded` says.
const ONE_PIECE: [u8; 2] = [1, 0];

/// Refuses a compressed file that claims far more points than anybody could pack into it, or a chunk whose
/// layers claim more bytes than the file has: each layer's memory is taken before it is read.
pub(crate) fn check_chunks(file: &mut File, length: u64) -> Result<(), CloudFileError> {
    let header = Header::new(BufReader::new(&mut *file)).map_err(broken)?;
    let is_packing = |vlr: &&las::Vlr| vlr.user_id == LazVlr::USER_ID && vlr.record_id == LazVlr::RECORD_ID;
    let Some(vlr) = header.vlrs().iter().find(is_packing) else { return Ok(()) };
    let points = header.number_of_points();
    if points / POINTS_PER_BYTE > length {
        return Err(CloudFileError::Las { what: format!("claims {points} points in {length} bytes") });
    }
    let packing = LazVlr::from_buffer(&vlr.data).map_err(broken)?;
    let record = u64::from(header.point_format().len());
    if packing.items_size() != record || record > LONGEST_PACKED {
        let packed = packing.items_size();
        let what = format!(
            "has points of {record} bytes packed as {packed}: both the same and {LONGEST_PACKED} at most are read"
        );
        return Err(CloudFileError::Las { what });
    }
    if packing.items().first().is_none_or(|item| item.version() < 3) {
        return Ok(());
    }
    if vlr.data.starts_with(&ONE_PIECE) {
        return Err(CloudFileError::Las { what: "has layers but no chunks".to_owned() });
    }
    let start = bytes_at(file, POINT_DATA_AT)?.map_or(0, |b| u64::from(u32::from_le_bytes(b)));
    check_layers(file, &packing, start, length, points)
}

/// Walks the chunks of `points` points as they are decompressed, one behind the other. Each begins with its
/// first point as it is, then its count of points, then the size of every layer; the layers follow.
fn check_layers(
    file: &mut File,
    packing: &LazVlr,
    start: u64,
    length: u64,
    points: u64,
) -> Result<(), CloudFileError> {
    file.seek(SeekFrom::Start(start))?;
    let table = ChunkTable::read_from(BufReader::new(&mut *file), packing).map_err(broken)?;
    let layers: u64 = packing.items().iter().map(|item| layers_of(item.item_type())).sum();
    let (mut at, mut passed) = (start.saturating_add(8), 0_u64);
    for chunk in 0.. {
        if passed >= points || at >= length {
            break;
        }
        let sizes_at = at.saturating_add(packing.items_size() + 4);
        let mut claimed = 0_u64;
        for layer in 0..layers {
            let Some(size) = bytes_at(file, sizes_at + 4 * layer)? else { return Ok(()) };
            claimed += u64::from(u32::from_le_bytes(size));
        }
        let layers_at = sizes_at + 4 * layers;
        if claimed > length.saturating_sub(layers_at) {
            let what =
                format!("is damaged: chunk {chunk} claims {claimed} bytes at byte {layers_at} of {length}");
            return Err(CloudFileError::Las { what });
        }
        at = layers_at + claimed;
        let of_chunk = match packing.uses_variable_size_chunks() {
            true => table.as_ref().get(chunk).map_or(u64::MAX, |entry| entry.point_count),
            false => u64::from(packing.chunk_size()),
        };
        // A chunk of no points is never left.
        passed = if of_chunk == 0 { u64::MAX } else { passed.saturating_add(of_chunk) };
    }
    Ok(())
}

/// Layers of a part of a point: coordinates, returns, class, flags, intensity, angle, user's and source's
/// number, time; colors; infrared; wave packet; each extra byte.
fn layers_of(item: LazItemType) -> u64 {
    match item {
        LazItemType::Point14 => 9,
        LazItemType::RGB14 | LazItemType::WavePacket14 => 1,
        LazItemType::RGBNIR14 => 2,
        LazItemType::Byte14(count) => u64::from(count),
        _ => 0,
    }
}

pub(crate) fn broken(error: impl std::fmt::Display) -> CloudFileError {
    CloudFileError::Las { what: format!("cannot be read: {error}") }
}
