//! Openings with a body that is cut from their wall, and doors and windows that fill them.

use super::Architecture;
use super::evidence::Value;
use crate::building::elements::{Use, WallOpening};
use crate::formats::ifc::step::Id;
use crate::formats::ifc::{frame, solids};
use crate::formats::text::number::Number;

/// Openings reach beyond their wall by this on either side, meters, so that no skin of it stays.
const BEYOND_M: f64 = 0.01;

impl Architecture<'_> {
    /// Adds an opening and what fills it.
    pub(super) fn opening(&mut self, opening: &WallOpening) {
        let elements = self.elements;
        let Some(wall) = elements.wall(&opening.wall) else { return };
        let Some(wall_id) = self.added.get(&wall.id).copied() else { return };
        let at_m = wall.place_m(opening);
        let place = self.place(wall.point(at_m, 0.0), opening.sill_m, wall.along_at(at_m));
        let deep_m = wall.drawn_thickness_m + 2.0 * (BEYOND_M + wall.rise_m(opening.width_m));
        let sides = [opening.width_m, deep_m];
        let solid = solids::cuboid(self.step, [0.0, 0.0], sides, [0.0, opening.height_m]);
        let context = self.project.body;
        let body =
            self.step.add(format_args!("IFCSHAPEREPRESENTATION({context},'Body','SweptSolid',({solid}))"));
        let shape = self.shape(&[body]);
        let (owner, name) = (self.project.owner, &opening.id);
        let [id, voids] = ["", " voids"].map(|word| self.id(format_args!("opening {name}{word}")));
        let hole = self.step.add(format_args!(
            "IFCOPENINGELEMENT('{id}',{owner},'{name}',$,$,{place},{shape},'{name}',.OPENING.)"
        ));
        self.step.add(format_args!("IFCRELVOIDSELEMENT('{voids}',{owner},$,$,{wall_id},{hole})"));
        let quantities = [
            ("LENGTH", "Width", opening.width_m),
            ("LENGTH", "Height", opening.height_m),
            ("AREA", "Area", opening.width_m * opening.height_m),
        ];
        let label = format!("opening {name}");
        self.quantities(hole, &label, "Qto_OpeningElementBaseQuantities", &quantities);
        if Self::is_filled(opening) {
            self.filling(opening, hole, place);
        } else {
            self.opening_evidence(opening, hole, &label);
        }
    }

    fn opening_evidence(&mut self, opening: &WallOpening, element: Id, label: &str) {
        let values = [
            ("Source", Value::Word(if opening.inferred { "inferred" } else { "measured" })),
            ("Evidence", Value::Word(&opening.evidence)),
            ("DrivenThrough", Value::Flag(opening.evidence == "driven through")),
            ("BodyIsAssumed", Value::Flag(true)),
        ];
        self.evidence(element, label, &values);
    }

    /// A door or window: a frame, and a pane in a window.
    fn filling(&mut self, opening: &WallOpening, hole: Id, place: Id) {
        let ([width, height], is_window) = ([opening.width_m, opening.height_m], opening.kind == Use::Window);
        let items = frame::frame(self.step, [width, height], is_window);
        let body = self.body(&items, frame::color(is_window));
        let shape = self.shape(&[body]);
        let (owner, name) = (self.project.owner, &opening.id);
        let [id, fills] = ["", " fills"].map(|word| self.id(format_args!("{name}{word}")));
        let (entity, class) = if is_window { ("IFCWINDOW", "WINDOW") } else { ("IFCDOOR", "DOOR") };
        let element = self.step.add(format_args!(
            "{entity}('{id}',{owner},'{name}',$,$,{place},{shape},'{name}',{},{},.{class}.,.NOTDEFINED.,$)",
            Number(height),
            Number(width)
        ));
        self.step.add(format_args!("IFCRELFILLSELEMENT('{fills}',{owner},$,$,{hole},{element})"));
        self.contained.push(element);
        self.added.insert(name.clone(), element);
        self.opening_evidence(opening, element, &name.clone());
    }
}
