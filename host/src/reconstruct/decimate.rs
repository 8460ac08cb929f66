//! A bound on the triangles of a whole model: it is made coarser until it fits, and only then are parts left
//! out.
//!
//! One tolerance rules what goes at a time: how far borders may move when they are straightened, and with it
//! how small a surface is no longer worth its triangles. It starts at the tolerance of the model itself and
//! grows by steps until the model fits. Loose pieces of fine structure go before any flat surface of the same
//! size. Meters, square meters.

use crate::model::area::area_m2;
use crate::model::{Mesh, Model};
use crate::reconstruct::polygons::finish::{Limits, coarsen};
use crate::reconstruct::polygons::seams::weld;
use crate::reconstruct::polygons::triangulate::{faces as faces_of, inferred_faces};
use crate::reconstruct::simplify::fewer;
use biplane_geometry::UnionFind;

/// What a bound cost.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Bounded {
    /// How far borders were allowed to move, meters.
    pub tolerance_m: f64,
    /// Triangles of fine structure that are left out.
    pub leftover_triangles: usize,
    /// Polygons that are left out.
    pub polygons: usize,
    /// The coarsest tolerance was not enough: the smallest surfaces had to go whatever their size.
    pub forced: bool,
}

/// First tolerance that is tried, meters.
const FIRST_M: f64 = 0.03;
/// What one step makes of a tolerance. Larger: fewer steps, coarser models than needed. Smaller: more time.
const STEP: f64 = 1.2;
/// Coarsest tolerance, meters; what does not fit then loses its smallest surfaces whatever their size.
const LAST_M: f64 = 1.0;
/// A surface that is no larger than a square of this many tolerances goes, a loose piece already below twice
/// that.
const SMALLEST: f64 = 1.5;

/// Makes a model fit into `most_triangles`; `None` when it did as it was.
pub(crate) fn bound(model: &mut Model, max_triangles: usize) -> Option<Bounded> {
    let max_triangles = leave_room(model, max_triangles);
    let mut faces = faces_of(model);
    let before = (model.polygons.len(), model.leftovers.triangles.len());
    if triangles(&faces) + before.1 <= max_triangles {
        return None;
    }
    let mut tolerance_m = FIRST_M;
    let mut coarse = coarser(model, tolerance_m);
    faces = faces_of(&coarse);
    while triangles(&faces) + coarse.leftovers.triangles.len() > max_triangles && tolerance_m < LAST_M {
        tolerance_m = (tolerance_m * STEP).min(LAST_M);
        coarse = coarser(model, tolerance_m);
        faces = faces_of(&coarse);
    }
    let forced = triangles(&faces) + coarse.leftovers.triangles.len() > max_triangles;
    *model = coarse;
    drop_smallest(model, &faces, max_triangles);
    Some(Bounded {
        tolerance_m,
        leftover_triangles: before.1 - model.leftovers.triangles.len(),
        polygons: before.0.saturating_sub(model.polygons.len()),
        forced,
    })
}

/// What is left for the rest when inferred surfaces stay whole, unless they would take more than a quarter,
/// and round things keep their meshes; they go where they would take more than half.
fn leave_room(model: &mut Model, max_triangles: usize) -> usize {
    let inferred = triangles(&inferred_faces(model));
    if inferred > max_triangles / 4 {
        model.inferred.clear();
    }
    let max_triangles = max_triangles - if model.inferred.is_empty() { 0 } else { inferred };
    let round: usize = model.cylinders.iter().map(|one| one.mesh().triangles.len()).sum();
    if round > max_triangles / 2 {
        model.cylinders.clear();
        return max_triangles;
    }
    max_triangles - round
}

/// By how much borders may move.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Reach {
    /// At least, meters; things of that size go.
    pub from_m: f64,
    /// At most, meters.
    pub to_m: f64,
}

/// A model with borders straightened by the least reach, and then by steps until it has no more than
/// `most_triangles` or they moved by all of it; and the length they moved by, meters. Leftovers are
/// simplified within the same length.
pub(crate) fn coarsened(model: &Model, reach: Reach, max_triangles: usize) -> (Model, f64) {
    let Reach { from_m, to_m } = reach;
    let mut tolerance_m = from_m;
    loop {
        let coarse = coarser(model, tolerance_m);
        let leftovers = fewer::freely(&coarse.leftovers, tolerance_m as f32);
        let coarse = Model { leftovers, ..coarse };
        if tolerance_m >= to_m
            || triangles(&faces_of(&coarse)) + coarse.leftovers.triangles.len() <= max_triangles
        {
            return (coarse, tolerance_m);
        }
        tolerance_m = (tolerance_m * STEP).min(to_m);
    }
}

