//! Rooms, walls, doors and windows as they are written: `building.json`, and what other formats are made of.
//!
//! One name a thing in all files: storey, letter, number, such as `S1-W03`. R rooms, W walls, D doors, P
//! passages, N windows. Frame `map`, meters.

pub(crate) mod assemble;
mod label_place;
mod turned;

use crate::building::openings::OpeningKind;
use crate::building::spaces::line::{Curve, Line, chords};
use biplane_geometry::PortableMath;
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

/// Curved walls are drawn with chords that are nowhere further from them, meters.
const CHORD_M: f64 = 0.002;

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
    /// As much of that as was seen, its ceiling or over its floor: the rest is a guess. None in models of
    /// versions that did not count it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub seen_area_m2: Option<f64>,
    /// Whether walls, doors and windows go all around it.
    pub closed: bool,
    /// Share of its outline on which wall was seen.
    pub walled_share: f64,
    /// Whether part of its outline, or its ceiling's height, is a guess. Its floor always is.
    pub inferred: bool,
}

/// The narrowest doors of buildings are 0.7 m, and widths are found within 5 cm. What is narrower may be a
/// gap beside a cupboard, or a part of a door, meters.
pub(crate) const NARROWEST_DOOR_M: f64 = 0.6;

/// Smaller areas that nobody saw are not worth a word, square meters.
const MIN_GUESSED_M2: f64 = 0.05;
/// A wall of which less was seen is a guess.
const MIN_SEEN: f64 = 0.3;

impl WallOpening {
    /// Whether it is a door that is narrower than doors are.
    pub(crate) fn is_narrow(&self) -> bool {
        self.kind == Use::Door && self.width_m < NARROWEST_DOOR_M
    }
}

impl Room {
    /// Area that is a guess, of a room that is not closed, square meters; none where hardly any is.
    pub(crate) fn guessed_m2(&self) -> Option<f64> {
        let guessed_m2 = self.area_m2 - self.seen_area_m2?;
        Some(guessed_m2).filter(|guessed_m2| !self.closed && *guessed_m2 >= MIN_GUESSED_M2)
    }

    /// What its name stands for: `room 2` of `S1-R02`.
    pub(crate) fn long_name(&self) -> String {
        let number = self.id.rsplit_once("-R").and_then(|(_, number)| number.parse::<u32>().ok());
        number.map_or_else(|| self.id.clone(), |number| format!("room {number}"))
    }
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

/// The circle that a curved wall follows.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct WallCurve {
    /// Its center.
    pub center_m: [f64; 2],
    /// Its radius in the middle of the wall.
    pub radius_m: f64,
}

/// A wall, straight or curved.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Wall {
    /// Its name.
    pub id: String,
    /// Its storey.
    pub storey: String,
    /// The ends of the line in its middle.
    pub axis_m: [[f64; 2]; 2],
    /// The circle on which that line runs counter-clockwise; none of a straight wall.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub curve: Option<WallCurve>,
    /// Its corners at the floor as it is drawn, counter-clockwise; of a curved wall those of its chords.
    pub outline_m: Vec<[f64; 2]>,
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

/// The name of a storey by its number, from 1 at the lowest one.
pub(crate) fn storey_name(number: usize) -> String {
    format!("S{number}")
}

/// The evidence of a door of which a shut leaf was seen, behind the face of its wall.
pub(crate) const CLOSED_LEAF: &str = "closed leaf";

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

impl Use {
    /// The order in which lists have them.
    pub(crate) const LISTED: [Self; 3] = [Self::Door, Self::Passage, Self::Window];

    /// What it is called.
    pub(crate) const fn word(self) -> &'static str {
        match self {
            Self::Door => "door",
            Self::Window => "window",
            Self::Passage => "passage",
        }
    }

    /// The name of the opening of that kind which is so many-th of its storey, from 1: `S1-D01`.
    pub(crate) fn name(self, storey: &str, number: usize) -> String {
        let letter = match self {
            Self::Door => 'D',
            Self::Window => 'N',
            Self::Passage => 'P',
        };
        format!("{storey}-{letter}{number:02}")
    }
}

