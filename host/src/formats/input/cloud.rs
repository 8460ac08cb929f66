//! Point clouds from files of other programs: PLY, LAS or LAZ, E57, PCD, PTX and other text. Their first
//! bytes say which.
//!
//! Coordinates are taken as meters; those far from zero are moved near it ([`crate::formats::input::shift`]).
//! A PLY whose points say their scan and beam is taken as organized ([`organize`]). No length in a file
//! decides how much memory is taken.

use crate::formats::input::cloud_file::CloudFile;
use crate::formats::input::cloud_file::CloudFileError;
use crate::formats::input::lines::{ptx, xyz};
use crate::formats::input::pcd;
use crate::formats::input::shift::Shift;
use crate::formats::ply;
use crate::formats::ply::error::PlyError;
use crate::formats::ply::read::Wanted;
use biplane_recording::file_kind::{FileKind, KIND_BYTES};
use std::fs::File;
use std::io::{self, BufReader, Read};
use std::path::Path;

/// Coordinates with larger steps are worth a word, meters: planes of a good scanner begin to suffer.
const COARSE_M: f64 = 0.005;

/// Reads a cloud.
///
/// # Errors
/// When the file cannot be read, is no cloud or a damaged one, or holds no point that is anywhere.
pub fn read(path: &Path) -> Result<CloudFile, CloudFileError> {
    let mut file = File::open(path)?;
    let mut start = Vec::new();
    Read::by_ref(&mut file).take(KIND_BYTES).read_to_end(&mut start)?;
    let found = match FileKind::of(&start) {
        _ if start.is_empty() => return Err(CloudFileError::NoPoints),
        // Also where no line ends behind the word: the parser of PLY says what is wrong there.
        _ if start.starts_with(b"ply") && start.len() > 3 => from_ply(&whole(start, file)?)?,
        Some(FileKind::Las) => from_las(file)?,
        Some(FileKind::E57) => from_e57(file)?,
        Some(FileKind::Pcd) => pcd::read(&whole(start, file)?)?,
        None if ptx::is_ptx(&start) => ptx::read(BufReader::new(start.chain(file)))?,
        None if xyz::is_xyz(&start) => xyz::read(BufReader::new(start.chain(file)))?,
        _ => return Err(CloudFileError::Unknown { found: start }),
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

/// All bytes of a file of which these are the first.
fn whole(start: Vec<u8>, mut file: File) -> io::Result<Vec<u8>> {
    let mut bytes = start;
    file.read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// The cloud in a PLY file's bytes.
///
/// # Errors
/// When it is no PLY, or not a whole one.
pub fn from_ply(bytes: &[u8]) -> Result<CloudFile, PlyError> {
    let wanted = Wanted { shift: Shift::Find, columns: Some(&crate::formats::input::organize::COLUMNS) };
    let mut ply = ply::read_wanted(bytes, &wanted)?;
    let points_m = std::mem::take(&mut ply.mesh.vertices_m);
    let mut found = crate::formats::input::organize::organized(points_m, &ply);
    if ply.step_m > COARSE_M {
        found.notes.push(format!(
            "coordinates are 32-bit numbers, which step by about {:.2} m so far from zero: write them as 64-bit numbers (double)",
            ply.step_m
        ));
    }
    Ok(found)
}

#[cfg(feature = "e57")]
fn from_e57(file: File) -> Result<CloudFile, CloudFileError> {
    crate::formats::input::e57::read(file)
}

#[cfg(not(feature = "e57"))]
fn from_e57(_file: File) -> Result<CloudFile, CloudFileError> {
    Err(CloudFileError::WithoutE57)
}

#[cfg(feature = "las")]
fn from_las(file: File) -> Result<CloudFile, CloudFileError> {
    crate::formats::las::read::read(file)
}

#[cfg(not(feature = "las"))]
fn from_las(_file: File) -> Result<CloudFile, CloudFileError> {
    Err(CloudFileError::WithoutLas)
}
