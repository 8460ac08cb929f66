//! What others would make of a raw mesh: edges collapsed where that costs the least quadric error, until few triangles are left.
//!
//! Stands for QSlim, which the paper compared with, at the same number of polygons; made by meshoptimizer. Metres. Sources: Garland and
//! Heckbert, "Surface Simplification Using Quadric Error Metrics" (1997); the paper, section 4.

use crate::leftovers::{Pieces, only};
use crate::model::Mesh;
use crate::surface_distance::Surface;
use meshopt::SimplifyOptions;
use rayon::prelude::*;
use std::collections::BTreeMap;

/// No bound on the error: the number of triangles is what is asked for. (Relative to the size of the mesh.)
const ANY_ERROR: f32 = 1e9;
/// So often the bound is halved before a piece stays as it is.
const HALVINGS: usize = 6;

/// A mesh simplified to `triangles` triangles, each vertex moved to where the error is least, as QSlim does.
///
/// Holes may close and edges that more than two triangles share may part, or a mesh of scans stops at three times the count. When
/// loose pieces alone keep it above, the smallest go too; if nothing would stay then, the result has more triangles than asked for.
pub fn to_count(mesh: &Mesh, triangles: usize) -> Mesh {
    let whole = collapse(mesh, triangles, SimplifyOptions::Permissive);
    if whole.triangles.len() <= triangles {
        return whole;
    }
    let largest = collapse(mesh, triangles, SimplifyOptions::Permissive | SimplifyOptions::Prune);
    if largest.triangles.is_empty() { whole } else { largest }
}

/// A mesh with fewer triangles, none of whose old vertices is further than `tolerance_m` from the new surface. Its vertices are some of the old
/// ones, and its borders stay as they are, so that it meets what it met. Connected pieces are simplified each for itself.
pub fn within(mesh: &Mesh, tolerance_m: f32) -> Mesh {
    let mut pieces = Pieces::new(mesh.vertices_m.len());
    for [a, b, c] in &mesh.triangles {
        pieces.join(*a, *b);
        pieces.join(*b, *c);
    }
    let mut of_piece: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
    for (index, [a, ..]) in mesh.triangles.iter().enumerate() {
        of_piece.entry(pieces.root(*a)).or_default().push(index);
    }
    let of_piece: Vec<Vec<usize>> = of_piece.into_values().collect();
    let simple: Vec<Mesh> =
        of_piece.par_iter().map(|which| piece_within(only(mesh, which), tolerance_m)).collect();
    let mut out = Mesh::default();
    for piece in simple {
        let first = out.vertices_m.len() as u32;
        out.vertices_m.extend(piece.vertices_m);
        out.triangles.extend(piece.triangles.iter().map(|triangle| triangle.map(|corner| first + corner)));
    }
    out
}

/// A mesh with fewer triangles, an error of about `tolerance_m` away: borders move too, and pieces smaller than that go. For views from afar;
/// [`within`] keeps to its bound.
pub fn freely(mesh: &Mesh, tolerance_m: f32) -> Mesh {
    if !mesh.vertices_m.as_flattened().iter().all(|v| v.is_finite()) || mesh.triangles.is_empty() {
        return mesh.clone();
    }
    let options = SimplifyOptions::ErrorAbsolute | SimplifyOptions::Permissive | SimplifyOptions::Prune;
    let corners = meshopt::simplify_decoder(
        mesh.triangles.as_flattened(),
        &mesh.vertices_m,
        0,
        tolerance_m,
        options,
        None,
    );
    compact(&mesh.vertices_m, corners.as_chunks().0.to_vec())
}

/// The library bounds a mean of squares; where a vertex ends up too far off all the same, the simplification is made again with a smaller bound.
fn piece_within(piece: Mesh, tolerance_m: f32) -> Mesh {
    if !piece.vertices_m.as_flattened().iter().all(|v| v.is_finite()) {
        return piece;
    }
    let mut bound_m = tolerance_m;
    for _ in 0..HALVINGS {
        let corners = meshopt::simplify_decoder(
            piece.triangles.as_flattened(),
            &piece.vertices_m,
            0,
            bound_m,
            SimplifyOptions::LockBorder | SimplifyOptions::ErrorAbsolute,
            None,
        );
        let simple = compact(&piece.vertices_m, corners.as_chunks().0.to_vec());
        if !simple.triangles.is_empty() {
            let surface = Surface::new(&simple);
            let near = |p: &[f32; 3]| surface.distance_m(p.map(f64::from)) <= f64::from(tolerance_m);
            if piece.vertices_m.iter().all(near) {
                return simple;
            }
        }
        bound_m /= 2.0;
    }
    piece
}

fn collapse(mesh: &Mesh, triangles: usize, options: SimplifyOptions) -> Mesh {
    let mut vertices_m = mesh.vertices_m.clone();
    // The library trusts its input.
    let finite =
        |corner: &u32| vertices_m.get(*corner as usize).is_some_and(|p| p.iter().all(|v| v.is_finite()));
    let mut corners: Vec<u32> =
        mesh.triangles.iter().filter(|t| t.iter().all(finite)).flatten().copied().collect();
    for p in &mut vertices_m {
        if !p.iter().all(|v| v.is_finite()) {
            *p = [0.0; 3];
        }
    }
    if corners.is_empty() {
        return Mesh::default();
    }
    let kept = meshopt::simplify_with_update(
        &mut corners,
        &mut vertices_m,
        &mut [],
        &[],
        0,
        None,
        3 * triangles,
        ANY_ERROR,
        options,
        None,
    );
    let triangles = corners[..kept].as_chunks().0.to_vec();
    compact(&vertices_m, triangles)
}

/// Leaves out the vertices that no triangle names.
fn compact(vertices_m: &[[f32; 3]], mut triangles: Vec<[u32; 3]>) -> Mesh {
    let mut new_of = vec![u32::MAX; vertices_m.len()];
    let mut kept_m = Vec::new();
    for corner in triangles.as_flattened_mut() {
        let new = &mut new_of[*corner as usize];
        if *new == u32::MAX {
            *new = kept_m.len() as u32;
            kept_m.push(vertices_m[*corner as usize]);
        }
        *corner = *new;
    }
    Mesh { vertices_m: kept_m, triangles }
}

#[cfg(test)]
mod tests {
    use super::{to_count, within};
    use crate::model::Mesh;
    use crate::planes::random::Random;

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
            let surface = crate::surface_distance::Surface::new(&simple);
            for p in &rough.vertices_m {
                assert!(surface.distance_m(p.map(f64::from)) <= f64::from(tolerance_m) + 1e-6);
            }
            let on_border = |p: &&[f32; 3]| p[0] < 0.01 || p[0] > 1.99 || p[1] < 0.01 || p[1] > 1.99;
            assert_eq!(simple.vertices_m.iter().filter(on_border).count(), 80);
        }
        assert_eq!(within(&Mesh::default(), 0.1), Mesh::default());
    }

    #[test]
    fn empty_and_broken_meshes_become_nothing() {
        assert_eq!(to_count(&Mesh::default(), 5), Mesh::default());
        let broken = Mesh { vertices_m: vec![[f32::NAN; 3]; 3], triangles: vec![[0, 1, 2], [7, 8, 9]] };
        assert_eq!(to_count(&broken, 5), Mesh::default());
    }
}
