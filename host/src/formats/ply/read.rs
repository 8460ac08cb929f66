//! Reads PLY meshes and point clouds: ASCII and binary, either byte order, any property types and order, as
//! CloudCompare, MeshLab, PCL, Open3D and this project write them.
//!
//! Coordinates as in the file (meters by convention), or moved closer to zero
//! ([`crate::formats::input::shift`]). Source: G. Turk, "The PLY Polygon File Format" (1994). Nothing in a
//! file makes this panic, run on without end or reserve memory that the file does not fill.

use crate::formats::input::shift::{Shift, moved};
use crate::formats::ply::error::PlyError;
use crate::formats::ply::header::{Element, Header, Property, Scalar};
use crate::formats::ply::values::Values;
use crate::model::Mesh;

/// What a PLY file holds.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Ply {
    /// Vertices and faces; faces with more than three corners are cut into fans.
    pub mesh: Mesh,
    /// Every other scalar property of the vertices, by name, in file order.
    pub vertex_columns: Vec<(String, Vec<f64>)>,
    /// Every scalar property of the faces, one value a triangle.
    pub face_columns: Vec<(String, Vec<f64>)>,
    /// What was taken off every coordinate: vertices plus this are the file's.
    pub shift_m: [f64; 3],
    /// How coarse coordinates are that the file holds as 32-bit numbers far from zero: about the step from
    /// one to the next, meters; else 0.
    pub step_m: f64,
    /// Rows of an element `scan`: where each scan was taken from, in the file's coordinates.
    pub scan_origins_m: Vec<[f64; 3]>,
}

/// What of a file is wanted.
#[derive(Clone, Copy, Debug, Default)]
pub struct Wanted<'a> {
    /// How coordinates are moved closer to zero.
    pub shift: Shift,
    /// The scalar properties to keep; `None` = all.
    pub columns: Option<&'a [&'a str]>,
}

impl Wanted<'_> {
    fn column(&self, name: &str) -> bool {
        self.columns.is_none_or(|columns| columns.contains(&name))
    }
}

impl Ply {
    /// A property of the vertices, by name.
    pub fn vertex_column(&self, name: &str) -> Option<&[f64]> {
        self.vertex_columns.iter().find(|column| column.0 == name).map(|column| column.1.as_slice())
    }

    /// A property of the triangles' faces, by name.
    pub fn face_column(&self, name: &str) -> Option<&[f64]> {
        self.face_columns.iter().find(|column| column.0 == name).map(|column| column.1.as_slice())
    }
}

/// Reads a file's bytes, all of it, coordinates as they stand there.
///
/// # Errors
/// When it is no PLY, or not a whole one.
pub fn read(bytes: &[u8]) -> Result<Ply, PlyError> {
    read_wanted(bytes, &Wanted::default())
}

/// Reads what is wanted of a file's bytes.
///
/// # Errors
/// When it is no PLY, or not a whole one.
pub fn read_wanted(bytes: &[u8], wanted: &Wanted<'_>) -> Result<Ply, PlyError> {
    let (header, body) = Header::parse(bytes)?;
    let mut values = Values::new(header.format, body);
    let mut ply = Ply::default();
    let mut has_vertices = false;
    for element in &header.elements {
        match element.name.as_str() {
            "vertex" => {
                read_vertices(element, &mut values, wanted, &mut ply)?;
                has_vertices = true;
            }
            "face" => read_faces(element, &mut values, wanted, &mut ply)?,
            "scan" => read_scans(element, &mut values, &mut ply)?,
            _ => each_row(element, &mut values, |_, _| Ok(()))?,
        }
    }
    let vertices = ply.mesh.vertices_m.len();
    let lost = ply.mesh.triangles.iter().position(|t| t.iter().any(|corner| *corner as usize >= vertices));
    match lost {
        Some(face) => {
            let vertex = ply.mesh.triangles[face].iter().copied().max().map_or(-1, i64::from);
            Err(PlyError::NoSuchVertex { face, vertex, vertices })
        }
        None if !has_vertices => Err(PlyError::NoVertices),
        None => Ok(ply),
    }
}

