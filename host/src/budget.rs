//! A bound on the triangles of a whole model: what is smallest goes first.
//!
//! Loose pieces of fine structure go before any flat surface, each from the smallest area on. Square metres.

use crate::export::area_m2;
use crate::model::{Mesh, Model};

/// What had to go.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Dropped {
    /// Triangles of fine structure.
    pub leftover_triangles: usize,
    /// Polygons.
    pub polygons: usize,
}

/// Takes the smallest parts out of a model until it has at most `most_triangles`. `faces` are the triangles of each polygon; those of
/// dropped polygons are taken out too.
pub fn bound(model: &mut Model, faces: &mut Vec<Mesh>, most_triangles: usize) -> Dropped {
    let of_polygons: usize = faces.iter().map(|face| face.triangles.len()).sum();
    let before = model.leftovers.triangles.len();
    model.leftovers = largest_pieces(&model.leftovers, most_triangles.saturating_sub(of_polygons));
    let leftover_triangles = before - model.leftovers.triangles.len();
    let mut polygons = 0;
    if of_polygons > most_triangles {
        let keep = largest(faces, most_triangles);
        polygons = keep.iter().filter(|keep| !**keep).count();
        let mut kept = keep.iter();
        model.polygons.retain(|_| kept.next().copied().unwrap_or(false));
        let mut kept = keep.iter();
        faces.retain(|_| kept.next().copied().unwrap_or(false));
    }
    Dropped { leftover_triangles, polygons }
}

/// Which meshes stay when the largest of them, by area, may have so many triangles together: one that does not fit makes room for
/// smaller ones that do.
fn largest(meshes: &[Mesh], most_triangles: usize) -> Vec<bool> {
    let mut order: Vec<(f64, usize)> = meshes.iter().map(area_m2).zip(0..).collect();
    order.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    let mut keep = vec![false; meshes.len()];
    let mut left = most_triangles;
    for (_, index) in order {
        let Some(rest) = left.checked_sub(meshes[index].triangles.len()) else { continue };
        left = rest;
        keep[index] = true;
    }
    keep
}

/// The largest connected pieces of a mesh with so many triangles together.
fn largest_pieces(mesh: &Mesh, most_triangles: usize) -> Mesh {
    if mesh.triangles.len() <= most_triangles {
        return mesh.clone();
    }
    let piece_of = pieces(mesh);
    let count = piece_of.iter().max().map_or(0, |last| last + 1);
    let mut meshes = vec![Mesh::default(); count];
    for (triangle, &piece) in mesh.triangles.iter().zip(&piece_of) {
        let corners = triangle.map(|corner| mesh.vertices_m[corner as usize]);
        let first = meshes[piece].vertices_m.len() as u32;
        meshes[piece].vertices_m.extend(corners);
        meshes[piece].triangles.push([first, first + 1, first + 2]);
    }
    let keep = largest(&meshes, most_triangles);
    let rest: Vec<usize> = (0..mesh.triangles.len()).filter(|&triangle| keep[piece_of[triangle]]).collect();
    only(mesh, &rest)
}

/// For each triangle the number of its connected piece, in the order of their first triangles.
fn pieces(mesh: &Mesh) -> Vec<usize> {
    let mut parent: Vec<u32> = (0..mesh.vertices_m.len() as u32).collect();
    for [a, b, c] in &mesh.triangles {
        for (one, other) in [(*a, *b), (*b, *c)] {
            let (one, other) = (root(&mut parent, one), root(&mut parent, other));
            // The smaller number wins, whatever the order of the triangles.
            parent[one.max(other) as usize] = one.min(other);
        }
    }
    let mut numbers = vec![usize::MAX; parent.len()];
    let mut next = 0;
    let mut number = |root: u32| {
        let slot = &mut numbers[root as usize];
        if *slot == usize::MAX {
            *slot = next;
            next += 1;
        }
        *slot
    };
    mesh.triangles.iter().map(|[a, ..]| number(root(&mut parent, *a))).collect()
}

fn root(parent: &mut [u32], mut vertex: u32) -> u32 {
    while parent[vertex as usize] != vertex {
        let grandparent = parent[parent[vertex as usize] as usize];
        parent[vertex as usize] = grandparent;
        vertex = grandparent;
    }
    vertex
}

/// Some triangles of a mesh, without unused vertices.
fn only(mesh: &Mesh, triangles: &[usize]) -> Mesh {
    crate::leftovers::only(mesh, triangles)
}

#[cfg(test)]
mod tests {
    use super::{Dropped, bound};
    use crate::export::sample;
    use crate::model::Mesh;

    /// Loose squares of two triangles each with these sides, metres.
    fn squares(sides_m: &[f32]) -> Mesh {
        let mut mesh = Mesh::default();
        for (index, &side) in sides_m.iter().enumerate() {
            let (x, first) = (index as f32 * 10.0, mesh.vertices_m.len() as u32);
            mesh.vertices_m.extend([
                [x, 0.0, 0.0],
                [x + side, 0.0, 0.0],
                [x + side, side, 0.0],
                [x, side, 0.0],
            ]);
            mesh.triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
        }
        mesh
    }

    #[test]
    fn the_smallest_pieces_go_first_and_flat_surfaces_last() {
        let mut model = sample::model();
        model.leftovers = squares(&[1.0, 3.0, 2.0]);
        let cut = |most: usize| {
            let (mut model, mut faces) = (model.clone(), sample::faces(&model));
            let dropped = bound(&mut model, &mut faces, most);
            let x_m: Vec<f32> = model.leftovers.vertices_m.iter().step_by(4).map(|p| p[0]).collect();
            assert_eq!(model.polygons.len(), faces.len());
            (dropped, x_m, model.polygons.len())
        };
        let dropped = |leftover_triangles, polygons| Dropped { leftover_triangles, polygons };
        assert_eq!(cut(100), (dropped(0, 0), vec![0.0, 10.0, 20.0], 2));
        assert_eq!(cut(15), (dropped(2, 0), vec![10.0, 20.0], 2));
        assert_eq!(cut(12), (dropped(4, 0), vec![10.0], 2));
        assert_eq!(cut(10), (dropped(6, 0), vec![], 2));
        assert_eq!(cut(9), (dropped(6, 1), vec![], 1));
        assert_eq!(cut(0), (dropped(6, 2), vec![], 0));
    }
}
