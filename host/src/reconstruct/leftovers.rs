//! The fine structure that is on no plane: it stays a mesh, without flakes that hang in the air.
//!
//! Triangles of mixed pixels and of gaps along a beam are gone already
//! ([`crate::reconstruct::polygons::triangles::assign`]). Frame `map`, meters. Source: the paper, section 1
//! ("interspersed with small fine-structured models of regions that cannot be captured by a flat-surface
//! model").

use crate::model::Mesh;
use crate::model::part::only;
use biplane_geometry::UnionFind;
use biplane_geometry::vec3::distance;
use serde::Serialize;

/// Which of the triangles on no plane stay.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LeftoverParams {
    /// Connected pieces of fewer triangles are dropped. Larger: small objects get lost. Smaller: flakes of
    /// noise stay.
    pub min_triangles: usize,
    /// Triangles with a longer edge are dropped, meters: where no plane vouches for it, a surface between
    /// points so far apart is a guess. Larger: sheets between the leaves of trees. Smaller: sparse things get
    /// lost.
    pub max_edge_m: f32,
    /// What stays may be simplified by this much, meters (`crate::reconstruct::simplify::fewer::within`);
    /// `None`: not at all. Larger: fewer triangles, leaves and legs lose their shape. Smaller: triangles by
    /// the thousand.
    pub tolerance_m: Option<f32>,
}

impl Default for LeftoverParams {
    fn default() -> Self {
        Self { min_triangles: 4, max_edge_m: 0.3, tolerance_m: None }
    }
}

/// The triangles `rest` of `mesh` as a mesh of their own, without large ones, small pieces and unused
/// vertices; simplified where that is asked for.
pub(crate) fn collect(params: &LeftoverParams, mesh: &Mesh, rest: &[usize]) -> Mesh {
    let vertices = mesh.vertices_m.len();
    let inside = |index: &usize| {
        mesh.triangles.get(*index).is_some_and(|t| {
            t.iter().all(|corner| (*corner as usize) < vertices) && longest_m(mesh, *t) <= params.max_edge_m
        })
    };
    let rest: Vec<usize> = rest.iter().copied().filter(inside).collect();
    let mut pieces = UnionFind::new(vertices);
    for [a, b, c] in rest.iter().map(|index| mesh.triangles[*index]) {
        pieces.join(a, b);
        pieces.join(b, c);
    }
    let mut sizes = vec![0usize; vertices];
    rest.iter().for_each(|index| sizes[pieces.root(mesh.triangles[*index][0]) as usize] += 1);
    let large =
        |index: &usize| sizes[pieces.root(mesh.triangles[*index][0]) as usize] >= params.min_triangles;
    let kept: Vec<usize> = rest.into_iter().filter(large).collect();
    let left = only(mesh, &kept);
    match params.tolerance_m {
        Some(tolerance_m) => crate::reconstruct::simplify::fewer::within(&left, tolerance_m),
        None => left,
    }
}

fn longest_m(mesh: &Mesh, triangle: [u32; 3]) -> f32 {
    let [p, q, r] = triangle.map(|corner| mesh.vertices_m[corner as usize]);
    distance(p, q).max(distance(q, r)).max(distance(r, p))
}

#[cfg(test)]
mod tests {
    use super::LeftoverParams;
    use super::collect;
    use crate::model::Mesh;
    use crate::model::part::only;

    /// A strip of five triangles, and one that touches nothing.
    fn strip_and_flake() -> Mesh {
        let vertices_m = (0..10u8).map(|k| [0.1 * f32::from(k), 0.0, 0.1 * f32::from(k % 2)]).collect();
        let mut triangles: Vec<[u32; 3]> = (0..5).map(|k| [k, k + 1, k + 2]).collect();
        triangles.push([7, 8, 9]);
        Mesh { vertices_m, triangles }
    }

    #[test]
    fn pieces_stay_flakes_go_and_no_vertex_is_unused() {
        let mesh = strip_and_flake();
        let left = collect(&LeftoverParams::default(), &mesh, &[0, 1, 2, 3, 4, 5]);
        assert_eq!((left.triangles.len(), left.vertices_m.len()), (5, 7));
        let all = only(&mesh, &[0, 1, 2, 3, 4, 5]);
        assert_eq!(
            collect(
                &LeftoverParams { min_triangles: 1, ..LeftoverParams::default() },
                &mesh,
                &[0, 1, 2, 3, 4, 5]
            ),
            all
        );
        assert_eq!((all.triangles.len(), all.vertices_m.len()), (6, 10));
        assert_eq!(all.vertices_m[all.triangles[5][2] as usize], mesh.vertices_m[9]);
    }

    #[test]
    fn sheets_between_points_far_apart_are_no_surface() {
        let mut mesh = strip_and_flake();
        mesh.vertices_m[6][0] += 0.3;
        // The strip ends before the point that is far off.
        let left = collect(&LeftoverParams::default(), &mesh, &[0, 1, 2, 3, 4, 5]);
        assert_eq!(left.triangles.len(), 4);
        let far = LeftoverParams { max_edge_m: 1.0, ..LeftoverParams::default() };
        assert_eq!(collect(&far, &mesh, &[0, 1, 2, 3, 4, 5]).triangles.len(), 5);
    }

    #[test]
    fn only_what_is_asked_for_counts_and_nonsense_is_left_out() {
        let mut mesh = strip_and_flake();
        // Two triangles of the strip are no piece.
        assert!(collect(&LeftoverParams::default(), &mesh, &[0, 1]).triangles.is_empty());
        mesh.triangles.push([0, 1, 99]);
        assert_eq!(only(&mesh, &[6, 77, 0]).triangles.len(), 1);
        assert_eq!(
            collect(&LeftoverParams { min_triangles: 1, ..LeftoverParams::default() }, &mesh, &[6, 77, 0])
                .triangles
                .len(),
            1
        );
    }
}
