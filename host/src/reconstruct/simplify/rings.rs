//! Which triangles are about each vertex, and the edges of a mesh.

use rayon::prelude::*;

/// The triangles about each vertex.
#[derive(Debug)]
pub(crate) struct Rings {
    /// Where each vertex's triangles begin in `triangles`; one more than there are vertices.
    starts: Vec<u32>,
    triangles: Vec<u32>,
}

/// An edge, its vertices ascending.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Edge {
    /// The two vertices.
    pub ends: [u32; 2],
    /// Triangles that share it: 1 at a border, 2 inside, more where surfaces meet.
    pub triangles: u32,
    /// One of those triangles.
    pub triangle: u32,
}

impl Rings {
    /// Of triangles whose corners are below `vertices`.
    pub(crate) fn new(vertices: usize, triangles: &[[u32; 3]]) -> Self {
        let mut starts = vec![0u32; vertices + 1];
        for corner in triangles.as_flattened() {
            starts[*corner as usize + 1] += 1;
        }
        for at in 0..vertices {
            starts[at + 1] += starts[at];
        }
        let mut next = starts.clone();
        let mut sorted = vec![0; 3 * triangles.len()];
        for (index, triangle) in triangles.iter().enumerate() {
            for corner in triangle {
                let slot = &mut next[*corner as usize];
                sorted[*slot as usize] = index as u32;
                *slot += 1;
            }
        }
        Self { starts, triangles: sorted }
    }

    /// The triangles about a vertex, ascending.
    pub(crate) fn of(&self, vertex: u32) -> &[u32] {
        let [start, end] = [self.starts[vertex as usize], self.starts[vertex as usize + 1]];
        &self.triangles[start as usize..end as usize]
    }

    /// All edges of the triangles that these are the rings of, by their first vertex, then their second.
    pub(crate) fn edges(&self, triangles: &[[u32; 3]]) -> Vec<Edge> {
        let vertices = self.starts.len() as u32 - 1;
        let from = |vertex: u32| {
            let mut found: Vec<(u32, u32)> = Vec::new();
            for &index in self.of(vertex) {
                let others = triangles[index as usize].into_iter().filter(|other| *other > vertex);
                found.extend(others.map(|other| (other, index)));
            }
            found.sort_unstable();
            let edge = |group: &[(u32, u32)]| Edge {
                ends: [vertex, group[0].0],
                triangles: group.len() as u32,
                triangle: group[0].1,
            };
            found.chunk_by(|a, b| a.0 == b.0).map(edge).collect::<Vec<_>>()
        };
        (0..vertices).into_par_iter().flat_map_iter(from).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::{Edge, Rings};

    #[test]
    fn two_triangles_have_four_borders_and_an_edge_between_them() {
        let triangles = [[0, 1, 2], [2, 1, 4]];
        let rings = Rings::new(5, &triangles);
        assert_eq!(
            [0, 1, 2, 3, 4].map(|v| rings.of(v).to_vec()),
            [vec![0], vec![0, 1], vec![0, 1], vec![], vec![1]]
        );
        let edge = |a, b, triangles, triangle| Edge { ends: [a, b], triangles, triangle };
        assert_eq!(
            rings.edges(&triangles),
            [edge(0, 1, 1, 0), edge(0, 2, 1, 0), edge(1, 2, 2, 0), edge(1, 4, 1, 1), edge(2, 4, 1, 1)]
        );
    }
}
