//! What others would make of a raw mesh: edges collapsed where that costs the least quadric error, until few
//! triangles are left.
//!
//! Stands for QSlim, which the paper compared with, at the same number of polygons. Meters. Sources: Garland
//! and Heckbert, "Surface Simplification Using Quadric Error Metrics" (1997); the paper, section 4.

use crate::metrics::surface_distance::Surface;
use crate::model::Mesh;
use crate::model::part::only;
use crate::reconstruct::simplify::collapse::{Rules, collapse};
use biplane_geometry::PortableMath;
use biplane_geometry::UnionFind;
use rayon::prelude::*;
use std::collections::BTreeMap;

/// So often the bound is halved before a piece stays as it is.
const HALVINGS: usize = 6;

/// A mesh simplified to `triangles` triangles, each vertex moved to where the error is least, as QSlim does.
///
/// Holes may close, and small pieces may go. At least one triangle is asked for.
pub(crate) fn to_count(mesh: &Mesh, triangles: usize) -> Mesh {
    collapse(mesh, &Rules { is_free: true, triangles: triangles.max(1), error_m: f64::INFINITY })
}

/// A mesh with fewer triangles, none of whose old vertices is further than `tolerance_m` from the new
/// surface. Its vertices are some of the old ones, and its borders stay as they are, so that it meets what it
/// met. Connected pieces are simplified each for itself. A triangle that names no vertex is left out.
pub(crate) fn within(mesh: &Mesh, tolerance_m: f32) -> Mesh {
    let simple: Vec<Mesh> =
        pieces(mesh).par_iter().map(|which| piece_within(only(mesh, which), tolerance_m)).collect();
    let mut out = Mesh::default();
    for piece in simple {
        let first = out.vertices_m.len() as u32;
        out.vertices_m.extend(piece.vertices_m);
        out.triangles.extend(piece.triangles.iter().map(|triangle| triangle.map(|corner| first + corner)));
    }
    out
}

/// A mesh with fewer triangles, an error of about `tolerance_m` away: borders move too, and pieces smaller
/// than that go. For views from afar; [`within`] keeps to its bound. A triangle that names no vertex is left
/// out.
pub(crate) fn freely(mesh: &Mesh, tolerance_m: f32) -> Mesh {
    let is_large = |which: &Vec<usize>| extent_m(mesh, which) > 2.0 * tolerance_m;
    let mut kept: Vec<usize> = pieces(mesh).into_iter().filter(is_large).flatten().collect();
    kept.sort_unstable();
    collapse(&only(mesh, &kept), &Rules { is_free: true, triangles: 0, error_m: f64::from(tolerance_m) })
}

/// The triangles of each connected piece, by the first vertex of the pieces; those with corners that do not
/// exist are left out.
fn pieces(mesh: &Mesh) -> Vec<Vec<usize>> {
    let vertices = mesh.vertices_m.len();
    let sound =
        |(_, triangle): &(usize, &[u32; 3])| triangle.iter().all(|corner| (*corner as usize) < vertices);
    let mut pieces = UnionFind::new(vertices);
    for (_, [a, b, c]) in mesh.triangles.iter().enumerate().filter(sound) {
        pieces.join(*a, *b);
        pieces.join(*b, *c);
    }
    let mut of_piece: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
    for (index, [a, ..]) in mesh.triangles.iter().enumerate().filter(sound) {
        of_piece.entry(pieces.root(*a)).or_default().push(index);
    }
    of_piece.into_values().collect()
}

/// The diagonal of the box about some triangles, meters.
fn extent_m(mesh: &Mesh, which: &[usize]) -> f32 {
    let corners =
        || which.iter().flat_map(|index| mesh.triangles[*index]).map(|c| mesh.vertices_m[c as usize]);
    let side_m = |axis: usize| {
        let values = || corners().map(|p| p[axis]);
        values().fold(f32::NEG_INFINITY, f32::max) - values().fold(f32::INFINITY, f32::min)
    };
    side_m(0).portable_hypot(side_m(1)).portable_hypot(side_m(2))
}

/// The error that is bounded is a mean of squares; where a vertex ends up too far off all the same, the
/// simplification is made again with a smaller bound.
fn piece_within(piece: Mesh, tolerance_m: f32) -> Mesh {
    if !piece.vertices_m.as_flattened().iter().all(|v| v.is_finite()) {
        return piece;
    }
    let mut error_m = f64::from(tolerance_m);
    for _ in 0..HALVINGS {
        let simple = collapse(&piece, &Rules { is_free: false, triangles: 0, error_m });
        if !simple.triangles.is_empty() {
            let surface = Surface::new(&simple);
            let near = |p: &[f32; 3]| surface.distance_m(p.map(f64::from)) <= f64::from(tolerance_m);
            if piece.vertices_m.iter().all(near) {
                return simple;
            }
        }
        error_m /= 2.0;
    }
    piece
}

#[cfg(test)]
mod tests {
    use super::{freely, to_count, within};
    use crate::model::Mesh;
    use crate::reconstruct::planes::paper::random::Random;

