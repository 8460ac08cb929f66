//! Labelled triangle meshes as PLY files: written in binary, read in ASCII and binary (little-endian).
//!
//! Vertices have float properties x, y, z in metres; faces a list of vertex indices and, where there is one, an int property
//! `plane`. Polygons are cut into fans; other elements and properties are passed over. Format: Turk, "The PLY polygon file format".

use crate::world::mesh::{LabelledMesh, NO_PLANE};
use header::{Element, Header, Kind, Scalar};
use std::io::{self, Write};

mod header;

/// Writes a mesh.
pub fn write_ply(out: &mut dyn Write, mesh: &LabelledMesh) -> io::Result<()> {
    writeln!(out, "ply\nformat binary_little_endian 1.0\ncomment metres; plane -1: no plane")?;
    writeln!(out, "element vertex {}", mesh.vertices_m.len())?;
    writeln!(out, "property float x\nproperty float y\nproperty float z")?;
    writeln!(out, "element face {}", mesh.faces.len())?;
    writeln!(out, "property list uchar int vertex_indices\nproperty int plane\nend_header")?;
    for vertex in &mesh.vertices_m {
        for coordinate in vertex {
            out.write_all(&(*coordinate as f32).to_le_bytes())?;
        }
    }
    for (face, plane) in mesh.faces.iter().zip(&mesh.planes) {
        out.write_all(&[3])?;
        for index in face {
            out.write_all(&index.to_le_bytes())?;
        }
        out.write_all(&plane.to_le_bytes())?;
    }
    Ok(())
}

/// What is wrong in a PLY file.
#[derive(Debug, PartialEq, thiserror::Error)]
pub enum PlyError {
    /// The head is no PLY head.
    #[error("line {line} of the head: expected {expected}, found `{found}`")]
    Header {
        /// Counted from 1.
        line: usize,
        /// What should stand there.
        expected: &'static str,
        /// What stands there.
        found: String,
    },
    /// A format that is not read.
    #[error("format `{found}`: expected ascii or binary_little_endian")]
    Format {
        /// The format.
        found: String,
    },
    /// Something that a mesh needs is missing.
    #[error("no {what}")]
    Missing {
        /// What is missing.
        what: &'static str,
    },
    /// The file ends too early, or a word is no number.
    #[error("{element} {index} (from 0): expected a number at byte {offset} of the data, found {found}")]
    Data {
        /// Element.
        element: String,
        /// Which one.
        index: usize,
        /// Where.
        offset: usize,
        /// What is there.
        found: &'static str,
    },
    /// A face names a vertex that is not there.
    #[error("face {face} (from 0): vertex {found} of {vertices}")]
    Index {
        /// Which face.
        face: usize,
        /// What it names.
        found: f64,
        /// How many there are.
        vertices: usize,
    },
}

/// Reads a mesh. Tells whether its faces came with plane labels.
pub fn parse(bytes: &[u8]) -> Result<(LabelledMesh, bool), PlyError> {
    let (header, data) = Header::parse(bytes)?;
    let mut source = Source { data, offset: 0, ascii: header.ascii };
    let mut mesh = LabelledMesh::default();
    let mut labelled = false;
    for element in &header.elements {
        match element.name.as_str() {
            "vertex" => read_vertices(element, &mut source, &mut mesh)?,
            "face" => labelled = read_faces(element, &mut source, &mut mesh)?,
            _ => {
                // A row without properties has no bytes: the count of such rows means nothing, however large.
                let rows = if element.properties.is_empty() { 0 } else { element.count };
                for index in 0..rows {
                    read_row(element, index, &mut source, |_, _| {})?;
                }
            }
        }
    }
    if mesh.faces.is_empty() { Err(PlyError::Missing { what: "faces" }) } else { Ok((mesh, labelled)) }
}

fn read_vertices(
    element: &Element,
    source: &mut Source<'_>,
    mesh: &mut LabelledMesh,
) -> Result<(), PlyError> {
    let place = |name| element.properties.iter().position(|property| property.name == name);
    let (Some(x), Some(y), Some(z)) = (place("x"), place("y"), place("z")) else {
        return Err(PlyError::Missing { what: "x, y, z of vertices" });
    };
    for index in 0..element.count {
        let mut vertex = [0.0; 3];
        read_row(element, index, source, |property, values| {
            for (axis, own) in [x, y, z].into_iter().enumerate() {
                if own == property {
                    vertex[axis] = values.first().copied().unwrap_or(0.0);
                }
            }
        })?;
        mesh.vertices_m.push(vertex);
    }
    Ok(())
}

fn read_faces(element: &Element, source: &mut Source<'_>, mesh: &mut LabelledMesh) -> Result<bool, PlyError> {
    let is_list = |name: &str| ["vertex_indices", "vertex_index"].contains(&name);
    let list = element.properties.iter().position(|property| is_list(&property.name));
    let list = list.ok_or(PlyError::Missing { what: "vertex_indices of faces" })?;
    let plane = element.properties.iter().position(|property| property.name == "plane");
    let vertices = mesh.vertices_m.len();
    for face in 0..element.count {
        let (mut corners, mut label) = (Vec::new(), NO_PLANE);
        read_row(element, face, source, |property, values| {
            if property == list {
                corners = values.to_vec();
            } else if Some(property) == plane {
                label = values.first().map_or(NO_PLANE, |value| *value as i32);
            }
        })?;
        if let Some(found) = corners.iter().copied().find(|v| !(0.0..vertices as f64).contains(v)) {
            return Err(PlyError::Index { face, found, vertices });
        }
        for i in 2..corners.len() {
            mesh.face([corners[0] as u32, corners[i - 1] as u32, corners[i] as u32], label);
        }
    }
    Ok(plane.is_some())
}

