//! Elements as they lie after a turn about the vertical axis: plans for people have their walls along the
//! page.

use super::{Elements, Room, Wall, WallOpening};
use crate::model::turn::Turn;

impl Elements {
    /// All places after a turn.
    pub(crate) fn turned(mut self, turn: &Turn) -> Self {
        self.rooms.iter_mut().for_each(|room| turn_room(room, turn));
        self.walls.iter_mut().for_each(|wall| turn_wall(wall, turn));
        for WallOpening { center_m, .. } in &mut self.openings {
            *center_m = turn.apply(*center_m);
        }
        self
    }
}

fn turn_room(room: &mut Room, turn: &Turn) {
    let rings = std::iter::once(&mut room.outline_m).chain(&mut room.holes_m);
    rings.flatten().for_each(|place| *place = turned(*place, turn));
}

fn turn_wall(wall: &mut Wall, turn: &Turn) {
    let places = wall.axis_m.iter_mut().chain(&mut wall.outline_m);
    places.chain(wall.curve.as_mut().map(|curve| &mut curve.center_m)).for_each(|place| {
        *place = turned(*place, turn);
    });
}

fn turned([x, y]: [f64; 2], turn: &Turn) -> [f64; 2] {
    let [x, y, _] = turn.apply([x, y, 0.0]);
    [x, y]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_places_turn_and_lengths_and_names_stay() {
        let ring = r#"{"storeys": [], "rooms": [{"id": "S1-R01", "storey": "S1", "outline_m": [[1, 0], [2, 0], [2, 1]],
            "holes_m": [[[1.5, 0.1], [1.6, 0.1], [1.6, 0.2]]], "floor_z_m": 0, "ceiling_z_m": 2.5, "area_m2": 0.5, "seen_area_m2": null,
            "closed": true, "walled_share": 1, "inferred": false}], "walls": [{"id": "S1-W01", "storey": "S1",
            "axis_m": [[1, 0], [2, 0]], "curve": {"center_m": [1.5, 3], "radius_m": 3}, "outline_m": [[1, 0], [2, 0], [2, -0.2]],
            "thickness_m": null, "thickness_from": "unknown", "drawn_thickness_m": 0.2, "seen_left": true, "height_m": 2.5,
            "rooms": [], "seen_share": 1, "inferred": true}], "openings": [{"id": "S1-D01", "kind": "door", "wall": "S1-W01",
            "center_m": [1.5, 0, 1], "width_m": 0.5, "height_m": 2, "sill_m": 0, "rooms": [], "evidence": "seen through",
            "inferred": true}]}"#;
        let elements: Elements = serde_json::from_str(ring).unwrap();
        assert_eq!(elements.clone().turned(&Turn::default()), elements);
        let turned = elements.turned(&Turn { angle_rad: std::f64::consts::FRAC_PI_2 });
        let near = |[x, y]: [f64; 2], to: [f64; 2]| (x - to[0]).abs() < 1e-9 && (y - to[1]).abs() < 1e-9;
        let (room, wall) = (&turned.rooms[0], &turned.walls[0]);
        assert!(near(room.outline_m[1], [0.0, 2.0]) && near(room.holes_m[0][2], [-0.2, 1.6]));
        assert!(near(wall.axis_m[1], [0.0, 2.0]) && near(wall.outline_m[2], [0.2, 2.0]));
        assert!(near(wall.curve.unwrap().center_m, [-3.0, 1.5]) && wall.curve.unwrap().radius_m == 3.0);
        let [x, y, z] = turned.openings[0].center_m;
        assert!(near([x, y], [0.0, 1.5]) && z == 1.0 && turned.openings[0].id == "S1-D01");
    }
}
