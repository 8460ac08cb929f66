//! LAS and LAZ point clouds, through the crate `las`. Only coordinates are taken.
//!
//! Points are read in portions, so that a header's count decides nothing; what it and a LAZ file's chunk table claim is checked
//! against the file's length before anyone believes it. Source: LAS specification 1.4 (ASPRS), LAZ specification (Isenburg).

use super::{CloudFile, CloudFileError};
use crate::model::Cloud;
use crate::shift::{Shift, moved};
use las::{PointDataBuilder, Reader};
use std::fs::File;
use std::io::{self, BufReader, Read, Seek, SeekFrom};
use std::panic::{AssertUnwindSafe, catch_unwind};

/// Points a portion.
const PORTION: u64 = 1 << 16;

/// Reads a file from its start.
pub fn read(mut file: File) -> Result<CloudFile, CloudFileError> {
    let length = file.metadata()?.len();
    file.rewind()?;
    check_claims(&mut file, length)?;
    file.rewind()?;
    // The decompressor trusts its input in places; what it then does must not end the program.
    let read = catch_unwind(AssertUnwindSafe(|| positions(file)));
    let positions_m = read.unwrap_or_else(|_| {
        Err(CloudFileError::Las { what: "is damaged: its points cannot be decompressed".to_owned() })
    })?;
    let shift_m = Shift::Find.of(&positions_m);
    let cloud = Cloud { points_m: moved(&positions_m, shift_m), ..Cloud::default() };
    Ok(CloudFile { cloud, shift_m, ..CloudFile::default() })
}

fn positions(file: File) -> Result<Vec<[f64; 3]>, CloudFileError> {
    let broken = |error: las::Error| CloudFileError::Las { what: format!("cannot be read: {error}") };
    let mut reader = Reader::new(BufReader::new(file)).map_err(broken)?;
    let count = reader.header().number_of_points();
    let mut portion = PointDataBuilder::new().for_header(reader.header()).build();
    let mut positions_m: Vec<[f64; 3]> = Vec::new();
    while (positions_m.len() as u64) < count {
        let wanted = PORTION.min(count - positions_m.len() as u64);
        let read = reader.fill_points(wanted, &mut portion).map_err(|error| CloudFileError::Las {
            what: format!(
                "ends or is damaged within points {} to {} of {count}: {error}",
                positions_m.len(),
                positions_m.len() as u64 + wanted
            ),
        })?;
        if read == 0 {
            break;
        }
        let coordinates = portion.x().zip(portion.y()).zip(portion.z());
        positions_m.extend(coordinates.map(|((x, y), z)| [x, y, z]));
    }
    Ok(positions_m)
}

/// Offsets of fields in a LAS header; the long count is there from version 1.4 on.
const MINOR_VERSION_AT: u64 = 25;
const POINT_DATA_AT: u64 = 96;
const POINT_FORMAT_AT: u64 = 104;
const RECORD_LENGTH_AT: u64 = 105;
const SHORT_COUNT_AT: u64 = 107;
const LONG_COUNT_AT: u64 = 247;
/// Bit of the point format that says that points are compressed.
const COMPRESSED: u8 = 0x80;

/// Refuses a file that claims more than it has bytes for.
fn check_claims(file: &mut File, length: u64) -> Result<(), CloudFileError> {
    let start = bytes_at(file, POINT_DATA_AT)?.map_or(0, |b| u64::from(u32::from_le_bytes(b)));
    match bytes_at(file, POINT_FORMAT_AT)? {
        Some([format]) if format & COMPRESSED != 0 => check_chunk_table(file, start, length),
        Some(_) => check_count(file, start, length),
        None => Ok(()),
    }
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
