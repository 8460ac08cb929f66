//! LAS and LAZ: the raw points with plane and time, for CloudCompare, QGIS, PDAL, LAStools and laspy.
//!
//! Version 1.4, point format 6, steps of a tenth of a millimeter. Extra bytes: `plane` (-1 for none), and
//! `scan` and `beam` where points know them. `gps_time` is adjusted standard GPS time, 0 where it is not
//! known. Points on planes are of class 6 (building), others of class 1; `point_source_id` is the plane's
//! number from 1, 0 for none. Frame `map`, meters. Source: LAS specification 1.4 R15 (ASPRS).

pub(crate) mod claims;
mod gps_time;
#[cfg(feature = "las")]
pub(crate) mod read;

use std::io::{self, Seek, Write};

use ::las::point::{Classification, Format};
use ::las::{Builder, GpsTimeType, Point, Transform, Vector, Version, Vlr, Writer};

use super::generator;
use crate::formats::input::shift::restored;
use crate::formats::ply::write::{PointRow, PointTable};

/// Step of coordinates, meters.
const STEP_M: f64 = 1e-4;
/// Farthest coordinate from the file's offset that a step count in 32 bits holds, meters.
const REACH_M: f64 = 2e5;
/// Types of extra bytes: u16, u32, i32.
const U16: u8 = 3;
const U32: u8 = 5;
const I32: u8 = 6;

/// Writes the points, compressed (LAZ) or not (LAS). A point that is nowhere (not finite) stands at
/// the file's offset and is marked as withheld.
///
/// # Errors
/// When writing fails.
pub fn write<W>(out: W, points: &dyn PointTable, is_compressed: bool) -> io::Result<()>
where
    W: Write + Seek + Send + Sync + 'static,
{
    let mut extras = vec![("plane", I32, "index of the plane, -1: none")];
    if points.has_scans() {
        extras.extend([("scan", U32, "number of the scan"), ("beam", U16, "number in the scan")]);
    }
    let mut format = Format::new(6).map_err(io::Error::other)?;
    format.is_compressed = is_compressed;
    format.extra_bytes = extras.iter().map(|(_, kind, _)| if *kind == U16 { 2 } else { 4 }).sum();
    let mut builder = Builder::from((1, 4));
    builder.version = Version::new(1, 4);
    builder.date = None;
    builder.point_format = format;
    builder.generating_software = generator();
    builder.system_identifier = "OTHER".to_owned();
    builder.gps_time_type = GpsTimeType::Standard;
    // The specification wants it of point formats from 6 on, with a system of coordinates or without.
    builder.has_wkt_crs = true;
    let [x, y, z] = points.shift_m().map(|offset| Transform { scale: STEP_M, offset });
    builder.transforms = Vector { x, y, z };
    builder.vlrs = vec![extra_bytes(&extras), text(points.source())];
    let header = builder.into_header().map_err(io::Error::other)?;
    let mut writer = Writer::new(out, header).map_err(io::Error::other)?;
    points.visit(&mut |row| {
        let point = point(row, points.shift_m(), extras.len() > 1);
        writer.write_point(point).map_err(io::Error::other)
    })?;
    writer.close().map_err(io::Error::other)
}

fn point(row: &PointRow, shift_m: [f64; 3], has_scans: bool) -> Point {
    let near = row.point_m.map(f64::from);
    let is_somewhere = near.iter().all(|value| value.abs() < REACH_M);
    let [x, y, z] = restored(if is_somewhere { near } else { [0.0; 3] }, shift_m);
    let [plane, scan, beam] = row.numbers;
    let mut extra_bytes = plane.to_le_bytes().to_vec();
    if has_scans {
        extra_bytes.extend(scan.to_le_bytes());
        extra_bytes.extend((beam as u16).to_le_bytes());
    }
    Point {
        x,
        y,
        z,
        return_number: 1,
        number_of_returns: 1,
        classification: if plane < 0 { Classification::Unclassified } else { Classification::Building },
        is_withheld: !is_somewhere,
        point_source_id: u16::try_from(plane + 1).unwrap_or(u16::MAX),
        gps_time: Some(row.stamp_ns.map_or(0.0, gps_time::adjusted_s)),
        extra_bytes,
        ..Point::default()
    }
}

/// The record that describes the extra bytes of points.
fn extra_bytes(extras: &[(&str, u8, &str)]) -> Vlr {
    let mut data = Vec::new();
    for (name, kind, description) in extras {
        let mut record = [0_u8; 192];
        record[2] = *kind;
        record[4..4 + name.len()].copy_from_slice(name.as_bytes());
        record[160..160 + description.len()].copy_from_slice(description.as_bytes());
        data.extend(record);
    }
    Vlr { user_id: "LASF_Spec".to_owned(), record_id: 4, description: "extra bytes".to_owned(), data }
}

