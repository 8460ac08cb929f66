//! Rooms by the overlap of their footprints: as drawn, and with open plans as one room.
//!
//! A true plan may divide open space by use with no wall between; geometry cannot. True rooms, and rooms of
//! the model, that touch along more than [`OPEN_M`] are therefore also counted as one. Only rooms that the
//! robot entered count: a room of the model that is one which was not entered is neither right nor wrong.

use biplane_geometry::PortableMath;
use biplane_geometry::UnionFind;
use serde::Serialize;

use super::plan::{Frame, Room};
use super::region::{Overlap, Point, Region};
use super::scores::{Errors, Found, pair_best};

/// Footprints that share more than this of what both cover are one room (Floor-SP, RoomFormer).
const MIN_IOU: f64 = 0.7;
/// Rooms that touch along more than this are open to each other, meters: a door's width.
const OPEN_M: f64 = 0.9;
/// Borders nearer than this have no wall between them, meters: the thinnest walls have 5 cm.
const TOUCH_M: f64 = 0.03;
/// Borders that touch are parallel within this: the sine of 3 degrees.
const PARALLEL: f64 = 0.05;

/// How well rooms were found.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub(crate) struct RoomFigures {
    /// Rooms as the truth draws them.
    pub as_drawn: Found,
    /// Rooms with those that are open to each other as one.
    pub merged: Found,
    /// Differences of the areas of matched (merged) rooms over the true area.
    pub area_error: Errors,
    /// Differences of heights from floor to ceiling, matched as drawn, meters.
    pub height_error_m: Errors,
    /// True rooms that were not entered, which do not count.
    pub not_entered: usize,
}

/// A room or several that are open to each other.
struct Group {
    regions: Vec<Region>,
    entered: bool,
}

/// Measures rooms.
pub(crate) fn measure(truth: &[Room], model: &[Room]) -> RoomFigures {
    let model: Vec<Room> = model.iter().filter(|room| room.entered != Some(false)).cloned().collect();
    let (drawn, drawn_pairs) = matched(&single(truth), &single(&model));
    let (true_groups, model_groups) = (groups(truth), groups(&model));
    let (merged, pairs) = matched(&true_groups, &model_groups);
    let area = |(t, m): &(usize, usize)| {
        let parts = |group: &Group| Overlap::of(&group.regions.iter().collect::<Vec<_>>(), &[]).first_m2;
        let true_m2 = parts(&true_groups[*t]);
        (parts(&model_groups[*m]) - true_m2) / true_m2
    };
    let height = |(t, m): &(usize, usize)| Some(model[*m].height_m()? - truth[*t].height_m()?);
    RoomFigures {
        as_drawn: drawn,
        merged,
        area_error: Errors::of(pairs.iter().map(area)),
        height_error_m: Errors::of(drawn_pairs.iter().filter_map(height)),
        not_entered: truth.iter().filter(|room| room.entered == Some(false)).count(),
    }
}

/// Pairs of indices of true and model rooms that are the same room.
pub(crate) fn same_rooms(truth: &[Room], model: &[Room]) -> Vec<(usize, usize)> {
    matched(&single(truth), &single(model)).1
}

fn single(rooms: &[Room]) -> Vec<Group> {
    let of = |room: &Room| Group { regions: vec![room.region()], entered: room.entered != Some(false) };
    rooms.iter().map(of).collect()
}

fn groups(rooms: &[Room]) -> Vec<Group> {
    let mut sets = UnionFind::new(rooms.len());
    for a in 0..rooms.len() {
        for b in a + 1..rooms.len() {
            if touching_m(&rooms[a], &rooms[b]) > OPEN_M {
                sets.join(a as u32, b as u32);
            }
        }
    }
    let roots: Vec<u32> = (0..rooms.len()).map(|room| sets.root(room as u32)).collect();
    let of_root = |root: usize| {
        let members = || rooms.iter().zip(&roots).filter(|(_, r)| **r as usize == root).map(|(room, _)| room);
        let entered = members().any(|room| room.entered != Some(false));
        Group { regions: members().map(Room::region).collect(), entered }
    };
    (0..rooms.len()).filter(|room| roots[*room] as usize == *room).map(of_root).collect()
}

