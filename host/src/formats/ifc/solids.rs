//! Placements, profiles and what is swept from them.

use super::step::{Id, Ids, Reals, Step};
use crate::formats::text::number::Number;

/// Axes at a place, x along a level direction, z up.
pub(super) fn axes(step: &mut Step, at_m: [f64; 3], along: [f64; 2]) -> Id {
    let point = step.add(format_args!("IFCCARTESIANPOINT({})", Reals(&at_m)));
    let up = step.add(format_args!("IFCDIRECTION((0.,0.,1.))"));
    // More digits than places have: a direction acts over the whole length of a wall.
    let [x, y] = along;
    let along = step.add(format_args!("IFCDIRECTION(({x:.9},{y:.9},0.))"));
    step.add(format_args!("IFCAXIS2PLACEMENT3D({point},{up},{along})"))
}

/// A polyline in the plane; closed when asked for.
pub(super) fn polyline(step: &mut Step, points_m: &[[f64; 2]], closed: bool) -> Id {
    let points: Vec<Id> =
        points_m.iter().map(|p| step.add(format_args!("IFCCARTESIANPOINT({})", Reals(p)))).collect();
    let first = points.first().copied().filter(|_| closed);
    let points: Vec<Id> = points.into_iter().chain(first).collect();
    step.add(format_args!("IFCPOLYLINE({})", Ids(&points)))
}

/// A box: the middle of its foot, its sides, from a height up.
pub(super) fn cuboid(step: &mut Step, [x, y]: [f64; 2], [wide, deep]: [f64; 2], [low, high]: [f64; 2]) -> Id {
    let point = step.add(format_args!("IFCCARTESIANPOINT({})", Reals(&[x, y])));
    let place = step.add(format_args!("IFCAXIS2PLACEMENT2D({point},$)"));
    let profile =
        step.add(format_args!("IFCRECTANGLEPROFILEDEF(.AREA.,$,{place},{},{})", Number(wide), Number(deep)));
    swept(step, profile, low, high - low)
}

/// A prism over an outline with holes.
pub(super) fn prism(
    step: &mut Step,
    outline_m: &[[f64; 2]],
    holes_m: &[Vec<[f64; 2]>],
    [low, high]: [f64; 2],
) -> Id {
    let outer = polyline(step, outline_m, true);
    let profile = if holes_m.is_empty() {
        step.add(format_args!("IFCARBITRARYCLOSEDPROFILEDEF(.AREA.,$,{outer})"))
    } else {
        let holes: Vec<Id> = holes_m.iter().map(|hole| polyline(step, hole, true)).collect();
        step.add(format_args!("IFCARBITRARYPROFILEDEFWITHVOIDS(.AREA.,$,{outer},{})", Ids(&holes)))
    };
    swept(step, profile, low, high - low)
}

fn swept(step: &mut Step, profile: Id, from_m: f64, height_m: f64) -> Id {
    let point = step.add(format_args!("IFCCARTESIANPOINT({})", Reals(&[0.0, 0.0, from_m])));
    let place = step.add(format_args!("IFCAXIS2PLACEMENT3D({point},$,$)"));
    let up = step.add(format_args!("IFCDIRECTION((0.,0.,1.))"));
    step.add(format_args!("IFCEXTRUDEDAREASOLID({profile},{place},{up},{})", Number(height_m)))
}
