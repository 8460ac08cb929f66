//! Clouds from files: what is read, and what is refused with which words.

use crate::formats::input::cloud::from_ply;
use crate::formats::input::cloud::read;
use crate::formats::input::cloud_file::CloudFileError;
use std::path::PathBuf;

/// A file of its own for a test, gone when it is dropped.
struct Scratch(PathBuf);

impl Scratch {
    fn new(name: &str, bytes: &[u8]) -> Self {
        let path = std::env::temp_dir().join(format!("biplane-cloud-{}-{name}", std::process::id()));
        std::fs::write(&path, bytes).unwrap();
        Self(path)
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.0);
    }
}

/// Three points of two scans, not in the order of the scans.
fn scans(more: &str, values: &str) -> String {
    format!(
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nproperty int beam\n\
         property int scan\n{more}end_header\n{values}"
    )
}

const VALUES: &str = "1 0 0 5 9\n2 0 0 3 4\n3 0 0 2 9\n";

#[test]
fn points_are_sorted_by_scan_and_beam_and_found_again_in_the_order_of_the_file() {
    let file = from_ply(scans("", VALUES).as_bytes()).unwrap();
    assert_eq!((&file.cloud.scan, &file.cloud.beam), (&vec![0, 1, 1], &vec![3, 2, 5]));
    assert_eq!(file.scan_numbers, [4, 9]);
    assert_eq!(file.cloud.beams_per_scan, 6);
    let x_m: Vec<f32> = file.cloud.points_m.iter().map(|p| p[0]).collect();
    assert_eq!(x_m, [2.0, 3.0, 1.0]);
    assert_eq!(file.in_file_order(&x_m), [1.0, 2.0, 3.0]);
    assert!(file.is_organized() && file.cloud.origins_m.is_empty() && file.notes.is_empty());
}

#[test]
fn origins_come_from_an_element_by_scan_number_or_from_the_points() {
    let element = "element scan 10\nproperty float x\nproperty float y\nproperty float z\n";
    let rows: String = (0..10).map(|k| format!("{k} 0 1\n")).collect();
    let file = from_ply(scans(element, &format!("{VALUES}{rows}")).as_bytes()).unwrap();
    assert_eq!(file.cloud.origins_m, [[4.0, 0.0, 1.0], [9.0, 0.0, 1.0]]);

    let few = from_ply(scans(&element.replace("10", "9"), &format!("{VALUES}{rows}")).as_bytes()).unwrap();
    assert_eq!(few.notes, ["origins are left out: there are 9 of them and a scan 9"]);
    assert!(few.is_organized() && few.cloud.origins_m.is_empty());

    let points = "property float origin_x\nproperty float origin_y\nproperty float origin_z\n";
    let file =
        from_ply(scans(points, "1 0 0 5 9 7 7 7\n2 0 0 3 4 8 8 8\n3 0 0 2 9 9 9 9\n").as_bytes()).unwrap();
    assert_eq!(file.cloud.origins_m, [[8.0; 3], [9.0; 3]]);
}

#[test]
fn numbers_that_are_none_make_an_unorganized_cloud_and_a_note() {
    let file = from_ply(scans("", "1 0 0 5 9\n2 0 0 3 -4\n3 0 0 2 9\n").as_bytes()).unwrap();
    assert!(!file.is_organized());
    assert!(
        file.notes[0].starts_with("taken as unorganized: point 1 is beam 3 of scan -4"),
        "{:?}",
        file.notes
    );
    // As `build` writes what it does not know.
    let file = from_ply(scans("", "1 0 0 -1 -1\n2 0 0 -1 -1\n3 0 0 -1 -1\n").as_bytes()).unwrap();
    assert!(!file.is_organized() && file.notes.is_empty());
}

