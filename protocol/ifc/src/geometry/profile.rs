//! Profiles of swept solids: outlines with holes in the plane z = 0.

use std::f64::consts::TAU;

use crate::geometry::curve::Curves;
use crate::geometry::placement::{axes, operator};
use crate::geometry::vector::{Placement, Vec3};
use crate::step::value::{Entity, Value};

/// An outline and the holes in it.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Profile {
    /// Rings; the first is the outline.
    pub rings: Vec<Vec<Vec3>>,
}

/// Corners of a circle.
const CIRCLE: usize = 36;
/// Profiles of profiles deeper than this are a circle.
const MAX_DEPTH: usize = 8;

impl Profile {
    fn placed(mut self, placement: &Placement) -> Self {
        for point in self.rings.iter_mut().flatten() {
            *point = placement.point(*point);
        }
        self
    }

    fn of(rings: impl IntoIterator<Item = Vec<[f64; 2]>>) -> Self {
        let lift = |ring: Vec<[f64; 2]>| ring.into_iter().map(|[x, y]| [x, y, 0.0]).collect();
        Self { rings: rings.into_iter().map(lift).collect() }
    }
}

/// The outlines of a profile, of which a composite one has several; empty for one that is not known.
pub(crate) fn profiles(curves: &Curves<'_>, value: &Value) -> Vec<Profile> {
    nested(curves, value, 0)
}

fn nested(curves: &Curves<'_>, value: &Value, depth: usize) -> Vec<Profile> {
    let Some(entity) = curves.step.follow(value).filter(|_| depth < MAX_DEPTH) else { return Vec::new() };
    match entity.kind.as_str() {
        "IFCARBITRARYCLOSEDPROFILEDEF" => closed(curves, entity, &[]),
        "IFCARBITRARYPROFILEDEFWITHVOIDS" => closed(curves, entity, entity.at(3).list()),
        "IFCCOMPOSITEPROFILEDEF" => {
            entity.at(2).list().iter().flat_map(|part| nested(curves, part, depth + 1)).collect()
        }
        "IFCDERIVEDPROFILEDEF" | "IFCMIRROREDPROFILEDEF" => {
            let placement = operator(curves.step, entity.at(3));
            let parents = nested(curves, entity.at(2), depth + 1).into_iter();
            parents.map(|parent| parent.placed(&placement)).collect()
        }
        _ => {
            let placement = axes(curves.step, entity.at(2));
            parametric(entity).map(|profile| profile.placed(&placement)).into_iter().collect()
        }
    }
}

fn closed(curves: &Curves<'_>, entity: &Entity, holes: &[Value]) -> Vec<Profile> {
    let Some(outer) = curves.ring(entity.at(2)) else { return Vec::new() };
    let holes = holes.iter().filter_map(|hole| curves.ring(hole));
    vec![Profile { rings: std::iter::once(outer).chain(holes).collect() }]
}

fn rectangle(width: f64, depth: f64) -> Vec<[f64; 2]> {
    let (x, y) = (width / 2.0, depth / 2.0);
    vec![[-x, -y], [x, -y], [x, y], [-x, y]]
}

fn ellipse(a: f64, b: f64) -> Vec<[f64; 2]> {
    // Corners outside of the circle, so that the area is the circle's.
    let wide = (TAU / CIRCLE as f64 / (TAU / CIRCLE as f64).sin()).sqrt();
    let at = |k: usize| TAU * k as f64 / CIRCLE as f64;
    (0..CIRCLE).map(|k| [wide * a * at(k).cos(), wide * b * at(k).sin()]).collect()
}

/// Profiles that are given by measures; roundings of their corners are left away.
fn parametric(entity: &Entity) -> Option<Profile> {
    let size = |index: usize| entity.at(index).number().filter(|value| *value > 0.0);
    let [a, b] = [size(3)?, size(4).unwrap_or(0.0)];
    let ring = match entity.kind.as_str() {
        "IFCRECTANGLEPROFILEDEF" | "IFCROUNDEDRECTANGLEPROFILEDEF" => rectangle(a, b),
        "IFCRECTANGLEHOLLOWPROFILEDEF" => {
            let wall = 2.0 * size(5)?;
            return Some(Profile::of([rectangle(a, b), rectangle(a - wall, b - wall)]));
        }
        "IFCCIRCLEPROFILEDEF" => ellipse(a, a),
        "IFCCIRCLEHOLLOWPROFILEDEF" => return Some(Profile::of([ellipse(a, a), ellipse(a - b, a - b)])),
        "IFCELLIPSEPROFILEDEF" => ellipse(a, b),
        "IFCTRAPEZIUMPROFILEDEF" => {
            let (height, off) = (size(5)?, entity.at(6).number().unwrap_or(0.0));
            let (x, y) = (a / 2.0, height / 2.0);
            vec![[-x, -y], [x, -y], [-x + off + b, y], [-x + off, y]]
        }
        "IFCISHAPEPROFILEDEF" => {
            let (x, y, web, flange) = (a / 2.0, b / 2.0, size(5)? / 2.0, size(6)?);
            let right = vec![
                [x, -y],
                [x, -y + flange],
                [web, -y + flange],
                [web, y - flange],
                [x, y - flange],
                [x, y],
            ];
            mirrored(right, |[px, py]| [-px, py])
        }
        "IFCTSHAPEPROFILEDEF" => {
            let (x, y, web, flange) = (b / 2.0, a / 2.0, size(5)? / 2.0, size(6)?);
            mirrored(vec![[web, -y], [web, y - flange], [x, y - flange], [x, y]], |[px, py]| [-px, py])
        }
        "IFCLSHAPEPROFILEDEF" => {
            let (x, y, wall) = (size(4).unwrap_or(a) / 2.0, a / 2.0, size(5)?);
            vec![[-x, -y], [x, -y], [x, -y + wall], [-x + wall, -y + wall], [-x + wall, y], [-x, y]]
        }
        "IFCUSHAPEPROFILEDEF" => {
            let (x, y, web, flange) = (b / 2.0, a / 2.0, size(5)?, size(6)?);
            mirrored(vec![[-x + web, y - flange], [x, y - flange], [x, y], [-x, y]], |[px, py]| [px, -py])
        }
        "IFCCSHAPEPROFILEDEF" => {
            let (x, y, wall, girth) = (b / 2.0, a / 2.0, size(5)?, size(6)?);
            let upper = vec![
                [-x + wall, y - wall],
                [x - wall, y - wall],
                [x - wall, y - girth],
                [x, y - girth],
                [x, y],
                [-x, y],
            ];
            mirrored(upper, |[px, py]| [px, -py])
        }
        _ => return None,
    };
    Some(Profile::of([ring]))
}

/// Half of an outline, and the other half by a mirror.
fn mirrored(half: Vec<[f64; 2]>, mirror: impl Fn([f64; 2]) -> [f64; 2]) -> Vec<[f64; 2]> {
    let other: Vec<[f64; 2]> = half.iter().rev().map(|point| mirror(*point)).collect();
    [half, other].concat()
}
