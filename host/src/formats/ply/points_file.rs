//! The points of a `points.ply` of this program, one after the other: nobody holds them all.
//!
//! [`crate::formats::ply::read`] takes any PLY and holds it; this takes the one layout that
//! [`crate::formats::ply::write`] gives to points. Frame `map`, meters.

use std::fs::File;
use std::io::{self, BufReader, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use crate::formats::ply::error::PlyError;
use crate::formats::ply::header::{Element, Format, Header, Scalar};
use crate::formats::ply::write::{PointRow, PointTable};
use crate::formats::text::model_json::{ModelFile, ScanTimes};

/// The header is no longer than this, bytes.
const MAX_HEADER: u64 = 1 << 16;
/// Bytes of the longest record: three coordinates in 64 bits, three numbers in 32.
const MAX_ROW: usize = 36;

/// Why a file is not the points of a model.
#[derive(Debug, thiserror::Error)]
pub(crate) enum PointsFileError {
    /// Reading failed.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// It is no PLY, or not a whole one.
    #[error(transparent)]
    Ply(#[from] PlyError),
    /// It is the PLY of another program.
    #[error("expected points in little endian with x, y, z, plane, scan and beam, found {found}")]
    Layout {
        /// What the first element has.
        found: String,
    },
    /// It is of another model.
    #[error("expected {expected} points as model.json says, found {found}")]
    Count {
        /// How many the model has.
        expected: usize,
        /// How many the file has.
        found: usize,
    },
}

/// The points of a model's folder.
#[derive(Debug)]
pub(crate) struct PointsFile<'a> {
    path: PathBuf,
    /// Where the first record begins.
    body: u64,
    count: usize,
    /// Coordinates have 64 bits and hold the shift.
    is_far: bool,
    shift_m: [f64; 3],
    source: &'a str,
    times: Option<&'a ScanTimes<'a>>,
}

impl<'a> PointsFile<'a> {
    /// Opens the points of a model and looks whether they are whole.
    ///
    /// # Errors
    /// When they are not, or not of that model.
    pub(crate) fn open(path: &Path, model: &'a ModelFile<'_>) -> Result<Self, PointsFileError> {
        let mut file = File::open(path)?;
        let mut head = Vec::new();
        file.by_ref().take(MAX_HEADER).read_to_end(&mut head)?;
        let (header, rest) = Header::parse(&head)?;
        let element = header.elements.first().ok_or(PlyError::NoVertices)?;
        let is_far = coordinates(header.format, element)?;
        let body = (head.len() - rest.len()) as u64;
        let found = (file.metadata()?.len().saturating_sub(body) / row_bytes(is_far) as u64) as usize;
        if found < element.count {
            let (element, count) = (element.name.clone(), element.count);
            return Err(PlyError::Truncated { element, index: found, count }.into());
        }
        if element.count != model.points.count {
            return Err(PointsFileError::Count { expected: model.points.count, found: element.count });
        }
        Ok(Self {
            path: path.to_owned(),
            body,
            count: element.count,
            is_far,
            shift_m: model.shift_m,
            source: &model.source,
            times: model.points.times.as_ref(),
        })
    }

    /// A record as it stands in the file.
    fn row(&self, bytes: &[u8]) -> PointRow {
        let (xyz, numbers) = bytes.split_at(bytes.len() - 12);
        let numbers = words(numbers).map(i32::from_le_bytes);
        let point_m = if self.is_far {
            let far: [f64; 3] = words(xyz).map(f64::from_le_bytes);
            std::array::from_fn(|k| (far[k] - self.shift_m[k]) as f32)
        } else {
            words(xyz).map(f32::from_le_bytes)
        };
        let stamp_ns = self.times.and_then(|times| times.stamp_ns(numbers[1], numbers[2]));
        PointRow { point_m, numbers, stamp_ns }
    }
}

/// Three numbers of `N` bytes each; zero where bytes are missing.
fn words<const N: usize>(bytes: &[u8]) -> [[u8; N]; 3] {
    let (words, _) = bytes.as_chunks::<N>();
    std::array::from_fn(|k| words.get(k).copied().unwrap_or([0; N]))
}

fn row_bytes(is_far: bool) -> usize {
    if is_far { MAX_ROW } else { MAX_ROW - 12 }
}

/// Whether the coordinates of points have 64 bits.
fn coordinates(format: Format, element: &Element) -> Result<bool, PointsFileError> {
    let properties = &element.properties;
    let names: Vec<&str> = properties.iter().map(|property| property.name.as_str()).collect();
    let types: Vec<Scalar> = properties.iter().map(|property| property.value_type).collect();
    let numbers = [Scalar::I32; 3];
    let is_ours = format == Format::LittleEndian
        && element.name == "vertex"
        && names == ["x", "y", "z", "plane", "scan", "beam"]
        && properties.iter().all(|property| property.count_type.is_none())
        && types[3..] == numbers;
    match types.first_chunk::<3>() {
        Some([Scalar::F32, Scalar::F32, Scalar::F32]) if is_ours => Ok(false),
        Some([Scalar::F64, Scalar::F64, Scalar::F64]) if is_ours => Ok(true),
        _ => {
            let found = format!("{} with {}", element.name, names.join(", "));
            Err(PointsFileError::Layout { found: found.chars().take(80).collect() })
        }
    }
}

impl PointTable for PointsFile<'_> {
    fn count(&self) -> usize {
        self.count
    }

    fn has_scans(&self) -> bool {
        self.times.is_some()
    }

    fn origins_m(&self) -> &[[f32; 3]] {
        &[]
    }

    fn shift_m(&self) -> [f64; 3] {
        self.shift_m
    }

    fn source(&self) -> &str {
        self.source
    }

    fn visit(&self, visit: &mut dyn FnMut(&PointRow) -> io::Result<()>) -> io::Result<()> {
        let mut file = BufReader::with_capacity(1 << 18, File::open(&self.path)?);
        file.seek(SeekFrom::Start(self.body))?;
        let mut record = [0; MAX_ROW];
        let record = &mut record[..row_bytes(self.is_far)];
        for _ in 0..self.count {
            file.read_exact(record)?;
            visit(&self.row(record))?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::PointsFile;
    use crate::formats::Shapes;
    use crate::formats::ply::write::{PointRow, PointRows, PointTable, write_points};
    use crate::formats::text::model_json::{ModelFile, PointsOf, ScanTimes};
    use crate::model::{Cloud, Model};

    fn rows_of(table: &dyn PointTable) -> Vec<PointRow> {
        let mut rows = Vec::new();
        table
            .visit(&mut |row| {
                rows.push(*row);
                Ok(())
            })
            .unwrap();
        rows
    }

    #[test]
    fn points_come_back_near_and_far_and_every_cut_is_an_error() {
        let path = std::env::temp_dir().join(format!("biplane-points-{}.ply", std::process::id()));
        let cloud = Cloud {
            points_m: vec![[1.0, 2.0, 3.0], [-0.5, 1e-5, 0.1]],
            scan: vec![0, 1],
            beam: vec![1, 0],
            stamps_ns: vec![50, 60],
            delays_ns: vec![0, 3],
            ..Cloud::default()
        };
        let model = Model::default();
        for shift_m in [[0.0; 3], [4e6, 0.0, -1e3]] {
            let rows = PointRows {
                cloud: &cloud,
                labels: &[4],
                scan_numbers: &[],
                order: None,
                shift_m,
                source: "a",
            };
            let mut bytes = Vec::new();
            write_points(&mut bytes, &rows).unwrap();
            let shapes = Shapes { shift_m, source: "a".to_owned(), ..Shapes::new(&model) };
            let times = ScanTimes { scans_ns: vec![50, 60].into(), beams_ns: vec![0, 3].into() };
            let file = ModelFile::new(&shapes, None, PointsOf { count: 2, times: Some(times) });
            fs::write(&path, &bytes).unwrap();
            let points = PointsFile::open(&path, &file).unwrap();
            assert_eq!((points.count(), points.has_scans(), points.source()), (2, true, "a"));
            let (found, expected) = (rows_of(&points), rows_of(&rows));
            assert_eq!(found[0], expected[0]);
            assert_eq!((found[1].numbers, found[1].stamp_ns), ([-1, 1, 0], Some(60)));
            let far = |row: &PointRow| [0, 1, 2].map(|k| f64::from(row.point_m[k]) + shift_m[k]);
            assert_eq!(far(&found[1]), far(&expected[1]));

            for end in 0..bytes.len() {
                fs::write(&path, &bytes[..end]).unwrap();
                assert!(PointsFile::open(&path, &file).is_err(), "cut at {end}");
            }
            fs::write(&path, &bytes).unwrap();
            let other = ModelFile::new(&shapes, None, PointsOf { count: 3, times: None });
            let error = PointsFile::open(&path, &other).unwrap_err().to_string();
            assert_eq!(error, "expected 3 points as model.json says, found 2");
        }
        fs::remove_file(&path).unwrap();
    }
}
