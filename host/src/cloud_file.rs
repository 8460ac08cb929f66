//! Point clouds from files of other programs: PLY and LAS or LAZ, told apart by their first bytes.
//!
//! Coordinates are taken as metres; those far from zero are moved near it ([`crate::shift`]). A PLY whose points say their scan and beam
//! is taken as organised ([`organise`]). No length in a file decides how much memory is taken.

#[cfg(feature = "las")]
mod las;
pub mod organise;

use crate::model::Cloud;
use crate::ply_read::{self, PlyError, Wanted};
use crate::shift::Shift;
use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

/// A cloud as it was in a file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CloudFile {
    /// The points without the shift; an organised cloud in the order scan, then beam.
    pub cloud: Cloud,
    /// What was taken off every coordinate, metres.
    pub shift_m: [f64; 3],
    /// For each point of `cloud` its place in the file; `None` when both orders are one.
    pub order: Option<Vec<u32>>,
    /// The file's number of each scan of `cloud`.
    pub scan_numbers: Vec<u32>,
    /// What of the file could not be used, in words.
    pub notes: Vec<String>,
}

impl CloudFile {
    /// Whether the points know their scan and beam.
    pub fn is_organised(&self) -> bool {
        self.cloud.beams_per_scan > 0
    }

    /// Values of the cloud's points in the order of the file.
    pub fn in_file_order<T: Copy>(&self, values: &[T]) -> Vec<T> {
        let mut out = values.to_vec();
        for (value, place) in values.iter().zip(self.order.iter().flatten()) {
            if let Some(slot) = out.get_mut(*place as usize) {
                *slot = *value;
            }
        }
        out
    }
}

/// Why a file gives no cloud.
#[derive(Debug, thiserror::Error)]
pub enum CloudFileError {
    /// The system refused.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// It is a PLY that cannot be read.
    #[error(transparent)]
    Ply(#[from] PlyError),
    /// It is a LAS or LAZ that cannot be read.
    #[error("the LAS file {what}")]
    Las {
        /// What is wrong, and where.
        what: String,
    },
    /// LAS was left out when the program was built.
    #[error("this program was built without the feature `las` and reads no LAS or LAZ files")]
    WithoutLas,
    /// It is something else.
    #[error("expected a PLY (first bytes `ply`) or a LAS or LAZ file (`LASF`), found `{}`", found.escape_ascii())]
    Unknown {
        /// The file's first bytes.
        found: Vec<u8>,
    },
    /// There is nothing in it.
    #[error("the file holds no point")]
    NoPoints,
    /// Not one point is anywhere.
    #[error("none of the {points} points has finite coordinates")]
    NoFinitePoints {
        /// How many there are.
        points: usize,
    },
}

/// Coordinates with larger steps are worth a word, metres: planes of a good scanner begin to suffer.
const COARSE_M: f64 = 0.005;

/// Reads a cloud.
///
/// # Errors
/// When the file cannot be read, is no cloud or a damaged one, or holds no point that is anywhere.
pub fn read(path: &Path) -> Result<CloudFile, CloudFileError> {
    let mut file = File::open(path)?;
    let mut magic = Vec::new();
    Read::by_ref(&mut file).take(4).read_to_end(&mut magic)?;
    let found = match magic.as_slice() {
        [b'p', b'l', b'y', _] => {
            let mut bytes = magic;
            file.read_to_end(&mut bytes)?;
            from_ply(&bytes)?
        }
        b"LASF" => from_las(file)?,
        [] => return Err(CloudFileError::NoPoints),
        _ => return Err(CloudFileError::Unknown { found: magic }),
    };
    let points = found.cloud.len();
    if points == 0 {
        return Err(CloudFileError::NoPoints);
    }
    if !found.cloud.points_m.iter().any(|p| p.iter().all(|v| v.is_finite())) {
        return Err(CloudFileError::NoFinitePoints { points });
    }
    Ok(found)
}

/// The cloud in a PLY file's bytes.
///
/// # Errors
/// When it is no PLY, or not a whole one.
pub fn from_ply(bytes: &[u8]) -> Result<CloudFile, PlyError> {
    let wanted = Wanted { shift: Shift::Find, columns: Some(&organise::COLUMNS) };
    let mut ply = ply_read::read_wanted(bytes, &wanted)?;
    let points_m = std::mem::take(&mut ply.mesh.vertices_m);
    let mut found = organise::organised(points_m, &ply);
    if ply.step_m > COARSE_M {
        found.notes.push(format!(
            "coordinates are 32-bit numbers, which step by about {:.2} m so far from zero: write them as 64-bit numbers (double)",
            ply.step_m
        ));
    }
    Ok(found)
}

#[cfg(feature = "las")]
fn from_las(file: File) -> Result<CloudFile, CloudFileError> {
    las::read(file)
}

#[cfg(not(feature = "las"))]
fn from_las(_file: File) -> Result<CloudFile, CloudFileError> {
    Err(CloudFileError::WithoutLas)
}

#[cfg(test)]
mod tests;
