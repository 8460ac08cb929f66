//! Reads Wavefront OBJ meshes: vertices and faces; everything else is skipped.
//!
//! Coordinates as in the file (meters by convention). Source: the OBJ format appendix of Wavefront's Advanced
//! Visualizer manual.

use crate::formats::text::short::short;

/// Vertices and triangles of a file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Obj {
    /// Vertex positions.
    pub vertices_m: Vec<[f64; 3]>,
    /// Faces; those with more than three corners are cut into fans.
    pub triangles: Vec<[u32; 3]>,
}

/// Why a file is no OBJ that can be read here.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ObjError {
    /// A vertex without three numbers.
    #[error("line {line} of the OBJ file: expected `v X Y Z`, found `{found}`")]
    Vertex {
        /// Line in the file, from 1.
        line: usize,
        /// What stands there.
        found: String,
    },
    /// A face that refers to no vertex before it.
    #[error("line {line} of the OBJ file: a face refers to vertex `{found}`, there are {vertices} before it")]
    NoSuchVertex {
        /// Line in the file, from 1.
        line: usize,
        /// What stands there.
        found: String,
        /// How many there are.
        vertices: usize,
    },
}

/// Reads a file's bytes.
///
/// # Errors
/// When a vertex is no three numbers, or a face refers to one that is not there.
pub fn read(bytes: &[u8]) -> Result<Obj, ObjError> {
    let mut obj = Obj::default();
    for (index, text) in bytes.split(|byte| *byte == b'\n').enumerate() {
        let text = String::from_utf8_lossy(text);
        let mut words = text.split_whitespace();
        match words.next() {
            Some("v") => {
                let mut next = || words.next()?.parse::<f64>().ok();
                match (next(), next(), next()) {
                    (Some(x), Some(y), Some(z)) => obj.vertices_m.push([x, y, z]),
                    _ => return Err(ObjError::Vertex { line: index + 1, found: short(&text) }),
                }
            }
            Some("f") => {
                let vertices = obj.vertices_m.len();
                let lack =
                    |word: &str| ObjError::NoSuchVertex { line: index + 1, found: short(word), vertices };
                let corners = words.map(|word| corner(word, vertices).ok_or_else(|| lack(word)));
                let corners: Vec<u32> = corners.collect::<Result<_, _>>()?;
                obj.triangles.extend(corners.windows(2).skip(1).map(|pair| [corners[0], pair[0], pair[1]]));
            }
            _ => {}
        }
    }
    Ok(obj)
}

/// The vertex of a corner such as `7`, `7/1/3` or `-1` (the last one so far), from 0.
fn corner(word: &str, vertices: usize) -> Option<u32> {
    let number: i64 = word.split('/').next()?.parse().ok()?;
    let index = if number < 0 { number.checked_add(i64::try_from(vertices).ok()?)? } else { number - 1 };
    u32::try_from(index).ok().filter(|index| (*index as usize) < vertices)
}

#[cfg(test)]
mod tests {
    use super::read;

    #[test]
    fn faces_refer_to_vertices_from_the_front_or_the_end_and_become_triangles() {
        let text = b"# comment\nmtllib a.mtl\no wall\nv 0 0 0\nv 1 0 0 0.5 0.5 0.5\r\nv 1 1 0\nv 0 1 0\nvn 0 0 1\nvt 0 0\n\
            f 1//1 2/1/1 3/1 4\nv 5 5 5\nf -1 -4 1\nl 1 2\nf 1 2\n";
        let obj = read(text).unwrap();
        assert_eq!(obj.vertices_m[4], [5.0; 3]);
        assert_eq!(obj.triangles, [[0, 1, 2], [0, 2, 3], [4, 1, 0]]);
        assert_eq!(read(b"").unwrap().vertices_m.len(), 0);
    }

    #[test]
    fn what_is_wrong_is_said_with_its_line() {
        let error = |text: &[u8]| read(text).unwrap_err().to_string();
        assert_eq!(error(b"\nv 1 x 3\n"), "line 2 of the OBJ file: expected `v X Y Z`, found `v 1 x 3`");
        let lack = "line 2 of the OBJ file: a face refers to vertex `2/7`, there are 1 before it";
        assert_eq!(error(b"v 1 2 3\nf 1 2/7 1\n"), lack);
        for bad in ["0", "-2", "999999999999999999999", "a", "", "-9223372036854775808"] {
            assert!(read(format!("v 1 2 3\nf 1 1 /{bad}\n").as_bytes()).is_err());
            assert_eq!(read(format!("v 1 2 3\nf 1 1 {bad}\n").as_bytes()).is_err(), !bad.is_empty(), "{bad}");
        }
    }
}