#[test]
fn short_numbers_far_from_zero_are_said_to_be_coarse() {
    let bytes = |numbers: &str, size: usize| {
        let xyz = ["x", "y", "z"].map(|name| format!("property {numbers} {name}\n")).concat();
        let mut bytes =
            format!("ply\nformat binary_little_endian 1.0\nelement vertex 1\n{xyz}end_header\n").into_bytes();
        for v in [6_000_000.0f64, 5.0, 1.0] {
            if size == 4 { bytes.extend((v as f32).to_le_bytes()) } else { bytes.extend(v.to_le_bytes()) }
        }
        bytes
    };
    let short = from_ply(&bytes("float", 4)).unwrap();
    assert!(short.notes[0].contains("step by about 0.72 m"), "{:?}", short.notes);
    assert_eq!(from_ply(&bytes("double", 8)).unwrap().notes, Vec::<String>::new());
}

#[test]
fn what_is_no_cloud_or_holds_nothing_is_said() {
    for (name, bytes, says) in [
        ("empty", &b""[..], "the file holds no point"),
        ("png", b"\x89PNG\r\n", "this file is a picture"),
        ("none", b"ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\nproperty float y\nproperty float z\nend_header\n", "no point"),
        (
            "nan",
            b"ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\nend_header\nnan 1 2\ninf inf 0\n",
            "none of the 2 points has finite coordinates",
        ),
    ] {
        let file = Scratch::new(name, bytes);
        let error = read(&file.0).unwrap_err().to_string();
        assert!(error.contains(says), "{name}: {error}");
    }
    assert!(matches!(read(&PathBuf::from("/nowhere/a.ply")), Err(CloudFileError::Io(_))));
}

#[cfg(feature = "las")]
mod las {
    use super::{Scratch, read};
    use las::point::Format;
    use las::{Builder, Point, Transform, Vector, Writer};
    use std::io::Cursor;

    /// A LAS or LAZ file with points in UTM coordinates, 1 mm apart.
    fn written(compressed: bool, points: u32) -> Vec<u8> {
        written_as(0, compressed, points)
    }

    fn written_as(format: u8, compressed: bool, points: u32) -> Vec<u8> {
        let mut builder = Builder::from((1, 4));
        builder.point_format = Format::new(format).unwrap();
        builder.has_wkt_crs = format > 5;
        builder.point_format.is_compressed = compressed;
        let axis = |offset| Transform { scale: 0.001, offset };
        builder.transforms = Vector { x: axis(400_000.0), y: axis(5_000_000.0), z: axis(0.0) };
        let mut writer = Writer::new(Cursor::new(Vec::new()), builder.into_header().unwrap()).unwrap();
        for k in 0..points {
            let along = 0.001 * f64::from(k);
            let gps_time = (format > 5).then_some(0.0);
            let point = Point { x: 400_100.0 + along, y: 5_000_200.0, z: 3.0, gps_time, ..Point::default() };
            writer.write_point(point).unwrap();
        }
        writer.close().unwrap();
        writer.into_inner().unwrap().into_inner()
    }

    #[test]
    fn points_far_from_zero_keep_their_millimeters() {
        for compressed in [false, true] {
            let file = Scratch::new(&format!("utm-{compressed}"), &written(compressed, 70_000));
            let found = read(&file.0).unwrap();
            assert_eq!((found.cloud.len(), found.is_organized()), (70_000, false));
            for k in [0usize, 1, 65_535, 65_536, 69_999] {
                let x = f64::from(found.cloud.points_m[k][0]) + found.shift_m[0];
                assert!((x - (400_100.0 + 0.001 * k as f64)).abs() < 1e-4, "{compressed} {k} {x}");
            }
        }
    }

