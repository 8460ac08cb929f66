//! E57 point clouds, through the crate `e57`: all scans of a file, each moved by its own pose. Only
//! coordinates are taken, and of a scan with a pose where it was taken from.
//!
//! A point without valid coordinates stays in its place as one that is nowhere (NaN). No number in the file
//! decides how much memory is taken: points are counted as they come. Source: ASTM E2807.

use std::fs::File;
use std::io::{BufReader, Seek};

use biplane_geometry::quantile::upper_median;
use e57::{CartesianCoordinate, E57Reader, PointCloud, RecordDataType, RecordName, Transform};
use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};

use crate::formats::input::cloud_file::{CloudFile, CloudFileError, ScanStart};
use crate::formats::input::quietly::quietly;

/// Coordinates with larger steps are worth a word, meters: good scanners are as fine.
const COARSE_M: f64 = 0.001;
/// Points of a scan that say how far it lies from its origin.
const SAMPLE: u64 = 4096;

/// Reads a file from its start.
pub(crate) fn read(mut file: File) -> Result<CloudFile, CloudFileError> {
    file.rewind()?;
    let found = quietly(|| scans(file));
    let found = found.unwrap_or_else(|_| Err(broken("is damaged: its points cannot be unpacked")))?;
    let notes = (found.step_m > COARSE_M).then(|| {
        format!(
            "coordinates are 32-bit numbers, which step by {:.3} m so far from the origin of their scan: no \
             plane is finer. Write them as 64-bit or scaled numbers, or give the scan a pose near its points",
            found.step_m
        )
    });
    Ok(CloudFile {
        scans: found.starts,
        notes: notes.into_iter().collect(),
        ..CloudFile::of_positions(&found.positions_m)
    })
}

/// What is taken of all scans.
#[derive(Debug, Default)]
struct Scans {
    positions_m: Vec<[f64; 3]>,
    starts: Vec<ScanStart>,
    /// Step of the coarsest coordinates, meters; 0 where none has 32 bits.
    step_m: f64,
}

fn broken(what: impl Into<String>) -> CloudFileError {
    CloudFileError::E57 { what: what.into() }
}

fn scans(file: File) -> Result<Scans, CloudFileError> {
    let mut reader =
        E57Reader::new(BufReader::new(file)).map_err(|error| broken(format!("cannot be read: {error}")))?;
    let mut found = Scans::default();
    for (number, scan) in reader.pointclouds().iter().enumerate() {
        if !takes_room(scan) {
            let what =
                format!("has {} points in scan {number} that take no room: it is damaged", scan.records);
            return Err(broken(what));
        }
        let first = found.positions_m.len();
        let pose = scan.transform.as_ref().map(turn_and_place);
        let position_m = pose.map(|(_, place)| place.into());
        found.starts.push(ScanStart { first_point: first, position_m });
        let mut steps = Steps::of(scan);
        let error = |read: usize, error: &e57::Error| {
            broken(format!(
                "ends or is damaged after point {read} of {} of scan {number}: {error}",
                scan.records
            ))
        };
        let mut points = reader.pointcloud_simple(scan).map_err(|found| error(0, &found))?;
        points.intensity_to_color(false);
        points.apply_pose(false);
        for point in points {
            let point = point.map_err(|damage| error(found.positions_m.len() - first, &damage))?;
            found.positions_m.push(match point.cartesian {
                CartesianCoordinate::Valid { x, y, z } => {
                    steps.see([x, y, z], found.positions_m.len() - first);
                    pose.map_or([x, y, z], |(turn, place)| (turn * Vector3::new(x, y, z) + place).into())
                }
                CartesianCoordinate::Direction { .. } | CartesianCoordinate::Invalid => [f64::NAN; 3],
            });
        }
        found.step_m = found.step_m.max(steps.step_m());
    }
    Ok(found)
}

/// A scan's pose in the file. Its rotation is taken as it stands: other programs' are of unit length.
fn turn_and_place(pose: &Transform) -> (Matrix3<f64>, Vector3<f64>) {
    let (q, t) = (&pose.rotation, &pose.translation);
    let turn = UnitQuaternion::new_unchecked(Quaternion::new(q.w, q.x, q.y, q.z));
    (turn.to_rotation_matrix().into_inner(), Vector3::new(t.x, t.y, t.z))
}

/// How finely a scan's coordinates are written, after some of its points.
#[derive(Debug)]
struct Steps {
    /// Distances from zero along each axis whose numbers have 32 bits.
    axes_m: Vec<(usize, Vec<f64>)>,
    /// Points from one that is looked at to the next.
    every: usize,
}

impl Steps {
    fn of(scan: &PointCloud) -> Self {
        let axes = [RecordName::CartesianX, RecordName::CartesianY, RecordName::CartesianZ];
        let has_32_bits = |name: &RecordName| {
            let is_single = |data_type: &RecordDataType| matches!(data_type, RecordDataType::Single { .. });
            scan.prototype.iter().any(|record| record.name == *name && is_single(&record.data_type))
        };
        let axes = axes.iter().enumerate().filter(|(_, name)| has_32_bits(name));
        let every = usize::try_from(scan.records.div_ceil(SAMPLE)).unwrap_or(usize::MAX).max(1);
        Self { axes_m: axes.map(|(axis, _)| (axis, Vec::new())).collect(), every }
    }

