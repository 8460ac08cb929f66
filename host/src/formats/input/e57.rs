//! E57 point clouds, through the crate `e57`: all scans of a file, each moved by its own pose. Only
//! coordinates are taken.
//!
//! A point without valid coordinates stays in its place as one that is nowhere (NaN). No number in the file
//! decides how much memory is taken: points are counted as they come. Source: ASTM E2807.

use std::fs::File;
use std::io::{BufReader, Seek};

use e57::{CartesianCoordinate, E57Reader, PointCloud, RecordDataType};

use crate::formats::input::cloud_file::{CloudFile, CloudFileError};
use crate::formats::input::quietly::quietly;

/// Reads a file from its start.
pub(crate) fn read(mut file: File) -> Result<CloudFile, CloudFileError> {
    file.rewind()?;
    let positions = quietly(|| positions(file));
    let positions_m =
        positions.unwrap_or_else(|_| Err(broken("is damaged: its points cannot be unpacked")))?;
    Ok(CloudFile::of_positions(&positions_m))
}

fn broken(what: impl Into<String>) -> CloudFileError {
    CloudFileError::E57 { what: what.into() }
}

fn positions(file: File) -> Result<Vec<[f64; 3]>, CloudFileError> {
    let mut reader =
        E57Reader::new(BufReader::new(file)).map_err(|error| broken(format!("cannot be read: {error}")))?;
    let scans = reader.pointclouds();
    let mut positions_m = Vec::new();
    for (number, scan) in scans.iter().enumerate() {
        if !takes_room(scan) {
            let what =
                format!("has {} points in scan {number} that take no room: it is damaged", scan.records);
            return Err(broken(what));
        }
        let first = positions_m.len();
        let error = |read: usize, error: &e57::Error| {
            broken(format!(
                "ends or is damaged after point {read} of {} of scan {number}: {error}",
                scan.records
            ))
        };
        let mut points = reader.pointcloud_simple(scan).map_err(|found| error(0, &found))?;
        points.intensity_to_color(false);
        for point in points {
            let point = point.map_err(|found| error(positions_m.len() - first, &found))?;
            positions_m.push(match point.cartesian {
                CartesianCoordinate::Valid { x, y, z } => [x, y, z],
                CartesianCoordinate::Direction { .. } | CartesianCoordinate::Invalid => [f64::NAN; 3],
            });
        }
    }
    Ok(positions_m)
}

/// Whether a point takes at least one bit of the file. Otherwise the count alone would say how many there
/// are.
fn takes_room(scan: &PointCloud) -> bool {
    scan.records == 0
        || scan.prototype.iter().any(|record| match record.data_type {
            RecordDataType::Single { .. } | RecordDataType::Double { .. } => true,
            RecordDataType::ScaledInteger { min, max, .. } | RecordDataType::Integer { min, max } => {
                min < max
            }
        })
}