    #[test]
    fn a_cut_or_boastful_file_is_an_error_and_takes_no_memory() {
        for compressed in [false, true] {
            let whole = written(compressed, 1000);
            // Every place in the header, then some in the points.
            for end in (4..400).chain((400..whole.len() - 1).step_by(397)) {
                let file = Scratch::new(&format!("cut-{compressed}"), &whole[..end]);
                assert!(read(&file.0).is_err(), "{compressed}: cut at {end} of {}", whole.len());
            }
            // LAS 1.4 keeps its count in eight bytes at 247; four bytes at 107 are for readers of older
            // versions.
            let mut boast = whole.clone();
            boast[107..111].fill(0);
            boast[247..255].copy_from_slice(&1_000_000_000_000u64.to_le_bytes());
            let file = Scratch::new(&format!("boast-{compressed}"), &boast);
            let error = read(&file.0).map(|found| found.cloud.len()).unwrap_err().to_string();
            let says = if compressed {
                "the LAS file cannot be read"
            } else {
                "ends after point 1000 of 1000000000000"
            };
            assert!(error.contains(says), "{error}");
        }
    }

    #[test]
    fn layers_and_records_longer_than_the_file_are_refused_before_memory_is_taken_for_them() {
        let refused = |name: &str, bytes: &[u8]| {
            let file = Scratch::new(name, bytes);
            read(&file.0).map(|found| found.cloud.len()).unwrap_err().to_string()
        };
        // Behind the place of the chunk table and the first point as it is: a count, then the size of the
        // first layer.
        let mut layers = written_as(6, true, 1000);
        let start = u32::from_le_bytes(layers[96..100].try_into().unwrap()) as usize;
        let record = usize::from(u16::from_le_bytes(layers[105..107].try_into().unwrap()));
        let size_at = start + 8 + record + 4;
        layers[size_at..size_at + 4].copy_from_slice(&0xF000_0000u32.to_le_bytes());
        let error = refused("layers", &layers);
        assert!(error.contains("is damaged: chunk 0 claims 40265"), "{error}");

        // A record behind the points: its place and number in the header, 18 bytes, an identifier, its
        // length.
        let mut extended = written(false, 10);
        let end = extended.len();
        extended[235..243].copy_from_slice(&(end as u64).to_le_bytes());
        extended[243] = 1;
        extended.resize(end + 64, 0);
        extended[end + 20] = 4;
        let file = Scratch::new("extended", &extended);
        assert_eq!(read(&file.0).unwrap().cloud.len(), 10, "a record of four bytes is there");
        extended[end + 24] = 0x40;
        let error = refused("extended", &extended);
        assert!(error.contains("claims 274877906948 bytes"), "{error}");
    }
}

/// Coordinates of a file as they are, the shift put back.
fn positions_of(name: &str, bytes: &[u8]) -> Result<Vec<[f64; 3]>, String> {
    let scratch = Scratch::new(name, bytes);
    let file = read(&scratch.0).map_err(|error| error.to_string())?;
    let back = |p: &[f32; 3]| std::array::from_fn(|k| f64::from(p[k]) + file.shift_m[k]);
    Ok(file.cloud.points_m.iter().map(back).collect())
}

#[test]
fn text_is_read_with_any_separators_headers_and_columns() {
    let expected = vec![[1.5, 2.0, 3.0], [-4.0, 0.25, 1e3]];
    for text in [
        "1.5 2 3\n-4 0.25 1e3\n",
        "# a comment\n\n1.5\t2\t3 17 0 0\r\n-4\t.25\t1000 9 0 0\r\n",
        "//X Y Z\n1.5 2 3\n-4 0.25 1e3",
        "2\n1.5 2 3 -1000 0 0 0\n-4 0.25 1000 5 6 7 8\n",
        "\u{feff}x,y,z\n1.5,2,3\n-4,0.25,1000\n",
        "id;\"Z\";\"X\";\"Y\"\n7;3;1,5;2\n8;1000;-4;0,25\n",
        "1,5; 2; 3\n-4; 0,25; 1000\n",
        "east north up\n1.5 2 3\n-4 0.25 1e3\n",
    ] {
        assert_eq!(positions_of("text", text.as_bytes()).as_ref(), Ok(&expected), "{text}");
    }
    let far = positions_of("text", b"500000.125 5400000 180\n500001 5400001.5 181\n").unwrap();
    assert_eq!(far, [[500000.125, 5400000.0, 180.0], [500001.0, 5400001.5, 181.0]]);
}