    fn see(&mut self, point_m: [f64; 3], index: usize) {
        if index.is_multiple_of(self.every) {
            self.axes_m.iter_mut().for_each(|(axis, values)| values.push(point_m[*axis].abs()));
        }
    }

    /// From one number of 32 bits to the next where the middle of the points lies, along the coarsest axis,
    /// meters.
    fn step_m(self) -> f64 {
        let steps_m = self.axes_m.into_iter().map(|(_, mut values)| {
            values.retain(|value| value.is_finite());
            values.sort_unstable_by(f64::total_cmp);
            let far_m = upper_median(&values).unwrap_or(0.0) as f32;
            f64::from(far_m.next_up() - far_m)
        });
        steps_m.fold(0.0, f64::max)
    }
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

#[cfg(test)]
mod tests {
    use std::fs::File;
    use std::path::Path;

    use e57::{E57Writer, Quaternion, Record, RecordName, RecordValue, Transform, Translation};

    use super::read;
    use crate::formats::input::cloud_file::CloudFile;

    /// Whether its numbers have 32 bits (else 64), x, y and z of its points, and its pose.
    type Scan<'a> = (bool, &'a [[f64; 3]], Option<Transform>);

    /// What is read of scans that the crate `e57` has written.
    fn written(name: &str, scans: &[Scan<'_>]) -> CloudFile {
        let path = std::env::temp_dir().join(format!("biplane-e57-{}-{name}", std::process::id()));
        let mut writer = E57Writer::from_file(&path, "file").unwrap();
        for (has_32_bits, points_m, pose) in scans {
            let prototype = match has_32_bits {
                true => vec![Record::CARTESIAN_X_F32, Record::CARTESIAN_Y_F32, Record::CARTESIAN_Z_F32],
                false => vec![Record::CARTESIAN_X_F64, Record::CARTESIAN_Y_F64, Record::CARTESIAN_Z_F64],
            };
            assert_eq!(prototype[0].name, RecordName::CartesianX);
            let mut scan = writer.add_pointcloud("scan", prototype).unwrap();
            scan.set_transform(pose.clone());
            for point_m in *points_m {
                let value = |v: &f64| match has_32_bits {
                    true => RecordValue::Single(*v as f32),
                    false => RecordValue::Double(*v),
                };
                scan.add_point(point_m.iter().map(value).collect()).unwrap();
            }
            scan.finalize().unwrap();
        }
        writer.finalize().unwrap();
        read_and_remove(&path)
    }

    fn read_and_remove(path: &Path) -> CloudFile {
        let found = read(File::open(path).unwrap());
        std::fs::remove_file(path).unwrap();
        found.unwrap()
    }

    /// By 90 degrees about z, then away.
    fn pose() -> Transform {
        let half = std::f64::consts::FRAC_1_SQRT_2;
        Transform {
            rotation: Quaternion { w: half, x: 0.0, y: 0.0, z: half },
            translation: Translation { x: 500_000.0, y: 20.0, z: 3.0 },
        }
    }

    #[test]
    fn numbers_of_32_bits_far_from_the_origin_are_said_to_be_coarse_once() {
        // From 2^18 to 2^19 numbers of 24 digits step by 2^-5.
        let far: &[[f64; 3]] = &[[500_000.0, 1.0, 2.0]; 3];
        let near: &[[f64; 3]] = &[[5000.0, 1.0, 2.0], [5000.5, 1.0, 2.0], [1e9, 1.0, 2.0]];
        let notes = |name: &str, scans: &[Scan<'_>]| written(name, scans).notes;
        let coarse = notes("far", &[(true, far, None), (true, far, None)]);
        assert!(coarse.len() == 1 && coarse[0].contains("step by 0.031 m so far"), "{coarse:?}");
        // From 2^12 on they step by 2^-11, half a millimeter; a stray point does not decide.
        assert_eq!(notes("near", &[(true, near, None)]), [""; 0]);
        assert_eq!(notes("double", &[(false, far, None)]), [""; 0]);
        // A pose brings what is near its scanner far away, as it should be.
        assert_eq!(notes("posed", &[(true, near, Some(pose()))]), [""; 0]);
    }

    #[test]
    fn a_scan_is_moved_by_its_pose_and_was_taken_where_that_is() {
        let points_m: &[[f64; 3]] = &[[1.0, 2.0, 0.5], [-4.0, 0.125, 10.0]];
        let found = written("pose", &[(false, points_m, Some(pose())), (false, points_m, None)]);
        let expected = [[499_998.0, 21.0, 3.5], [499_999.875, 16.0, 13.0], points_m[0], points_m[1]];
        for (point, expected) in found.cloud.points_m.iter().zip(expected) {
            let off_m = (0..3).map(|k| (f64::from(point[k]) + found.shift_m[k] - expected[k]).abs());
            assert!(off_m.fold(0.0, f64::max) < 0.05, "{point:?} {expected:?}");
        }
        let starts: Vec<_> = found.scans.iter().map(|scan| (scan.first_point, scan.position_m)).collect();
        assert_eq!(starts, [(0, Some([500_000.0, 20.0, 3.0])), (2, None)]);
    }
}
