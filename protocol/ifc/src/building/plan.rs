//! The plan of a storey in the schema of Biplane's `building.json`. Meters; heights over the storey's floor.

use serde::Serialize;

/// A storey of the file.
#[derive(Clone, Debug, PartialEq)]
pub struct Storey {
    /// Its name.
    pub name: String,
    /// Its height as it is stated, meters.
    pub elevation_m: f64,
}

/// Rooms, walls and openings of a storey.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Plan {
    /// Height of the floor in the frame of the file.
    #[serde(skip)]
    pub floor_z_m: f64,
    /// The storey itself.
    pub storeys: Vec<PlanStorey>,
    /// Its rooms.
    pub rooms: Vec<Room>,
    /// Its walls.
    pub walls: Vec<Wall>,
    /// Doors, windows and passages.
    pub openings: Vec<Opening>,
}

impl Plan {
    /// The same plan with every place moved by a rigid motion of the floor.
    #[must_use]
    pub fn moved(&self, motion: impl Fn([f64; 2]) -> [f64; 2]) -> Self {
        let mut plan = self.clone();
        let rooms = plan.rooms.iter_mut();
        let rings = rooms.flat_map(|room| std::iter::once(&mut room.outline_m).chain(&mut room.holes_m));
        let walls = plan.walls.iter_mut();
        let walls = walls.flat_map(|wall| wall.outline_m.iter_mut().chain(&mut wall.axis_m));
        for point in rings.flatten().chain(walls) {
            *point = motion(*point);
        }
        for opening in &mut plan.openings {
            let [x, y, z] = opening.center_m;
            let [x, y] = motion([x, y]);
            opening.center_m = [x, y, z];
            opening.box_m.iter_mut().for_each(|point| *point = motion(*point));
        }
        plan
    }
}

/// A storey of a plan.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct PlanStorey {
    /// Its name in this plan.
    pub id: String,
    /// Height of its floor: 0.
    pub floor_z_m: f64,
    /// Height of its highest ceiling.
    pub ceiling_z_m: f64,
}

/// A room.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Room {
    /// Its name in this plan.
    pub id: String,
    /// The name of its storey.
    pub storey: String,
    /// Its name in the file.
    pub name: String,
    /// Outline, counter-clockwise.
    pub outline_m: Vec<[f64; 2]>,
    /// Holes.
    pub holes_m: Vec<Vec<[f64; 2]>>,
    /// Height of its floor: 0.
    pub floor_z_m: f64,
    /// Median height of what is over it.
    pub ceiling_z_m: f64,
    /// Area.
    pub area_m2: f64,
    /// Whether its outline is complete: it is.
    pub closed: bool,
    /// Whether the robot was in it; absent where no drive is known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub entered: Option<bool>,
}

/// A wall.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Wall {
    /// Its name in this plan.
    pub id: String,
    /// The name of its storey.
    pub storey: String,
    /// Its name in the file.
    pub name: String,
    /// "wall", or "curtain" for a glazed front.
    pub kind: String,
    /// Axis.
    pub axis_m: [[f64; 2]; 2],
    /// What it covers.
    pub outline_m: Vec<[f64; 2]>,
    /// Thickness: width of the least rectangle around it.
    pub thickness_m: f64,
    /// Height.
    pub height_m: f64,
    /// Names of the rooms that it bounds.
    pub rooms: Vec<String>,
}

/// A door, window or passage.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Opening {
    /// Its name in this plan.
    pub id: String,
    /// "door", "window" or "passage".
    pub kind: String,
    /// Its name in the file.
    pub name: String,
    /// The name of its wall.
    pub wall: String,
    /// Its middle.
    pub center_m: [f64; 3],
    /// Width of the opening in the wall.
    pub width_m: f64,
    /// Height of the opening.
    pub height_m: f64,
    /// Its lower edge over the floor.
    pub sill_m: f64,
    /// Whether a leaf closes it during the drive.
    pub shut: bool,
    /// Names of the rooms on its sides.
    pub rooms: Vec<String>,
    /// What it covers seen from above.
    #[serde(skip)]
    pub box_m: Vec<[f64; 2]>,
}