fn triangles(faces: &[Mesh]) -> usize {
    faces.iter().map(|face| face.triangles.len()).sum()
}

/// The model with straighter borders and without what is small.
fn coarser(model: &Model, tolerance_m: f64) -> Model {
    let small_m2 = (SMALLEST * tolerance_m).powi(2);
    let limits = Limits { tolerance_m, min_hole_m2: small_m2, min_polygon_m2: small_m2, slit_m: 0.0 };
    let neighbors = weld::neighbors(&model.planes, &model.polygons);
    let mut polygons = coarsen(&limits, &model.planes, &neighbors, &model.polygons);
    let pairs: Vec<(usize, usize)> = neighbors
        .iter()
        .enumerate()
        .flat_map(|(own, others)| others.iter().map(move |other| (own.min(*other), own.max(*other))))
        .collect::<std::collections::BTreeSet<_>>()
        .into_iter()
        .collect();
    weld::weld(&model.planes, &mut polygons, &pairs, tolerance_m);
    Model {
        planes: model.planes.clone(),
        polygons,
        leftovers: larger_pieces(&model.leftovers, 4.0 * small_m2),
        cylinders: model.cylinders.clone(),
        inferred: model.inferred.clone(),
    }
}

/// Takes out the smallest parts of a model, loose pieces first, until it fits.
fn drop_smallest(model: &mut Model, faces: &[Mesh], max_triangles: usize) {
    let of_polygons = triangles(faces);
    model.leftovers = largest_pieces(&model.leftovers, max_triangles.saturating_sub(of_polygons));
    if of_polygons > max_triangles {
        let mut kept = largest(faces, max_triangles).into_iter();
        model.polygons.retain(|_| kept.next().unwrap_or(false));
    }
}

/// Which meshes stay when the largest of them, by area, may have so many triangles together: one that does
/// not fit makes room for smaller ones that do.
fn largest(meshes: &[Mesh], max_triangles: usize) -> Vec<bool> {
    let mut order: Vec<(f64, usize)> = meshes.iter().map(area_m2).zip(0..).collect();
    order.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    let mut keep = vec![false; meshes.len()];
    let mut left = max_triangles;
    for (_, index) in order {
        let Some(rest) = left.checked_sub(meshes[index].triangles.len()) else { continue };
        left = rest;
        keep[index] = true;
    }
    keep
}

/// The largest connected pieces of a mesh with so many triangles together.
fn largest_pieces(mesh: &Mesh, max_triangles: usize) -> Mesh {
    if mesh.triangles.len() <= max_triangles {
        return mesh.clone();
    }
    let (piece_of, meshes) = cut(mesh);
    let keep = largest(&meshes, max_triangles);
    let rest: Vec<usize> = (0..mesh.triangles.len()).filter(|&triangle| keep[piece_of[triangle]]).collect();
    only(mesh, &rest)
}

/// The connected pieces of a mesh that have at least this area.
fn larger_pieces(mesh: &Mesh, min_m2: f64) -> Mesh {
    let (piece_of, meshes) = cut(mesh);
    let keep: Vec<bool> = meshes.iter().map(|piece| area_m2(piece) >= min_m2).collect();
    let rest: Vec<usize> = (0..mesh.triangles.len()).filter(|&triangle| keep[piece_of[triangle]]).collect();
    only(mesh, &rest)
}

/// The connected pieces of a mesh, and for each triangle which of them it is in.
fn cut(mesh: &Mesh) -> (Vec<usize>, Vec<Mesh>) {
    let piece_of = pieces(mesh);
    let count = piece_of.iter().max().map_or(0, |last| last + 1);
    let mut meshes = vec![Mesh::default(); count];
    for (triangle, &piece) in mesh.triangles.iter().zip(&piece_of) {
        let corners = triangle.map(|corner| mesh.vertices_m[corner as usize]);
        let first = meshes[piece].vertices_m.len() as u32;
        meshes[piece].vertices_m.extend(corners);
        meshes[piece].triangles.push([first, first + 1, first + 2]);
    }
    (piece_of, meshes)
}