/// Reads all properties of one row; `take` gets each one's index and values.
fn read_row(
    element: &Element,
    index: usize,
    source: &mut Source<'_>,
    mut take: impl FnMut(usize, &[f64]),
) -> Result<(), PlyError> {
    for (place, property) in element.properties.iter().enumerate() {
        let read = |source: &mut Source<'_>, scalar| {
            let offset = source.offset;
            let found = |found| PlyError::Data { element: element.name.clone(), index, offset, found };
            source.number(scalar).map_err(found)
        };
        match property.kind {
            Kind::One(scalar) => {
                let value = read(source, scalar)?;
                take(place, &[value]);
            }
            Kind::List(count, scalar) => {
                let count = read(source, count)?;
                // Grows with what is really there, whatever the count says.
                let mut values = Vec::new();
                for _ in 0..count.max(0.0) as u64 {
                    values.push(read(source, scalar)?);
                }
                take(place, &values);
            }
        }
    }
    Ok(())
}

/// Numbers of the data part.
struct Source<'a> {
    data: &'a [u8],
    offset: usize,
    ascii: bool,
}

impl Source<'_> {
    fn number(&mut self, scalar: Scalar) -> Result<f64, &'static str> {
        let rest = self.data.get(self.offset..).unwrap_or(&[]);
        if self.ascii {
            let start = rest.iter().position(|b| !b.is_ascii_whitespace()).ok_or("the end of the file")?;
            let word = &rest[start..];
            let length = word.iter().position(u8::is_ascii_whitespace).unwrap_or(word.len());
            self.offset += start + length;
            let text = std::str::from_utf8(&word[..length]).map_err(|_| "something else")?;
            return text.parse::<f64>().ok().filter(|value| value.is_finite()).ok_or("something else");
        }
        let (value, length) = scalar.read(rest).ok_or("the end of the file")?;
        self.offset += length;
        if value.is_finite() { Ok(value) } else { Err("something else") }
    }
}

#[cfg(test)]
mod tests {
    use super::{PlyError, parse, write_ply};
    use crate::world::mesh::LabelledMesh;

    fn square() -> LabelledMesh {
        LabelledMesh {
            vertices_m: vec![[0.0, 0.0, 0.5], [1.0, 0.0, 0.5], [1.0, 1.0, 0.5], [0.0, 1.0, 0.5]],
            faces: vec![[0, 1, 2], [0, 2, 3]],
            planes: vec![7, -1],
        }
    }

    #[test]
    fn what_is_written_is_read_again() {
        let mut bytes = Vec::new();
        write_ply(&mut bytes, &square()).expect("written");
        assert_eq!(parse(&bytes), Ok((square(), true)));
    }

    #[test]
    fn ascii_polygons_with_foreign_properties_become_fans() {
        let text = "ply\nformat ascii 1.0\ncomment by hand\nelement vertex 4\nproperty double x\nproperty double y\nproperty uchar red\n\
                    property float z\nelement face 1\nproperty list uchar int vertex_index\nelement edge 1\nproperty int a\n\
                    property int b\nend_header\n0 0 255 0.5\n1 0 255 0.5\n1 1 255 0.5\n0 1 255 0.5\n4 0 1 2 3\n0 1\n";
        let (mesh, labelled) = parse(text.as_bytes()).expect("a mesh");
        assert_eq!((mesh.vertices_m, mesh.faces, labelled), (square().vertices_m, square().faces, false));
        assert_eq!(mesh.planes, vec![-1, -1]);
    }

    #[test]
    fn every_truncation_is_an_error_and_none_a_panic() {
        let mut bytes = Vec::new();
        write_ply(&mut bytes, &square()).expect("written");
        for length in 0..bytes.len() {
            assert!(parse(&bytes[..length]).is_err(), "{length}");
        }
    }

    #[test]
    fn impossible_counts_indices_and_formats_are_refused() {
        let file = |format: &str, face: &str| {
            format!(
                "ply\nformat {format} 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 1\n\
                 property list uint int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n{face}\n"
            )
        };
        assert!(matches!(parse(file("ascii", "4000000000 0 1 2").as_bytes()), Err(PlyError::Data { .. })));
        assert!(matches!(
            parse(file("ascii", "3 0 1 3").as_bytes()),
            Err(PlyError::Index { found: 3.0, .. })
        ));
        assert!(matches!(parse(file("ascii", "3 0 1 -1").as_bytes()), Err(PlyError::Index { .. })));
        assert!(matches!(parse(file("binary_big_endian", "").as_bytes()), Err(PlyError::Format { .. })));
        assert!(matches!(parse(b"solid stl"), Err(PlyError::Header { line: 1, .. })));
    }
}