fn read_vertices(
    element: &Element,
    values: &mut Values<'_>,
    wanted: &Wanted<'_>,
    ply: &mut Ply,
) -> Result<(), PlyError> {
    let xyz = xyz_of(element).ok_or(PlyError::NoVertices)?;
    let others: Vec<usize> = scalars(element, wanted).filter(|k| !xyz.contains(k)).collect();
    let mut columns = columns_for(element, &others);
    let mut positions_m = Vec::new();
    each_row(element, values, |_, row| {
        positions_m.push(xyz.map(|k| row.scalars[k]));
        columns.iter_mut().zip(&others).for_each(|(column, k)| column.1.push(row.scalars[*k]));
        Ok(())
    })?;
    ply.shift_m = wanted.shift.of(&positions_m);
    if values.are_binary() && xyz.iter().any(|k| element.properties[*k].value_type == Scalar::F32) {
        let far_m = ply.shift_m.iter().fold(0.0, |far_m, v| v.abs().max(far_m));
        ply.step_m = far_m * f64::from(f32::EPSILON);
    }
    ply.mesh.vertices_m = moved(&positions_m, ply.shift_m);
    ply.vertex_columns = columns;
    Ok(())
}

/// Where each scan was taken from; a `scan` element without coordinates says nothing.
fn read_scans(element: &Element, values: &mut Values<'_>, ply: &mut Ply) -> Result<(), PlyError> {
    let xyz = xyz_of(element);
    each_row(element, values, |_, row| {
        ply.scan_origins_m.extend(xyz.map(|xyz| xyz.map(|k| row.scalars[k])));
        Ok(())
    })
}

fn xyz_of(element: &Element) -> Option<[usize; 3]> {
    let at = |name: &str| element.properties.iter().position(|p| p.name == name && p.count_type.is_none());
    Some([at("x")?, at("y")?, at("z")?])
}

fn read_faces(
    element: &Element,
    values: &mut Values<'_>,
    wanted: &Wanted<'_>,
    ply: &mut Ply,
) -> Result<(), PlyError> {
    let named = |p: &Property| {
        p.count_type.is_some() && ["vertex_indices", "vertex_index"].contains(&p.name.as_str())
    };
    let corners_at = element.properties.iter().position(named);
    let others: Vec<usize> = scalars(element, wanted).collect();
    let mut columns = columns_for(element, &others);
    each_row(element, values, |index, row| {
        let Some(corners) = corners_at.map(|k| &row.lists[k]) else { return Ok(()) };
        let corners = corners_of(corners, index, ply.mesh.vertices_m.len())?;
        for pair in corners.windows(2).skip(1) {
            ply.mesh.triangles.push([corners[0], pair[0], pair[1]]);
            columns.iter_mut().zip(&others).for_each(|(column, k)| column.1.push(row.scalars[*k]));
        }
        Ok(())
    })?;
    ply.face_columns = columns;
    Ok(())
}

fn corners_of(list: &[f64], face: usize, vertices: usize) -> Result<Vec<u32>, PlyError> {
    let whole = |v: &f64| {
        let fits = *v >= 0.0 && *v <= f64::from(u32::MAX) && v.fract() == 0.0;
        if fits { Ok(*v as u32) } else { Err(PlyError::NoSuchVertex { face, vertex: *v as i64, vertices }) }
    };
    list.iter().map(whole).collect()
}

fn scalars(element: &Element, wanted: &Wanted<'_>) -> impl Iterator<Item = usize> {
    let kept = |p: &Property| p.count_type.is_none() && wanted.column(&p.name);
    (0..element.properties.len()).filter(|k| kept(&element.properties[*k])).collect::<Vec<_>>().into_iter()
}

