//! DXF: a floor plan a storey and the surfaces in 3D, for AutoCAD, LibreCAD, QCAD, Rhino and other drawing
//! programs.
//!
//! Plans are cut 1.2 m over the floor and lie at the height of their floor. Layers: WALLS (openings are
//! gaps), OPENINGS (a line across each, and leaves of closed doors), SECTION (what else is cut), FLOOR and
//! CEILING (outlines), LABELS (names and sizes of openings). Of a drive walls have their depth, with HATCH
//! where it is known and ASSUMED for sides that nobody saw, and rooms have tags. With several storeys each
//! has its own layers, `S1-WALLS` being the lowest, and those of the lowest are on. SURFACES (round things
//! too), INFERRED and LEFTOVERS hold the model as 3D faces and are off where there is a plan. Frame `map`,
//! turned where that is asked for, meters.
//! Source: Autodesk's DXF reference for release 2000 (AC1015).

mod document;
mod layer;
mod rooms;
#[cfg(test)]
mod tests;

use biplane_geometry::PortableMath;
use std::collections::BTreeMap;
use std::io::{self, Write};

use self::document::Document;
use self::layer::Layer;
use self::rooms::RoomPlan;
use super::{Placement, Shapes};
use crate::building::elements::{Elements, Use, WallOpening, storey_name};
use crate::building::part::CUT_M;
use crate::building::plan::{self, Plan};
use crate::building::{Building, Opening, OpeningKind};
use crate::model::Mesh;

/// Height of labels, meters: 2 mm on paper at 1:50; the size of a window of a meter fits its width.
const TEXT_M: f64 = 0.1;

/// Writes the model as DXF.
///
/// # Errors
/// When writing fails.
pub fn write(out: &mut impl Write, shapes: &Shapes<'_>, building: &Building) -> io::Result<()> {
    let mut document = Document::new(vec![super::description(shapes)]);
    let storeys = building.floors_m.len();
    let names = building.opening_names();
    let plans = (0..storeys).filter_map(|at| Some((at, plan::draw(shapes.model, building, at)?)));
    for (number, (storey, plan)) in plans.enumerate() {
        let prefix = if storeys > 1 { format!("{}-", storey_name(storey + 1)) } else { String::new() };
        // Plans lie on each other: the lowest one is shown.
        let is_on = number == 0;
        let is_shown = |o: &(&Opening, &str)| o.0.storey == storey && o.0.is_cut(plan.floor_m);
        let named = building.openings.iter().zip(names.iter().map(String::as_str));
        let openings: Vec<(&Opening, &str)> = named.filter(is_shown).collect();
        let elements = building.elements_at(plan.floor_m);
        let placement = Placement::of(shapes);
        let corner_m = corner_m(&plan, placement);
        let (plan, openings) = match &elements {
            // Walls with depth stand for their surfaces.
            Some(_) => (Plan { walls: Vec::new(), floors: Vec::new(), ..plan }, Vec::new()),
            None => (plan, openings),
        };
        if let Some(elements) = &elements {
            let z_m = plan.floor_m;
            RoomPlan { document: &mut document, prefix: &prefix, is_on, placement, z_m }.draw(elements);
        }
        let mut drawing = Drawing { document: &mut document, prefix, is_on, placement, z_m: plan.floor_m };
        for opening in elements.iter().flat_map(|elements| &elements.openings) {
            drawing.sizes(opening, elements.as_ref());
        }
        drawing.draw(&plan, &openings);
        drawing.title(plan.floor_m, corner_m);
    }
    surfaces(&mut document, shapes, storeys == 0);
    document.write(out)
}

/// What is written at an opening.
struct Label<'a> {
    name: &'a str,
    /// Half of how thick its wall is drawn: nothing is written on its lines, meters.
    deep_m: f64,
    ends_m: [[f64; 2]; 2],
    width_m: f64,
    height_m: f64,
    /// Of a window.
    sill_m: Option<f64>,
}

/// One plan on its layers.
struct Drawing<'a> {
    document: &'a mut Document,
    prefix: String,
    is_on: bool,
    placement: Placement,
    z_m: f64,
}