/// A text about the file, as the specification has it.
fn text(source: &str) -> Vlr {
    let data = format!("points of {source}; frame map (z up), meters\0").into_bytes();
    Vlr { user_id: "LASF_Spec".to_owned(), record_id: 3, description: "source, frame, unit".to_owned(), data }
}

#[cfg(test)]
mod tests {
    use std::io::{Cursor, Seek, SeekFrom, Write};
    use std::sync::{Arc, Mutex};

    use super::write;
    use crate::formats::ply::write::PointRows;
    use crate::model::Cloud;

    /// A file in memory that is still there when its writer is gone.
    #[derive(Clone, Default)]
    struct Shared(Arc<Mutex<Cursor<Vec<u8>>>>);

    impl Write for Shared {
        fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
            self.0.lock().unwrap().write(bytes)
        }
        fn flush(&mut self) -> std::io::Result<()> {
            Ok(())
        }
    }

    impl Seek for Shared {
        fn seek(&mut self, to: SeekFrom) -> std::io::Result<u64> {
            self.0.lock().unwrap().seek(to)
        }
    }

    fn cloud() -> Cloud {
        Cloud {
            points_m: vec![[1.0, 2.0, 3.0], [-0.5, 0.25, 0.125], [f32::NAN; 3]],
            scan: vec![0, 1, 1],
            beam: vec![90, 180, 181],
            origins_m: vec![[0.0; 3]; 2],
            beams_per_scan: 361,
            stamps_ns: vec![1_483_228_800_000_000_000, 1_483_228_801_000_000_000],
            delays_ns: (0..361).map(|beam| beam * 1_000_000).collect(),
        }
    }

    #[test]
    fn points_come_back_with_plane_scan_beam_and_time_from_both_kinds() {
        let cloud = cloud();
        for is_compressed in [false, true] {
            let shift_m = [4e6, 0.0, -1e3];
            let rows = PointRows {
                cloud: &cloud,
                labels: &[4],
                scan_numbers: &[],
                order: None,
                shift_m,
                source: "a.mcap",
            };
            let file = Shared::default();
            write(file.clone(), &rows, is_compressed).unwrap();
            let bytes = file.0.lock().unwrap().get_ref().clone();
            let mut reader = ::las::Reader::new(Cursor::new(bytes)).unwrap();
            assert_eq!(reader.header().date(), None);
            let points: Vec<::las::Point> = reader.read_all().unwrap().points().map(Result::unwrap).collect();
            assert_eq!(points.len(), 3);
            let at = |p: &::las::Point| [p.x, p.y, p.z];
            for (found, expected) in at(&points[1]).into_iter().zip([3_999_999.5, 0.25, -999.875]) {
                assert!((found - expected).abs() < 6e-5, "{found} {expected}");
            }
            assert_eq!(points[0].extra_bytes, [4, 0, 0, 0, 0, 0, 0, 0, 90, 0]);
            assert_eq!(points[1].extra_bytes, [255, 255, 255, 255, 1, 0, 0, 0, 180, 0]);
            assert_eq!(points.iter().map(|p| p.point_source_id).collect::<Vec<_>>(), [5, 0, 0]);
            // 2017-01-01 00:00:00 UTC is 1,167,264,018 s of GPS; beam 90 is 90 ms later.
            assert!((points[0].gps_time.unwrap() - 167_264_018.09).abs() < 1e-6, "{:?}", points[0].gps_time);
            assert_eq!(points.iter().map(|p| p.is_withheld).collect::<Vec<_>>(), [false, false, true]);
        }
    }

    #[test]
    fn vertices_of_a_mesh_have_a_plane_alone() {
        let cloud = Cloud { points_m: vec![[1.0, 2.0, 3.0]], ..Cloud::default() };
        let rows = PointRows {
            cloud: &cloud,
            labels: &[-1],
            scan_numbers: &[],
            order: None,
            shift_m: [0.0; 3],
            source: "",
        };
        let file = Shared::default();
        write(file.clone(), &rows, false).unwrap();
        let bytes = file.0.lock().unwrap().get_ref().clone();
        let point = ::las::Reader::new(Cursor::new(bytes))
            .unwrap()
            .read_all()
            .unwrap()
            .points()
            .next()
            .unwrap()
            .unwrap();
        assert_eq!((point.extra_bytes.as_slice(), point.gps_time), ([255; 4].as_slice(), Some(0.0)));
    }
}