    /// A level sheet of `side` x `side` squares of 10 cm with its corner at `x_m`.
    fn sheet(side: u32, x_m: f32) -> Mesh {
        let at = |k: u32| [x_m + 0.1 * (k % (side + 1)) as f32, 0.1 * (k / (side + 1)) as f32, 0.0];
        let corner = |k: u32| k / side * (side + 1) + k % side;
        let square = |k: u32| {
            let (a, c) = (corner(k), corner(k) + side + 1);
            [[a, a + 1, c + 1], [a, c + 1, c]]
        };
        Mesh {
            vertices_m: (0..(side + 1) * (side + 1)).map(at).collect(),
            triangles: (0..side * side).flat_map(square).collect(),
        }
    }

    fn area_m2(mesh: &Mesh) -> f32 {
        let area = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|k| mesh.vertices_m[k as usize]);
            0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))
        };
        mesh.triangles.iter().map(area).sum()
    }

    #[test]
    fn a_flat_sheet_becomes_two_triangles_of_the_same_area() {
        let simple = to_count(&sheet(20, 0.0), 2);
        assert_eq!((simple.triangles.len(), simple.vertices_m.len()), (2, 4));
        assert!((area_m2(&simple) - 4.0).abs() < 1e-4, "{}", area_m2(&simple));
    }

    #[test]
    fn loose_pieces_go_when_the_count_asks_for_it() {
        let mut both = sheet(20, 0.0);
        let small = sheet(2, 9.0);
        let from = both.vertices_m.len() as u32;
        both.triangles.extend(small.triangles.iter().map(|t| t.map(|k| k + from)));
        both.vertices_m.extend(small.vertices_m);
        assert_eq!(to_count(&both, 4).triangles.len(), 4);
        let one = to_count(&both, 2);
        assert_eq!(one.triangles.len(), 2);
        assert!(one.vertices_m.iter().all(|p| p[0] < 5.0), "the large piece is what stays");
    }

    #[test]
    fn within_a_tolerance_no_old_vertex_is_further_off_and_the_border_stays() {
        let mut random = Random::new(4);
        let mut rough = sheet(20, 0.0);
        rough.vertices_m.iter_mut().for_each(|p| p[2] = 0.06 * random.unit() as f32);
        let mut before = rough.triangles.len();
        for tolerance_m in [0.005, 0.02, 0.05] {
            let simple = within(&rough, tolerance_m);
            assert!(simple.triangles.len() < before, "{tolerance_m}");
            before = simple.triangles.len();
            // By trying all triangles: distance of each old vertex.
            let surface = crate::metrics::surface_distance::Surface::new(&simple);
            for p in &rough.vertices_m {
                assert!(surface.distance_m(p.map(f64::from)) <= f64::from(tolerance_m) + 1e-6);
            }
            let on_border = |p: &&[f32; 3]| p[0] < 0.01 || p[0] > 1.99 || p[1] < 0.01 || p[1] > 1.99;
            assert_eq!(simple.vertices_m.iter().filter(on_border).count(), 80);
        }
        assert_eq!(within(&Mesh::default(), 0.1), Mesh::default());
    }

    #[test]
    fn a_triangle_that_names_no_vertex_is_left_out_of_every_simplification() {
        let whole = sheet(6, 0.0);
        let mut broken = whole.clone();
        broken.triangles.insert(3, [0, 1, whole.vertices_m.len() as u32]);
        broken.triangles.push([u32::MAX, 2, 3]);
        assert_eq!(within(&broken, 0.01), within(&whole, 0.01));
        assert_eq!(freely(&broken, 0.01), freely(&whole, 0.01));
        assert_eq!(to_count(&broken, 2), to_count(&whole, 2));
        let nothing = Mesh { vertices_m: vec![[0.0; 3]; 3], triangles: vec![[7, 8, 9]] };
        assert!(within(&nothing, 0.1).triangles.is_empty() && freely(&nothing, 0.1).triangles.is_empty());
    }

    #[test]
    fn freely_the_border_moves_and_what_is_smaller_than_the_tolerance_goes() {
        let mut both = sheet(20, 0.0);
        let crumb = Mesh {
            vertices_m: vec![[7.0, 0.0, 0.0], [7.02, 0.0, 0.0], [7.0, 0.02, 0.0]],
            triangles: vec![[0, 1, 2]],
        };
        let from = both.vertices_m.len() as u32;
        both.triangles.extend(crumb.triangles.iter().map(|t| t.map(|k| k + from)));
        both.vertices_m.extend(crumb.vertices_m);
        let simple = freely(&both, 0.05);
        assert!(simple.triangles.len() < 20, "{}", simple.triangles.len());
        assert!(simple.vertices_m.iter().all(|p| p[0] < 5.0), "the crumb is gone");
        assert!((area_m2(&simple) - 4.0).abs() < 0.3, "{}", area_m2(&simple));
        assert!(freely(&both, 0.001).vertices_m.iter().any(|p| p[0] > 5.0), "of a finer one it is part");
    }

    #[test]
    fn empty_and_broken_meshes_become_nothing() {
        assert_eq!(to_count(&Mesh::default(), 5), Mesh::default());
        let broken = Mesh { vertices_m: vec![[f32::NAN; 3]; 3], triangles: vec![[0, 1, 2], [7, 8, 9]] };
        assert_eq!(to_count(&broken, 5), Mesh::default());
    }
}
