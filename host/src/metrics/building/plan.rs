//! The plan of a building as `building.json` states it: rooms, walls, openings. Meters; heights in the frame
//! of the file.

use biplane_geometry::PortableMath;
use biplane_geometry::Pose2;
use serde::Deserialize;

use super::region::{Point, Region};

/// What a `building.json` or a truth in its schema holds, as far as it is compared. Unknown keys are other
/// readers' business.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default)]
pub(crate) struct Plan {
    /// Storeys; none stated where there is one.
    pub storeys: Vec<Storey>,
    /// Rooms.
    pub rooms: Vec<Room>,
    /// Walls.
    pub walls: Vec<Wall>,
    /// Doors, windows, passages.
    pub openings: Vec<Opening>,
    /// Columns.
    pub columns: Vec<Column>,
}

/// A storey.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default)]
pub(crate) struct Storey {
    /// Its name in the file.
    pub id: String,
    /// Height of its floor.
    pub floor_z_m: f64,
}

/// A room: what its walls leave free.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default)]
pub(crate) struct Room {
    /// Its name in the file.
    pub id: String,
    /// Its storey's name.
    pub storey: String,
    /// Outline.
    pub outline_m: Vec<Point>,
    /// What is cut out of it.
    pub holes_m: Vec<Vec<Point>>,
    /// Height of its floor.
    pub floor_z_m: f64,
    /// Height of its ceiling, where one was seen.
    pub ceiling_z_m: Option<f64>,
    /// Whether the robot was in it; not stated: told from the trajectory, or taken as yes.
    pub entered: Option<bool>,
}

/// A wall.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default)]
pub(crate) struct Wall {
    /// Its name in the file.
    pub id: String,
    /// Its storey's name.
    pub storey: String,
    /// "wall" where nothing is stated; others, such as glazed fronts and curved walls, are not counted.
    pub kind: Option<String>,
    /// Its axis.
    pub axis_m: [Point; 2],
    /// What it covers, when that is not its axis with its thickness.
    pub outline_m: Vec<Point>,
    /// Thickness; none where only one side was seen.
    pub thickness_m: Option<f64>,
}

/// A door, window or passage.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default)]
pub(crate) struct Opening {
    /// Its name in the file.
    pub id: String,
    /// "door", "window" or "passage".
    pub kind: String,
    /// Its wall's name.
    pub wall: String,
    /// Middle: x, y, and a height where it is stated.
    pub center_m: Vec<f64>,
    /// Clear width.
    pub width_m: f64,
    /// Clear height.
    pub height_m: f64,
    /// Height of its lower edge over the floor.
    pub sill_m: f64,
    /// Whether a leaf closes it: then it is neither asked for nor wrong.
    pub shut: bool,
}

/// A column.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default)]
pub(crate) struct Column {
    /// Middle: x and y.
    pub center_m: Vec<f64>,
}

impl Room {
    /// What it covers.
    pub(crate) fn region(&self) -> Region {
        Region::new(&self.outline_m, &self.holes_m)
    }

    /// From floor to ceiling.
    pub(crate) fn height_m(&self) -> Option<f64> {
        self.ceiling_z_m.map(|ceiling| ceiling - self.floor_z_m).filter(|height| *height > 0.0)
    }
}

impl Wall {
    /// What it covers; nothing where its thickness is not known.
    pub(crate) fn footprint(&self) -> Option<Region> {
        if self.outline_m.len() >= 3 && self.thickness_m.is_some() {
            return Some(Region::new(&self.outline_m, &[]));
        }
        let half = self.thickness_m.filter(|thickness| *thickness > 0.0)? / 2.0;
        let frame = self.frame()?;
        let ring = [(0.0, half), (0.0, -half), (frame.length_m, -half), (frame.length_m, half)];
        Some(Region::new(&ring.map(|(along, aside)| frame.point(along, aside)), &[]))
    }

    /// Its own axes; none for a wall without length.
    pub(crate) fn frame(&self) -> Option<Frame> {
        Frame::between(self.axis_m[0], self.axis_m[1])
    }

    /// Whether it is counted among the straight walls.
    pub(crate) fn is_straight(&self) -> bool {
        self.kind.as_deref().is_none_or(|kind| kind == "wall")
    }
}

impl Opening {
    /// Its middle seen from above.
    pub(crate) fn place(&self) -> Option<Point> {
        match self.center_m[..] {
            [x, y] | [x, y, _] => Some([x, y]),
            _ => None,
        }
    }

    /// Whether one walks through it.
    pub(crate) fn is_door(&self) -> bool {
        self.kind == "door" || self.kind == "passage"
    }
}

/// Axes along and across a line: `across` points to its left.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Frame {
    /// Where it begins.
    pub origin_m: Point,
    /// Unit vector along it.
    pub along: Point,
    /// Its length.
    pub length_m: f64,
}

