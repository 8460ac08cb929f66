//! The model's surfaces where the building knows better: doors and windows become rectangles in the faces of
//! their walls, and so do holes of other upright surfaces that nearly are. Roofs end in level lines. Narrow
//! notches in borders are filled.
//!
//! Each edge is put where the fewest rays contradict it; surface that rays contradict is neither added nor
//! taken away. Frame `map`, meters.

mod bays;
mod border;
mod combs;
mod holes;
pub(crate) mod inferred;
mod notches;
mod plane_rays;
mod rectangle;
mod unresolved;

use std::collections::BTreeSet;

use rayon::prelude::*;

use self::bays::Bay;
use self::combs::Level;
use self::plane_rays::PlaneRays;
use self::rectangle::Place;
use super::elements::{Elements, Wall, WallOpening};
use super::elevation::Span;
use super::part::CUT_M;
use super::spaces::evidence::Evidence;
use crate::model::{Model, PlanarPolygon, Plane};
use crate::reconstruct::polygons::finish::without_spikes;
use crate::reconstruct::polygons::flat_polygon::{flat, lifted};
use crate::reconstruct::polygons::outline::union::{Ring, Shape, area_m2, union};
use crate::reconstruct::polygons::plane_frame::Frame;
use crate::reconstruct::polygons::seams::met_edges::MetEdges;
use crate::reconstruct::polygons::seams::{clearance, jogs, weld};

/// A plane is a wall's face when it lies this near to its side, meters; more with more noise.
const BESIDE_M: f64 = 0.04;
/// The same in standard deviations of the noise.
const BESIDE_SIGMAS: f64 = 3.0;
/// And looks away from the wall's middle: cosine of 3 degrees.
const SAME_WAY: f64 = 0.9986;
/// A plane is upright when its normal rises by less than this (sine of the angle; 6 degrees).
const UPRIGHT: f64 = 0.1;
/// It is a roof's when its normal rises by this: 75 to 15 degrees off the vertical.
const ROOF: std::ops::Range<f64> = 0.26..0.966;
/// Pieces that only a straight edge cut off are dropped when they are smaller, square meters: as in outlines.
const MIN_PIECE_M2: f64 = 0.05;
/// Corners of neighbors this near to each other along their common line become one, meters. Outlines were
/// welded before: a corner that moves by a centimeter now tilts a jamb, and blocks rays. What is further
/// apart becomes a corner of both.
const WELD_M: f64 = 0.001;
/// Steps between an edge that was put where it belongs and the border beside it are evened out up to this
/// depth, meters: outlines are as exact at best.
const JOG_M: f64 = 0.01;

/// The polygons of the model with rectangles for the openings that are known.
pub(crate) fn with_rectangles(evidence: &Evidence<'_>, elements: &Elements) -> Vec<PlanarPolygon> {
    let model = evidence.model;
    let neighbors = weld::neighbors(&model.planes, &model.polygons);
    let met = MetEdges::new(&model.planes, &model.polygons, &neighbors);
    let changed: Vec<Option<Vec<PlanarPolygon>>> = (0..model.planes.len())
        .into_par_iter()
        .map(|plane| {
            let places = places(evidence, elements, plane);
            of_plane(evidence, plane, &places, &met)
        })
        .collect();
    let mut written = BTreeSet::new();
    let mut polygons = Vec::with_capacity(model.polygons.len());
    for polygon in &model.polygons {
        match changed.get(polygon.plane) {
            Some(Some(new)) if written.insert(polygon.plane) => polygons.extend(new.iter().cloned()),
            Some(Some(_)) => {}
            _ => polygons.push(polygon.clone()),
        }
    }
    weld_changed(model, &mut polygons, &written);
    polygons
}

/// Lets the planes that changed share corners with their neighbors again, without small steps.
fn weld_changed(model: &Model, polygons: &mut [PlanarPolygon], changed: &BTreeSet<usize>) {
    let neighbors = weld::neighbors(&model.planes, polygons);
    let evened = jogs::even_out(&model.planes, polygons, &neighbors, JOG_M);
    let has_changed = |plane: &usize| changed.contains(plane) || evened.contains(plane);
    let pairs: BTreeSet<(usize, usize)> = neighbors
        .iter()
        .enumerate()
        .flat_map(|(own, others)| others.iter().map(move |other| (own.min(*other), own.max(*other))))
        .filter(|(a, b)| has_changed(a) || has_changed(b))
        .collect();
    let pairs: Vec<(usize, usize)> = pairs.into_iter().collect();
    weld::weld(&model.planes, polygons, &pairs, WELD_M);
}

/// Whether a plane is a face of a straight wall at a place in the wall's middle.
fn is_face_at(evidence: &Evidence<'_>, plane: &Plane, wall: &Wall, place_m: [f64; 3]) -> bool {
    let beside_m = BESIDE_M.max(BESIDE_SIGMAS * evidence.sigma_m);
    let ([x, y], _) = wall.along();
    [[y, -x], [-y, x]].iter().any(|normal| {
        let same_way = plane.normal[0] * normal[0] + plane.normal[1] * normal[1];
        let off_m = -plane.distance_m(place_m) - wall.drawn_thickness_m / 2.0;
        wall.is_straight() && same_way > SAME_WAY && off_m.abs() <= beside_m
    })
}

/// Whether a plane is a face of a wall along all of it.
fn is_face_of(evidence: &Evidence<'_>, plane: &Plane, wall: &Wall) -> bool {
    let z_m = evidence.floor_m + CUT_M;
    wall.axis_m.iter().all(|[x, y]| is_face_at(evidence, plane, wall, [*x, *y, z_m]))
}

