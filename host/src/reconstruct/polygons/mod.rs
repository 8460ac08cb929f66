//! From triangles of one plane to polygons with holes (the paper, section 3.2).
//!
//! Instead of the paper's pairwise merging, which must not make holes, all pieces of a plane are united at
//! once: one wall, one polygon, its doors and windows holes of it. Frame `map`, meters.

pub(crate) mod finish;
pub(crate) mod flat_polygon;
pub(crate) mod outline;
pub(crate) mod paper;
pub(crate) mod params;
pub(crate) mod plane_frame;
pub(crate) mod seams;
#[cfg(test)]
mod tests;
pub(crate) mod triangles;
pub(crate) mod triangulate;
pub(crate) mod validate;

use crate::reconstruct::planes::labeled::Planes;
pub use params::{Merging, PolygonParams};

use crate::model::{Cloud, Mesh, PlanarPolygon, Plane};
use crate::reconstruct::polygons::outline::border_context::Borders;
use crate::reconstruct::polygons::outline::directed_edges::DirectedEdges;
use crate::reconstruct::polygons::outline::union::{Ring, doubled_area, union};
use crate::reconstruct::polygons::plane_frame::{FlatPoint, Frame};
use crate::reconstruct::polygons::triangles::assign::{Assigner, Corners, Piece, Pieces};
use finish::Limits;
use rayon::prelude::*;

/// The flat surfaces, and the triangles that are none.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Merged {
    /// The flat surfaces.
    pub polygons: Vec<PlanarPolygon>,
    /// Indices of triangles of the raw mesh that no polygon stands for.
    pub rest: Vec<usize>,
    /// Triangles dropped because they only bridge a gap ([`gaps`]).
    pub jump_edges: usize,
}

/// Merges the triangles of each plane to polygons.
pub(crate) fn merge(params: &PolygonParams, cloud: &Cloud, mesh: &Mesh, planes: &Planes) -> Merged {
    if planes.labels.len() != cloud.len() {
        return Merged { rest: (0..mesh.triangles.len()).collect(), ..Merged::default() };
    }
    let labels = triangles::sliver_planes::without(cloud, &planes.labels, &planes.planes);
    let small_component =
        triangles::small_components::SmallComponent { area_m2: params.min_hole_m2, off_m: params.step_m };
    let labels = triangles::small_components::join(cloud, mesh, &labels, &planes.planes, small_component);
    let labels =
        triangles::label_propagation::propagate_labels(cloud, mesh, &labels, &planes.planes, params.step_m);
    let laid_m = triangles::project_to_plane::onto_planes(cloud, &labels, &planes.planes);
    let assigner = Assigner { params, cloud, planes: &planes.planes, labels: &labels, laid_m };
    let pieces = assigner.assign(mesh);
    let pairs: Vec<(usize, usize)> = pieces.seams.iter().copied().collect();
    let mut neighbors = vec![Vec::new(); planes.planes.len()];
    for (a, b) in &pairs {
        neighbors[*a].push(*b);
        neighbors[*b].push(*a);
    }
    let polygons: Vec<Vec<PlanarPolygon>> = neighbors
        .par_iter()
        .enumerate()
        .map(|(index, near)| polygons_of(params, (index, near), &planes.planes, &pieces, &assigner.laid_m))
        .collect();
    let mut polygons: Vec<PlanarPolygon> = polygons.into_iter().flatten().collect();
    if params.slit_m > 0.0 {
        seams::jogs::even_out(&planes.planes, &mut polygons, &neighbors, params.border_tolerance_m);
    }
    seams::weld::weld(&planes.planes, &mut polygons, &pairs, params.border_tolerance_m);
    if params.merging == Merging::Paper {
        polygons = paper::without_holes(&planes.planes, polygons);
    }
    Merged { polygons, rest: pieces.rest, jump_edges: pieces.jump_edges }
}

/// The polygons of the pieces of a plane that meets its `neighbors`; `laid_m` are the corners of its
/// triangles.
fn polygons_of(
    params: &PolygonParams,
    (index, neighbors): (usize, &[usize]),
    planes: &[Plane],
    all: &Pieces,
    laid_m: &[[f64; 3]],
) -> Vec<PlanarPolygon> {
    let corners_of = |triangle: &Corners| triangle.map(|corner| laid_m[corner as usize]);
    let (triangles, rings) = (&all.triangles[index], &all.rings[index]);
    let first = triangles.first().map(|triangle| corners_of(triangle)[0]);
    let Some(near_m) = first.or_else(|| rings.first()?.first().copied()) else { return Vec::new() };
    let frame = Frame::new(&planes[index], near_m);
    let mut flat = border_of(&frame, triangles, laid_m);
    flat.extend(rings.iter().filter_map(|ring| counter_clockwise(&frame, ring)));
    let shapes = union(flat.iter().map(Vec::as_slice));
    drop(flat);
    let limits = Limits {
        tolerance_m: params.border_tolerance_m,
        min_hole_m2: params.min_hole_m2,
        min_polygon_m2: params.min_polygon_m2,
        slit_m: params.slit_m,
    };
    let mut borders = Borders::new(planes, index, &frame, neighbors).with_corners(&shapes);
    triangles.iter().for_each(|triangle| borders.note_spacing(&frame, &corners_of(triangle)));
    rings.iter().for_each(|ring| borders.note_spacing(&frame, ring));
    finish::finish(&limits, index, &frame, shapes, &borders)
}

/// Rings round the triangles of a plane, in plane coordinates: their union is that of the triangles.
fn border_of(frame: &Frame, triangles: &[Corners], laid_m: &[[f64; 3]]) -> Vec<Ring> {
    let flat = |corner: u32| frame.flat(laid_m[corner as usize]);
    let mut edges = DirectedEdges::with_room(triangles.len());
    for &[a, b, c] in triangles {
        let (Some(p), Some(q), Some(r)) = (flat(a), flat(b), flat(c)) else { continue };
        match doubled_area(&[p, q, r]) {
            0 => {}
            doubled if doubled > 0 => edges.add([a, b, c]),
            _ => edges.add([a, c, b]),
        }
    }
    let ring = |corners: Vec<u32>| corners.into_iter().filter_map(flat).collect();
    edges.rings().into_iter().map(ring).collect()
}

/// A piece in plane coordinates, turned counter-clockwise; `None` when it has no area.
fn counter_clockwise(frame: &Frame, piece: &Piece) -> Option<Ring> {
    let mut ring: Ring = piece.iter().map(|p| frame.flat(*p)).collect::<Option<Vec<FlatPoint>>>()?;
    let doubled = doubled_area(&ring);
    if doubled < 0 {
        ring.reverse();
    }
    (doubled != 0).then_some(ring)
}
