//! A triangle mesh as few bytes: whole millimeters instead of floats, each vertex as the step from the one
//! before, each corner as how long ago its vertex was new.
//!
//! Vertices are in the order in which triangles first name them. All numbers are base-128 varints, low bits
//! first; steps are zigzag coded (0, -1, 1, -2 are 0, 1, 2, 3). First three steps a vertex, then three
//! corners a triangle: `n` means the vertex with the index (vertices seen so far) - n, so 0 is a new one.
//! Scans neighbor each other in a mesh of scans, so most numbers are one byte.

use crate::model::Mesh;

/// The finest step, meters. Finer ones cost bytes and show only noise.
const FINEST_M: f64 = 1e-3;
/// Steps that fit 16 bits, in which a graphics card takes positions.
const MAX_STEPS: f64 = 65_535.0;

/// The lattice that all meshes of a page lie on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Lattice {
    /// Its corner in `map`, meters.
    pub origin_m: [f64; 3],
    /// Its step, meters.
    pub step_m: f64,
}

impl Lattice {
    /// One that holds all finite vertices of some meshes: of a millimeter, or as coarse as 16 bits need.
    pub(crate) fn around<'a>(meshes: impl Iterator<Item = &'a Mesh>) -> Self {
        let (mut min, mut max) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for point in meshes.flat_map(|mesh| &mesh.vertices_m).filter(|point| is_finite(point)) {
            for axis in 0..3 {
                min[axis] = min[axis].min(f64::from(point[axis]));
                max[axis] = max[axis].max(f64::from(point[axis]));
            }
        }
        let longest_m = (0..3).map(|axis| max[axis] - min[axis]).fold(0.0, f64::max);
        let origin_m = if longest_m.is_finite() && min[0].is_finite() { min } else { [0.0; 3] };
        Self { origin_m, step_m: (longest_m / MAX_STEPS).max(FINEST_M) }
    }

    /// The steps to a point.
    fn steps(&self, point_m: [f32; 3]) -> [i64; 3] {
        let steps = |axis: usize| ((f64::from(point_m[axis]) - self.origin_m[axis]) / self.step_m).round();
        [0, 1, 2].map(|axis| steps(axis).clamp(0.0, MAX_STEPS) as i64)
    }
}

/// A packed mesh.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Packed {
    /// Vertices that triangles name.
    pub vertices: usize,
    /// Triangles with three finite corners.
    pub triangles: usize,
    /// See the module's text.
    pub bytes: Vec<u8>,
}

/// Packs a mesh. Triangles with a corner that is not there or not finite are left out.
pub(crate) fn pack(mesh: &Mesh, lattice: &Lattice) -> Packed {
    let there = |corner: &u32| mesh.vertices_m.get(*corner as usize).is_some_and(is_finite);
    let mut number = vec![u32::MAX; mesh.vertices_m.len()];
    let (mut steps, mut corners) = (Vec::new(), Vec::new());
    let (mut seen, mut triangles) = (0_u32, 0);
    let mut last = [0_i64; 3];
    for triangle in mesh.triangles.iter().filter(|triangle| triangle.iter().all(there)) {
        triangles += 1;
        for &corner in triangle {
            let known = &mut number[corner as usize];
            if *known == u32::MAX {
                *known = seen;
                let at = lattice.steps(mesh.vertices_m[corner as usize]);
                (0..3).for_each(|axis| put(&mut steps, zigzag(at[axis] - last[axis])));
                last = at;
                put(&mut corners, 0);
                seen += 1;
            } else {
                put(&mut corners, u64::from(seen - *known));
            }
        }
    }
    steps.append(&mut corners);
    Packed { vertices: seen as usize, triangles, bytes: steps }
}

fn is_finite(point: &[f32; 3]) -> bool {
    point.iter().all(|value| value.is_finite())
}

fn zigzag(value: i64) -> u64 {
    ((value << 1) ^ (value >> 63)) as u64
}

fn put(bytes: &mut Vec<u8>, mut value: u64) {
    while value > 127 {
        bytes.push(value as u8 | 128);
        value >>= 7;
    }
    bytes.push(value as u8);
}

#[cfg(test)]
mod tests {
    use super::{Lattice, pack};
    use crate::model::Mesh;

    #[test]
    fn two_triangles_have_the_bytes_that_the_format_says() {
        let mesh = Mesh {
            vertices_m: vec![[0.0; 3], [0.002, 0.0, 0.0], [0.002, 0.1, 0.0], [f32::NAN; 3], [0.0, 0.1, 0.0]],
            triangles: vec![[0, 1, 2], [0, 2, 3], [0, 2, 4], [0, 1, 99]],
        };
        let lattice = Lattice::around([&mesh].into_iter());
        assert_eq!((lattice.origin_m, lattice.step_m), ([0.0; 3], 0.001));
        let packed = pack(&mesh, &lattice);
        assert_eq!((packed.vertices, packed.triangles), (4, 2));
        #[rustfmt::skip]
        let expected = [
            0, 0, 0,  4, 0, 0,  0, 200, 1, 0,  3, 0, 0, // 200, 1: zigzag of 100 is 200 = 72 + 128, 1
            0, 0, 0,  3, 1, 0,
        ];
        assert_eq!(packed.bytes, expected);
    }

    #[test]
    fn a_large_building_has_a_coarser_lattice_and_nothing_has_one_too() {
        let far = Mesh { vertices_m: vec![[-100.0, 0.0, 0.0], [555.35, 0.0, 0.0]], triangles: Vec::new() };
        let lattice = Lattice::around([&far].into_iter());
        assert!((lattice.step_m - 0.01).abs() < 1e-6 && lattice.origin_m[0] == -100.0);
        let empty = Lattice::around(std::iter::empty());
        assert_eq!((empty.origin_m, empty.step_m), ([0.0; 3], 0.001));
    }
}
