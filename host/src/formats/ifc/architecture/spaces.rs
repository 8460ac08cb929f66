//! Rooms as spaces with what bounds them, their floors and their ceilings.

use super::Architecture;
use super::evidence::Value;
use crate::building::elements::Room;
use crate::formats::ifc::solids;
use crate::formats::ifc::step::{Id, Ids};
use crate::model::inferred::{InferredKind, InferredSurface};
use biplane_geometry::PortableMath;

/// Floors and ceilings are assumed to be so thick, meters: one side of them was seen at best.
const FLOOR_M: f64 = 0.2;
const CEILING_M: f64 = 0.02;
const FLOOR_COLOR: [u8; 3] = [203, 190, 170];
const CEILING_COLOR: [u8; 3] = [236, 234, 228];

fn perimeter_m(ring: &[[f64; 2]]) -> f64 {
    let ends = ring.iter().zip(ring.iter().cycle().skip(1));
    ends.map(|(a, b)| (b[0] - a[0]).portable_hypot(b[1] - a[1])).sum()
}

/// Area of a ring, square meters, positive in either direction.
pub(super) fn area_m2(ring: &[[f64; 2]]) -> f64 {
    let ends = ring.iter().zip(ring.iter().cycle().skip(1));
    (0.5 * ends.map(|(a, b)| a[0] * b[1] - a[1] * b[0]).sum::<f64>()).abs()
}

