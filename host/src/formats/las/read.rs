//! LAS and LAZ point clouds, through the crate `las`. Only coordinates are taken.
//!
//! Points are read in portions, so that a header's count decides nothing; what it, a LAZ file's chunk table
//! and its chunks claim ([`claims`]) is checked against the file's length before anyone believes it. Source:
//! LAS specification 1.4 (ASPRS), LAZ specification (Isenburg).

pub(crate) use crate::formats::input::cloud_file::CloudFile;
pub(crate) use crate::formats::input::cloud_file::CloudFileError;
use crate::formats::input::quietly::quietly;
use crate::formats::las::claims::broken;
use las::{PointDataBuilder, Reader};
use std::fs::File;
use std::io::{BufReader, Seek};

/// Bytes of points a portion.
const PORTION_BYTES: u64 = 1 << 20;

/// Reads a file from its start.
pub(crate) fn read(mut file: File) -> Result<CloudFile, CloudFileError> {
    let length = file.metadata()?.len();
    file.rewind()?;
    crate::formats::las::claims::check(&mut file, length)?;
    file.rewind()?;
    // The decompressor trusts its input in places; what it then does must not end the program.
    let read = quietly(|| {
        crate::formats::las::claims::check_chunks(&mut file, length)?;
        file.rewind()?;
        positions(file)
    });
    let positions_m = read.unwrap_or_else(|_| {
        Err(CloudFileError::Las { what: "is damaged: its points cannot be decompressed".to_owned() })
    })?;
    Ok(CloudFile::of_positions(&positions_m))
}

fn positions(file: File) -> Result<Vec<[f64; 3]>, CloudFileError> {
    let mut reader = Reader::new(BufReader::new(file)).map_err(broken)?;
    let count = reader.header().number_of_points();
    let portion_points = PORTION_BYTES / u64::from(reader.header().point_format().len()).max(1) + 1;
    let mut portion = PointDataBuilder::new().for_header(reader.header()).build();
    let mut positions_m: Vec<[f64; 3]> = Vec::new();
    while (positions_m.len() as u64) < count {
        let wanted = portion_points.min(count - positions_m.len() as u64);
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
