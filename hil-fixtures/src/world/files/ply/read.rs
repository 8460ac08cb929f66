//! A mesh from an ASCII or binary PLY file.

use super::PlyError;
use super::header::{Element, Header, Kind, Scalar};
use crate::world::mesh::{LabeledMesh, NO_PLANE};

/// Reads a mesh. Tells whether its faces came with plane labels.
pub fn parse(bytes: &[u8]) -> Result<(LabeledMesh, bool), PlyError> {
    let (header, data) = Header::parse(bytes)?;
    let mut source = Source { data, offset: 0, ascii: header.ascii };
    let mut mesh = LabeledMesh::default();
    let mut labeled = false;
    for element in &header.elements {
        match element.name.as_str() {
            "vertex" => read_vertices(element, &mut source, &mut mesh)?,
            "face" => labeled = read_faces(element, &mut source, &mut mesh)?,
            _ => {
                // A row without properties has no bytes: the count of such rows means nothing, however large.
                let rows = if element.properties.is_empty() { 0 } else { element.count };
                for index in 0..rows {
                    read_row(element, index, &mut source, |_, _| {})?;
                }
            }
        }
    }
    if mesh.faces.is_empty() { Err(PlyError::Missing { what: "faces" }) } else { Ok((mesh, labeled)) }
}

fn read_vertices(element: &Element, source: &mut Source<'_>, mesh: &mut LabeledMesh) -> Result<(), PlyError> {
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

fn read_faces(element: &Element, source: &mut Source<'_>, mesh: &mut LabeledMesh) -> Result<bool, PlyError> {
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
