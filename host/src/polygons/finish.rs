//! The last steps from united shapes to polygons: no flakes, straight borders, room between corners and edges.
//!
//! The same steps with a larger tolerance make a coarser polygon of a finished one. Frame `map`, metres.

use super::border;
use super::clearance;
use super::frame::{FlatPoint, Frame, STEP_M};
use super::union::{Ring, Shape, area_m2, repair};
use crate::model::{PlanarPolygon, Plane};

/// How much the last steps may change.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// How far a border may move, metres.
    pub tolerance_m: f64,
    /// Smaller openings are closed, square metres.
    pub min_hole_m2: f64,
    /// Smaller polygons are dropped, square metres.
    pub min_polygon_m2: f64,
}

/// The polygons of plane `index` that shapes in its `frame` become.
pub fn finish(limits: &Limits, index: usize, frame: &Frame, mut shapes: Vec<Shape>) -> Vec<PlanarPolygon> {
    drop_small(limits, &mut shapes);
    for shape in &mut shapes {
        for ring in shape.iter_mut() {
            *ring = border::straighten(ring, limits.tolerance_m / STEP_M);
        }
        shape.retain(|ring| !ring.is_empty());
    }
    let mut shapes = clearance::clear(repair(&shapes));
    drop_small(limits, &mut shapes);
    let lift = |ring: &Ring| ring.iter().map(|p| frame.lift(*p)).collect::<Vec<_>>();
    let polygon = |shape: Shape| {
        let (outer, holes) = shape.split_first()?;
        Some(PlanarPolygon { plane: index, outer_m: lift(outer), holes_m: holes.iter().map(lift).collect() })
    };
    shapes.into_iter().filter_map(polygon).collect()
}

/// A finished polygon with fewer corners: none at all when it is too small, several when it falls apart.
pub fn coarsen(limits: &Limits, plane: &Plane, polygon: &PlanarPolygon) -> Vec<PlanarPolygon> {
    let Some(near_m) = polygon.outer_m.first() else { return Vec::new() };
    let frame = Frame::new(plane, *near_m);
    let flat = |ring: &Vec<[f64; 3]>| ring.iter().map(|p| frame.flat(*p)).collect::<Option<Vec<FlatPoint>>>();
    let rings = std::iter::once(&polygon.outer_m).chain(&polygon.holes_m);
    match rings.map(flat).collect::<Option<Shape>>() {
        Some(shape) => finish(limits, polygon.plane, &frame, vec![shape]),
        None => Vec::new(),
    }
}

/// Closes pinholes and drops flakes.
fn drop_small(limits: &Limits, shapes: &mut Vec<Shape>) {
    shapes.retain(|shape| shape.first().is_some_and(|outer| area_m2(outer) >= limits.min_polygon_m2));
    for shape in shapes {
        let mut first = true;
        shape.retain(|ring| std::mem::take(&mut first) || area_m2(ring) >= limits.min_hole_m2);
    }
}