#[test]
fn each_scan_of_a_pts_begins_with_its_count() {
    let two = "2\n1.5 2 3 -1000 0 0 0\n-4 0.25 1000 5 6 7 8\n\n1\r\n7 8 9 1 2 3 4\r\n0\n";
    let points = vec![[1.5, 2.0, 3.0], [-4.0, 0.25, 1e3], [7.0, 8.0, 9.0]];
    assert_eq!(positions_of("pts", two.as_bytes()).as_ref(), Ok(&points));
    // What stands behind the counted points are points.
    assert_eq!(positions_of("pts", two.replacen('2', "1", 1).as_bytes()).as_ref(), Ok(&points));
    let error = |from: &str, to: &str| positions_of("pts", two.replacen(from, to, 1).as_bytes()).unwrap_err();
    assert_eq!(
        error("2\n", "3\n"),
        "line 5: expected point 2 of 3 in scan 0 (line 1 counts them), found `1`"
    );
    assert_eq!(
        error("1\r\n", "5\r\n"),
        "line 7: expected point 1 of 5 in scan 1 (line 5 counts them), found `0`"
    );
    assert_eq!(
        error("4\r\n0\n", "4\r\n18446744073709551615"),
        "line 8: expected point 0 of 18446744073709551615 in scan 2 (line 7 counts them), found the end of the file"
    );
    assert_eq!(error("1\r\n", "eins\n"), "line 5: expected x, y and z as numbers, found `eins`");
    let no_pts = positions_of("pts", b"1 2 3\n2\n4 5 6\n").unwrap_err();
    assert_eq!(no_pts, "line 2: expected x, y and z as numbers, found `2`");
}

#[test]
fn a_text_that_is_no_cloud_says_in_which_line() {
    let error = |text: &str| positions_of("no_text", text.as_bytes()).unwrap_err();
    assert_eq!(error("1 2 3\n1 zwei 3\n"), "line 2: expected x, y and z as numbers, found `1 zwei 3`");
    assert_eq!(error("1 2 3\n4 5"), "line 2: expected x, y and z as numbers, found `4 5`");
    assert_eq!(error("1 2\n4 5 6\n"), "line 1: expected x, y and z as numbers, found `1 2`");
    assert!(error("hello world\nno numbers here\n").ends_with("is a text that begins with \"hello world\""));
}

/// Header of the PCD files below, as another program (pypcd4) wrote it.
const PCD_HEAD: &str = "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 4\nHEIGHT 1\n\
    VIEWPOINT 0.0 0.0 0.0 1.0 0.0 0.0 0.0\nPOINTS 4\nDATA ";
/// What follows `DATA binary_compressed`, from the same program.
const PCD_PACKED: [u8; 46] = [
    0x26, 0, 0, 0, 0x30, 0, 0, 0, 8, 0, 0, 0x80, 0x3f, 0, 0, 0, 0xbf, 0, 0x60, 7, 0x60, 0x0b, 0, 0x40, 0x20,
    7, 0, 0x3e, 0x20, 0x13, 0x20, 7, 0x40, 3, 0, 0x40, 0x20, 7, 1, 0x7a, 0x44, 0x80, 7, 1, 0x40, 0x40,
];
const PCD_POINTS: [[f64; 3]; 4] = [[1.0, 2.0, 3.0], [-0.5, 0.25, 1e3], [1.0, 2.0, 3.0], [1.0, 2.0, 3.0]];

