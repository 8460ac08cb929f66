//! Doors and windows by their middles, and their sizes.
//!
//! Those count that lie beside a room that was entered. A passage is a door without a leaf and counts as one.
//! A door that was shut during the drive is neither asked for nor wrong, and so is glazing that the truth
//! calls no window (a glazed front).

use biplane_geometry::PortableMath;
use serde::Serialize;

use super::plan::{Frame, Opening, Plan, Wall};
use super::region::{Point, Region};
use super::scores::{Errors, Found, pair_best};

/// Middles nearer than this are of one opening, meters.
const NEAR_M: f64 = 0.4;
/// An opening lies beside a room that begins so near to its middle, across its wall, meters: half of a thick
/// wall and a little.
const BESIDE_M: f64 = 0.5;

/// How well openings were found.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub(crate) struct OpeningFigures {
    /// Doors and passages.
    pub doors: Found,
    /// Windows.
    pub windows: Found,
    /// Differences of widths of both, meters.
    pub width_error_m: Errors,
    /// Differences of clear heights of both, meters.
    pub height_error_m: Errors,
    /// Differences of sills of windows, meters.
    pub sill_error_m: Errors,
}

/// Measures openings. `entered` are the true rooms that were entered.
pub(crate) fn measure(truth: &Plan, model: &Plan, entered: &[Region]) -> OpeningFigures {
    let bounds = |plan: &Plan, opening: &Opening| {
        let wall = plan.walls.iter().find(|wall| wall.id == opening.wall);
        opening.place().is_some_and(|place| is_beside(place, wall, entered))
    };
    let counted: Vec<&Opening> = truth.openings.iter().filter(|o| !o.shut && bounds(truth, o)).collect();
    let glazed: Vec<Region> =
        truth.walls.iter().filter(|wall| !wall.is_straight()).filter_map(Wall::footprint).collect();
    let excused = |opening: &Opening| {
        let Some(place) = opening.place() else { return false };
        let is_shut = truth.openings.iter().any(|o| o.shut && is_near(o, place));
        let is_other = truth.openings.iter().any(|o| !o.shut && !bounds(truth, o) && is_near(o, place));
        let is_front = !truth.openings.iter().any(|o| is_near(o, place))
            && glazed.iter().any(|front| is_within(front, place));
        is_shut || is_other || is_front
    };
    let found: Vec<&Opening> = model.openings.iter().filter(|o| !excused(o)).collect();
    let of = |is_door: bool| {
        let pick = |openings: &[&'_ Opening]| -> Vec<Opening> {
            openings.iter().filter(|o| o.is_door() == is_door).map(|o| (*o).clone()).collect()
        };
        (pick(&counted), pick(&found))
    };
    let ((true_doors, doors), (true_windows, windows)) = (of(true), of(false));
    let door_pairs = pairs(&true_doors, &doors);
    let window_pairs = pairs(&true_windows, &windows);
    let all = || {
        let doors = door_pairs.iter().map(|(t, m)| (&true_doors[*t], &doors[*m]));
        doors.chain(window_pairs.iter().map(|(t, m)| (&true_windows[*t], &windows[*m])))
    };
    let sills = window_pairs.iter().map(|(t, m)| windows[*m].sill_m - true_windows[*t].sill_m);
    OpeningFigures {
        doors: Found::new(true_doors.len(), doors.len(), door_pairs.len()),
        windows: Found::new(true_windows.len(), windows.len(), window_pairs.len()),
        width_error_m: Errors::of(all().map(|(t, m)| m.width_m - t.width_m)),
        height_error_m: Errors::of(all().map(|(t, m)| m.height_m - t.height_m)),
        sill_error_m: Errors::of(sills),
    }
}

fn distance_m(a: Point, b: Point) -> f64 {
    (b[0] - a[0]).portable_hypot(b[1] - a[1])
}

fn is_near(opening: &Opening, place: Point) -> bool {
    opening.place().is_some_and(|own| distance_m(own, place) <= NEAR_M)
}

/// Within a footprint or a hand's breadth beside it.
fn is_within(region: &Region, [x, y]: Point) -> bool {
    const AROUND_M: f64 = 0.25;
    let steps = [-AROUND_M, 0.0, AROUND_M];
    steps.iter().any(|dx| steps.iter().any(|dy| region.contains([x + dx, y + dy])))
}

/// Whether a room lies on either side of an opening, across its wall; all around it without one.
fn is_beside(place: Point, wall: Option<&Wall>, rooms: &[Region]) -> bool {
    let across = |frame: Frame| vec![[-frame.along[1], frame.along[0]], [frame.along[1], -frame.along[0]]];
    let around = || vec![[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]];
    let directions = wall.and_then(Wall::frame).map_or_else(around, across);
    let steps = [0.0, 0.1, 0.2, 0.3, 0.4, BESIDE_M];
    let points = directions
        .iter()
        .flat_map(|[x, y]| steps.iter().map(move |step| [place[0] + x * step, place[1] + y * step]));
    points.into_iter().any(|point| rooms.iter().any(|room| room.contains(point)))
}

fn pairs(truth: &[Opening], model: &[Opening]) -> Vec<(usize, usize)> {
    let mut near = Vec::new();
    for (t, own) in truth.iter().enumerate() {
        for (m, other) in model.iter().enumerate() {
            if let (Some(a), Some(b)) = (own.place(), other.place())
                && distance_m(a, b) <= NEAR_M
            {
                near.push((t, m, -distance_m(a, b)));
            }
        }
    }
    pair_best(near.into_iter())
}

#[cfg(test)]
mod tests {
    use super::{Opening, Plan, Region, Wall, measure};

    fn opening(kind: &str, x: f64, width_m: f64) -> Opening {
        let (kind, wall) = (kind.to_owned(), "W1".to_owned());
        Opening { kind, wall, center_m: vec![x, 0.0, 1.0], width_m, height_m: 2.0, ..Opening::default() }
    }

    #[test]
    fn shut_doors_and_openings_of_other_rooms_are_neither_asked_for_nor_wrong() {
        let axis_m = [[0.0, 0.0], [20.0, 0.0]];
        let walls = vec![Wall { id: "W1".to_owned(), axis_m, thickness_m: Some(0.2), ..Wall::default() }];
        let shut = Opening { shut: true, ..opening("door", 4.0, 0.9) };
        let openings =
            vec![opening("door", 2.0, 0.9), shut, opening("window", 7.0, 1.5), opening("window", 15.0, 1.5)];
        let truth = Plan { walls: walls.clone(), openings, ..Plan::default() };
        let room = [Region::new(&[[0.0, 0.1], [10.0, 0.1], [10.0, 4.0], [0.0, 4.0]], &[])];
        let seen = [("passage", 2.1), ("door", 4.1), ("window", 15.1), ("window", 9.0)];
        let openings = seen.map(|(kind, x)| opening(kind, x, 0.95)).to_vec();
        let found = measure(&truth, &Plan { walls, openings, ..Plan::default() }, &room);
        assert_eq!((found.doors.truth, found.doors.model, found.doors.matched), (1, 1, 1));
        assert_eq!((found.windows.truth, found.windows.model, found.windows.matched), (1, 1, 0));
        assert!((found.width_error_m.worst.unwrap() - 0.05).abs() < 1e-9);
    }
}
