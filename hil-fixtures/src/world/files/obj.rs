//! Triangle meshes from Wavefront OBJ files.
//!
//! Vertices (`v`) in meters, faces (`f`) of any number of corners, cut into fans; corners as `7`, `7/1`,
//! `7//3`, `7/1/3` or counted backwards (`-1` is the last vertex so far). Objects (`o`) are named runs of
//! faces; groups, materials, normals and texture are passed over. The faces get no plane label here.

use crate::world::mesh::{LabeledMesh, NO_PLANE, Object};
use crate::world::vec3::Vec3;

/// What is wrong in an OBJ file.
#[derive(Debug, PartialEq, thiserror::Error)]
pub enum ObjError {
    /// A vertex without three numbers.
    #[error("line {line}: expected `v x y z` with three numbers, found `{found}`")]
    Vertex {
        /// Counted from 1.
        line: usize,
        /// The line.
        found: String,
    },
    /// A face with a corner that is no vertex.
    #[error("line {line}: face corner `{found}`: expected a vertex from 1 to {vertices}")]
    Corner {
        /// Counted from 1.
        line: usize,
        /// The corner.
        found: String,
        /// Vertices so far.
        vertices: usize,
    },
    /// Nothing in it.
    #[error("no faces in it")]
    Empty,
}

/// Reads a mesh and its objects.
pub fn parse(text: &str) -> Result<(LabeledMesh, Vec<Object>), ObjError> {
    let mut mesh = LabeledMesh::default();
    let mut objects: Vec<Object> = Vec::new();
    for (index, content) in text.lines().enumerate() {
        let line = index + 1;
        let mut words = content.split_ascii_whitespace();
        match words.next() {
            Some("v") => {
                let vertex =
                    vertex(&mut words).ok_or_else(|| ObjError::Vertex { line, found: shortened(content) })?;
                mesh.vertices_m.push(vertex);
            }
            Some("f") => {
                let vertices = mesh.vertices_m.len();
                let corner = |word: &str| {
                    corner(word, vertices).ok_or_else(|| ObjError::Corner {
                        line,
                        found: shortened(word),
                        vertices,
                    })
                };
                let corners = words.map(corner).collect::<Result<Vec<u32>, _>>()?;
                for i in 2..corners.len() {
                    mesh.face([corners[0], corners[i - 1], corners[i]], NO_PLANE);
                }
            }
            Some("o") => {
                let first = mesh.faces.len();
                objects.push(Object { name: words.collect::<Vec<_>>().join(" "), faces: first..first });
            }
            _ => {}
        }
        if let Some(object) = objects.last_mut() {
            object.faces.end = mesh.faces.len();
        }
    }
    if mesh.faces.is_empty() { Err(ObjError::Empty) } else { Ok((mesh, objects)) }
}

fn vertex<'a>(words: &mut impl Iterator<Item = &'a str>) -> Option<Vec3> {
    let mut next = || words.next()?.parse::<f64>().ok().filter(|value| value.is_finite());
    Some([next()?, next()?, next()?])
}

fn corner(word: &str, vertices: usize) -> Option<u32> {
    let number: i64 = word.split('/').next()?.parse().ok()?;
    let index = if number < 0 { i64::try_from(vertices).ok()? + number } else { number - 1 };
    let index = u32::try_from(index).ok()?;
    ((index as usize) < vertices).then_some(index)
}

/// The first characters of what was found, for a message.
fn shortened(text: &str) -> String {
    text.chars().take(40).collect()
}

#[cfg(test)]
mod tests {
    use super::{ObjError, parse};

    #[test]
    fn corners_come_in_all_their_spellings() {
        let text = "# a square\no wall\nv 0 0 0\nv 1 0 0 0.5 0.5 0.5\nv 1 1 0\nv 0 1e0 0\nvn 0 0 1\nf 1/1/1 2//1 3/2 4\nf -4 -3 -2\n";
        let (mesh, objects) = parse(text).expect("a mesh");
        assert_eq!((objects[0].name.as_str(), objects[0].faces.clone()), ("wall", 0..3));
        assert_eq!(mesh.vertices_m[3], [0.0, 1.0, 0.0]);
        assert_eq!(mesh.faces, vec![[0, 1, 2], [0, 2, 3], [0, 1, 2]]);
    }

    #[test]
    fn errors_name_the_line() {
        let found = |text: &str| parse(text).expect_err("broken").to_string();
        assert!(found("v 0 0 0\nv 1 x 0\n").contains("line 2"));
        assert!(found("v 0 0 0\nf 1 1 2\n").contains("corner `2`"));
        assert!(found("v 0 0 0\nf 1 1 0\n").contains("corner `0`"));
        assert!(found("v 0 0 nan\n").contains("line 1"));
        assert_eq!(parse("v 0 0 0\n"), Err(ObjError::Empty));
    }
}
