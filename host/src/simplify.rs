//! What others would make of a raw mesh: edges collapsed where that costs the least quadric error, until few triangles are left.
//!
//! Stands for QSlim, which the paper compared with, at the same number of polygons; made by meshoptimizer. Metres. Sources: Garland and
//! Heckbert, "Surface Simplification Using Quadric Error Metrics" (1997); the paper, section 4.

use crate::model::Mesh;
use meshopt::SimplifyOptions;

/// No bound on the error: the number of triangles is what is asked for. (Relative to the size of the mesh.)
const ANY_ERROR: f32 = 1e9;

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
    use super::to_count;
    use crate::model::Mesh;

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
    fn empty_and_broken_meshes_become_nothing() {
        assert_eq!(to_count(&Mesh::default(), 5), Mesh::default());
        let broken = Mesh { vertices_m: vec![[f32::NAN; 3]; 3], triangles: vec![[0, 1, 2], [7, 8, 9]] };
        assert_eq!(to_count(&broken, 5), Mesh::default());
    }
}
