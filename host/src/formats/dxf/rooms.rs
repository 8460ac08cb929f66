//! The plan of a drive's building: walls with their depth, hatched where it is known, openings, and a tag in
//! each room.

use super::document::Document;
use super::layer::Layer;
use crate::building::elements::{Elements, Room, Use, Wall, WallOpening};
use crate::building::part::CUT_M;
use crate::formats::Placement;

/// Height of room tags, meters.
const TAG_M: f64 = 0.15;

/// A plan in the making.
pub(super) struct RoomPlan<'a> {
    /// Where it is drawn.
    pub document: &'a mut Document,
    /// What layers of its storey begin with.
    pub prefix: &'a str,
    /// Whether its layers are shown.
    pub is_on: bool,
    /// Where it lies in the file.
    pub placement: Placement,
    /// Height of the floor.
    pub z_m: f64,
}

impl RoomPlan<'_> {
    /// Draws walls, openings and tags.
    pub(super) fn draw(&mut self, elements: &Elements) {
        for room in &elements.rooms {
            self.ring(Layer::FLOOR, &room.outline_m);
            for hole in &room.holes_m {
                self.ring(Layer::FLOOR, hole);
            }
        }
        for wall in &elements.walls {
            let openings = elements.openings.iter().filter(|opening| opening.wall == wall.id);
            let mut cut: Vec<&WallOpening> = openings
                .filter(|opening| opening.sill_m < CUT_M && opening.sill_m + opening.height_m > CUT_M)
                .collect();
            cut.sort_by(|a, b| wall.place_m(a).total_cmp(&wall.place_m(b)));
            self.wall(wall, &cut);
            for opening in cut {
                self.opening(wall, opening);
            }
        }
        for room in &elements.rooms {
            self.tag(room);
        }
    }

    fn layer(&mut self, layer: Layer) -> String {
        let name = format!("{}{}", self.prefix, layer.name);
        self.document.layer(&name, layer.shown(self.is_on));
        name
    }

    fn at(&self, [x, y]: [f64; 2]) -> [f64; 3] {
        self.placement.at([x, y, self.z_m])
    }

    fn line(&mut self, layer: Layer, from: [f64; 2], to: [f64; 2]) {
        let name = self.layer(layer);
        self.document.line(&name, self.at(from), self.at(to));
    }

    fn ring(&mut self, layer: Layer, ring: &[[f64; 2]]) {
        let name = self.layer(layer);
        let ring: Vec<[f64; 3]> = ring.iter().map(|p| self.at(*p)).collect();
        self.document.ring(&name, &ring);
    }

    /// The wall's pieces between its openings. What of it nobody saw is dashed: the far side, if its
    /// thickness is not known.
    fn wall(&mut self, wall: &Wall, cut: &[&WallOpening]) {
        let length_m = wall.length_m();
        let mut from_m = 0.0;
        let ends = cut.iter().map(|opening| {
            let middle_m = wall.place_m(opening);
            [middle_m - opening.width_m / 2.0, middle_m + opening.width_m / 2.0]
        });
        for [to_m, next_m] in ends.chain([[length_m, length_m]]) {
            if to_m > from_m {
                self.piece(wall, [from_m, to_m]);
            }
            from_m = next_m.max(from_m);
        }
    }

    fn piece(&mut self, wall: &Wall, [from_m, to_m]: [f64; 2]) {
        let half = wall.drawn_thickness_m / 2.0;
        let stations = wall.chords_m([from_m, to_m]);
        let right = stations.iter().map(|at| wall.point(*at, -half));
        let corners: Vec<[f64; 2]> =
            right.chain(stations.iter().rev().map(|at| wall.point(*at, half))).collect();
        if wall.thickness_m.is_some() {
            let name = self.layer(Layer::HATCH);
            let ring: Vec<[f64; 3]> = corners.iter().map(|p| self.at(*p)).collect();
            self.document.filled(&name, &ring);
        }
        let chords = stations.len() - 1;
        let sides = corners.iter().zip(corners.iter().cycle().skip(1));
        for (at, (a, b)) in sides.enumerate() {
            // Right, end, left, beginning.
            let side = at / (chords + 1) * 2 + usize::from(at % (chords + 1) == chords);
            let is_assumed = wall.thickness_m.is_none() && side != wall.seen_side();
            self.line(if is_assumed { Layer::ASSUMED } else { Layer::WALLS }, *a, *b);
        }
    }

    /// A door: jambs and threshold. A window: three lines.
    fn opening(&mut self, wall: &Wall, opening: &WallOpening) {
        let (middle_m, half) = (wall.place_m(opening), opening.width_m / 2.0);
        let deep = wall.drawn_thickness_m / 2.0;
        let aside: &[f64] = if opening.kind == Use::Window { &[-1.0, 0.0, 1.0] } else { &[-1.0, 1.0] };
        for share in aside {
            let ends = [middle_m - half, middle_m + half].map(|at| wall.point(at, share * deep));
            self.line(Layer::OPENINGS, ends[0], ends[1]);
        }
    }

    fn tag(&mut self, room: &Room) {
        let name = self.layer(Layer::LABELS);
        let [x, y] = room.label_place_m();
        let lines = [
            room.id.clone(),
            format!("area {:.1} m2", room.area_m2),
            format!("height {:.2} m", room.ceiling_z_m - room.floor_z_m),
        ];
        for (number, text) in lines.iter().enumerate() {
            let [x, y, z] = self.at([x, y]);
            self.document.text(&name, [x, y - 1.6 * TAG_M * number as f64, z], TAG_M, 0.0, text);
        }
    }
}