/// The openings in the wall whose face a plane is.
fn places(evidence: &Evidence<'_>, elements: &Elements, plane: usize) -> Vec<Place> {
    let plane = &evidence.model.planes[plane];
    let of = |opening: &WallOpening| {
        let wall = elements.wall(&opening.wall)?;
        is_face_at(evidence, plane, wall, opening.center_m).then(|| place_of(wall, opening))
    };
    elements.openings.iter().filter_map(of).collect()
}

/// Where an opening of a straight wall is.
fn place_of(wall: &Wall, opening: &WallOpening) -> Place {
    let ([x, y], _) = wall.along();
    Place {
        ends_m: [-0.5, 0.5].map(|share| {
            let along = share * opening.width_m;
            [opening.center_m[0] + along * x, opening.center_m[1] + along * y]
        }),
        heights_m: [-0.5, 0.5].map(|share| opening.center_m[2] + share * opening.height_m),
        has_sill: opening.sill_m > 0.0,
    }
}

/// The polygons of a plane with its openings and without notches; `None` when nothing changes.
fn of_plane(
    evidence: &Evidence<'_>,
    index: usize,
    places: &[Place],
    met: &MetEdges<'_>,
) -> Option<Vec<PlanarPolygon>> {
    let plane = &evidence.model.planes[index];
    let own: Vec<&PlanarPolygon> =
        evidence.model.polygons.iter().filter(|polygon| polygon.plane == index).collect();
    let frame = Frame::new(plane, *own.first()?.outer_m.first()?);
    let before: Vec<Shape> = own.iter().map(|polygon| flat(&frame, polygon)).collect::<Option<_>>()?;
    let drawn = with_outlines(evidence, plane, &frame, before.clone(), places);
    let seams = met.of_plane(index, &frame);
    let notches = notches::find(&drawn, &seams);
    let sides: Vec<[Span; 2]> = notches.iter().map(notches::sides).collect();
    let rays = PlaneRays::of(evidence, plane, &frame, &sides);
    let filled = notches::filled(drawn, &notches, &rays);
    let shapes = unresolved::straightened(evidence, plane, &frame, filled, &seams);
    if shapes == before {
        return None;
    }
    let mut shapes = clearance::clear(without_spikes(shapes));
    shapes.retain(|shape| shape.first().is_some_and(|outer| area_m2(outer) >= MIN_PIECE_M2));
    Some(lifted(index, &frame, shapes, &own))
}

/// The shapes of a plane with rectangles for openings, and level roofs.
fn with_outlines(
    evidence: &Evidence<'_>,
    plane: &Plane,
    frame: &Frame,
    before: Vec<Shape>,
    places: &[Place],
) -> Vec<Shape> {
    let mut outlines: Vec<Outline> = places.iter().map(|place| Outline::known(place, frame)).collect();
    if plane.normal[2].abs() < UPRIGHT {
        outlines.extend(unknown(&before, &outlines));
    }
    let levels = if ROOF.contains(&plane.normal[2].abs()) { combs::find(&before) } else { Vec::new() };
    let sides = outlines.iter().map(|outline| outline.sides).chain(levels.iter().map(Level::sides));
    let mut rays = PlaneRays::of(evidence, plane, frame, &sides.collect::<Vec<_>>());
    let rays_of_levels = rays.split_off(outlines.len());
    let (outlines, rims) = below_rims(outlines, rays);
    let mut shapes = before;
    if !rims.is_empty() {
        shapes = union(shapes.iter().flatten().chain(&rims).map(Vec::as_slice));
    }
    for (outline, rays) in &outlines {
        shapes = rectangle::cut(shapes, outline.sides, outline.has_sill, rays, evidence.sigma_m);
    }
    for (level, rays) in levels.iter().zip(&rays_of_levels) {
        shapes = level.drawn(&shapes, rays);
    }
    shapes
}

/// The outline of an opening in the coordinates of its plane.
#[derive(Clone, Debug, PartialEq)]
struct Outline {
    sides: [Span; 2],
    has_sill: bool,
    /// The bay that it may be.
    bay: Option<Bay>,
}

impl Outline {
    fn known(place: &Place, frame: &Frame) -> Self {
        Self { sides: place.in_frame(frame), has_sill: place.has_sill, bay: None }
    }
}

/// The outlines of what no room knows of: rectangular holes and bays.
fn unknown(shapes: &[Shape], known: &[Outline]) -> Vec<Outline> {
    let hole = |sides: [Span; 2]| Outline { sides, has_sill: true, bay: None };
    let bay = |bay: Bay| Outline { sides: bay.sides, has_sill: true, bay: Some(bay) };
    let all = holes::rectangles(shapes).into_iter().map(hole).chain(bays::find(shapes).into_iter().map(bay));
    all.filter(|new| !known.iter().any(|old| overlap(&new.sides, &old.sides))).collect()
}

/// The outlines with the rays near them, those of bays below their rims; and the rims. Bays without are left
/// out.
fn below_rims(outlines: Vec<Outline>, rays: Vec<PlaneRays>) -> (Vec<(Outline, PlaneRays)>, Vec<Ring>) {
    let mut rims = Vec::new();
    let mut found = Vec::new();
    for (mut outline, rays) in outlines.into_iter().zip(rays) {
        if let Some(bay) = outline.bay {
            let Some((sides, rim)) = bay.opening(&rays) else { continue };
            outline.sides = sides;
            rims.push(rectangle::ring(rim));
        }
        found.push((outline, rays));
    }
    (found, rims)
}

/// Whether two rectangles have something in common.
fn overlap(one: &[Span; 2], other: &[Span; 2]) -> bool {
    (0..2).all(|axis| one[axis][0] < other[axis][1] && other[axis][0] < one[axis][1])
}
