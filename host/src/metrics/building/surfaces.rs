//! The surfaces of walls, as ISPRS' benchmark of indoor modeling measures them (Khoshelham et al. 2017).
//!
//! A wall's surface here is what stands upright around a room: the room's border from its floor to its
//! ceiling without openings, and without borders to rooms that are open to it. *Completeness* is the share of
//! the reference within 10 cm of the model, *correctness* the share of the model within 10 cm of the
//! reference, *accuracy* the median distance of reference to model, of distances under 10 cm.

use biplane_geometry::PortableMath;
use serde::Serialize;

use biplane_geometry::quantile;

use super::plan::{Frame, Opening, Plan, Room};
use super::region::Point;
use super::rooms::{edges, touching_m};

/// Buffer and cut-off, meters.
const NEAR_M: f64 = 0.1;
/// Distance of the samples on a surface, meters.
const STEP_M: f64 = 0.1;
/// Height of a room whose ceiling is not known, meters.
const NOMINAL_HEIGHT_M: f64 = 2.4;
/// An opening's middle lies at most so far behind a room's border, meters: half of a thick wall, or where a
/// frame was seen in one.
const BEHIND_M: f64 = 0.4;

/// How well the surfaces of walls were found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub(crate) struct SurfaceFigures {
    /// Share of the reference within 10 cm of the model.
    pub completeness: f64,
    /// Share of the model within 10 cm of the reference.
    pub correctness: f64,
    /// Median distance from the reference to the model, of those under 10 cm, meters.
    pub accuracy_m: Option<f64>,
}

/// A rectangle of wall along a room's border, with openings.
struct Strip {
    frame: Frame,
    /// From the floor's height, meters over it.
    height_m: f64,
    /// Openings: along from, to, over the floor from, to.
    holes: Vec<[f64; 4]>,
}

impl Strip {
    /// Distance of a place on another strip: a point and a height over the floor.
    fn distance_m(&self, point: Point, z_m: f64) -> f64 {
        let [s, t] = self.frame.coordinates(point);
        let (at, up) = (s.clamp(0.0, self.frame.length_m), z_m.clamp(0.0, self.height_m));
        let holes =
            self.holes.iter().filter(|[a, b, low, high]| at > *a && at < *b && up > *low && up < *high);
        let out = holes.map(|[a, b, low, high]| (at - a).min(b - at).min(up - low).min(high - up));
        let within = out.fold(0.0, f64::max);
        (s - at).portable_hypot(z_m - up).portable_hypot(t).portable_hypot(within)
    }

    /// Places on it: point and height.
    fn samples(&self) -> Vec<(Point, f64)> {
        let count = |length: f64| (length / STEP_M).ceil().max(1.0) as usize;
        let (columns, rows) = (count(self.frame.length_m), count(self.height_m));
        let place = |k: usize| {
            let s = ((k / rows) as f64 + 0.5) / columns as f64 * self.frame.length_m;
            (s, ((k % rows) as f64 + 0.5) / rows as f64 * self.height_m)
        };
        let is_wall = |(s, z): &(f64, f64)| {
            !self.holes.iter().any(|[a, b, low, high]| s > a && s < b && z > low && z < high)
        };
        let places = (0..columns * rows).map(place).filter(is_wall);
        places.map(|(s, z)| (self.frame.point(s, 0.0), z)).collect()
    }
}

/// Measures the surfaces around rooms that were entered.
pub(crate) fn measure(truth: &Plan, model: &Plan) -> SurfaceFigures {
    let (reference, found) = (strips(truth), strips(model));
    let (to_model, to_truth) = (distances(&reference, &found), distances(&found, &reference));
    let share = |all: &[f64]| {
        let near = all.iter().filter(|distance| **distance <= NEAR_M).count();
        if all.is_empty() { 0.0 } else { near as f64 / all.len() as f64 }
    };
    let mut near: Vec<f64> = to_model.iter().copied().filter(|distance| *distance < NEAR_M).collect();
    near.sort_by(f64::total_cmp);
    SurfaceFigures {
        completeness: share(&to_model),
        correctness: share(&to_truth),
        accuracy_m: quantile::linear(&near, 0.5),
    }
}

/// Distance of each sample of some strips to the nearest of others.
fn distances(from: &[Strip], to: &[Strip]) -> Vec<f64> {
    let nearest = |(point, z): (Point, f64)| {
        to.iter().map(|strip| strip.distance_m(point, z)).fold(f64::INFINITY, f64::min)
    };
    from.iter().flat_map(Strip::samples).map(nearest).collect()
}

fn strips(plan: &Plan) -> Vec<Strip> {
    let entered = plan.rooms.iter().filter(|room| room.entered != Some(false));
    entered.flat_map(|room| strips_of(plan, room)).collect()
}

fn strips_of(plan: &Plan, room: &Room) -> Vec<Strip> {
    let height_m = room.height_m().unwrap_or(NOMINAL_HEIGHT_M);
    let rings = std::iter::once(&room.outline_m).chain(&room.holes_m);
    let strip = |[a, b]: [Point; 2]| {
        let frame = Frame::between(a, b)?;
        let alone = Room { outline_m: vec![a, b], ..Room::default() };
        let is_open = plan.rooms.iter().any(|other| {
            // A border of two points is its own way back: it touches twice.
            other.id != room.id && touching_m(&alone, other) > frame.length_m
        });
        let holes = plan.openings.iter().filter_map(|opening| hole(opening, &frame)).collect();
        (!is_open).then_some(Strip { frame, height_m, holes })
    };
    rings.flat_map(|ring| edges(ring)).filter_map(strip).collect()
}

/// Where an opening cuts a border.
fn hole(opening: &Opening, frame: &Frame) -> Option<[f64; 4]> {
    let [s, t] = frame.coordinates(opening.place()?);
    let half = opening.width_m / 2.0;
    let is_here = t.abs() < BEHIND_M && s > 0.0 && s < frame.length_m && !opening.shut;
    is_here.then_some([s - half, s + half, opening.sill_m, opening.sill_m + opening.height_m])
}

#[cfg(test)]
mod tests {
    use super::{Opening, Plan, Room, measure};

    fn plan(width_m: f64, doors: &[f64]) -> Plan {
        let outline_m = vec![[0.0, 0.0], [width_m, 0.0], [width_m, 4.0], [0.0, 4.0]];
        let rooms = vec![Room { outline_m, ceiling_z_m: Some(2.5), ..Room::default() }];
        let door =
            |x: &f64| Opening { center_m: vec![*x, -0.1], width_m: 1.0, height_m: 2.0, ..Opening::default() };
        Plan { rooms, openings: doors.iter().map(door).collect(), ..Plan::default() }
    }

    #[test]
    fn a_wall_off_by_more_than_the_buffer_is_neither_complete_nor_correct() {
        let same = measure(&plan(6.0, &[2.0]), &plan(6.0, &[2.0]));
        assert_eq!((same.completeness, same.correctness, same.accuracy_m), (1.0, 1.0, Some(0.0)));
        let off = measure(&plan(6.0, &[]), &plan(6.5, &[]));
        // One of the walls of 6, 4, 6, 4 m is off, but for its ends; 0.4 m of the long ones stick out.
        assert!((off.completeness - 16.2 / 20.0).abs() < 0.001, "{off:?}");
        assert!((off.correctness - (21.0 - 4.0 - 0.8) / 21.0).abs() < 0.001, "{off:?}");
        let filled = measure(&plan(6.0, &[2.0]), &plan(6.0, &[]));
        assert!(filled.completeness == 1.0 && filled.correctness < 0.98, "{filled:?}");
    }
}