impl Drawing<'_> {
    fn draw(&mut self, plan: &Plan, openings: &[(&Opening, &str)]) {
        for outline in &plan.ceilings {
            self.outline(Layer::CEILING, outline);
        }
        for outline in &plan.floors {
            self.outline(Layer::FLOOR, outline);
        }
        for (layer, lines) in
            [(Layer::SECTION, &plan.section), (Layer::WALLS, &plan.walls), (Layer::OPENINGS, &plan.leaves)]
        {
            for [from, to] in lines {
                self.line(layer, *from, *to);
            }
        }
        for (opening, name) in openings {
            let [from, to] = opening.ends_m;
            self.line(Layer::OPENINGS, from, to);
            let is_window = opening.kind == OpeningKind::Window;
            self.label(&Label {
                name,
                deep_m: 0.0,
                ends_m: opening.ends_m,
                width_m: opening.width_m(),
                height_m: opening.height_m(),
                sill_m: is_window.then_some(opening.bottom_m - self.z_m),
            });
        }
    }

    fn at(&self, [x, y]: [f64; 2]) -> [f64; 3] {
        self.placement.at([x, y, self.z_m])
    }

    fn layer(&mut self, layer: Layer) -> String {
        let name = format!("{}{}", self.prefix, layer.name);
        self.document.layer(&name, layer.shown(self.is_on));
        name
    }

    fn line(&mut self, layer: Layer, from: [f64; 2], to: [f64; 2]) {
        let name = self.layer(layer);
        self.document.line(&name, self.at(from), self.at(to));
    }

    fn outline(&mut self, layer: Layer, ring: &[[f64; 2]]) {
        let name = self.layer(layer);
        let ring: Vec<[f64; 3]> = ring.iter().map(|p| self.at(*p)).collect();
        self.document.ring(&name, &ring);
    }

    /// The name and the size of an opening in a wall with depth.
    fn sizes(&mut self, opening: &WallOpening, elements: Option<&Elements>) {
        let Some(wall) = elements.and_then(|elements| elements.wall(&opening.wall)) else { return };
        let [x, y] = wall.along_at(wall.place_m(opening));
        let half = opening.width_m / 2.0;
        let [cx, cy, _] = opening.center_m;
        self.label(&Label {
            name: &opening.id,
            deep_m: wall.drawn_thickness_m / 2.0,
            ends_m: [[cx - half * x, cy - half * y], [cx + half * x, cy + half * y]],
            width_m: opening.width_m,
            height_m: opening.height_m,
            sill_m: (opening.kind == Use::Window).then_some(opening.sill_m),
        });
    }

    /// The opening's name and size over it, the height of its sill under it, to be read from below or from
    /// the right.
    fn label(&mut self, opening: &Label<'_>) {
        let [a, b] = opening.ends_m.map(|end| self.at(end));
        let (mut dx, mut dy) = (b[0] - a[0], b[1] - a[1]);
        if dx < -1e-6 || (dx.abs() <= 1e-6 && dy < 0.0) {
            (dx, dy) = (-dx, -dy);
        }
        let width = dx.portable_hypot(dy).max(1e-9);
        let name = self.layer(Layer::LABELS);
        let mut put = |lines: f64, text: &str| {
            let away = (lines * TEXT_M + opening.deep_m.copysign(lines)) / width;
            let foot = [(a[0] + b[0]) / 2.0 - away * dy, (a[1] + b[1]) / 2.0 + away * dx];
            let degrees = dy.portable_atan2(dx).to_degrees();
            self.document.text(&name, [foot[0], foot[1], a[2]], TEXT_M, degrees, text);
        };
        put(0.5, &format!("{:.2} x {:.2}", opening.width_m, opening.height_m));
        put(2.1, opening.name);
        if let Some(sill_m) = opening.sill_m {
            put(-1.5, &format!("sill {sill_m:.2}"));
        }
    }

    fn title(&mut self, floor_m: f64, corner_m: [f64; 2]) {
        if !corner_m.iter().all(|value| value.is_finite()) {
            return;
        }
        let floor_m = ((floor_m + self.placement.shift_m[2]) * 100.0).round() / 100.0 + 0.0;
        let text = format!("floor {floor_m:+.2} m, cut {CUT_M:.2} m above it; meters");
        let name = self.layer(Layer::LABELS);
        let at = [corner_m[0], corner_m[1] - 4.0 * TEXT_M, self.at([0.0; 2])[2]];
        self.document.start_text(&name, at, TEXT_M, &text);
    }
}

/// The smallest x and y of what a plan cuts, in the file; infinite when it cuts nothing.
fn corner_m(plan: &Plan, placement: Placement) -> [f64; 2] {
    let all = plan.walls.iter().chain(&plan.section).flatten();
    let placed = all.map(|p| placement.at([p[0], p[1], plan.floor_m]));
    placed.fold([f64::INFINITY; 2], |low, p| [low[0].min(p[0]), low[1].min(p[1])])
}

/// The model as 3D faces; edges within a polygon are not drawn.
fn surfaces(document: &mut Document, shapes: &Shapes<'_>, is_on: bool) {
    let model = shapes.model;
    for (layer, meshes) in [
        (Layer::SURFACES, shapes.faces.as_slice()),
        (Layer::SURFACES, shapes.rounds.as_slice()),
        (Layer::INFERRED, shapes.inferred.as_slice()),
        (Layer::LEFTOVERS, std::slice::from_ref(&model.leftovers)),
    ] {
        let layer = layer.shown(is_on);
        for mesh in meshes.iter().filter(|mesh| !mesh.triangles.is_empty()) {
            document.layer(layer.name, layer);
            faces(document, layer.name, mesh, Placement::of(shapes));
        }
    }
}

fn faces(document: &mut Document, layer: &str, mesh: &Mesh, placement: Placement) {
    let edges = |[a, b, c]: [u32; 3]| [(a, b), (b, c), (c, a)].map(|(p, q)| (p.min(q), p.max(q)));
    let mut uses: BTreeMap<(u32, u32), u32> = BTreeMap::new();
    let is_flat = layer != Layer::LEFTOVERS.name;
    for edge in mesh.triangles.iter().filter(|_| is_flat).flat_map(|triangle| edges(*triangle)) {
        *uses.entry(edge).or_default() += 1;
    }
    for triangle in &mesh.triangles {
        let corner =
            |index: &u32| mesh.vertices_m.get(*index as usize).map(|p| placement.at(p.map(f64::from)));
        let corners: Vec<[f64; 3]> = triangle.iter().filter_map(corner).collect();
        let hidden = edges(*triangle).map(|edge| uses.get(&edge).is_some_and(|count| *count > 1));
        if let Ok(corners) = corners.try_into() {
            document.face(layer, corners, hidden);
        }
    }
}