/// Length along which two rooms have their borders on each other.
pub(crate) fn touching_m(a: &Room, b: &Room) -> f64 {
    let pairs = edges(&a.outline_m).flat_map(|own| edges(&b.outline_m).map(move |other| (own, other)));
    pairs.map(|(own, other)| shared_m(own, other)).sum()
}

pub(crate) fn edges(ring: &[Point]) -> impl Iterator<Item = [Point; 2]> + '_ {
    ring.iter().copied().zip(ring.iter().copied().cycle().skip(1)).map(|(a, b)| [a, b])
}

fn shared_m(own: [Point; 2], other: [Point; 2]) -> f64 {
    let Some(frame) = Frame::between(own[0], own[1]) else { return 0.0 };
    let [a, b] = other.map(|point| frame.coordinates(point));
    let length = (b[0] - a[0]).portable_hypot(b[1] - a[1]);
    let is_near = a[1].abs() < TOUCH_M && b[1].abs() < TOUCH_M;
    if !is_near || (b[1] - a[1]).abs() > PARALLEL * length {
        return 0.0;
    }
    (a[0].max(b[0]).min(frame.length_m) - a[0].min(b[0]).max(0.0)).max(0.0)
}

/// Counts and pairs; what lies on rooms that were not entered is left out.
fn matched(truth: &[Group], model: &[Group]) -> (Found, Vec<(usize, usize)>) {
    let refs = |group: &Group| -> Vec<Region> { group.regions.clone() };
    let mut scores = Vec::new();
    for (t, own) in truth.iter().enumerate() {
        for (m, other) in model.iter().enumerate() {
            let (own, other) = (refs(own), refs(other));
            let iou = Overlap::of(&own.iter().collect::<Vec<_>>(), &other.iter().collect::<Vec<_>>()).iou();
            if iou > MIN_IOU {
                scores.push((t, m, iou));
            }
        }
    }
    let pairs = pair_best(scores.into_iter());
    let (counted, others): (Vec<_>, Vec<_>) = pairs.into_iter().partition(|(t, _)| truth[*t].entered);
    let entered = truth.iter().filter(|group| group.entered).count();
    (Found::new(entered, model.len() - others.len(), counted.len()), counted)
}

#[cfg(test)]
mod tests {
    use super::{Room, measure};

    fn room(x: [f64; 2], y: [f64; 2]) -> Room {
        let outline_m = vec![[x[0], y[0]], [x[1], y[0]], [x[1], y[1]], [x[0], y[1]]];
        Room { outline_m, ceiling_z_m: Some(2.5), ..Room::default() }
    }

    #[test]
    fn open_plans_are_one_room_only_when_merged() {
        let truth =
            [room([0.0, 4.0], [0.0, 3.0]), room([4.0, 7.0], [0.0, 3.0]), room([7.1, 9.0], [0.0, 3.0])];
        let model = [room([0.0, 7.0], [0.0, 3.0]), room([7.1, 9.0], [0.0, 3.03])];
        let found = measure(&truth, &model);
        assert_eq!((found.as_drawn.truth, found.as_drawn.matched), (3, 1));
        assert_eq!((found.merged.truth, found.merged.model, found.merged.matched), (2, 2, 2));
        assert!((found.area_error.worst.unwrap() - 0.01).abs() < 1e-3, "{:?}", found.area_error);
    }

    #[test]
    fn rooms_that_were_not_entered_are_neither_right_nor_wrong() {
        let mut truth = [room([0.0, 4.0], [0.0, 3.0]), room([4.1, 7.0], [0.0, 3.0])];
        truth[1].entered = Some(false);
        let both = measure(&truth, &truth.clone().map(|room| Room { entered: None, ..room }));
        assert_eq!((both.merged.truth, both.merged.model, both.merged.matched), (1, 1, 1));
        let wrong = measure(&truth, &[room([0.0, 4.0], [0.0, 3.0]), room([0.0, 4.0], [5.0, 9.0])]);
        assert_eq!((wrong.merged.model, wrong.merged.matched), (2, 1));
    }
}
