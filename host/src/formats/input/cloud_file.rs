//! A cloud as it was in a file, and why a file gives none.

use crate::formats::input::shift::{Shift, moved};
use crate::formats::ply::error::PlyError;
use crate::formats::text::short::short;
use crate::model::Cloud;
use biplane_recording::file_kind::describe;
use std::io;

/// A cloud as it was in a file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CloudFile {
    /// The points without the shift; an organized cloud in the order scan, then beam.
    pub cloud: Cloud,
    /// What was taken off every coordinate, meters.
    pub shift_m: [f64; 3],
    /// For each point of `cloud` its place in the file; `None` when both orders are one.
    pub order: Option<Vec<u32>>,
    /// The file's number of each scan of `cloud`.
    pub scan_numbers: Vec<u32>,
    /// Its scans and where they were taken from, where its points stand scan by scan and it says so.
    pub(crate) scans: Vec<ScanStart>,
    /// What of the file could not be used, in words.
    pub notes: Vec<String>,
}

/// A scan of a file whose points stand one behind the other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ScanStart {
    /// Its first point in the file; its last is that before the next scan's.
    pub first_point: usize,
    /// Where the scanner stood, meters in the file's coordinates; `None` where the file does not say.
    pub position_m: Option<[f64; 3]>,
}

impl CloudFile {
    /// Points in the order of the file, of which nothing else is known; moved near zero.
    pub(crate) fn of_positions(positions_m: &[[f64; 3]]) -> Self {
        let shift_m = Shift::Find.of(positions_m);
        let cloud = Cloud { points_m: moved(positions_m, shift_m), ..Cloud::default() };
        Self { cloud, shift_m, ..Self::default() }
    }

    /// Whether the points know their scan and beam.
    pub fn is_organized(&self) -> bool {
        self.cloud.beams_per_scan > 0
    }

    /// Whether the file says of some scan where it was taken from.
    pub(crate) fn has_positions(&self) -> bool {
        !self.cloud.origins_m.is_empty() || self.scans.iter().any(|scan| scan.position_m.is_some())
    }

    /// Where a point of a cloud that stands scan by scan was seen from, meters without the shift.
    pub(crate) fn seen_from(&self, index: usize) -> Option<[f64; 3]> {
        let before = self.scans.partition_point(|scan| scan.first_point <= index);
        let position_m = self.scans[..before].last()?.position_m?;
        Some(std::array::from_fn(|k| position_m[k] - self.shift_m[k]))
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
    /// It is an E57 that cannot be read.
    #[error("the E57 file {what}")]
    E57 {
        /// What is wrong, and where.
        what: String,
    },
    /// E57 was left out when the program was built.
    #[error("this program was built without the feature `e57` and reads no E57 files")]
    WithoutE57,
    /// It is a PCD that cannot be read.
    #[error("the PCD file {what}")]
    Pcd {
        /// What is wrong, and where.
        what: String,
    },
    /// A line of a text is not what should stand there.
    #[error("line {line}: expected {expected}, found {found}")]
    Line {
        /// Line in the file, from 1.
        line: usize,
        /// What should stand there.
        expected: String,
        /// What stands there.
        found: String,
    },
    /// It is something else.
    #[error(
        "expected a cloud as PLY, LAS, LAZ, E57, PCD, PTX or as text with x y z in each line; this file {}",
        describe(found)
    )]
    Unknown {
        /// How the file begins.
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

impl CloudFileError {
    /// Something else than what was expected in a line; `None` is the end of the file.
    pub(crate) fn line(line: usize, expected: String, found: Option<&str>) -> Self {
        let found = found.map_or_else(|| "the end of the file".to_owned(), |row| format!("`{}`", short(row)));
        Self::Line { line, expected, found }
    }
}