impl Frame {
    /// From one point to another, when they differ.
    pub(crate) fn between(from: Point, to: Point) -> Option<Self> {
        let length_m = (to[0] - from[0]).portable_hypot(to[1] - from[1]);
        let along = [(to[0] - from[0]) / length_m, (to[1] - from[1]) / length_m];
        (length_m > 1e-9 && length_m.is_finite()).then_some(Self { origin_m: from, along, length_m })
    }

    /// A point by its place along and to the left.
    pub(crate) fn point(&self, along_m: f64, aside_m: f64) -> Point {
        let [x, y] = self.along;
        [self.origin_m[0] + x * along_m - y * aside_m, self.origin_m[1] + y * along_m + x * aside_m]
    }

    /// Place along and to the left of a point.
    pub(crate) fn coordinates(&self, point: Point) -> Point {
        let [dx, dy] = [point[0] - self.origin_m[0], point[1] - self.origin_m[1]];
        let [x, y] = self.along;
        [dx * x + dy * y, dy * x - dx * y]
    }
}

impl Plan {
    /// One storey by its name: its rooms, its walls and the openings in these.
    pub(crate) fn storey(&self, name: &str) -> Option<Self> {
        let storey = self.storeys.iter().find(|storey| storey.id == name)?.clone();
        let mut plan = self.clone();
        plan.storeys = vec![storey];
        plan.rooms.retain(|room| room.storey == name);
        plan.walls.retain(|wall| wall.storey == name);
        let walls = &plan.walls;
        plan.openings.retain(|opening| walls.iter().any(|wall| wall.id == opening.wall));
        Some(plan)
    }

    /// Whether a height is of the only storey of a plan, out of all these: nearest to its floor.
    pub(crate) fn is_at(&self, z_m: f64, all: &[Storey]) -> bool {
        let nearest = all.iter().min_by(|a, b| {
            let [a, b] = [a, b].map(|storey| (storey.floor_z_m - z_m).abs());
            a.total_cmp(&b)
        });
        nearest.is_none_or(|nearest| self.storeys.iter().any(|own| own.id == nearest.id))
    }

    /// The same plan in another frame.
    pub(crate) fn moved(&self, a_from_b: &Pose2) -> Self {
        let mut plan = self.clone();
        let rooms = plan.rooms.iter_mut();
        let rings = rooms.flat_map(|room| std::iter::once(&mut room.outline_m).chain(&mut room.holes_m));
        for point in rings.flatten() {
            *point = a_from_b.transform(*point);
        }
        for wall in &mut plan.walls {
            for point in wall.outline_m.iter_mut().chain(&mut wall.axis_m) {
                *point = a_from_b.transform(*point);
            }
        }
        let columns = plan.columns.iter_mut().map(|column| &mut column.center_m);
        for center in plan.openings.iter_mut().map(|opening| &mut opening.center_m).chain(columns) {
            if let [x, y, ..] = center[..] {
                center[..2].copy_from_slice(&a_from_b.transform([x, y]));
            }
        }
        plan
    }

    /// Marks the rooms that a trajectory was in, where the file does not state it.
    pub(crate) fn mark_entered(&mut self, way_m: &[Point]) {
        for room in &mut self.rooms {
            let region = room.region();
            room.entered.get_or_insert_with(|| {
                way_m.is_empty() || way_m.iter().filter(|point| region.contains(**point)).count() >= MIN_POSES
            });
        }
    }
}

/// With fewer poses in it a room was not entered: a trajectory that runs along a wall strays.
const MIN_POSES: usize = 5;

#[cfg(test)]
mod tests {
    use super::Plan;

    #[test]
    fn a_storey_has_its_own_rooms_walls_and_openings() {
        let text = r#"{"storeys": [{"id": "S1", "floor_z_m": 0.0}, {"id": "S2", "floor_z_m": 3.0}],
            "rooms": [{"id": "S1-R01", "storey": "S1"}, {"id": "S2-R01", "storey": "S2"}],
            "walls": [{"id": "S1-W01", "storey": "S1"}, {"id": "S2-W01", "storey": "S2"}],
            "openings": [{"id": "S1-D01", "wall": "S1-W01"}, {"id": "S2-D01", "wall": "S2-W01"}]}"#;
        let all: Plan = serde_json::from_str(text).unwrap();
        let upper = all.storey("S2").unwrap();
        let names = [&upper.rooms[0].id, &upper.walls[0].id, &upper.openings[0].id];
        assert_eq!(names, ["S2-R01", "S2-W01", "S2-D01"]);
        assert_eq!([upper.rooms.len(), upper.walls.len(), upper.openings.len()], [1, 1, 1]);
        assert!(upper.is_at(2.9, &all.storeys) && !upper.is_at(0.1, &all.storeys));
        assert!(all.storey("S3").is_none());
    }
}