impl From<OpeningKind> for Use {
    fn from(kind: OpeningKind) -> Self {
        match kind {
            OpeningKind::Door => Self::Door,
            OpeningKind::Passage => Self::Passage,
            OpeningKind::Window => Self::Window,
        }
    }
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
    /// What shows it: "driven through", "seen through", "closed leaf" or "frame".
    pub evidence: String,
    /// Whether only its frame or a closed leaf shows it, nothing was seen under it, or it is narrower than
    /// doors are and nobody drove through.
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
    /// The circle of a curved one, lengths counted from its middle, and half of its length, meters.
    fn arc(&self) -> Option<(Curve, f64)> {
        let WallCurve { center_m, radius_m } = self.curve?;
        let angle_rad = |end: [f64; 2]| (end[1] - center_m[1]).portable_atan2(end[0] - center_m[0]);
        let [from_rad, to_rad] = self.axis_m.map(angle_rad);
        let half_rad = (to_rad - from_rad).rem_euclid(TAU) / 2.0;
        Some((Curve { center_m, radius_m, zero_rad: from_rad + half_rad }, half_rad * radius_m))
    }

    /// Whether so little of its surface was seen that it is a guess.
    pub(crate) fn is_hardly_seen(&self) -> bool {
        self.seen_share < MIN_SEEN
    }

    /// Whether it is straight.
    pub(crate) fn is_straight(&self) -> bool {
        self.curve.is_none()
    }

    /// Unit vector from its beginning to its end, and the distance between them: along a straight wall, and
    /// its length.
    pub(crate) fn along(&self) -> ([f64; 2], f64) {
        let [a, b] = self.axis_m;
        let (x, y) = (b[0] - a[0], b[1] - a[1]);
        let length = x.portable_hypot(y).max(1e-9);
        ([x / length, y / length], length)
    }

    /// Its length along its middle, meters.
    pub(crate) fn length_m(&self) -> f64 {
        self.arc().map_or_else(|| self.along().1, |(_, half_m)| 2.0 * half_m)
    }

    /// Unit vector along it at a length from its beginning.
    pub(crate) fn along_at(&self, at_m: f64) -> [f64; 2] {
        let Some((curve, half_m)) = self.arc() else { return self.along().0 };
        let [x, y] = curve.normal(at_m - half_m);
        [-y, x]
    }

    /// The place at a length from its beginning, and so far to the left of its middle, meters.
    pub(crate) fn point(&self, at_m: f64, left_m: f64) -> [f64; 2] {
        let Some((curve, half_m)) = self.arc() else {
            let ([x, y], [a, b]) = (self.along().0, self.axis_m[0]);
            return [a + at_m * x - left_m * y, b + at_m * y + left_m * x];
        };
        Line::Curved(curve).point(at_m - half_m, curve.radius_m - left_m)
    }

    /// How far its middle bends away from a straight piece of a length, meters.
    pub(crate) fn rise_m(&self, length_m: f64) -> f64 {
        self.curve.map_or(0.0, |curve| length_m * length_m / (8.0 * curve.radius_m))
    }

    /// Lengths between which a piece of it is as good as straight; the piece itself of a straight wall.
    pub(crate) fn chords_m(&self, span: [f64; 2]) -> Vec<f64> {
        stations_m(span, self.curve.map(|curve| curve.radius_m))
    }

    /// Of the four sides of a straight wall, counter-clockwise from that to the right of its axis, the one
    /// that was seen when only one was.
    pub(crate) fn seen_side(&self) -> usize {
        if self.seen_left { 2 } else { 0 }
    }

    /// Where a place is: meters along it from its beginning, and to the left of its middle.
    pub(crate) fn place_of(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let Some((curve, half_m)) = self.arc() else {
            let ([along_x, along_y], [a, b]) = (self.along().0, self.axis_m[0]);
            let (dx, dy) = (x - a, y - b);
            return [dx * along_x + dy * along_y, dy * along_x - dx * along_y];
        };
        let [across, at] = Line::Curved(curve).place([x, y]);
        [at + half_m, curve.radius_m - across]
    }

    /// Where along it an opening's middle is, meters from its beginning.
    pub(crate) fn place_m(&self, opening: &WallOpening) -> f64 {
        let [x, y, _] = opening.center_m;
        self.place_of([x, y])[0]
    }
}

/// Lengths from one to another between which a curve of a radius is as good as straight; only the two ends
/// where there is no radius.
fn stations_m([from, to]: [f64; 2], radius_m: Option<f64>) -> Vec<f64> {
    let count = radius_m.map_or(1, |radius_m| chords(radius_m, to - from, CHORD_M));
    (0..=count).map(|step| from + (to - from) * step as f64 / count as f64).collect()
}
