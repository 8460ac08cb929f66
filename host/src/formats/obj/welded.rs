//! Corners of many polygons as one list of vertices: corners closer than a step are one vertex.

use std::collections::BTreeMap;

/// Vertices on a fine lattice, numbered from 0 in the order in which they first came.
#[derive(Debug)]
pub(crate) struct WeldedVertices {
    step_m: f64,
    known: BTreeMap<[i64; 3], usize>,
    lattice: Vec<[i64; 3]>,
}

impl WeldedVertices {
    /// No vertices yet; `step_m` is the lattice's step, meters.
    pub(crate) fn new(step_m: f64) -> Self {
        Self { step_m, known: BTreeMap::new(), lattice: Vec::new() }
    }

    /// The vertices as whole steps.
    pub(crate) fn lattice(&self) -> &[[i64; 3]] {
        &self.lattice
    }

    /// The vertices, meters.
    pub(crate) fn positions_m(&self) -> impl Iterator<Item = [f64; 3]> + '_ {
        self.lattice.iter().map(|at| at.map(|steps| steps as f64 * self.step_m))
    }

    /// The number of the vertex at a point.
    pub(crate) fn index_of(&mut self, point_m: [f64; 3]) -> usize {
        let at = point_m.map(|value| (value / self.step_m).round() as i64);
        let next = self.lattice.len();
        let index = *self.known.entry(at).or_insert(next);
        if index == next {
            self.lattice.push(at);
        }
        index
    }

    /// The numbers of a ring's vertices, neighbors that became one left out; empty when fewer than three are
    /// left.
    pub(crate) fn ring(&mut self, points_m: &[[f64; 3]]) -> Vec<usize> {
        let mut ring: Vec<usize> = points_m.iter().map(|point| self.index_of(*point)).collect();
        ring.dedup();
        while ring.len() > 1 && ring.first() == ring.last() {
            ring.pop();
        }
        if ring.len() < 3 { Vec::new() } else { ring }
    }
}

#[cfg(test)]
mod tests {
    use super::WeldedVertices;

    #[test]
    fn corners_within_a_step_are_one_vertex_and_slivers_vanish() {
        let mut vertices = WeldedVertices::new(0.001);
        let square = [[0.0; 3], [1.0, 0.0, 0.0], [1.0, 0.0002, 0.0], [1.0, 1.0, 0.0], [0.0, 0.0, 0.0004]];
        assert_eq!(vertices.ring(&square), [0, 1, 2]);
        assert_eq!(vertices.ring(&[[1.0, 1.0, 0.0], [0.0, 0.0, 2.0], [1.0, 1.0, 0.0003]]), [0; 0]);
        assert_eq!(vertices.lattice()[2], [1000, 1000, 0]);
        assert_eq!(vertices.positions_m().nth(3), Some([0.0, 0.0, 2.0]));
    }
}
