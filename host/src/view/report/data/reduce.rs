//! A raw mesh that is too large for a page, with fewer triangles: all vertices of a cell become the first of
//! them. Meters.

use crate::model::Mesh;
use crate::model::voxels::{Voxels, key};

/// The first cells' side, meters: about the points' spacing.
const FIRST_CELL_M: f64 = 0.03;
/// Each round's cells are larger by this at least.
const MIN_GROWTH: f64 = 1.1;
/// Rounds; far more than are needed.
const ROUNDS: usize = 50;

/// In place of a cell: the vertex is in none.
const NOWHERE: u32 = u32::MAX;

/// The mesh with at most so many triangles, and the side of the cells; `None` when it fits as it is.
pub(crate) fn to_fit(mesh: &Mesh, max_triangles: usize) -> Option<(Mesh, f64)> {
    if mesh.triangles.len() <= max_triangles {
        return None;
    }
    let mut cell_m = FIRST_CELL_M;
    let mut smaller = clustered(mesh, cell_m);
    for _ in 0..ROUNDS {
        if smaller.triangles.len() <= max_triangles {
            break;
        }
        // A surface has so many cells as their area goes into it.
        cell_m *= (smaller.triangles.len() as f64 / max_triangles.max(1) as f64).sqrt().max(MIN_GROWTH);
        smaller = clustered(mesh, cell_m);
    }
    Some((smaller, cell_m))
}

fn clustered(mesh: &Mesh, cell_m: f64) -> Mesh {
    let mut first_of: Voxels<u32> = Voxels::default();
    let mut vertices_m: Vec<[f32; 3]> = Vec::new();
    let mut new_of = Vec::with_capacity(mesh.vertices_m.len());
    for vertex in &mesh.vertices_m {
        let of_cell = key(vertex.map(f64::from), cell_m.recip()).map(|key| {
            *first_of.entry(key).or_insert_with(|| {
                vertices_m.push(*vertex);
                vertices_m.len() as u32 - 1
            })
        });
        new_of.push(of_cell.unwrap_or(NOWHERE));
    }
    let renumbered = mesh.triangles.iter().filter_map(|triangle| {
        let [a, b, c] = triangle.map(|corner| new_of.get(corner as usize).copied());
        let (a, b, c) = (a?, b?, c?);
        (a != b && b != c && c != a && ![a, b, c].contains(&NOWHERE)).then_some([a, b, c])
    });
    let mut triangles: Vec<[u32; 3]> = renumbered.collect();
    triangles.shrink_to_fit();
    vertices_m.shrink_to_fit();
    Mesh { vertices_m, triangles }
}

#[cfg(test)]
mod tests {
    use super::to_fit;
    use crate::model::Mesh;

    #[test]
    fn a_mesh_is_made_coarser_until_it_fits_and_stays_where_it_is() {
        // A level sheet of 100 x 100 squares of 1 cm.
        let at = |k: u32| [0.01 * (k % 101) as f32, 0.01 * (k / 101) as f32, 0.5];
        let square = |k: u32| {
            let a = k / 100 * 101 + k % 100;
            [[a, a + 1, a + 102], [a, a + 102, a + 101]]
        };
        let sheet = Mesh {
            vertices_m: (0..101 * 101).map(at).collect(),
            triangles: (0..10_000).flat_map(square).collect(),
        };
        assert!(to_fit(&sheet, 20_000).is_none());
        let (smaller, cell_m) = to_fit(&sheet, 1000).unwrap();
        let count = smaller.triangles.len();
        // A square meter in cells of `cell_m` has about two triangles a cell.
        assert!(count <= 1000 && count as f64 > 1.2 / (cell_m * cell_m), "{count} {cell_m}");
        assert!(smaller.vertices_m.iter().all(|p| sheet.vertices_m.contains(p)));
    }
}
