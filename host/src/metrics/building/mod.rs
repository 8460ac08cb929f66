//! A building as `building.json` states it against the true one: rooms, walls, surfaces, openings.
//!
//! Only what bounds the rooms that the robot entered counts. Meters.

mod alignment;
mod openings;
pub(crate) mod plan;
mod region;
mod rooms;
mod scores;
mod surfaces;
mod walls;

use biplane_geometry::PortableMath;
use serde::Serialize;

use self::openings::OpeningFigures;
use self::plan::{Opening, Plan, Room};
use self::region::{Point, Region};
use self::rooms::{RoomFigures, same_rooms};
pub(crate) use self::scores::{Errors, Found};
use self::surfaces::SurfaceFigures;
use self::walls::WallFigures;

/// Middles of columns nearer than this are of one column, meters.
const NEAR_COLUMN_M: f64 = 0.3;

/// How a building is held against the truth.
#[derive(Clone, Debug, Default, Serialize)]
pub(crate) struct BuildingFigures {
    /// The file of the truth.
    pub reference: String,
    /// Where the frame of the model lies in that of the truth: x and y in meters, turn in degrees.
    pub truth_from_model: [f64; 3],
    /// Rooms.
    pub rooms: RoomFigures,
    /// Walls.
    pub walls: WallFigures,
    /// Surfaces of walls.
    pub surfaces: SurfaceFigures,
    /// Doors and windows.
    pub openings: OpeningFigures,
    /// Pairs of rooms that a door joins.
    pub room_graph: Found,
    /// Columns.
    pub columns: Found,
}

/// How the frames of truth and model lie to each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Frames {
    /// Both are `map`, but for drift.
    Same,
    /// Anyhow.
    Unknown,
}

/// Compares a model with the truth. `way_m` is where the robot was, in the model's frame. None when no place
/// was found where the two agree.
pub(crate) fn measure(
    truth: &Plan,
    model: &Plan,
    way_m: &[Point],
    frames: Frames,
) -> Option<BuildingFigures> {
    let pose = match frames {
        Frames::Same => alignment::refine(truth, model),
        Frames::Unknown => alignment::search(truth, model)?,
    };
    let (mut truth, model) = (truth.clone(), model.moved(&pose));
    let way: Vec<Point> = way_m.iter().map(|point| pose.transform(*point)).collect();
    truth.mark_entered(&way);
    let entered = truth.rooms.iter().filter(|room| room.entered != Some(false)).map(Room::region);
    let entered: Vec<Region> = entered.collect();
    Some(BuildingFigures {
        reference: String::new(),
        truth_from_model: [pose.x_m, pose.y_m, pose.theta_rad.to_degrees()],
        rooms: rooms::measure(&truth.rooms, &model.rooms),
        walls: walls::measure(&truth, &model, &entered),
        surfaces: surfaces::measure(&truth, &model),
        openings: openings::measure(&truth, &model, &entered),
        room_graph: room_graph(&truth, &model),
        columns: columns(&truth, &model, &entered),
    })
}

/// Pairs of entered rooms that are joined by a door or passage, by index.
fn joined(plan: &Plan) -> Vec<[usize; 2]> {
    let regions: Vec<Region> = plan.rooms.iter().map(Room::region).collect();
    let beside = |opening: &Opening| -> Option<[usize; 2]> {
        let (place, frame) =
            (opening.place()?, plan.walls.iter().find(|wall| wall.id == opening.wall)?.frame()?);
        let reach = [0.15, 0.3, 0.45];
        let room = |side: f64| {
            reach.iter().find_map(|reach| {
                let [x, y] = [-frame.along[1] * reach * side, frame.along[0] * reach * side];
                regions.iter().position(|region| region.contains([place[0] + x, place[1] + y]))
            })
        };
        let (a, b) = (room(1.0)?, room(-1.0)?);
        (a != b).then_some([a.min(b), a.max(b)])
    };
    let is_entered = |pair: &[usize; 2]| pair.iter().all(|room| plan.rooms[*room].entered != Some(false));
    let doors = plan.openings.iter().filter(|opening| opening.is_door() && !opening.shut);
    let mut pairs: Vec<[usize; 2]> = doors.filter_map(beside).filter(is_entered).collect();
    pairs.sort_unstable();
    pairs.dedup();
    pairs
}

fn room_graph(truth: &Plan, model: &Plan) -> Found {
    let same = same_rooms(&truth.rooms, &model.rooms);
    let in_truth = |room: usize| same.iter().find(|pair| pair.1 == room).map(|pair| pair.0);
    let (true_pairs, pairs) = (joined(truth), joined(model));
    let is_true = |[a, b]: &&[usize; 2]| match (in_truth(*a), in_truth(*b)) {
        (Some(a), Some(b)) => true_pairs.contains(&[a.min(b), a.max(b)]),
        _ => false,
    };
    Found::new(true_pairs.len(), pairs.len(), pairs.iter().filter(is_true).count())
}

fn columns(truth: &Plan, model: &Plan, entered: &[Region]) -> Found {
    let places = |plan: &Plan| -> Vec<Point> {
        let center = |center: &Vec<f64>| center.first().copied().zip(center.get(1).copied());
        plan.columns.iter().filter_map(|column| center(&column.center_m)).map(|(x, y)| [x, y]).collect()
    };
    let mut truth = places(truth);
    truth.retain(|place| entered.iter().any(|room| room.contains(*place)));
    let model = places(model);
    let near = truth.iter().enumerate().flat_map(|(t, a)| {
        model.iter().enumerate().map(move |(m, b)| (t, m, -(b[0] - a[0]).portable_hypot(b[1] - a[1])))
    });
    let pairs = scores::pair_best(near.filter(|(_, _, score)| *score > -NEAR_COLUMN_M));
    Found::new(truth.len(), model.len(), pairs.len())
}
