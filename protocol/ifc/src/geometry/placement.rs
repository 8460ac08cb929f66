//! Placements as the file states them.

use crate::geometry::vector::{Placement, Vec3, cross, scale, unit};
use crate::step::value::{Step, Value};

/// Placements relative to placements deeper than this are a circle.
const MAX_DEPTH: usize = 64;

/// The coordinates of an `IfcCartesianPoint` or the ratios of an `IfcDirection`; two get a third that is 0.
pub(crate) fn triple(step: &Step, value: &Value) -> Option<Vec3> {
    match step.follow(value)?.at(0).numbers()[..] {
        [x, y] => Some([x, y, 0.0]),
        [x, y, z] => Some([x, y, z]),
        _ => None,
    }
}

/// An `IfcAxis2Placement2D` or `3D`; the identity where none is stated.
pub(crate) fn axes(step: &Step, value: &Value) -> Placement {
    let Some(entity) = step.follow(value) else { return Placement::IDENTITY };
    let origin = triple(step, entity.at(0)).unwrap_or_default();
    let (axis, reference) = match entity.kind.as_str() {
        "IFCAXIS2PLACEMENT3D" => (triple(step, entity.at(1)), triple(step, entity.at(2))),
        "IFCAXIS1PLACEMENT" => (triple(step, entity.at(1)), None),
        _ => (None, triple(step, entity.at(1))),
    };
    Placement::new(origin, axis.unwrap_or([0.0, 0.0, 1.0]), reference.unwrap_or([1.0, 0.0, 0.0]))
}

/// An `IfcLocalPlacement` in the frame of the file.
pub(crate) fn local(step: &Step, value: &Value) -> Placement {
    let mut placement = Placement::IDENTITY;
    let mut at = step.follow(value);
    for _ in 0..MAX_DEPTH {
        let Some(entity) = at.filter(|entity| entity.kind == "IFCLOCALPLACEMENT") else { break };
        placement = axes(step, entity.at(1)).after(&placement);
        at = step.follow(entity.at(0));
    }
    placement
}

/// An `IfcCartesianTransformationOperator` of two or three dimensions.
pub(crate) fn operator(step: &Step, value: &Value) -> Placement {
    let Some(entity) = step.follow(value) else { return Placement::IDENTITY };
    let direction = |index: usize| triple(step, entity.at(index)).and_then(unit);
    let origin = triple(step, entity.at(2)).unwrap_or_default();
    let is_flat = entity.kind.contains("OPERATOR2D");
    let z = if is_flat { None } else { direction(4) }.unwrap_or([0.0, 0.0, 1.0]);
    let placed = Placement::new(origin, z, direction(0).unwrap_or([1.0, 0.0, 0.0]));
    let x = placed.axes[0];
    let mut y = cross(placed.axes[2], x);
    if direction(1).is_some_and(|stated| crate::geometry::vector::dot(stated, y) < 0.0) {
        y = scale(y, -1.0);
    }
    let first = entity.at(3).number().unwrap_or(1.0);
    let (second, third) = match (is_flat, entity.kind.ends_with("NONUNIFORM")) {
        (true, true) => (entity.at(4).number().unwrap_or(first), first),
        (false, true) => (entity.at(5).number().unwrap_or(first), entity.at(6).number().unwrap_or(first)),
        _ => (first, first),
    };
    Placement { axes: [scale(x, first), scale(y, second), scale(placed.axes[2], third)], origin }
}