#[test]
fn a_viewpoint_of_a_pcd_says_from_where_its_points_were_seen() {
    let seen_from = |viewpoint: &str| {
        let head = PCD_HEAD.replace("VIEWPOINT 0.0 0.0 0.0 1.0 0.0 0.0 0.0\n", viewpoint);
        let body = "500001.0 2.0 3.0\n500002.0 2.0 3.0\n500001.0 7.0 3.0\n500001.0 2.0 4.0\n";
        let found = crate::formats::input::pcd::read(format!("{head}ascii\n{body}").as_bytes()).unwrap();
        assert_eq!(found.seen_from(0), found.seen_from(3));
        found.seen_from(3).map(|place| [0, 1, 2].map(|k| place[k] + found.shift_m[k]))
    };
    assert_eq!(seen_from("VIEWPOINT 500000 -1.5 2 0.5 0.5 0.5 0.5\n"), Some([500_000.0, -1.5, 2.0]));
    assert_eq!(seen_from("VIEWPOINT 0 0 0 0.5 0.5 0.5 0.5\n"), Some([0.0; 3]));
    for unsaid in ["", "VIEWPOINT 0 0 0 1 0 0 0\n", "VIEWPOINT 1 2 3\n", "VIEWPOINT 1 2 nan 1 0 0 0\n"] {
        assert_eq!(seen_from(unsaid), None, "{unsaid}");
    }
}

#[test]
fn pcd_files_of_another_program_are_read_and_every_cut_is_an_error() {
    let ascii = "1.0 2.0 3.0\n-0.5 0.25 1000.0\n1.0 2.0 3.0\n1.0 2.0 3.0\n";
    let binary: Vec<u8> = PCD_POINTS.iter().flatten().flat_map(|v| (*v as f32).to_le_bytes()).collect();
    for (kind, body) in
        [("ascii", ascii.as_bytes()), ("binary", binary.as_slice()), ("binary_compressed", &PCD_PACKED)]
    {
        let bytes = [PCD_HEAD.as_bytes(), kind.as_bytes(), b"\n", body].concat();
        assert_eq!(positions_of("pcd", &bytes), Ok(PCD_POINTS.to_vec()), "{kind}");
        // In ASCII the last digits may be missing, and nobody knows.
        let sure = if kind == "ascii" { bytes.len() - 12 } else { bytes.len() };
        for end in 19..sure {
            assert!(positions_of("pcd", &bytes[..end]).is_err(), "{kind} cut at {end}");
        }
    }
}

#[test]
fn pcd_fields_have_any_type_and_order_and_lies_take_no_memory() {
    let head = "# .PCD v.7 - Point Cloud Data file format\nVERSION .7\nFIELDS rgb normal z y x\nSIZE 4 4 8 2 1\n\
        TYPE U F F I U\nCOUNT 1 3 1 1 1\nWIDTH 1\nHEIGHT 1\nPOINTS 1\nDATA binary\n";
    let mut body = vec![9; 16];
    body.extend(2.5_f64.to_le_bytes());
    body.extend((-7_i16).to_le_bytes());
    body.push(200);
    let bytes = [head.as_bytes(), &body].concat();
    assert_eq!(positions_of("types", &bytes), Ok(vec![[200.0, -7.0, 2.5]]));
    for (from, to, says) in [
        ("POINTS 1", "POINTS 18446744073709551615", "ends after point 1 of 18446744073709551615"),
        ("COUNT 1 3", "COUNT 1 18446744073709551615", "no or of endless length"),
        ("COUNT 1 3", "COUNT 4611686018427387901 3", "no or of endless length"),
        ("y x", "y w", "has no field x"),
        ("SIZE 4 4 8 2 1", "SIZE 4 4 3 2 1", "header line that cannot be read: `SIZE 4 4 3 2 1`"),
        ("binary", "zipped", "data of the kind `zipped`"),
    ] {
        let lie = [head.replace(from, to).as_bytes(), &body].concat();
        let error = positions_of("lie", &lie).unwrap_err();
        assert!(error.starts_with("the PCD file ") && error.contains(says), "{error}");
    }
}
