//! Walls: a rectangle along the axis, swept up from the floor.

use super::Architecture;
use super::evidence::Value;
use super::spaces::area_m2;
use crate::building::elements::{KnownBy, Use, Wall, WallOpening};
use crate::formats::ifc::solids;
use crate::formats::ifc::step::Id;
use crate::formats::text::number::Number;

/// What was seen on both sides, on one, and what was hardly seen.
const MEASURED: [u8; 3] = [226, 220, 208];
const ONE_SIDE: [u8; 3] = [214, 214, 220];
const INFERRED: [u8; 3] = [200, 208, 226];
/// Ends of walls this close to another wall meet it, meters.
const MEETS_M: f64 = 0.15;

/// How a wall is known, in a word.
fn source(wall: &Wall) -> &'static str {
    match (wall.inferred, wall.thickness_m) {
        (false, Some(_)) => "measured",
        (true, Some(_)) => "inferred",
        (_, None) => "one side",
    }
}

impl KnownBy {
    /// In the words of the property set.
    fn word(self) -> &'static str {
        match self {
            Self::Faces => "faces",
            Self::SameLine => "same line",
            Self::Unknown => "unknown",
        }
    }
}

impl Architecture<'_> {
    /// Adds a wall.
    pub(super) fn wall(&mut self, wall: &Wall) {
        let (along, _) = wall.along();
        let length_m = wall.length_m();
        let place = self.place(wall.axis_m[0], 0.0, along);
        let (axis, solid) = self.wall_solid(wall, along);
        let context = self.project.axis;
        let axis = self.step.add(format_args!("IFCSHAPEREPRESENTATION({context},'Axis','Curve2D',({axis}))"));
        let color = match source(wall) {
            "measured" => MEASURED,
            "inferred" => INFERRED,
            _ => ONE_SIDE,
        };
        let body = self.body(&[solid], color);
        let shape = self.shape(&[axis, body]);
        let (owner, name) = (self.project.owner, &wall.id);
        let id = self.id(format_args!("{name}"));
        let element = self
            .step
            .add(format_args!("IFCWALL('{id}',{owner},'{name}',$,$,{place},{shape},'{name}',.SOLIDWALL.)"));
        self.contained.push(element);
        self.added.insert(name.clone(), element);
        self.wall_facts(wall, element, length_m);
    }

    /// The axis and the body of a wall in its own placement: a box, or what stands on chords of a circle.
    fn wall_solid(&mut self, wall: &Wall, along: [f64; 2]) -> (Id, Id) {
        let length_m = wall.length_m();
        let heights_m = [0.0, wall.height_m];
        if wall.is_straight() {
            let axis = solids::polyline(self.step, &[[0.0, 0.0], [length_m, 0.0]], false);
            let sides = [length_m, wall.drawn_thickness_m];
            return (axis, solids::cuboid(self.step, [length_m / 2.0, 0.0], sides, heights_m));
        }
        let local = |[x, y]: [f64; 2]| {
            let (x, y) = (x - wall.axis_m[0][0], y - wall.axis_m[0][1]);
            [x * along[0] + y * along[1], y * along[0] - x * along[1]]
        };
        let middle = wall.chords_m([0.0, length_m]).into_iter().map(|at| local(wall.point(at, 0.0)));
        let axis = solids::polyline(self.step, &middle.collect::<Vec<_>>(), false);
        let outline: Vec<[f64; 2]> = wall.outline_m.iter().copied().map(local).collect();
        (axis, solids::prism(self.step, &outline, &[], heights_m))
    }

    /// Quantities, layers and evidence of a wall.
    fn wall_facts(&mut self, wall: &Wall, element: Id, length_m: f64) {
        let name = wall.id.clone();
        let openings_m2: f64 = self.openings_of(wall).map(|opening| opening.width_m * opening.height_m).sum();
        let gross_m2 = length_m * wall.height_m;
        let mut quantities = vec![
            ("LENGTH", "Length", length_m),
            ("LENGTH", "Height", wall.height_m),
            ("AREA", "GrossSideArea", gross_m2),
            ("AREA", "NetSideArea", gross_m2 - openings_m2),
        ];
        let mut evidence = vec![
            ("Source", Value::Word(source(wall))),
            ("SeenShare", Value::Share(wall.seen_share)),
            ("ThicknessFrom", Value::Word(wall.thickness_from.word())),
        ];
        match wall.thickness_m {
            Some(thickness_m) => {
                quantities.push(("LENGTH", "Width", thickness_m));
                let gross_m3 = if wall.is_straight() {
                    gross_m2 * thickness_m
                } else {
                    area_m2(&wall.outline_m) * wall.height_m
                };
                quantities.push(("VOLUME", "GrossVolume", gross_m3));
                quantities.push(("VOLUME", "NetVolume", gross_m3 - openings_m2 * thickness_m));
                self.layers(&name, element, thickness_m);
            }
            None => evidence.push(("AssumedDepth", Value::Length(wall.drawn_thickness_m))),
        }
        let below_m = self.inferred_below_m(wall);
        if below_m > 0.0 {
            evidence.push(("InferredBelow", Value::Length(below_m)));
        }
        self.quantities(element, &name, "Qto_WallBaseQuantities", &quantities);
        self.evidence(element, &name, &evidence);
        if wall.thickness_from == KnownBy::Faces && wall.rooms.len() > 1 {
            self.properties(element, &name, "Pset_WallCommon", &[("IsExternal", Value::Flag(false))]);
        }
    }

    /// How high over the floor a wall is inferred at most, meters; 0 where nothing of it is.
    fn inferred_below_m(&self, wall: &Wall) -> f64 {
        let floor_m = self.project.storeys[self.storey].floor_m;
        let own = self.inferred.iter().filter(|surface| surface.part_of == wall.id);
        own.flat_map(|surface| &surface.outer_m).map(|p| p[2] - floor_m).fold(0.0, f64::max)
    }

    /// The openings of a wall.
    pub(super) fn openings_of<'w>(&'w self, wall: &'w Wall) -> impl Iterator<Item = &'w WallOpening> {
        self.elements.openings.iter().filter(|opening| opening.wall == wall.id)
    }

    /// One layer of the wall's thickness, of a material that nobody knows.
    fn layers(&mut self, name: &str, element: Id, thickness_m: f64) {
        let owner = self.project.owner;
        let material = self.step.add(format_args!("IFCMATERIAL('unknown',$,$)"));
        let layer = self
            .step
            .add(format_args!("IFCMATERIALLAYER({material},{},$,'wall',$,$,$)", Number(thickness_m)));
        let layers = self.step.add(format_args!("IFCMATERIALLAYERSET(({layer}),'{name}',$)"));
        let usage = self.step.add(format_args!(
            "IFCMATERIALLAYERSETUSAGE({layers},.AXIS2.,.POSITIVE.,{},$)",
            Number(-thickness_m / 2.0)
        ));
        let id = self.id(format_args!("material of {name}"));
        self.step.add(format_args!("IFCRELASSOCIATESMATERIAL('{id}',{owner},$,$,({element}),{usage})"));
    }

    /// Which walls meet, and with which ends.
    pub(super) fn joints(&mut self) {
        let walls = &self.elements.walls;
        for (number, wall) in walls.iter().enumerate() {
            for (end, word) in [(0, "ATSTART"), (1, "ATEND")] {
                for (other_number, other) in walls.iter().enumerate().filter(|(at, _)| *at != number) {
                    let Some(other_word) = meets(wall.axis_m[end], other) else { continue };
                    // Corners are met from both: the earlier wall tells of them.
                    if other_word != "ATPATH" && other_number < number {
                        continue;
                    }
                    let owner = self.project.owner;
                    let id = self.id(format_args!("{} {word} meets {}", wall.id, other.id));
                    let [a, b] = [&wall.id, &other.id].map(|name| self.added[name]);
                    self.step.add(format_args!(
                        "IFCRELCONNECTSPATHELEMENTS('{id}',{owner},$,$,$,{a},{b},(),(),.{other_word}.,.{word}.)"
                    ));
                }
            }
        }
    }

    /// Whether an opening is filled.
    pub(super) fn is_filled(opening: &WallOpening) -> bool {
        opening.kind != Use::Passage
    }
}

/// Where along a wall a place meets it, in IFC's words; `None` when it does not.
fn meets(place: [f64; 2], wall: &Wall) -> Option<&'static str> {
    let length_m = wall.length_m();
    let [at, off] = wall.place_of(place);
    let near = wall.drawn_thickness_m / 2.0 + MEETS_M;
    if off.abs() > near || at < -near || at > length_m + near {
        return None;
    }
    Some(match (at < near, at > length_m - near) {
        (true, _) => "ATSTART",
        (_, true) => "ATEND",
        _ => "ATPATH",
    })
}
