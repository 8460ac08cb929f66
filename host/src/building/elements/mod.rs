//! Rooms, walls, doors and windows as they are written: `building.json`, and what other formats are made of.
//!
//! One name a thing in all files: storey, letter, number, such as `S1-W03`. R rooms, W walls, D doors, P
//! passages, N windows. Frame `map`, meters.

pub(crate) mod assemble;

use biplane_geometry::PortableMath;
use serde::{Deserialize, Serialize};

/// A storey.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Storey {
    /// Its name.
    pub id: String,
    /// Height of its floor.
    pub floor_z_m: f64,
    /// Height of most of its ceilings.
    pub ceiling_z_m: Option<f64>,
    /// The floor is the plane on which the robot drove: no laser saw it.
    pub floor_inferred: bool,
}

/// A room that the robot entered.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Room {
    /// Its name.
    pub id: String,
    /// Its storey.
    pub storey: String,
    /// Its outline at the floor, counter-clockwise.
    pub outline_m: Vec<[f64; 2]>,
    /// What stands in it, clockwise.
    pub holes_m: Vec<Vec<[f64; 2]>>,
    /// Height of its floor.
    pub floor_z_m: f64,
    /// Height of its ceiling.
    pub ceiling_z_m: f64,
    /// Area of the outline less that of the holes, square meters.
    pub area_m2: f64,
    /// Whether walls, doors and windows go all around it.
    pub closed: bool,
    /// Share of its outline on which wall was seen.
    pub walled_share: f64,
    /// Whether part of its outline, or its ceiling's height, is a guess. Its floor always is.
    pub inferred: bool,
}

/// What tells how thick a wall is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum KnownBy {
    /// Both faces.
    Faces,
    /// Both faces elsewhere on the same line.
    SameLine,
    /// Nothing.
    Unknown,
}

/// A straight wall.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Wall {
    /// Its name.
    pub id: String,
    /// Its storey.
    pub storey: String,
    /// The line in its middle.
    pub axis_m: [[f64; 2]; 2],
    /// Its corners at the floor as it is drawn, counter-clockwise.
    pub outline_m: [[f64; 2]; 4],
    /// Its thickness; `None` when only one side was seen.
    pub thickness_m: Option<f64>,
    /// What tells the thickness.
    pub thickness_from: KnownBy,
    /// How deep it is drawn: its thickness, or a guess.
    pub drawn_thickness_m: f64,
    /// Whether the side to the left of its axis was seen; where one was, that one.
    pub seen_left: bool,
    /// Height from the floor.
    pub height_m: f64,
    /// The rooms beside it.
    pub rooms: Vec<String>,
    /// Share of its surface, openings left out, on which rays ended.
    pub seen_share: f64,
    /// Whether its far side or most of its surface is a guess. What is lower than the laser sees always is.
    pub inferred: bool,
}

/// What an opening is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Use {
    /// One walks through it.
    Door,
    /// It has a sill.
    Window,
    /// One walks through it, and it is wider than doors are.
    Passage,
}

/// A door, window or passage.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct WallOpening {
    /// Its name.
    pub id: String,
    /// What it is for.
    pub kind: Use,
    /// Its wall.
    pub wall: String,
    /// Its middle, in the middle of the wall.
    pub center_m: [f64; 3],
    /// From jamb to jamb.
    pub width_m: f64,
    /// From its lower to its upper edge.
    pub height_m: f64,
    /// Its lower edge over the floor.
    pub sill_m: f64,
    /// The rooms on its two sides, as far as the robot entered them.
    pub rooms: Vec<String>,
    /// What shows it: "driven through", "seen through" or "frame".
    pub evidence: String,
    /// Whether only its frame shows it.
    pub inferred: bool,
}

/// All of a building that was found.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Elements {
    /// Storeys, from below.
    pub storeys: Vec<Storey>,
    /// Rooms.
    pub rooms: Vec<Room>,
    /// Walls.
    pub walls: Vec<Wall>,
    /// Doors, windows and passages.
    pub openings: Vec<WallOpening>,
}

impl Elements {
    /// Whether no room was found, and so nothing else.
    pub(crate) fn is_empty(&self) -> bool {
        self.rooms.is_empty()
    }

    /// Those of another storey too.
    pub(crate) fn take(&mut self, other: Self) {
        self.storeys.extend(other.storeys);
        self.rooms.extend(other.rooms);
        self.walls.extend(other.walls);
        self.openings.extend(other.openings);
    }

    /// Those of one storey.
    pub(crate) fn of_storey(&self, storey: &Storey) -> Self {
        let walls: Vec<Wall> = self.walls.iter().filter(|wall| wall.storey == storey.id).cloned().collect();
        let is_in = |opening: &&WallOpening| walls.iter().any(|wall| wall.id == opening.wall);
        Self {
            storeys: vec![storey.clone()],
            rooms: self.rooms.iter().filter(|room| room.storey == storey.id).cloned().collect(),
            openings: self.openings.iter().filter(is_in).cloned().collect(),
            walls,
        }
    }

    /// The storey with a name.
    pub(crate) fn storey(&self, id: &str) -> Option<&Storey> {
        self.storeys.iter().find(|storey| storey.id == id)
    }

    /// The wall with a name.
    pub(crate) fn wall(&self, id: &str) -> Option<&Wall> {
        self.walls.iter().find(|wall| wall.id == id)
    }
}

impl Wall {
    /// Unit vector along it, and its length.
    pub(crate) fn along(&self) -> ([f64; 2], f64) {
        let [a, b] = self.axis_m;
        let (x, y) = (b[0] - a[0], b[1] - a[1]);
        let length = x.portable_hypot(y).max(1e-9);
        ([x / length, y / length], length)
    }

    /// Of its four sides, counter-clockwise from that to the right of its axis, the one that was seen when
    /// only one was.
    pub(crate) fn seen_side(&self) -> usize {
        if self.seen_left { 2 } else { 0 }
    }

    /// Where along it an opening's middle is, meters from its beginning.
    pub(crate) fn place_m(&self, opening: &WallOpening) -> f64 {
        let ([x, y], _) = self.along();
        let [cx, cy, _] = opening.center_m;
        (cx - self.axis_m[0][0]) * x + (cy - self.axis_m[0][1]) * y
    }
}
