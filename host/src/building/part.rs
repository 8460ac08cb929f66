//! What a single polygon is in a building: a wall, a floor, a ceiling, or a thing. Meters.

use crate::model::{Model, PlanarPolygon, Plane};

/// Height above the floor at which plans are cut, meters: through doors and windows, over desks.
pub(crate) const CUT_M: f64 = 1.2;

/// Planes whose normal's rise is no more than this are upright: 11.5 degrees.
const UPRIGHT: f64 = 0.2;

/// Planes whose normal's rise is at least this are level: 18 degrees.
pub(crate) const LEVEL: f64 = 0.95;

/// What ends lower over its floor is a thing and no wall, meters: most furniture is lower, most doors are
/// higher.
const WALL_TOP_M: f64 = 1.8;

/// A wall whose storey is not known is at least this high, meters.
const WALL_HEIGHT_M: f64 = 1.5;

/// Level surfaces within this of a storey's floor belong to it, meters: noise, ramps, thresholds; not steps
/// of stairs twice.
const FLOOR_BAND_M: f64 = 0.3;

/// Least room under a ceiling, meters.
const HEADROOM_M: f64 = 1.8;

/// What a polygon is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Upright, and reaches higher than furniture.
    Wall,
    /// Level, seen from above, at the height of a storey.
    Floor,
    /// Level, seen from below, with room to stand under it.
    Ceiling,
    /// The leaf of a closed door: fills a door behind its wall.
    Leaf,
    /// Everything else: furniture, slopes, reveals.
    Other,
}

/// A polygon's part in the building.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Part {
    /// What it is.
    pub kind: Kind,
    /// Index of its storey; the lowest when none is known.
    pub storey: usize,
}

pub(crate) fn is_upright(plane: &Plane) -> bool {
    plane.normal[2].abs() <= UPRIGHT
}

/// Least and greatest height of a polygon, meters.
pub(crate) fn heights_m(polygon: &PlanarPolygon) -> (f64, f64) {
    let fold =
        |pick: fn(f64, f64) -> f64, start| polygon.outer_m.iter().fold(start, |best, p| pick(best, p[2]));
    (fold(f64::min, f64::INFINITY), fold(f64::max, f64::NEG_INFINITY))
}

/// The highest storey whose floor is no higher than this; the lowest where there is none.
fn storey_at(floors_m: &[f64], z_m: f64) -> usize {
    floors_m.iter().rposition(|floor| *floor <= z_m).unwrap_or(0)
}

pub(crate) fn part(model: &Model, polygon: &PlanarPolygon, floors_m: &[f64]) -> Part {
    let (low_m, high_m) = heights_m(polygon);
    let Some(plane) = model.planes.get(polygon.plane) else {
        return Part { kind: Kind::Other, storey: storey_at(floors_m, low_m) };
    };
    if is_upright(plane) {
        let storey = storey_at(floors_m, low_m + 2.0 * FLOOR_BAND_M);
        let top_m = highest_m(model, polygon.plane, high_m);
        let is_wall = match floors_m.get(storey) {
            Some(floor_m) => top_m >= floor_m + WALL_TOP_M,
            None => high_m - low_m >= WALL_HEIGHT_M,
        };
        return Part { kind: if is_wall { Kind::Wall } else { Kind::Other }, storey };
    }
    let middle_m = (low_m + high_m) / 2.0;
    if plane.normal[2] >= LEVEL {
        let storey = storey_at(floors_m, middle_m + FLOOR_BAND_M);
        let is_floor = floors_m.get(storey).is_some_and(|floor_m| (middle_m - floor_m).abs() <= FLOOR_BAND_M);
        return Part { kind: if is_floor { Kind::Floor } else { Kind::Other }, storey };
    }
    let storey = storey_at(floors_m, middle_m - HEADROOM_M);
    let has_room = floors_m.get(storey).is_none_or(|floor_m| middle_m >= floor_m + HEADROOM_M);
    let is_ceiling = plane.normal[2] <= -LEVEL && has_room;
    Part { kind: if is_ceiling { Kind::Ceiling } else { Kind::Other }, storey }
}

/// Top of the plane's polygons, meters: a wall that furniture parts stays a wall. Those of other storeys do
/// not count.
fn highest_m(model: &Model, plane: usize, own_m: f64) -> f64 {
    let tops = model.polygons.iter().filter(|other| other.plane == plane).map(|other| heights_m(other).1);
    tops.filter(|top| *top <= own_m + WALL_TOP_M).fold(own_m, f64::max)
}
