//! Reads PLY meshes and point clouds: ASCII and binary little endian, as CloudCompare, MeshLab and this project write them.
//!
//! Coordinates as in the file (metres by convention). Source: G. Turk, "The PLY Polygon File Format" (1994). Nothing in a file makes
//! this panic or reserve memory that the file does not fill.

mod header;
mod values;

use crate::model::Mesh;
use header::{Element, Header, Property};
use values::Values;

/// What a PLY file holds.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Ply {
    /// Vertices and faces; faces with more than three corners are cut into fans.
    pub mesh: Mesh,
    /// Every other scalar property of the vertices, by name, in file order.
    pub vertex_columns: Vec<(String, Vec<f64>)>,
    /// Every scalar property of the faces, one value a triangle.
    pub face_columns: Vec<(String, Vec<f64>)>,
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

/// Why a file is no PLY that can be read here.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PlyError {
    /// The first line is not `ply`.
    #[error("not a PLY file: it does not begin with the line `ply`")]
    NotPly,
    /// A line of the header is none.
    #[error("line {line} of the PLY header: expected {expected}, found `{found}`")]
    Header {
        /// Line in the file, from 1.
        line: usize,
        /// What would have been right.
        expected: &'static str,
        /// What stands there.
        found: String,
    },
    /// The header promises more than the file holds.
    #[error("the PLY file ends inside {element} {index} of {count}")]
    Truncated {
        /// Name of the element.
        element: String,
        /// Which one, from 0.
        index: usize,
        /// How many the header promises.
        count: usize,
    },
    /// A word of an ASCII file is no number.
    #[error("{element} {index} of the PLY file: expected a number, found `{found}`")]
    NotANumber {
        /// Name of the element.
        element: String,
        /// Which one, from 0.
        index: usize,
        /// What stands there.
        found: String,
    },
    /// A face refers to a vertex that is not there.
    #[error("face {face} of the PLY file refers to vertex {vertex}, there are {vertices}")]
    NoSuchVertex {
        /// Which face, from 0.
        face: usize,
        /// The vertex it names.
        vertex: i64,
        /// How many there are.
        vertices: usize,
    },
    /// The vertices have no coordinates.
    #[error("the PLY file has no vertices with the properties x, y and z")]
    NoVertices,
}

/// Reads a file's bytes.
pub fn read(bytes: &[u8]) -> Result<Ply, PlyError> {
    let (header, body) = Header::parse(bytes)?;
    let mut values = Values::new(header.format, body);
    let mut ply = Ply::default();
    let mut has_vertices = false;
    for element in &header.elements {
        match element.name.as_str() {
            "vertex" => {
                read_vertices(element, &mut values, &mut ply)?;
                has_vertices = true;
            }
            "face" => read_faces(element, &mut values, &mut ply)?,
            _ => skip(element, &mut values)?,
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

fn read_vertices(element: &Element, values: &mut Values<'_>, ply: &mut Ply) -> Result<(), PlyError> {
    let at = |name: &str| element.properties.iter().position(|p| p.name == name && p.count_type.is_none());
    let (Some(x), Some(y), Some(z)) = (at("x"), at("y"), at("z")) else { return Err(PlyError::NoVertices) };
    let others: Vec<usize> = scalars(element).filter(|k| ![x, y, z].contains(k)).collect();
    let mut columns = columns_for(element, &others);
    for index in 0..element.count {
        let row = read_row(element, index, values)?.scalars;
        ply.mesh.vertices_m.push([row[x] as f32, row[y] as f32, row[z] as f32]);
        columns.iter_mut().zip(&others).for_each(|(column, k)| column.1.push(row[*k]));
    }
    ply.vertex_columns = columns;
    Ok(())
}

fn read_faces(element: &Element, values: &mut Values<'_>, ply: &mut Ply) -> Result<(), PlyError> {
    let named = |p: &Property| {
        p.count_type.is_some() && ["vertex_indices", "vertex_index"].contains(&p.name.as_str())
    };
    let corners_at = element.properties.iter().position(named);
    let others: Vec<usize> = scalars(element).collect();
    let mut columns = columns_for(element, &others);
    for index in 0..element.count {
        let row = read_row(element, index, values)?;
        let Some(corners) = corners_at.and_then(|k| row.lists.iter().find(|list| list.0 == k)) else {
            continue;
        };
        let corners = corners_of(&corners.1, index, ply.mesh.vertices_m.len())?;
        for pair in corners.windows(2).skip(1) {
            ply.mesh.triangles.push([corners[0], pair[0], pair[1]]);
            columns.iter_mut().zip(&others).for_each(|(column, k)| column.1.push(row.scalars[*k]));
        }
    }
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

fn skip(element: &Element, values: &mut Values<'_>) -> Result<(), PlyError> {
    // An element without properties has no bytes: its count means nothing.
    let count = if element.properties.is_empty() { 0 } else { element.count };
    (0..count).try_for_each(|index| read_row(element, index, values).map(drop))
}

fn scalars(element: &Element) -> impl Iterator<Item = usize> + '_ {
    (0..element.properties.len()).filter(|k| element.properties[*k].count_type.is_none())
}

fn columns_for(element: &Element, which: &[usize]) -> Vec<(String, Vec<f64>)> {
    which.iter().map(|k| (element.properties[*k].name.clone(), Vec::new())).collect()
}

/// The values of one element: a slot a property (lists leave theirs at 0), and the lists with their property's index.
struct Row {
    scalars: Vec<f64>,
    lists: Vec<(usize, Vec<f64>)>,
}

fn read_row(element: &Element, index: usize, values: &mut Values<'_>) -> Result<Row, PlyError> {
    let mut row = Row { scalars: vec![0.0; element.properties.len()], lists: Vec::new() };
    for (k, property) in element.properties.iter().enumerate() {
        let mut next = |scalar| values.next(scalar).map_err(|lack| lack.at(element, index));
        match property.count_type {
            None => row.scalars[k] = next(property.value_type)?,
            Some(count_type) => {
                let count = next(count_type)?;
                let mut list = Vec::new();
                while (list.len() as f64) < count {
                    list.push(next(property.value_type)?);
                }
                row.lists.push((k, list));
            }
        }
    }
    Ok(row)
}

#[cfg(test)]
mod tests {
    use super::{PlyError, read};

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
        assert_eq!(ply.face_column("colour"), None);
    }

    #[test]
    fn a_binary_triangle_is_read_to_the_bit() {
        let ply = read(&binary()).unwrap();
        assert_eq!(ply.mesh.vertices_m, [[0.5, 1.0, 2.0], [1.5, 1.0, 2.0], [1.5, 3.0, 2.0]]);
        assert_eq!(ply.mesh.triangles, [[2, 1, 0]]);
        assert_eq!(ply.vertex_column("red"), Some(&[200.0; 3][..]));
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
            broken("ascii", "binary_big_endian"),
            "line 2 of the PLY header: expected format ascii or binary_little_endian, found `format binary_big_endian 1.0`"
        );
        assert_eq!(
            broken("4 0 1 2 3 5", "4 0 1 2 9 5"),
            "face 1 of the PLY file refers to vertex 9, there are 4"
        );
        assert_eq!(broken("1 1 0 8", "1 x 0 8"), "vertex 2 of the PLY file: expected a number, found `x`");
        assert_eq!(
            broken("element vertex 4", "element vertex 99999999999"),
            "the PLY file ends inside vertex 5 of 99999999999"
        );
    }
}
