//! The last steps from united shapes to polygons: no flakes, straight borders, room between corners and
//! edges.
//!
//! The same steps with a larger tolerance make a coarser polygon of a finished one. Frame `map`, meters.

use crate::model::{PlanarPolygon, Plane};
use crate::reconstruct::polygons::flat_polygon::flat;
use crate::reconstruct::polygons::outline::border;
use crate::reconstruct::polygons::outline::border::Rules;
use crate::reconstruct::polygons::outline::border_context::Borders;
use crate::reconstruct::polygons::outline::union::{Ring, Shape, area_m2, repair};
use crate::reconstruct::polygons::outline::{slits, spikes};
use crate::reconstruct::polygons::plane_frame::{FlatPoint, Frame, STEP_M};
use crate::reconstruct::polygons::seams::clearance;
use rayon::prelude::*;

/// What is smaller than this joins nothing, square meters: a triangle or two.
const FLAKE_M2: f64 = 0.002;
/// Spikes are taken off so often at most.
const SPIKE_ROUNDS: usize = 4;

/// How much the last steps may change.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Limits {
    /// How far a border may move, meters.
    pub tolerance_m: f64,
    /// Smaller openings are closed, square meters.
    pub min_hole_m2: f64,
    /// Smaller polygons are dropped, square meters.
    pub min_polygon_m2: f64,
    /// Narrower gaps are closed, meters; 0 leaves them, and corners that turn back.
    pub slit_m: f64,
}

/// The polygons of plane `index` that shapes in its `frame` become.
pub(crate) fn finish(
    limits: &Limits,
    index: usize,
    frame: &Frame,
    mut shapes: Vec<Shape>,
    borders: &Borders,
) -> Vec<PlanarPolygon> {
    drop_small(limits, FLAKE_M2.min(limits.min_polygon_m2), &mut shapes);
    let tolerance = |p: FlatPoint| {
        let tolerance = borders.tolerance(p, limits.tolerance_m / STEP_M);
        // The corners of what somebody drew are no rows of points.
        if limits.slit_m > 0.0 { tolerance } else { tolerance.without_rows() }
    };
    let rules = Rules { tolerance: &tolerance, seams: &borders.seams, directions: &borders.directions };
    let mut shapes = repair(&straight(shapes, &rules));
    if limits.slit_m > 0.0 {
        shapes = slits::without_slits(&without_spikes(shapes), limits.slit_m);
        shapes = without_spikes(repair(&straight(shapes, &rules)));
    }
    let mut shapes = clearance::clear(shapes);
    drop_small(limits, limits.min_polygon_m2, &mut shapes);
    let lift = |ring: &Ring| ring.iter().map(|p| frame.lift(*p)).collect::<Vec<_>>();
    let polygon = |shape: Shape| {
        let (outer, holes) = shape.split_first()?;
        Some(PlanarPolygon { plane: index, outer_m: lift(outer), holes_m: holes.iter().map(lift).collect() })
    };
    shapes.into_iter().filter_map(polygon).collect()
}

/// Finished polygons with fewer corners: none at all for one that is too small, several for one that falls
/// apart. `neighbors` are the planes that meet each plane.
pub(crate) fn coarsen(
    limits: &Limits,
    planes: &[Plane],
    neighbors: &[Vec<usize>],
    polygons: &[PlanarPolygon],
) -> Vec<PlanarPolygon> {
    let of = |polygon: &PlanarPolygon| {
        let plane = planes.get(polygon.plane)?;
        let frame = Frame::new(plane, *polygon.outer_m.first()?);
        let shape = flat(&frame, polygon)?;
        let borders = Borders::new(planes, polygon.plane, &frame, &neighbors[polygon.plane]);
        Some(finish(limits, polygon.plane, &frame, vec![shape], &borders))
    };
    let coarse: Vec<Vec<PlanarPolygon>> =
        polygons.par_iter().map(|polygon| of(polygon).unwrap_or_default()).collect();
    coarse.into_iter().flatten().collect()
}

/// Shapes with straight borders.
fn straight(mut shapes: Vec<Shape>, rules: &Rules<'_>) -> Vec<Shape> {
    for shape in &mut shapes {
        let mut first = true;
        for ring in shape.iter_mut() {
            *ring = border::straighten(ring, rules);
            if std::mem::take(&mut first) && ring.is_empty() {
                break;
            }
        }
        // Openings of what vanished vanish too.
        if shape.first().is_some_and(Vec::is_empty) {
            shape.clear();
        }
        shape.retain(|ring| !ring.is_empty());
    }
    shapes
}

/// Shapes without corners that turn back. Where a border crosses another after that, new ones may arise.
pub(crate) fn without_spikes(mut shapes: Vec<Shape>) -> Vec<Shape> {
    for _ in 0..SPIKE_ROUNDS {
        let mut changed = false;
        for ring in shapes.iter_mut().flatten() {
            let clean = spikes::without_spikes(ring);
            changed |= clean != *ring;
            *ring = clean;
        }
        if !changed {
            break;
        }
        // Openings of what vanished vanish too: nothing is left for them to be cut from.
        shapes = repair(&shapes);
    }
    shapes
}

/// Closes pinholes and drops flakes smaller than `min_polygon_m2`.
fn drop_small(limits: &Limits, min_polygon_m2: f64, shapes: &mut Vec<Shape>) {
    shapes.retain(|shape| shape.first().is_some_and(|outer| area_m2(outer) >= min_polygon_m2));
    for shape in shapes {
        let mut first = true;
        shape.retain(|ring| std::mem::take(&mut first) || area_m2(ring) >= limits.min_hole_m2);
    }
}