fn columns_for(element: &Element, which: &[usize]) -> Vec<(String, Vec<f64>)> {
    which.iter().map(|k| (element.properties[*k].name.clone(), Vec::new())).collect()
}

/// The values of one record, a slot a property in both: lists leave their number at 0, numbers their list
/// empty.
struct Row {
    scalars: Vec<f64>,
    lists: Vec<Vec<f64>>,
}

/// Hands out the records of an element, one after the other.
fn each_row(
    element: &Element,
    values: &mut Values<'_>,
    mut take: impl FnMut(usize, &Row) -> Result<(), PlyError>,
) -> Result<(), PlyError> {
    let properties = element.properties.len();
    let mut row = Row { scalars: vec![0.0; properties], lists: vec![Vec::new(); properties] };
    // An element without properties has no bytes: its count means nothing.
    let count = if properties == 0 { 0 } else { element.count };
    for index in 0..count {
        for (k, property) in element.properties.iter().enumerate() {
            let mut next = |scalar| values.next(scalar).map_err(|lack| lack.at(element, index));
            match property.count_type {
                None => row.scalars[k] = next(property.value_type)?,
                Some(count_type) => {
                    let count = next(count_type)?;
                    row.lists[k].clear();
                    while (row.lists[k].len() as f64) < count {
                        row.lists[k].push(next(property.value_type)?);
                    }
                }
            }
        }
        take(index, &row)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::Wanted;
    use super::read;
    use super::read_wanted;
    use crate::formats::input::shift::Shift;
    use crate::formats::ply::error::PlyError;

    const QUAD: &str = "ply\nformat ascii 1.0\ncomment units m\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
        property int scan\nelement face 1\nproperty list uchar int vertex_indices\nproperty int plane\nend_header\n\
        0 0 0 7\n1 0 0 7\n1 1 0 8\n0 1 0 8\n4 0 1 2 3 5\n";

    fn binary() -> Vec<u8> {
        let mut bytes = b"ply\r\nformat binary_little_endian 1.0\r\nelement vertex 3\r\nproperty double x\r\nproperty float y\r\n\
            property float z\r\nproperty uchar red\r\nelement face 1\r\nproperty list uchar uint vertex_index\r\nend_header\r\n"
            .to_vec();
        for (x, y, z) in [(0.5f64, 1.0f32, 2.0f32), (1.5, 1.0, 2.0), (1.5, 3.0, 2.0)] {
            bytes.extend(x.to_le_bytes());
            bytes.extend(y.to_le_bytes());
            bytes.extend(z.to_le_bytes());
            bytes.push(200);
        }
        bytes.push(3);
        [2u32, 1, 0].iter().for_each(|k| bytes.extend(k.to_le_bytes()));
        bytes
    }

    #[test]
    fn an_ascii_quad_becomes_two_triangles_with_its_properties() {
        let ply = read(QUAD.as_bytes()).unwrap();
        assert_eq!(ply.mesh.vertices_m[2], [1.0, 1.0, 0.0]);
        assert_eq!(ply.mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
        assert_eq!(ply.vertex_column("scan"), Some(&[7.0, 7.0, 8.0, 8.0][..]));
        assert_eq!(ply.face_column("plane"), Some(&[5.0, 5.0][..]));
        assert_eq!(ply.face_column("color"), None);
    }

    #[test]
    fn a_binary_triangle_is_read_to_the_bit() {
        let ply = read(&binary()).unwrap();
        assert_eq!(ply.mesh.vertices_m, [[0.5, 1.0, 2.0], [1.5, 1.0, 2.0], [1.5, 3.0, 2.0]]);
        assert_eq!(ply.mesh.triangles, [[2, 1, 0]]);
        assert_eq!(ply.vertex_column("red"), Some(&[200.0; 3][..]));
    }

    #[test]
    fn either_byte_order_any_order_of_properties_and_foreign_elements_read_the_same() {
        let mut bytes = b"ply\nformat binary_big_endian 1.0\ncomment caf\xe9\nelement marker 2\nproperty list uchar short at\n\
            element vertex 2\nproperty uchar red\nproperty double z\nproperty float x\nproperty short y\nproperty int scan\n\
            element scan 1\nproperty float x\nproperty float y\nproperty float z\nelement nothing 1000000000000\nend_header\n"
            .to_vec();
        bytes.extend([2, 1, 2, 3, 4, 0]);
        for k in 0..2i16 {
            bytes.push(7);
            bytes.extend((2.5 + f64::from(k)).to_be_bytes());
            bytes.extend(0.25f32.to_be_bytes());
            bytes.extend((-3 * k).to_be_bytes());
            bytes.extend((70_000 + i32::from(k)).to_be_bytes());
        }
        [1.0f32, 2.0, 3.0].iter().for_each(|v| bytes.extend(v.to_be_bytes()));
        let ply = read_wanted(&bytes, &Wanted { columns: Some(&["scan"]), ..Wanted::default() }).unwrap();
        assert_eq!(ply.mesh.vertices_m, [[0.25, 0.0, 2.5], [0.25, -3.0, 3.5]]);
        assert_eq!(ply.vertex_columns, [("scan".to_owned(), vec![70_000.0, 70_001.0])]);
        assert_eq!(ply.scan_origins_m, [[1.0, 2.0, 3.0]]);
    }

    #[test]
    fn coordinates_far_from_zero_are_moved_and_keep_their_millimeters() {
        let text = "ply\nformat ascii 1.0\nelement vertex 2\nproperty double x\nproperty double y\nproperty double z\nend_header\n\
            5432109.123 -654321.5 12.25\n5432109.125 -654321.5 12.25\n";
        let ply = read_wanted(text.as_bytes(), &Wanted { shift: Shift::Find, columns: None }).unwrap();
        let first: [f64; 3] = std::array::from_fn(|k| f64::from(ply.mesh.vertices_m[0][k]) + ply.shift_m[k]);
        for (got, want) in first.iter().zip([5_432_109.123, -654_321.5, 12.25]) {
            assert!((got - want).abs() < 1e-5, "{first:?}");
        }
        assert!((ply.mesh.vertices_m[1][0] - ply.mesh.vertices_m[0][0] - 0.002).abs() < 1e-5);
        assert_eq!(read(text.as_bytes()).unwrap().shift_m, [0.0; 3]);
    }

    #[test]
    fn every_cut_of_a_file_is_an_error_and_none_a_panic() {
        for file in [QUAD.as_bytes().to_vec(), binary()] {
            // The last two bytes of the text are its last digit and a newline.
            for end in 0..file.len() - 2 {
                assert!(read(&file[..end]).is_err(), "cut at {end}");
            }
        }
    }

    #[test]
    fn errors_say_what_and_where() {
        let broken = |from: &str, to: &str| read(QUAD.replace(from, to).as_bytes()).unwrap_err().to_string();
        assert_eq!(broken("ply\n", "pyl\n"), PlyError::NotPly.to_string());
        assert_eq!(
            broken("ascii", "binary_middle_endian"),
            "line 2 of the PLY header: expected format ascii, binary_little_endian or binary_big_endian, version 1.0, found \
             `format binary_middle_endian 1.0`"
        );
        assert_eq!(
            broken("4 0 1 2 3 5", "4 0 1 2 9 5"),
            "face 1 of the PLY file refers to vertex 9, there are 4"
        );
        assert_eq!(broken("1 1 0 8", "1 x 0 8"), "vertex 2 of the PLY file: expected a number, found `x`");
        let endless = broken("end_header\n", &"\u{1}\u{2}".repeat(100));
        assert!(endless.ends_with(&format!("found `{}`", "\u{fffd}".repeat(60))), "{endless:?}");
        assert_eq!(
            broken("element vertex 4", "element vertex 1000000000000"),
            "the PLY file ends inside vertex 5 of 1000000000000"
        );
    }
}