impl Architecture<'_> {
    /// Adds all rooms under their storey, its floor, and their ceilings.
    pub(super) fn spaces(&mut self) {
        let elements = self.elements;
        let floor = self.floor(&elements.rooms);
        let mut spaces = Vec::new();
        for room in &elements.rooms {
            let space = self.space(room);
            self.ceiling(room);
            self.boundaries(room, space, floor);
            spaces.push(space);
        }
        let (owner, storey) = (self.project.owner, self.project.storeys[self.storey].id);
        let id = self.id(format_args!("spaces of {}", self.storey_name()));
        self.step.add(format_args!("IFCRELAGGREGATES('{id}',{owner},$,$,{storey},{})", Ids(&spaces)));
    }

    fn space(&mut self, room: &Room) -> Id {
        let place = self.place([0.0, 0.0], 0.0, [1.0, 0.0]);
        let height_m = room.ceiling_z_m - room.floor_z_m;
        let solid = solids::prism(self.step, &room.outline_m, &room.holes_m, [0.0, height_m]);
        let context = self.project.body;
        let body =
            self.step.add(format_args!("IFCSHAPEREPRESENTATION({context},'Body','SweptSolid',({solid}))"));
        let rings = std::iter::once(&room.outline_m).chain(&room.holes_m);
        let curves: Vec<Id> = rings.map(|ring| solids::polyline(self.step, ring, true)).collect();
        let context = self.project.footprint;
        let foot = self
            .step
            .add(format_args!("IFCSHAPEREPRESENTATION({context},'FootPrint','Curve2D',{})", Ids(&curves)));
        let shape = self.shape(&[foot, body]);
        let (owner, name, long_name) = (self.project.owner, &room.id, room.long_name());
        let id = self.id(format_args!("{name}"));
        let space = self.step.add(format_args!(
            "IFCSPACE('{id}',{owner},'{name}',$,$,{place},{shape},'{long_name}',.ELEMENT.,.INTERNAL.,$)"
        ));
        let area = area_m2(&room.outline_m) - room.holes_m.iter().map(|hole| area_m2(hole)).sum::<f64>();
        let around = perimeter_m(&room.outline_m) + room.holes_m.iter().map(|h| perimeter_m(h)).sum::<f64>();
        let quantities = [
            ("LENGTH", "Height", height_m),
            ("AREA", "NetFloorArea", area),
            ("LENGTH", "NetPerimeter", around),
            ("VOLUME", "NetVolume", area * height_m),
        ];
        self.quantities(space, name, "Qto_SpaceBaseQuantities", &quantities);
        let mut values = vec![
            ("Source", Value::Word(if room.inferred { "inferred" } else { "measured" })),
            ("SeenShare", Value::Share(room.walled_share)),
            ("Closed", Value::Flag(room.closed)),
            ("Entered", Value::Flag(true)),
            ("FloorIsInferred", Value::Flag(true)),
        ];
        values.extend(room.seen_area_m2.map(|seen_m2| ("SeenArea", Value::Area(seen_m2))));
        self.evidence(space, name, &values);
        space
    }

    /// The floor of all rooms: where the robot drove, as far as the rooms go.
    fn floor(&mut self, rooms: &[Room]) -> Id {
        let place = self.place([0.0, 0.0], 0.0, [1.0, 0.0]);
        let solids: Vec<Id> = rooms
            .iter()
            .map(|room| solids::prism(self.step, &room.outline_m, &room.holes_m, [-FLOOR_M, 0.0]))
            .collect();
        let body = self.body(&solids, FLOOR_COLOR);
        let shape = self.shape(&[body]);
        let owner = self.project.owner;
        let name = &format!("{}-FLOOR", self.storey_name());
        let id = self.id(format_args!("{name}"));
        let element = self
            .step
            .add(format_args!("IFCSLAB('{id}',{owner},'{name}',$,$,{place},{shape},'{name}',.FLOOR.)"));
        let area: f64 = rooms
            .iter()
            .map(|room| area_m2(&room.outline_m) - room.holes_m.iter().map(|h| area_m2(h)).sum::<f64>())
            .sum();
        self.quantities(element, name, "Qto_SlabBaseQuantities", &[("AREA", "NetArea", area)]);
        let mut values = vec![
            ("Source", Value::Word("inferred")),
            ("ThicknessFrom", Value::Word("unknown")),
            ("AssumedDepth", Value::Length(FLOOR_M)),
        ];
        let storey = self.storey_name();
        let is_floor = |s: &&InferredSurface| s.kind == InferredKind::Floor && s.part_of == storey;
        let floors = self.inferred.iter().filter(is_floor);
        let free_m2: f64 = floors.map(InferredSurface::area_m2).sum();
        if free_m2 > 0.0 {
            values.push(("SeenFreeArea", Value::Area(free_m2)));
        }
        self.evidence(element, name, &values);
        self.contained.push(element);
        element
    }

    fn ceiling(&mut self, room: &Room) {
        let up_m = room.ceiling_z_m - room.floor_z_m;
        let place = self.place([0.0, 0.0], 0.0, [1.0, 0.0]);
        let solid = solids::prism(self.step, &room.outline_m, &room.holes_m, [up_m, up_m + CEILING_M]);
        let body = self.body(&[solid], CEILING_COLOR);
        let shape = self.shape(&[body]);
        let owner = self.project.owner;
        let name = format!("{}-CEILING", room.id);
        let id = self.id(format_args!("{name}"));
        let element = self
            .step
            .add(format_args!("IFCCOVERING('{id}',{owner},'{name}',$,$,{place},{shape},'{name}',.CEILING.)"));
        let values = [
            ("Source", Value::Word("measured")),
            ("ThicknessFrom", Value::Word("unknown")),
            ("AssumedDepth", Value::Length(CEILING_M)),
        ];
        self.evidence(element, &name, &values);
        self.contained.push(element);
    }

    /// What bounds a room: its walls, doors and windows, the floor, and where it is open a virtual element.
    fn boundaries(&mut self, room: &Room, space: Id, floor: Id) {
        let elements = self.elements;
        let walls = elements.walls.iter().filter(|wall| wall.rooms.contains(&room.id)).map(|wall| &wall.id);
        let fillings =
            elements.openings.iter().filter(|opening| opening.rooms.contains(&room.id)).map(|o| &o.id);
        let named = walls.chain(fillings).filter_map(|name| Some((name.clone(), *self.added.get(name)?)));
        let mut bounds: Vec<(String, Id, &str)> = named.map(|(name, id)| (name, id, "PHYSICAL")).collect();
        bounds.push(("floor".to_owned(), floor, "PHYSICAL"));
        let owner = self.project.owner;
        if !room.closed {
            let name = format!("{}-OPEN", room.id);
            let id = self.id(format_args!("{name}"));
            let element = self.step.add(format_args!("IFCVIRTUALELEMENT('{id}',{owner},'{name}',$,$,$,$,$)"));
            self.contained.push(element);
            bounds.push((name, element, "VIRTUAL"));
        }
        for (name, element, kind) in bounds {
            let id = self.id(format_args!("{} bounded by {name}", room.id));
            self.step.add(format_args!(
                "IFCRELSPACEBOUNDARY1STLEVEL('{id}',{owner},$,$,{space},{element},$,.{kind}.,.NOTDEFINED.,$)"
            ));
        }
    }
}
