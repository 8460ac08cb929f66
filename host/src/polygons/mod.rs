//! From triangles of one plane to polygons with holes (the paper, section 3.2).
//!
//! Instead of the paper's pairwise merging, which must not make holes, all pieces of a plane are united at once: one wall, one
//! polygon, its doors and windows holes of it. Frame `map`, metres.

pub mod adopt;
pub mod assign;
pub mod border;
pub mod borders;
pub mod clearance;
pub mod finish;
pub mod frame;
pub mod gaps;
pub mod islands;
pub mod lay;
pub mod line;
pub mod paper;
pub mod seam;
pub mod thin;
pub mod union;
pub mod validate;
pub mod weld;

use crate::model::{Cloud, Mesh, PlanarPolygon, Plane};
use crate::planes::Planes;
use assign::{Assigner, Piece, Pieces};
use borders::Borders;
use finish::Limits;
use frame::{FlatPoint, Frame};
use rayon::prelude::*;
use serde::Serialize;
use union::{Ring, doubled_area, union};

/// Which polygons of one plane become one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Merging {
    /// All that hang together: one wall, one polygon, its doors and windows holes of it.
    #[default]
    Holes,
    /// Two that share exactly one sequence of edges, as in the paper ([`paper`]): no holes, more polygons.
    Paper,
}

/// How triangles of one plane become polygons.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PolygonParams {
    /// Which polygons of one plane become one.
    pub merging: Merging,
    /// A border may move by this much when it is straightened, metres. Larger: fewer corners. Smaller: noisy borders.
    pub border_tolerance_m: f64,
    /// Openings smaller than this are closed, square metres. Larger: windows close. Smaller: pinholes of noise stay.
    pub min_hole_m2: f64,
    /// Polygons smaller than this are dropped, square metres. Larger: small faces get lost. Smaller: flakes of noise stay.
    pub min_polygon_m2: f64,
    /// Planes are extended to their common line over at most this distance, and no further than the raw triangle is long, metres.
    /// Larger: invented surface. Smaller: cracks where points are far apart.
    pub seam_reach_m: f64,
    /// What stands out of a plane by up to this, and is no plane itself, is laid on it, metres; triangles across a deeper step between
    /// parallel planes are left out. Larger: small things vanish, borders at steps wander by the points' spacing. Smaller: slits
    /// along steps, crumples of far points.
    pub step_m: f64,
    /// Points on no plane that hang together in fewer than so many are spikes. Larger: thin poles get lost. Smaller: spikes stay.
    pub min_structure_points: usize,
    /// Triangles with an edge of at least this length along the beam are no surface but the gap behind an edge, metres.
    pub veil_length_m: f64,
    /// How close to the beam's direction such an edge must run, degrees. Larger: grazed surfaces get lost. Smaller: veils stay.
    pub veil_angle_deg: f64,
}

impl Default for PolygonParams {
    fn default() -> Self {
        Self {
            merging: Merging::default(),
            border_tolerance_m: 0.03,
            min_hole_m2: 0.02,
            min_polygon_m2: 0.002,
            seam_reach_m: 0.5,
            step_m: 0.1,
            min_structure_points: 4,
            veil_length_m: 0.1,
            veil_angle_deg: 15.0,
        }
    }
}

/// The flat surfaces, and the triangles that are none.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Merged {
    /// The flat surfaces.
    pub polygons: Vec<PlanarPolygon>,
    /// Indices of triangles of the raw mesh that no polygon stands for.
    pub rest: Vec<usize>,
    /// Triangles dropped because they only bridge a gap ([`gaps`]).
    pub veils: usize,
}

/// Merges the triangles of each plane to polygons.
pub fn merge(params: &PolygonParams, cloud: &Cloud, mesh: &Mesh, planes: &Planes) -> Merged {
    if planes.labels.len() != cloud.len() {
        return Merged { rest: (0..mesh.triangles.len()).collect(), ..Merged::default() };
    }
    let labels = thin::without(cloud, &planes.labels, &planes.planes);
    let speck = islands::Speck { area_m2: params.min_hole_m2, off_m: params.step_m };
    let labels = islands::join(cloud, mesh, &labels, &planes.planes, speck);
    let labels = adopt::adopt(cloud, mesh, &labels, &planes.planes, params.step_m);
    let laid_m = lay::onto_planes(cloud, &labels, &planes.planes);
    let assigner = Assigner { params, cloud, planes: &planes.planes, labels: &labels, laid_m };
    let pieces = assigner.assign(mesh);
    let polygons: Vec<Vec<PlanarPolygon>> = (0..planes.planes.len())
        .into_par_iter()
        .map(|index| polygons_of(params, index, &planes.planes, &pieces))
        .collect();
    let mut polygons: Vec<PlanarPolygon> = polygons.into_iter().flatten().collect();
    let pairs: Vec<(usize, usize)> = pieces.seams.iter().copied().collect();
    weld::weld(&planes.planes, &mut polygons, &pairs, params.border_tolerance_m);
    if params.merging == Merging::Paper {
        polygons = paper::without_holes(&planes.planes, polygons);
    }
    Merged { polygons, rest: pieces.rest, veils: pieces.veils }
}

/// The polygons of the pieces of plane `index`.
fn polygons_of(params: &PolygonParams, index: usize, planes: &[Plane], all: &Pieces) -> Vec<PlanarPolygon> {
    let pieces = &all.by_plane[index];
    let Some(near_m) = pieces.first().and_then(|piece| piece.first()) else { return Vec::new() };
    let frame = Frame::new(&planes[index], *near_m);
    let flat: Vec<Ring> = pieces.iter().filter_map(|piece| counter_clockwise(&frame, piece)).collect();
    let shapes = union(flat.iter().map(Vec::as_slice));
    let limits = Limits {
        tolerance_m: params.border_tolerance_m,
        min_hole_m2: params.min_hole_m2,
        min_polygon_m2: params.min_polygon_m2,
    };
    let other = |(a, b): &(usize, usize)| match index {
        _ if index == *a => Some(*b),
        _ if index == *b => Some(*a),
        _ => None,
    };
    let neighbours: Vec<usize> = all.seams.iter().filter_map(other).collect();
    let borders = Borders::new(planes, index, &frame, &neighbours).with_spacing(&frame, pieces, &shapes);
    finish::finish(&limits, index, &frame, shapes, &borders)
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

#[cfg(test)]
pub mod cracks;
#[cfg(test)]
mod tests;