/// For each triangle the number of its connected piece, in the order of their first triangles.
fn pieces(mesh: &Mesh) -> Vec<usize> {
    let mut groups = UnionFind::new(mesh.vertices_m.len());
    for [a, b, c] in &mesh.triangles {
        groups.join(*a, *b);
        groups.join(*b, *c);
    }
    let mut numbers = vec![usize::MAX; mesh.vertices_m.len()];
    let mut next = 0;
    let mut number = |root: u32| {
        let slot = &mut numbers[root as usize];
        if *slot == usize::MAX {
            *slot = next;
            next += 1;
        }
        *slot
    };
    mesh.triangles.iter().map(|[a, ..]| number(groups.root(*a))).collect()
}

/// Some triangles of a mesh, without unused vertices.
fn only(mesh: &Mesh, triangles: &[usize]) -> Mesh {
    crate::model::part::only(mesh, triangles)
}

#[cfg(test)]
mod tests {
    use super::{FIRST_M, LAST_M, bound};
    use crate::formats::Shapes;
    use crate::model::sample;
    use crate::model::{Mesh, Model};
    use crate::reconstruct::polygons::validate;
    use biplane_geometry::vec3::dot;

    /// Distance of a point to a ring, by trying all edges.
    fn off_ring_m(ring_m: &[[f64; 3]], p: [f64; 3]) -> f64 {
        let sub = |a: [f64; 3], b: [f64; 3]| [0, 1, 2].map(|k| a[k] - b[k]);
        let off = |(a, b): (&[f64; 3], &[f64; 3])| {
            let (edge, to) = (sub(*b, *a), sub(p, *a));
            let along = (dot(edge, to) / dot(edge, edge)).clamp(0.0, 1.0);
            let rest = [0, 1, 2].map(|k| to[k] - along * edge[k]);
            dot(rest, rest).sqrt()
        };
        ring_m.iter().zip(ring_m.iter().cycle().skip(1)).map(off).fold(f64::INFINITY, f64::min)
    }

    /// Loose squares of two triangles each with these sides, meters.
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
    fn a_model_that_fits_stays_as_it_is() {
        let mut model = sample::model();
        let before = model.clone();
        assert_eq!(bound(&mut model, 11), None);
        assert_eq!(model, before);
    }

    #[test]
    fn loose_pieces_go_before_flat_surfaces_and_the_smallest_first() {
        let cut = |maximum: usize| {
            let mut model = Model { leftovers: squares(&[0.15, 3.0, 2.0]), ..sample::model() };
            let bounded = bound(&mut model, maximum).unwrap();
            assert!(Shapes::new(&model).triangles() <= maximum);
            let x_m: Vec<f32> = model.leftovers.vertices_m.iter().step_by(4).map(|p| p[0]).collect();
            (x_m, model.polygons.len(), bounded.forced)
        };
        assert_eq!(cut(15), (vec![10.0, 20.0], 2, false));
        assert_eq!(cut(12), (vec![10.0], 2, false));
        assert_eq!(cut(9), (vec![10.0], 2, false), "the window of 1 m is closed before a wall goes");
        assert_eq!(cut(3), (vec![], 1, true));
        assert_eq!(cut(0), (vec![], 0, true));
    }

    #[test]
    fn borders_never_move_further_than_the_coarsest_tolerance() {
        // No tolerance makes a room of four walls fit into a triangle.
        let bounded = bound(&mut sample::model(), 1).unwrap();
        assert!(bounded.forced && bounded.tolerance_m == LAST_M, "{bounded:?}");
    }

    #[test]
    fn the_last_tolerance_is_reached_and_borders_move_no_further_than_said() {
        // The wall's upper border becomes a saw with teeth of 10 cm: 40 corners.
        let mut model = sample::model();
        let saw = (0..=40).map(|k| [4.0 - 0.1 * f64::from(k), 2.0, 3.0 + 0.1 * f64::from(k % 2)]);
        model.polygons[0].outer_m.splice(2.., saw);
        let before = model.clone();
        let bounded = bound(&mut model, 20).unwrap();
        assert!(Shapes::new(&model).triangles() <= 20 && !bounded.forced);
        assert!(bounded.tolerance_m > FIRST_M && bounded.tolerance_m <= LAST_M, "{bounded:?}");
        assert_eq!(model.polygons.len(), 2);
        for (polygon, old) in model.polygons.iter().zip(&before.polygons) {
            assert_eq!(validate::check(polygon, &model.planes[polygon.plane]), Ok(()));
            for p in &old.outer_m {
                let off_m = off_ring_m(&polygon.outer_m, *p);
                assert!(off_m <= bounded.tolerance_m + 0.002, "{off_m} {bounded:?}");
            }
        }
    }
}
